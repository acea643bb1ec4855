"""Computes a rig from views of a chessboard, and the time offset from what two cameras see."""
