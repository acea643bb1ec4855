"""Solves a rig from pairs of views of a target, and judges it: corners in, a rig, its figures and a verdict out. Imports `target` alone. Pure."""
