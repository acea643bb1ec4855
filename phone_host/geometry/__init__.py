"""Geometry that calibration and scanning share: rigid motions, how lenses project, least squares with eliminated blocks, triangulation. Pure."""
