"""Tests of camera."""
