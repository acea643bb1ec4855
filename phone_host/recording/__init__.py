"""Keeps what both cameras saw, for later."""
