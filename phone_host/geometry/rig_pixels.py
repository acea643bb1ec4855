"""How the pixels of a rectified pair move with the parameters of the true cameras. Pure.

A rig has thirty parameters, in this order: the left camera's twelve (`geometry.lens`), the right camera's twelve, a small turn
of the right camera about its own axes (rad), the translation (m). A point stays where it is in the left camera's axes, and the
rectification stays that of the estimated rig; then the derivatives are exact: how a point's pixels move with the true cameras,
and how the rectification carries that to the rectified images. With the covariance C of the estimate they carry its
uncertainty to whatever is computed from the pixels: J C J^T.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.geometry.lens import PARAMETERS, project_linearised
from phone_host.geometry.se3 import cross_matrices
from phone_host.model import RIG_PARAMETERS, CameraModel, Rectification, Rig

Floats = NDArray[np.float64]

LEFT: Final = slice(0, PARAMETERS)
RIGHT: Final = slice(PARAMETERS, 2 * PARAMETERS)
RIG: Final = slice(2 * PARAMETERS, RIG_PARAMETERS)
"""Places of the left camera's parameters, of the right one's, and of the turn and the translation between them."""


def pixel_derivatives(slopes: Floats, nearness: Floats, rig: Rig, rectification: Rectification) -> Floats:
    """Return the derivatives of rectified pixels by the true parameters.

    Args:
        slopes: (N, 2) of the points, x / z and y / z in the rectified axes of the left camera.
        nearness: (N,) 1 / z, 1/m; 0 at infinity.
        rig: the cameras as they are estimated.
        rectification: of that rig.

    Returns:
        (N, 2, 2, 30): of the left and of the right image, x and y, px per unit.
    """
    left = (
        np.column_stack([slopes, np.ones(len(slopes))]) @ rectification.R_left
    )  # rows: R_left^T p; p is scaled by 1 / z
    turned = left @ rig.R_right_left.T
    right = turned + nearness[:, np.newaxis] * rig.t_right_left_m
    result = np.zeros((len(left), 2, 2, RIG_PARAMETERS))
    result[:, 0, :, LEFT], _ = _of_camera(left, rig.left, rectification.R_left, rectification)
    result[:, 1, :, RIGHT], by_point = _of_camera(right, rig.right, rectification.R_right, rectification)
    result[:, 1, :, RIG.start : RIG.start + 3] = by_point @ -cross_matrices(turned)
    result[:, 1, :, RIG.start + 3 :] = by_point * nearness[:, np.newaxis, np.newaxis]
    return result


def standard_errors(covariance: Floats) -> Floats:
    """Return independent errors of one standard deviation, (n, n), one a column: their squares E E^T are the covariance.

    Args:
        covariance: (n, n) of parameters whose units may differ; positive semi-definite up to rounding.
    """
    sigmas = np.sqrt(np.diag(covariance).clip(min=0))
    scale = np.where(sigmas > 0, sigmas, 1.0)
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    return np.asarray(scale[:, np.newaxis] * vectors * np.sqrt(values.clip(min=0)), np.float64)


def _of_camera(
    points: Floats, model: CameraModel, rotation: Floats, rectification: Rectification
) -> tuple[Floats, Floats]:
    """Return the derivatives of rectified pixels by the true camera's parameters (N, 2, 12) and by the true point (N, 2, 3)."""
    _, by_point, by_values = project_linearised(points, model)
    depths = points @ rotation[2]  # along the rectified axis
    by_slope = by_point @ rotation.T[:, :2] * depths[:, np.newaxis, np.newaxis]
    back = np.linalg.inv(by_slope) * rectification.geometry.focal_px
    return back @ by_values, back @ by_point
