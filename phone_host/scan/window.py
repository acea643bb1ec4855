"""The newest keyframes and the points they see, fitted together: a sliding bundle. Pure.

Shared parameters of the equations are the keyframes' motions and the disparities' common error, blocks are the points
(`geometry.schur`). The oldest keyframes of a window stay where they are, which ties it to what came before. The common error shows
where points at different depths move past each other: a wrong disparity puts the near ones at another scale than the far ones.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.geometry.schur import NormalEquations, minimise
from phone_host.geometry.se3 import SE3, rotations_of
from phone_host.scan.camera_pose import Observer, by_motion, huber

Floats = NDArray[np.float64]
Numbers = NDArray[np.int64]

WINDOW: Final = 10
"""Keyframes that are fitted together."""

_CONVERGED: Final = 1e-3
"""Relative decrease of the cost at which the search ends; the next keyframe's bundle goes on from there."""

_LEAST_POINTS: Final = 20

_OFFSET_SIGMA_PX: Final = 0.15
"""Standard deviation of the common error before anything was seen."""

_OFFSET_STEP_PX: Final = 0.02
"""By how much it may change from one window to the next: it is a property of rig and matcher, and windows share their views."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Keyframe:
    """A view whose motion is estimated together with others.

    Attributes:
        index: of the view in the sequence.
        camera_world: takes the world's points to the camera.
        ids: (N,) the points it sees, in rising order.
        observed_px: (N, 3) float64 u, v, d of each, px; d NaN = none.
    """

    index: int
    camera_world: SE3
    ids: Numbers
    observed_px: Floats


@dataclass(frozen=True, slots=True, eq=False)
class Fitted:
    """Keyframes and points after the fit.

    Attributes:
        keyframes: as many as went in.
        ids: (P,) the points that were fitted, in rising order.
        points_m: (P, 3) float64, m, in the world.
        offset_px: by how much all disparities are too large, px.
    """

    keyframes: tuple[Keyframe, ...]
    ids: Numbers
    points_m: Floats
    offset_px: float

    def updated(self, ids: Numbers, points_m: Floats) -> Floats:
        """Return points (N, 3), m, with those that were fitted in place of the old ones."""
        if len(self.ids) == 0:
            return points_m
        at = np.minimum(np.searchsorted(self.ids, ids), len(self.ids) - 1)
        return np.where((self.ids[at] == ids)[:, np.newaxis], self.points_m[at], points_m)


def fitted(keyframes: Sequence[Keyframe], ids: Numbers, points_m: Floats, observer: Observer, still: int) -> Fitted:
    """Fit keyframes and the points that at least two of them see.

    Args:
        keyframes: at least two.
        ids: (P,) points whose place is known, in rising order; others start where their first disparity puts them.
        points_m: (P, 3) float64, m, in the world.
        observer: how they are measured.
        still: how many of the first keyframes stay where they are, >= 1.

    Returns:
        What was fitted; the keyframes as they came where too few points are seen twice.
    """
    seen, counts = np.unique(np.concatenate([each.ids for each in keyframes]), return_counts=True)
    seen = seen[counts > 1]
    start = _started(keyframes, seen, observer)
    start = Fitted(tuple(keyframes), ids, points_m, 0.0).updated(seen, start)
    known = np.isfinite(start).all(axis=1)
    seen, start = seen[known], start[known]
    if len(seen) < _LEAST_POINTS:
        return Fitted(tuple(keyframes), seen[:0], start[:0], observer.offset_px)
    problem = _Problem(tuple(_seen_by(each, seen) for each in keyframes), observer)
    state = _State(
        np.array([each.camera_world.R for each in keyframes]),
        np.array([each.camera_world.t_m for each in keyframes]),
        start,
        observer.offset_px,
    )
    free = np.append(np.repeat(np.arange(len(keyframes)) >= still, 6), values=True)
    found = minimise(problem, state, free, _CONVERGED)
    moved = (
        replace(each, camera_world=SE3(turn, shift))
        for each, turn, shift in zip(keyframes, found.turns, found.shifts_m, strict=True)
    )
    return Fitted(tuple(moved), seen, found.points_m, found.offset_px)


def _started(keyframes: Sequence[Keyframe], ids: Numbers, observer: Observer) -> Floats:
    """Return where the first disparity of each point puts it, (P, 3), m, in the world; NaN without any."""
    points = np.full((len(ids), 3), np.nan)
    for each in reversed(keyframes):
        rows = _seen_by(each, ids)
        found = each.camera_world.inverse().apply(observer.points(rows.observed_px))
        usable = np.isfinite(found).all(axis=1)
        points[rows.points[usable]] = found[usable]
    return points


@dataclass(frozen=True, slots=True, eq=False)
class _Seen:
    """What one keyframe sees of the fitted points: their numbers (N,), each once, and (N, 3) u, v, d."""

    points: Numbers
    observed_px: Floats


def _seen_by(keyframe: Keyframe, ids: Numbers) -> _Seen:
    at = np.minimum(np.searchsorted(ids, keyframe.ids), max(len(ids) - 1, 0))
    chosen = ids[at] == keyframe.ids if len(ids) else np.zeros(len(keyframe.ids), np.bool_)
    return _Seen(at[chosen], keyframe.observed_px[chosen])


@dataclass(frozen=True, slots=True, eq=False)
class _State:
    """Turns (K, 3, 3) and shifts (K, 3), m, that take the world's points to each camera; points (P, 3), m; common error, px."""

    turns: Floats
    shifts_m: Floats
    points_m: Floats
    offset_px: float


