"""Measures the squares of boards that a rig has not seen. Pure.

The boards are dealt out in parts; each part is measured by a rig fitted to the others. So an error that a rig makes
everywhere, of scale or of depth, shows in millimetres, while the rows of a rig fitted to the same views may still meet.
"""

from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.calibration.solve.board_in_space import ray_crossings
from phone_host.calibration.solve.bundle import BundleState, BundleView, FreeParameters, Vector, adjust_roughly, rig_of
from phone_host.calibration.solve.result import Squares
from phone_host.calibration.target.pairs import BoardPair
from phone_host.model import Rig

_PARTS: Final = 5
_LEAST_PAIRS: Final = 6
_NEIGHBOUR: Final = 0.01
"""Corners whose distance is a side, up to this share, span one."""


def held_out_squares(pairs: list[BoardPair], points_m: Vector, state: BundleState, free: FreeParameters) -> Squares:
    """Measure the squares of every pair by a rig that has not seen it.

    Args:
        pairs: the pairs that are used.
        points_m: (N, 3) corners in the board's axes.
        state: the rig fitted to all of them.
        free: what was estimated.
    """
    true_m = _side_m(points_m)
    sides: list[Vector] = []
    parts = min(_PARTS, len(pairs)) if len(pairs) >= _LEAST_PAIRS else 0
    for part in range(parts):
        out = np.arange(len(pairs)) % parts == part
        kept = [BundleView(pair.left_px, pair.right_px) for pair, held in zip(pairs, out, strict=True) if not held]
        rig = rig_of(adjust_roughly(kept, points_m, replace(state, poses=state.poses[~out]), free))
        held = [pair for pair, is_held in zip(pairs, out, strict=True) if is_held]
        sides.append(square_sides_m(held, points_m, rig))
    found = np.concatenate(sides) if sides else np.empty(0)
    if not found.size:
        return Squares(true_m=true_m, mean_m=float("nan"), sigma_m=float("nan"), count=0)
    return Squares(true_m=true_m, mean_m=float(found.mean()), sigma_m=float(found.std()), count=found.size)


def square_sides_m(pairs: list[BoardPair], points_m: Vector, rig: Rig) -> Vector:
    """Return the sides of the squares between neighbouring corners, (M,) m, as a rig measures them: where its rays meet best.

    Args:
        pairs: the corners; NaN where one is not seen.
        points_m: (N, 3) corners in the board's axes.
        rig: the rig.
    """
    points = ray_crossings(pairs, rig).points_m.reshape(len(pairs), -1, 3)
    first, second = _neighbours(points_m)
    sides = np.linalg.norm(points[:, first] - points[:, second], axis=2)
    return np.asarray(sides[np.isfinite(sides)], np.float64)


def _side_m(points_m: Vector) -> float:
    """Return the side of a square, or of an AprilGrid's tag: its gaps are so narrow that noise makes them longer."""
    return float(np.linalg.norm(points_m[1] - points_m[0]))


def _neighbours(points_m: Vector) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    apart, side_m = np.linalg.norm(points_m[:, np.newaxis] - points_m[np.newaxis], axis=2), _side_m(points_m)
    first, second = np.nonzero(np.triu(np.abs(apart - side_m) <= side_m * _NEIGHBOUR, 1))
    return first, second
