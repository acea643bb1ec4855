"""Tests of svg."""
