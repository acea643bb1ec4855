"""Tests of common/imagesize."""
