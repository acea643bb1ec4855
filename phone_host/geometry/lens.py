"""How each lens projects, back and forth, and how the pixels of a rectified pair move with the parameters of the true cameras. Pure.

The twelve parameters of a camera are fx fy cx cy and eight coefficients:

- pinhole, rational: k1 k2 p1 p2 k3 k4 k5 k6 of OpenCV's polynomial, whose radial factor is
  (1 + k1 r^2 + k2 r^4 + k3 r^6) / (1 + k4 r^2 + k5 r^4 + k6 r^6) with r = tan(angle to the axis);
- fisheye: k1 k2 k3 k4 of the angle itself, angle (1 + k1 angle^2 + ... + k4 angle^8), then four zeros.

Sources: OpenCV's documentation of calib3d and of fisheye; J. Kannala and S. Brandt, "A Generic Camera Model and Calibration
Method", 2006.

A rig has thirty parameters, in this order: the left camera's twelve, the right camera's twelve, a small turn
of the right camera about its own axes (rad), the translation (m). A point stays where it is in the left camera's axes, and the
rectification stays that of the estimated rig; then the derivatives are exact: how a point's pixels move with the true cameras,
and how the rectification carries that to the rectified images. With the covariance C of the estimate they carry its
uncertainty to whatever is computed from the pixels: J C J^T.
"""

from dataclasses import replace
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.geometry.se3 import cross_matrices
from phone_host.model import RIG_PARAMETERS, CameraModel, Lens, Rectification, Rig

Floats = NDArray[np.float64]

PARAMETERS: Final = 12
"""fx fy cx cy and eight coefficients."""

_COEFFICIENTS: Final = {Lens.PINHOLE: 5, Lens.RATIONAL: 8, Lens.FISHEYE: 4}
_ON_AXIS: Final = 1e-9
"""Slopes below which a point is taken to lie on the axis."""

_NEWTON_STEPS: Final = 30
# Undistortion is iterative; 5 iterations (OpenCV's default) leave 0.1 px in the corners of a wide lens.
_UNDISTORT = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 100, 1e-12)


def parameters_of(model: CameraModel) -> Floats:
    """Return the (12,) parameters of a camera; coefficients beyond the eighth (thin prism, tilt) are not among them."""
    m, given = model.matrix, model.distortion[: PARAMETERS - 4]
    return np.array([m[0, 0], m[1, 1], m[0, 2], m[1, 2], *given, *np.zeros(PARAMETERS - 4 - len(given))])


def with_parameters(model: CameraModel, values: Floats, lens: Lens | None = None) -> CameraModel:
    """Return a camera with other parameters.

    Args:
        model: gives the image's size.
        values: (12,).
        lens: what they mean; default: as before.
    """
    kind = model.lens if lens is None else lens
    matrix = np.array([[values[0], 0, values[2]], [0, values[1], values[3]], [0, 0, 1]])
    return replace(model, matrix=matrix, distortion=values[4 : 4 + _COEFFICIENTS[kind]].copy(), lens=kind)


def project(points: Floats, model: CameraModel) -> Floats:
    """Return where points appear in the image.

    Args:
        points: (N, 3) in the camera's axes, any unit. A fisheye lens also sees points behind the image plane (z < 0); for the others
            such points give meaningless pixels.
        model: the camera.

    Returns:
        (N, 2) px.
    """
    if not len(points):
        return np.empty((0, 2))
    if model.lens is Lens.FISHEYE:
        return project_linearised(points, model)[0]
    seen = cv2.projectPoints(np.asarray(points, np.float64), np.zeros(3), np.zeros(3), model.matrix, model.distortion)[
        0
    ]
    return np.asarray(seen, np.float64).reshape(-1, 2)


