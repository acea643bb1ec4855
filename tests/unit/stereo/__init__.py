"""Tests of stereo."""
