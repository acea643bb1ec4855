"""Tests of common/camera."""
