"""Printers: G-code, and how it is brought to one that hangs on a serial line."""
