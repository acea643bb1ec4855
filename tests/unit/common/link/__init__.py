"""Tests of common/link."""