def project_linearised(points: Floats, model: CameraModel) -> tuple[Floats, Floats, Floats]:
    """Return where points appear, and the derivatives by the points and by the camera's parameters.

    Args:
        points: (N, 3) in the camera's axes.
        model: the camera, without thin prism and tilt.

    Returns:
        (N, 2) px; (N, 2, 3) px per unit of the points; (N, 2, 12) px per parameter.
    """
    bend = _bend_fisheye if model.lens is Lens.FISHEYE else _bend_polynomial
    values = parameters_of(model)
    bent, by_point, by_coefficient = bend(points, values[4:])
    focal = values[:2]
    by_values = np.zeros((len(points), 2, PARAMETERS))
    by_values[:, 0, 0], by_values[:, 1, 1] = bent[:, 0], bent[:, 1]
    by_values[:, 0, 2] = by_values[:, 1, 3] = 1
    by_values[:, :, 4:] = by_coefficient * focal[:, np.newaxis]
    return bent * focal + values[2:4], by_point * focal[:, np.newaxis], by_values


def rays_through(points_px: NDArray[np.floating], model: CameraModel) -> Floats:
    """Return the directions that points of the image come from, the inverse of `project`.

    Args:
        points_px: (N, 2), px.
        model: the camera.

    Returns:
        (N, 3) in the camera's axes. Pinhole and rational: z = 1. Fisheye: unit vectors, z < 0 beyond 90 degrees from the axis. NaN
        where a fisheye lens's polynomial cannot be inverted.
    """
    points = np.asarray(points_px, np.float64).reshape(-1, 2)
    if not len(points):
        return np.empty((0, 3))
    if model.lens is Lens.FISHEYE:
        return _fisheye_rays(points, model)
    slopes = cv2.undistortPointsIter(
        points[:, np.newaxis], model.matrix, model.distortion, np.eye(3), np.eye(3), _UNDISTORT
    )
    return np.column_stack([np.asarray(slopes, np.float64).reshape(-1, 2), np.ones(len(points))])


def farthest_angle(model: CameraModel) -> float:
    """Return the angle to the axis, rad, up to which a fisheye lens's polynomial grows; half a turn at most."""
    _, by_angle = _fisheye_angle(np.linspace(0, np.pi, 400), parameters_of(model)[4:8])
    falling = np.flatnonzero(by_angle <= 0)
    return float(np.pi * (falling[0] - 1) / 399) if len(falling) else float(np.pi)


def _bend_polynomial(points: Floats, k: Floats) -> tuple[Floats, Floats, Floats]:
    """Return bent slopes (N, 2), their derivatives by the points (N, 2, 3) and by the eight coefficients (N, 2, 8)."""
    z = points[:, 2]
    x, y = points[:, 0] / z, points[:, 1] / z
    r2 = x * x + y * y
    over, under = 1 + r2 * (k[0] + r2 * (k[1] + r2 * k[4])), 1 + r2 * (k[5] + r2 * (k[6] + r2 * k[7]))
    radial = over / under
    by_r2 = (k[0] + r2 * (2 * k[1] + r2 * 3 * k[4]) - radial * (k[5] + r2 * (2 * k[6] + r2 * 3 * k[7]))) / under
    bent = np.column_stack(
        [
            x * radial + 2 * k[2] * x * y + k[3] * (r2 + 2 * x * x),
            y * radial + k[2] * (r2 + 2 * y * y) + 2 * k[3] * x * y,
        ]
    )
    across = 2 * x * y * by_r2 + 2 * (k[2] * x + k[3] * y)
    by_slope = np.empty((len(points), 2, 2))
    by_slope[:, 0, 0] = radial + 2 * x * x * by_r2 + 2 * k[2] * y + 6 * k[3] * x
    by_slope[:, 0, 1] = by_slope[:, 1, 0] = across
    by_slope[:, 1, 1] = radial + 2 * y * y * by_r2 + 6 * k[2] * y + 2 * k[3] * x
    by_point = np.empty((len(points), 2, 3))
    by_point[:, :, :2] = by_slope / z[:, np.newaxis, np.newaxis]
    by_point[:, :, 2] = -(by_point[:, :, 0] * x[:, np.newaxis] + by_point[:, :, 1] * y[:, np.newaxis])
    powers = np.column_stack([r2, r2**2, r2**3])
    radials = np.concatenate([powers / under[:, np.newaxis], -powers * (radial / under)[:, np.newaxis]], axis=1)
    slopes = np.stack([x, y], axis=1)[:, :, np.newaxis]
    by_k = np.empty((len(points), 2, 8))
    by_k[:, :, [0, 1, 4, 5, 6, 7]] = slopes * radials[:, np.newaxis]
    by_k[:, 0, 2], by_k[:, 0, 3] = 2 * x * y, r2 + 2 * x * x
    by_k[:, 1, 2], by_k[:, 1, 3] = r2 + 2 * y * y, 2 * x * y
    return bent, by_point, by_k


