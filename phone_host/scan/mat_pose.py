"""Where a mat lies, from its corners in both images of a rectified pair in one fit; and how large its squares are. Pure.

Either image alone tells the pose from the sheet's size; both together also from the baseline. So the fit also says how long the printed squares are, as the
rig measures them: a sheet printed "fit to page" is up to 7 % smaller than it says, and would not fit the depths. The rig's metre counts.

Source: G. Schweighofer and A. Pinz, "Robust Pose Estimation from a Planar Target", 2006, for the two poses that one flat view leaves open.
"""

from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.geometry.se3 import SE3
from phone_host.model import Epipolar, StereoGeometry
from phone_host.scan.mat import MatCorners

Floats = NDArray[np.float64]

LEAST_CORNERS: Final = 8
"""In one of the two images; fewer hardly tell where a sheet is."""

_SIGMA_PX: Final = 0.05
"""Of a corner's coordinate: what blur, JPEG and noise leave in rendered images, and more than twice of it counts less."""

_MOST_RMS_PX: Final = 1.0
"""A sheet that is bent, or a rig that is off, leaves more."""

_ROBUST_SIGMAS: Final = 2.0
_MOST_STEPS: Final = 20
_STILL: Final = 1e-8
"""rad and m."""

_TO_RIGHT: Final = {Epipolar.LEFT: (1.0, 0.0), Epipolar.UP: (0.0, 1.0), Epipolar.DOWN: (0.0, -1.0)}


@dataclass(frozen=True, slots=True)
class MatScale:
    """How long the printed squares are, as a share of what the mat's name says.

    Attributes:
        value: 1 = as it says.
        sigma: its standard deviation.
    """

    value: float = 1.0
    sigma: float = 0.0


@dataclass(frozen=True, slots=True)
class MatSaid:
    """What a mat told of a pair.

    Attributes:
        seen: corners that were used, left and right.
        rms_px: what the fit leaves of their coordinates, px.
        sigma_m: standard deviation of where the object stands, m.
        scale: of the printed squares, with what earlier pairs told.
    """

    seen: tuple[int, int]
    rms_px: float
    sigma_m: float
    scale: MatScale


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class MatPose:
    """Where a mat lies.

    Attributes:
        camera_mat: takes the mat's axes to those of the rectified left camera.
        covariance: (6, 6) of a small motion in the camera's axes: turn, rad, shift, m.
        scale: of the printed squares, with what was known of it before.
        seen: corners that were used, left and right.
        rms_px: what the fit leaves of their coordinates, px.
    """

    camera_mat: SE3
    covariance: Floats
    scale: MatScale
    seen: tuple[int, int]
    rms_px: float

    def said(self, stands_m: Floats) -> MatSaid:
        """Return it in numbers, for an object that stands at a point (3,), m, of the mat's axes."""
        return MatSaid(self.seen, self.rms_px, self.sigma_at(stands_m), self.scale)

    def sigma_at(self, point_m: Floats) -> float:
        """Return the standard deviation of where a point (3,), m, of the mat's axes is, m, all directions together."""
        x, y, z = self.camera_mat.apply(point_m)
        moved = np.array([[0, z, -y, 1, 0, 0], [-z, 0, x, 0, 1, 0], [y, -x, 0, 0, 0, 1]])
        return float(np.sqrt(np.trace(moved @ self.covariance @ moved.T)))


@dataclass(frozen=True, slots=True, eq=False)
class _Seen:
    """Corners that are seen: M coordinates of either image, one a row."""

    points_m: Floats
    pixels: Floats
    is_right: NDArray[np.bool_]


