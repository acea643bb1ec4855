"""Frames arrive: what comes from the board, what the own camera gives, and where the two meet."""
