"""Meshes as files that other programs read, and read back: one module a format."""
