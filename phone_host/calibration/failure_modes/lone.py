"""Each camera alone, for the search for causes: a usual lens, a pose for each view, and what they leave. Pure.

The search needs one simple lens for all of its rules, whatever lens the calibration chooses in the end. Corners that were
not seen are NaN.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from common.errors import DataError
from phone_host.calibration.solve.bundle import BundleState
from phone_host.calibration.solve.calibrate_alone import LoneCamera, calibrate_alone, corners_of, errors_px, with_poses
from phone_host.calibration.solve.relative_pose import prediction_errors_px, states_of
from phone_host.calibration.target.pairs import BoardPair
from phone_host.geometry.lens import parameters_of
from phone_host.model import Side

Vector = NDArray[np.float64]

LENS: Final = 9
"""Numbers of a usual lens: fx fy cx cy k1 k2 p1 p2 k3."""

_LEAST_CORNERS: Final = 6


@dataclass(frozen=True, slots=True, eq=False)
class Lone:
    """One camera, with a pose for each view, and the squares that are left, px^2."""

    camera: LoneCamera
    squares_px2: float

    @property
    def lens(self) -> Vector:
        """Its (9,) numbers."""
        return parameters_of(self.camera.parameters)[:LENS]


def both_alone(
    pairs: list[BoardPair], points_m: Vector, sizes_px: tuple[tuple[int, int], ...]
) -> tuple[list[BoardPair], Lone, Lone] | None:
    """Calibrate each camera alone, without views that are plainly wrong.

    Args:
        pairs: the corners.
        points_m: (N, 3) corners in the board's axes.
        sizes_px: width and height of the left and of the right images.

    Returns:
        The pairs left and both cameras; None if fewer than three are left.

    Raises:
        cv2.error: no lens explains the views.
    """
    kept, cameras = list(pairs), []
    for side, size_px in zip(Side, sizes_px, strict=True):
        found = lone_camera(kept, side, points_m, size_px)
        if found is None:
            return None
        kept, camera = found
        cameras.append(camera)
    left, right = (_lone(with_poses(camera, kept, points_m), kept, points_m) for camera in cameras)
    return kept, left, right


def lone_camera(
    pairs: list[BoardPair], side: Side, points_m: Vector, size_px: tuple[int, int]
) -> tuple[list[BoardPair], LoneCamera] | None:
    """Return the pairs whose view on one side fits a lens, and its camera; None if fewer than three do.

    Raises:
        cv2.error: no lens explains the views.
    """
    usable = [pair for pair in pairs if np.isfinite(corners_of(pair, side)).all(axis=1).sum() >= _LEAST_CORNERS]
    try:
        kept, _, camera = calibrate_alone(usable, side, points_m, size_px)
    except DataError:
        return None
    return kept, camera


def apart_px(pairs: list[BoardPair], left: Lone, right: Lone, points_m: Vector) -> tuple[Vector, BundleState]:
    """Return how far each pair's right view is from where the rig that most agree on predicts it, (V,) px, and that rig."""
    states = states_of(left.camera, right.camera)
    errors = prediction_errors_px(states, [pair.right_px for pair in pairs], points_m)
    best = int(np.median(errors, axis=1).argmin())
    return errors[best], states[best]


def _lone(camera: LoneCamera, pairs: list[BoardPair], points_m: Vector) -> Lone:
    return Lone(camera, float(np.nansum(np.square(errors_px(camera, pairs, points_m)))))
