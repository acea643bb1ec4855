"""Solves a rig from pairs of views of a target, and judges it: corners in, a rig, its figures and a verdict out. Imports `target` alone. Pure.

Arguments, where a function does not say otherwise: `points_m` (N, 3) float64, corners in the board's axes, m; `corners` (N, 2) float64, px, NaN
where one is not seen; `pairs` and `views` V of them; poses (6,) or (V, 6), rotation vector and translation (m) from the board's axes to the
camera's, a pair's to the left camera's; `sizes_px` width and height of the left and of the right images; `free` which parameters are
estimated, (12,) of a camera in the order of `geometry.lens`; `sigmas_px` standard deviation of a coordinate, left and right; a `rectification`
is that of the rig beside it, and a rig has its covariance.
"""
