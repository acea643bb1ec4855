"""Tests of printing: a simulated printer, and the command against it."""