def fit_mat(
    points_m: Floats,
    corners: MatCorners,
    geometry: StereoGeometry,
    epipolar: Epipolar = Epipolar.LEFT,
    scale: MatScale = MatScale(),
) -> MatPose | None:
    """Find where a mat lies.

    Args:
        points_m: (N, 3) its corners in its axes, m.
        corners: where they are seen.
        geometry: of the rectified pair.
        epipolar: which way its epipolar lines run.
        scale: what is known of the squares; with sigma 0 they are taken to be so.

    Returns:
        The pose; None if too few corners are seen, or they fit no pose.
    """
    if max(corners.counts) < LEAST_CORNERS:
        return None
    seen = _seen(points_m, corners)
    camera = _Pair(geometry, np.array(_TO_RIGHT[epipolar]))
    fits = [_fitted(start, seen, camera, scale) for start in _starts(points_m, corners, camera)]
    found = min(fits, key=lambda fit: fit.cost, default=None)
    if found is None or not found.rms_px <= _MOST_RMS_PX:
        return None
    return MatPose(
        camera_mat=found.pose,
        covariance=found.covariance[:6, :6],
        scale=MatScale(found.scale, float(np.sqrt(found.covariance[6, 6]))),
        seen=corners.counts,
        rms_px=found.rms_px,
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Pair:
    """Projects points into both rectified images; `to_right` (2,): which way the right camera stands."""

    geometry: StereoGeometry
    to_right: Floats

    def projected(self, points: Floats, is_right: NDArray[np.bool_]) -> tuple[Floats, Floats]:
        """Return pixels (M, 2) and their derivatives by the points (M, 2, 3)."""
        of, z = self.geometry, points[:, 2]
        away = np.where(is_right, of.baseline_m, 0.0)[:, np.newaxis] * self.to_right
        zero = np.where(is_right, of.doffs_px, 0.0)[:, np.newaxis] * self.to_right
        aside = (points[:, :2] - away) / z[:, np.newaxis]
        slopes = np.zeros((len(points), 2, 3))
        slopes[:, 0, 0] = slopes[:, 1, 1] = of.focal_px / z
        slopes[:, :, 2] = -of.focal_px * aside / z[:, np.newaxis]
        return of.focal_px * aside + [of.cx_px, of.cy_px] + zero, slopes


@dataclass(frozen=True, slots=True, eq=False)
class _Fit:
    pose: SE3
    scale: float
    covariance: Floats
    cost: float
    rms_px: float


def _seen(points_m: Floats, corners: MatCorners) -> _Seen:
    known = [np.isfinite(each).all(axis=1) for each in (corners.left_px, corners.right_px)]
    return _Seen(
        np.concatenate([points_m[known[0]], points_m[known[1]]]),
        np.concatenate([corners.left_px[known[0]], corners.right_px[known[1]]]),
        np.repeat([False, True], [known[0].sum(), known[1].sum()]),
    )


def _starts(points_m: Floats, corners: MatCorners, camera: _Pair) -> list[SE3]:
    """Return the two poses that the image with more corners leaves open."""
    of, is_right = camera.geometry, corners.counts[1] > corners.counts[0]
    pixels = corners.right_px if is_right else corners.left_px
    known = np.isfinite(pixels).all(axis=1)
    zero = of.doffs_px * camera.to_right if is_right else np.zeros(2)
    slopes = (pixels[known] - [of.cx_px, of.cy_px] - zero) / of.focal_px
    count, turns, shifts, _ = cv2.solvePnPGeneric(
        points_m[known], slopes[:, np.newaxis], np.eye(3), None, flags=cv2.SOLVEPNP_IPPE
    )
    away = np.append(of.baseline_m * camera.to_right, 0.0) if is_right else np.zeros(3)
    poses = [
        SE3.of(np.concatenate([np.ravel(turn), np.ravel(shift) + away]).astype(np.float64))
        for turn, shift in zip(turns[:count], shifts[:count], strict=True)
    ]
    return [pose for pose in poses if (pose.apply(points_m)[:, 2] > 0).all()]


def _fitted(start: SE3, seen: _Seen, camera: _Pair, known: MatScale) -> _Fit:
    """Fit pose and scale by Gauss and Newton, each corner with Cauchy's weight."""
    pose, scale = start, known.value
    for _ in range(_MOST_STEPS):
        errors, jacobian = _linearised(pose, scale, seen, camera)
        weights = _weights(errors)
        matrix, right = _equations(errors, jacobian, weights, scale, known)
        step = np.asarray(np.linalg.solve(matrix, right), np.float64)
        pose, scale = _moved(pose, step), scale + step[6]
        if np.abs(step).max() < _STILL or not np.isfinite(step).all():
            break
    errors, jacobian = _linearised(pose, scale, seen, camera)
    weights = _weights(errors)
    matrix, _ = _equations(errors, jacobian, weights, scale, known)
    squares = (weights * errors**2).sum() / max(weights.sum(), 1e-12)
    noise = max(float(squares) / _SIGMA_PX**2, 1.0)
    lengths = np.linalg.norm(errors.reshape(-1, 2), axis=1) / _SIGMA_PX
    cost = float(np.log1p((lengths / _ROBUST_SIGMAS) ** 2).sum())
    covariance = np.asarray(np.linalg.inv(matrix) * noise, np.float64)
    return _Fit(pose, float(scale), covariance, cost, float(np.sqrt(squares)))


def _linearised(pose: SE3, scale: float, seen: _Seen, camera: _Pair) -> tuple[Floats, Floats]:
    """Return what is left of the coordinates, (2 M,) px, and derivatives (2 M, 7) by turn, shift and scale."""
    turned = seen.points_m @ pose.R.T
    points = scale * turned + pose.t_m
    pixels, slopes = camera.projected(points, seen.is_right)
    by_point = np.zeros((len(points), 3, 7))
    x, y, z = points.T
    by_point[:, 0, 1], by_point[:, 0, 2] = z, -y
    by_point[:, 1, 0], by_point[:, 1, 2] = -z, x
    by_point[:, 2, 0], by_point[:, 2, 1] = y, -x
    by_point[:, :, 3:6] = np.eye(3)
    by_point[:, :, 6] = turned
    return (seen.pixels - pixels).ravel(), (slopes @ by_point).reshape(-1, 7)


def _weights(errors: Floats) -> Floats:
    lengths = np.linalg.norm(errors.reshape(-1, 2), axis=1) / _SIGMA_PX
    return np.repeat(1 / (1 + (lengths / _ROBUST_SIGMAS) ** 2), 2)


def _equations(
    errors: Floats, jacobian: Floats, weights: Floats, scale: float, known: MatScale
) -> tuple[Floats, Floats]:
    """Return matrix (7, 7) and right side (7,); what is known of the scale counts as a measurement."""
    weighted = jacobian * (weights / _SIGMA_PX**2)[:, np.newaxis]
    matrix, right = weighted.T @ jacobian, weighted.T @ errors
    sure = 1 / max(known.sigma, 1e-9) ** 2
    matrix[6, 6] += sure
    right[6] += sure * (known.value - scale)
    return matrix, right


def _moved(pose: SE3, step: Floats) -> SE3:
    moved = SE3.of(step[:6]) @ pose
    return moved.exact()
