"""Tests of common/program."""