def _bend_fisheye(points: Floats, k: Floats) -> tuple[Floats, Floats, Floats]:
    """Return what `_bend_polynomial` does, for a fisheye lens."""
    x, y, z = points.T
    aside = np.hypot(x, y)
    angle = np.arctan2(aside, z)
    bent_angle, by_angle = _fisheye_angle(angle, k)
    squared = aside**2 + z**2
    on_axis = aside < _ON_AXIS * np.abs(z)
    safe = np.where(on_axis, 1.0, aside)
    cosine, sine = np.where(on_axis, 1.0, x / safe), np.where(on_axis, 0.0, y / safe)
    outwards = np.stack([cosine, sine], axis=1)
    bent = bent_angle[:, np.newaxis] * outwards
    # angle by point: (x z, y z, -(x^2 + y^2)) / (aside squared); outwards by point: across it, / aside.
    per_aside = np.where(on_axis, 1 / z, bent_angle / safe)
    grow = by_angle * np.where(on_axis, 1 / z, z / squared)
    by_point = np.empty((len(points), 2, 3))
    by_point[:, 0, 0] = grow * cosine**2 + per_aside * sine**2
    by_point[:, 0, 1] = by_point[:, 1, 0] = (grow - per_aside) * cosine * sine
    by_point[:, 1, 1] = grow * sine**2 + per_aside * cosine**2
    by_point[:, :, 2] = outwards * (-by_angle * aside / squared)[:, np.newaxis]
    by_k = np.zeros((len(points), 2, 8))
    powers = angle[:, np.newaxis] ** np.array([3, 5, 7, 9])
    by_k[:, :, :4] = outwards[:, :, np.newaxis] * powers[:, np.newaxis]
    return bent, by_point, by_k


def _fisheye_angle(angle: Floats, k: Floats) -> tuple[Floats, Floats]:
    """Return the bent angle and its derivative."""
    a2 = angle * angle
    bent = angle * (1 + a2 * (k[0] + a2 * (k[1] + a2 * (k[2] + a2 * k[3]))))
    return bent, 1 + a2 * (3 * k[0] + a2 * (5 * k[1] + a2 * (7 * k[2] + a2 * 9 * k[3])))


def _fisheye_rays(points: Floats, model: CameraModel) -> Floats:
    m, k = model.matrix, parameters_of(model)[4:8]
    y = (points[:, 1] - m[1, 2]) / m[1, 1]
    x = (points[:, 0] - m[0, 2] - m[0, 1] * y) / m[0, 0]
    bent = np.hypot(x, y)
    most = farthest_angle(model)
    angle = np.clip(bent, 0, most)
    for _ in range(_NEWTON_STEPS):
        seen, by_angle = _fisheye_angle(angle, k)
        angle = np.clip(angle - (seen - bent) / np.maximum(by_angle, 1e-6), 0, most)
    missed = np.abs(_fisheye_angle(angle, k)[0] - bent) > 1e-9
    safe = np.where(bent > 0, bent, 1.0)
    rays = np.column_stack([np.sin(angle) * x / safe, np.sin(angle) * y / safe, np.cos(angle)])
    rays[missed] = np.nan
    return rays


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
