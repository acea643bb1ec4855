"""Tests of common/recording."""
