"""All views of a turning thing fitted together: one axis, an angle for each view, and the points they see. Pure.

Shared parameters of the equations are the angles and the axis (two turns of its direction, two shifts of its point), blocks are the points
(`geometry.schur`). The first angle stays where it is. Where the turn is closed, views at its end see points of its beginning, and the error
of all the angles between is distributed by the fit itself.

An error that all disparities have in common is not estimated, as it is in `window`: on a thing that is small beside its distance it looks like another
scale. Let free, it took 0.95 px and spoilt the axis by 4.5 mm.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.geometry.schur import NormalEquations, minimise
from phone_host.geometry.se3 import cross_matrices, rotations_of
from phone_host.scan.observation import Observer, huber
from phone_host.scan.turn_axis import TurnAxis

Floats = NDArray[np.float64]
Numbers = NDArray[np.int64]

_CONVERGED: Final = 1e-5
_AXIS_PARAMETERS: Final = 4
"""Two of the direction, two of the point."""

_UNSEEN: Final = 1e-3
"""1/m^2 of every point, so that one that no view sees stays where it is; a view gives 1e6."""


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """What one view sees: numbers of the points (N,), each once, and (N, 3) u, v, d of each, px; d NaN = none."""

    points: Numbers
    observed_px: Floats


@dataclass(frozen=True, slots=True, eq=False)
class Circle:
    """Where the views of a turning thing lie.

    Attributes:
        axis: about which it turns.
        angles: (N,) how far it has turned at each view, rad.
        points_m: (P, 3) points of the thing, in the camera's axes at angle 0, m.
    """

    axis: TurnAxis
    angles: Floats
    points_m: Floats


def fitted_circle(start: Circle, seen: Sequence[Seen], observer: Observer) -> Circle:
    """Fit axis, angles and points.

    Args:
        start: where to begin.
        seen: what each view sees, as many as angles.
        observer: how points are measured.

    Returns:
        The fit.
    """
    middle = np.median(start.points_m, axis=0)
    start = replace(start, axis=start.axis.nearest_to(middle))
    free = np.ones(len(start.angles) + _AXIS_PARAMETERS, np.bool_)
    free[0] = False
    found = minimise(_Problem(tuple(seen), observer), start, free, _CONVERGED)
    return replace(found, axis=found.axis.nearest_to(middle))


def misfits(circle: Circle, seen: Seen, view: int, observer: Observer) -> Floats:
    """Return how far off each observation of a view is, (N,), in standard deviations."""
    there = circle.axis.camera_world(float(circle.angles[view])).apply(circle.points_m[seen.points])
    errors = _errors(there, seen, observer)
    return np.asarray(np.linalg.norm(errors, axis=1), np.float64)


def _across(direction: Floats) -> Floats:
    """Return two directions (3, 2) of length 1 across another one, always the same for it."""
    beside = np.eye(3)[int(np.argmin(np.abs(direction)))]
    first = np.cross(direction, beside)
    first /= np.linalg.norm(first)
    return np.column_stack([first, np.cross(direction, first)])


def _errors(points_m: Floats, seen: Seen, observer: Observer) -> Floats:
    return np.nan_to_num((seen.observed_px - observer.projected(points_m)) * observer.weights, nan=0.0)


@dataclass(frozen=True, slots=True, eq=False)
class _Problem:
    """See `geometry.schur.Problem`."""

    seen: tuple[Seen, ...]
    observer: Observer

    def cost(self, state: Circle) -> float:
        """Return Huber's cost of all observations."""
        total = 0.0
        for view, seen in enumerate(self.seen):
            total += float(huber(misfits(state, seen, view, self.observer))[0].sum())
        return total if np.isfinite(total) else float("inf")

    def moved(self, state: Circle, shared: Floats, blocks: Floats) -> Circle:
        """Return a state after a step."""
        views = len(self.seen)
        across = _across(state.axis.direction)
        direction = rotations_of(across @ shared[views : views + 2]) @ state.axis.direction
        point = state.axis.point_m + across @ shared[views + 2 : views + 4]
        axis = TurnAxis(direction / np.linalg.norm(direction), point)
        return Circle(axis, state.angles + shared[:views], state.points_m + blocks)

    def linearised(self, state: Circle) -> NormalEquations:
        """Linearise at a state."""
        views, count = len(self.seen), len(state.points_m)
        size = views + _AXIS_PARAMETERS
        shared, right, coupling = np.zeros((size, size)), np.zeros(size), np.zeros((count, size, 3))
        blocks, blocks_right = np.tile(_UNSEEN * np.eye(3), (count, 1, 1)), np.zeros((count, 3))
        observer, axis_at = self.observer, np.arange(views, size)
        for view, seen in enumerate(self.seen):
            pose = state.axis.camera_world(float(state.angles[view]))
            own = state.points_m[seen.points]
            there = pose.apply(own)
            errors = _errors(there, seen, observer)
            root = np.sqrt(huber(np.linalg.norm(errors, axis=1))[1])
            errors *= root[:, np.newaxis]
            slopes = observer.slopes(there) * (observer.weights * root[:, np.newaxis])[..., np.newaxis]
            slopes[~np.isfinite(seen.observed_px)] = 0
            by_shared = slopes @ _by_circle(state.axis, pose.R, own, there)
            by_point, at = slopes @ pose.R, np.concatenate([[view], axis_at])
            flat = by_shared.reshape(-1, len(at))
            shared[np.ix_(at, at)] += flat.T @ flat
            right[at] += flat.T @ errors.ravel()
            coupling[seen.points[:, np.newaxis], at] += np.swapaxes(by_shared, 1, 2) @ by_point
            turned = np.swapaxes(by_point, 1, 2)
            blocks[seen.points] += turned @ by_point
            blocks_right[seen.points] += (turned @ errors[..., np.newaxis])[..., 0]
        return NormalEquations(
            shared=shared, coupling=coupling, blocks=blocks, shared_right=right, blocks_right=blocks_right
        )


def _by_circle(axis: TurnAxis, turn: Floats, own_m: Floats, there_m: Floats) -> Floats:
    """Return the derivatives (N, 3, 5) of points in the camera by the angle, and by direction and point of the axis."""
    across = _across(axis.direction)
    result = np.empty((len(own_m), 3, 5))
    result[..., 0] = np.cross(axis.direction, there_m - axis.point_m)
    # The axis is turned by a small vector v: its rotation becomes exp(v) R exp(-v), so points move by v x there - R (v x own).
    by_vector = turn @ cross_matrices(own_m - axis.point_m) - cross_matrices(there_m - axis.point_m)
    result[..., 1:3] = by_vector @ across
    result[..., 3:] = (np.eye(3) - turn) @ across
    return result