@dataclass(frozen=True, slots=True, eq=False)
class _Problem:
    """See `geometry.schur.Problem`."""

    seen: tuple[_Seen, ...]
    observer: Observer

    def cost(self, state: _State) -> float:
        """Return Huber's cost of all observations."""
        total = float((self._offset(state)[0] ** 2).sum())
        for frame, rows in enumerate(self.seen):
            errors = self._errors(rows, self._in_camera(state, frame, rows), state)
            total += float(huber(np.linalg.norm(errors, axis=1))[0].sum())
        return total if np.isfinite(total) else float("inf")

    def moved(self, state: _State, shared: Floats, blocks: Floats) -> _State:
        """Return a state after a step."""
        steps = shared[:-1].reshape(-1, 6)
        turns = rotations_of(steps[:, :3])
        shifts = (turns @ state.shifts_m[..., np.newaxis])[..., 0] + steps[:, 3:]
        return _State(turns @ state.turns, shifts, state.points_m + blocks, state.offset_px + float(shared[-1]))

    def linearised(self, state: _State) -> NormalEquations:
        """Linearise at a state."""
        frames, count = len(self.seen), len(state.points_m)
        size = 6 * frames + 1
        shared, right, coupling = np.zeros((size, size)), np.zeros(size), np.zeros((count, size, 3))
        pulls, roots = self._offset(state)
        shared[-1, -1], right[-1] = (roots**2).sum(), (roots * pulls).sum()
        blocks, blocks_right = np.zeros((count, 3, 3)), np.zeros((count, 3))
        for frame, rows in enumerate(self.seen):
            points = self._in_camera(state, frame, rows)
            errors = self._errors(rows, points, state)
            root = np.sqrt(huber(np.linalg.norm(errors, axis=1))[1])
            errors *= root[:, np.newaxis]
            slopes = self.observer.slopes(points) * (self.observer.weights * root[:, np.newaxis])[..., np.newaxis]
            slopes[~np.isfinite(rows.observed_px)] = 0
            by_pose, by_point = by_motion(slopes, points), slopes @ state.turns[frame]
            here, flat, turned = slice(6 * frame, 6 * frame + 6), by_pose.reshape(-1, 6), np.swapaxes(by_point, 1, 2)
            shared[here, here] = flat.T @ flat
            right[here] = flat.T @ errors.ravel()
            coupling[rows.points, here] = np.swapaxes(by_pose, 1, 2) @ by_point
            by_offset = np.where(np.isfinite(rows.observed_px[:, 2]), self.observer.weights[2] * root, 0.0)
            shared[-1, -1] += (by_offset**2).sum()
            shared[here, -1] = shared[-1, here] = by_offset @ by_pose[:, 2]
            right[-1] += by_offset @ errors[:, 2]
            coupling[rows.points, -1] += by_offset[:, np.newaxis] * by_point[:, 2]
            blocks[rows.points] += turned @ by_point
            blocks_right[rows.points] += (turned @ errors[..., np.newaxis])[..., 0]
        return NormalEquations(
            shared=shared, coupling=coupling, blocks=blocks, shared_right=right, blocks_right=blocks_right
        )

    def _in_camera(self, state: _State, frame: int, rows: _Seen) -> Floats:
        return np.asarray(state.points_m[rows.points] @ state.turns[frame].T + state.shifts_m[frame], np.float64)

    def _errors(self, rows: _Seen, points_m: Floats, state: _State) -> Floats:
        """Return (N, 3) seen minus projected, in standard deviations; 0 where nothing was measured."""
        observer = replace(self.observer, offset_px=state.offset_px)
        errors = (rows.observed_px - observer.projected(points_m)) * observer.weights
        return np.nan_to_num(errors, nan=0.0)

    def _offset(self, state: _State) -> tuple[Floats, Floats]:
        """Return how far the common error is from none, and from that of the last window, in standard deviations; and 1 / these, 1/px."""
        roots = np.array([1 / _OFFSET_SIGMA_PX, 1 / _OFFSET_STEP_PX])
        return roots * (np.array([0.0, self.observer.offset_px]) - state.offset_px), roots
