"""Tests of the scan: its parts, the command, and going on after a kill."""
