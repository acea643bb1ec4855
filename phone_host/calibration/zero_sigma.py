"""How far the disparity of infinitely far points is uncertain: the noise of zero that a calibration leaves. Pure.

A point at infinity has D = d + doffs = 0 in an exact rig. In a calibrated one it has the disparity that the rig's errors
give it: by the relative yaw, the principal points, focal lengths and distortions. Depth is f b / D, so this error alone
decides how far a rig can see. It is the covariance of the rig's parameters, carried through the disparity to first
order:

    variance at a pixel = J C J^T,  J = derivative of that pixel's D by the parameters.
"""

from typing import Final

import cv2
import numpy as np

from phone_host.calibration.bundle import Vector, camera_arrays
from phone_host.model import Rectification, Rig
from phone_host.stereo.rectify import rectify_points

_PARAMETERS: Final = 9
_COLUMNS, _ROWS = 9, 7
"""Points over the image. The error bends as slowly as the lens: a finer grid changes the result by less than a tenth."""


def zero_sigma_px(covariance: Vector, globals_: Vector, rig: Rig, rectification: Rectification) -> float:
    """Return the standard uncertainty of the disparity of infinitely far points.

    Args:
        covariance: (24, 24) of the parameters, in the order of `bundle`: both cameras, rotation, translation.
        globals_: (24,) the parameters.
        rig: made of these parameters.
        rectification: of that rig.

    Returns:
        Root mean square over the rectified image, px of that image; NaN if the covariance is not finite.
    """
    if not np.isfinite(covariance).all():
        return float("nan")
    directions = _directions(rectification)
    steps = np.sqrt(np.diag(covariance).clip(min=0))
    jacobian = np.zeros((len(directions), len(globals_)))
    for index in np.flatnonzero(steps):
        step = np.zeros_like(globals_)
        step[index] = steps[index]
        further, nearer = (_disparities(globals_ + sign * step, directions, rig, rectification) for sign in (1, -1))
        jacobian[:, index] = (further - nearer) / (2 * steps[index])
    variances = np.einsum("ni,ij,nj->n", jacobian, covariance, jacobian)
    return float(np.sqrt(variances.clip(min=0).mean()))


def _directions(rectification: Rectification) -> Vector:
    """Return directions (N, 3) in the left camera's axes, spread evenly over the rectified image."""
    geometry = rectification.geometry
    columns = (np.arange(_COLUMNS) + 0.5) / _COLUMNS * rectification.width_px
    rows = (np.arange(_ROWS) + 0.5) / _ROWS * rectification.height_px
    x, y = (axis.ravel() for axis in np.meshgrid(columns, rows))
    rays = np.column_stack([x - geometry.cx_px, y - geometry.cy_px, np.full_like(x, geometry.focal_px)])
    return np.asarray(rays @ rectification.R_left, np.float64)  # R_left takes the left axes to the rectified ones


def _disparities(true: Vector, directions: Vector, rig: Rig, rectification: Rectification) -> Vector:
    """Return the disparity that infinitely far points get from this rig if the cameras are really those of `true`."""
    left, right = true[:_PARAMETERS], true[_PARAMETERS : 2 * _PARAMETERS]
    rotation, nowhere = true[2 * _PARAMETERS : 2 * _PARAMETERS + 3], np.zeros(3)
    seen = (
        cv2.projectPoints(directions, nowhere, nowhere, *camera_arrays(left))[0],
        cv2.projectPoints(directions, rotation, nowhere, *camera_arrays(right))[0],
    )
    turns = (rectification.R_left, rectification.R_right)
    at = [
        rectify_points(np.asarray(points, np.float64).reshape(-1, 2), model, turn, rectification.geometry)
        for points, model, turn in zip(seen, (rig.left, rig.right), turns, strict=True)
    ]
    axis = 1 if rectification.epipolar.is_vertical else 0
    return np.asarray(at[0][:, axis] - at[1][:, axis], np.float64)
