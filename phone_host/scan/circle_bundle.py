"""All views of a turning thing fitted together: one axis, an angle for each view, and the points they see. Pure.

Each corner is looked for where the circle so far says that it went. It is compared with the view in which it was found, never with the one before, so that
errors do not add up along the way.

Shared parameters of the equations are the angles and the axis (two turns of its direction, two shifts of its point), blocks are the points
(`geometry.schur`). The first angle stays where it is. Where the turn is closed, views at its end see points of its beginning, and the error
of all the angles between is distributed by the fit itself.

An error that all disparities have in common is not estimated, as it is in `window`: on a thing that is small beside its distance it looks like another
scale. Let free, it took 0.95 px and spoilt the axis by 4.5 mm.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.geometry.schur import NormalEquations, minimise
from phone_host.geometry.se3 import SE3, cross_matrices, rotations_of, vectors_of
from phone_host.model import Image, StereoGeometry
from phone_host.scan.camera_pose import Observer, huber
from phone_host.scan.odometry import flow, new_corners
from phone_host.scan.view import View

Floats = NDArray[np.float64]
Numbers = NDArray[np.int64]

_LEAST_TURN: Final = 0.03
"""rad between two views that tell an axis: with less, the noise of the poses is as large as the motion."""

_ROUNDS: Final = 20
_ROBUST: Final = 2.0
"""Times the usual error; motions that are farther off count less."""

_LEAST_SPREAD: Final = 1e-6
"""rad and m: errors below it are rounding."""


@dataclass(frozen=True, slots=True, eq=False)
class TurnAxis:
    """A line about which a thing turns.

    Attributes:
        direction: (3,) of length 1, so that the angles grow.
        point_m: (3,) on it.
    """

    direction: Floats
    point_m: Floats

    def camera_world(self, angle: float) -> SE3:
        """Return what takes the thing's points to the camera when it has turned by an angle, rad."""
        turn = rotations_of(angle * self.direction)
        return SE3(turn, self.point_m - turn @ self.point_m)

    def angle_of(self, camera_world: SE3) -> float:
        """Return the angle, -pi to pi, whose turn is nearest to that of a pose."""
        a, r = self.direction, camera_world.R
        along = a @ r @ a
        across = a @ np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]])
        return float(np.arctan2(across, np.trace(r) - along))

    def nearest_to(self, middle_m: Floats) -> "TurnAxis":
        """Return the same axis, with the point that is nearest to another one."""
        return TurnAxis(self.direction, self.point_m + (middle_m - self.point_m) @ self.direction * self.direction)


def axis_of(motions: Sequence[SE3]) -> TurnAxis | None:
    """Find the axis that motions of a thing have in common; those that contradict the others count little.

    Args:
        motions: each takes the thing from one view to a later one, in the camera's axes.

    Returns:
        The axis, its point as near to the origin as it gets; None: nothing turns far enough to tell one.
    """
    vectors = np.array([vectors_of(motion.R) for motion in motions]).reshape(-1, 3)
    shifts = np.array([motion.t_m for motion in motions]).reshape(-1, 3)
    turns = np.array([motion.R for motion in motions]).reshape(-1, 3, 3)
    angles = np.linalg.norm(vectors, axis=1)
    far = angles >= _LEAST_TURN
    if not far.any():
        return None
    vectors, shifts, turns, angles = vectors[far], shifts[far], turns[far], angles[far]
    weights = np.ones(len(angles))
    direction, point = np.zeros(3), np.zeros(3)
    for _ in range(_ROUNDS):
        _, directions = np.linalg.eigh((vectors * weights[:, np.newaxis]).T @ vectors)
        direction = directions[:, 2]
        if np.median(vectors @ direction) < 0:
            direction = -direction
        # Turned about (direction, point) the point stays: (1 - R) point = shift. Nothing is told along the axis: the point lies across it.
        across = directions[:, :2]
        rows = ((np.eye(3) - turns) @ across) * weights[:, np.newaxis, np.newaxis]
        point = across @ np.linalg.lstsq(rows.reshape(-1, 2), (shifts * weights[:, np.newaxis]).ravel(), rcond=None)[0]
        off = np.linalg.norm(vectors - (vectors @ direction)[:, np.newaxis] * direction, axis=1) + np.linalg.norm(
            shifts - (np.eye(3) - turns) @ point, axis=1
        ) / max(float(np.linalg.norm(point)), _LEAST_SPREAD)
        spread = max(float(np.median(off)), _LEAST_SPREAD)
        weights = np.minimum(1.0, _ROBUST * spread / np.maximum(off, _LEAST_SPREAD)) ** 2
    return TurnAxis(direction, point)


def unwrapped(angles: Sequence[float]) -> Floats:
    """Return angles, rad, in order, each within half a turn of the one before."""
    return np.asarray(np.unwrap(np.array(angles, np.float64)), np.float64)


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
    """Fit axis, angles and points."""
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


_CORNERS: Final = 100
"""Of a view."""

_APART_PX: Final = 6
_REACH: Final = 0.45
"""rad: how far a thing may turn until a corner looks too different."""

_NEIGHBOURS: Final = 4
"""Views before, and as many after, in which a corner is looked for; of those of the turn before as many again."""

_WINDOW_PX: Final = (17, 17)
_LEVELS: Final = 2
_THERE_AND_BACK_PX: Final = 0.5
_CONTRAST_PX: Final = 21
_CONTRAST_FLOOR: Final = 4.0
"""Grey levels of contrast that count as none: less is noise."""

_BORDER_PX: Final = 3
_DEPTH_SIGMAS: Final = 5.0
_DEPTH_SHARE: Final = 0.02
"""Of the depth: a corner whose place in the other view is farther off than this and five standard deviations is hidden there."""


@dataclass(frozen=True, slots=True, eq=False)
class Tracks:
    """Points that several views see.

    Attributes:
        points_m: (P, 3) where the circle so far puts them, m.
        seen: what each view sees of them.
        closing: sightings of points of one turn in views of another.
    """

    points_m: Floats
    seen: tuple[Seen, ...]
    closing: int


def tracks_of(views: Sequence[View], axis: TurnAxis, angles: Floats, *, across_turns: bool = True) -> Tracks:
    """Find corners in each view, and look for them in its neighbours, also one turn later or earlier.

    Args:
        views: of the thing alone: what does not belong to it has no depth.
        axis: about which it turns, as far as is known.
        angles: (N,) how far it has turned in each view, rad, as far as is known.
        across_turns: whether views of another turn are neighbours, too.
    """
    pictures = [_evened(view.grey) for view in views]
    observer = Observer(views[0].geometry, views[0].noise_px)
    numbers: list[list[Numbers]] = [[] for _ in views]
    observed: list[list[Floats]] = [[] for _ in views]
    points, count, closing = [], 0, 0
    for here, view in enumerate(views):
        corners = _corners(view)
        seen_here = view.observed(corners)
        usable = np.isfinite(seen_here[:, 2])
        corners, seen_here = corners[usable], seen_here[usable]
        if not len(corners):
            continue
        own = axis.camera_world(float(angles[here])).inverse().apply(observer.points(seen_here))
        met = np.zeros(len(corners), np.int64)
        found_in = []
        for there in _neighbours(angles, here, across_turns=across_turns):
            pose = axis.camera_world(float(angles[there]))
            pixels, found = _looked_for(pictures[here], pictures[there], corners, pose.apply(own), views[there])
            met += found
            found_in.append((there, pixels, found))
        kept = met >= 2
        index = np.cumsum(kept) - 1 + count
        numbers[here].append(index[kept])
        observed[here].append(seen_here[kept])
        for there, pixels, found in found_in:
            both = kept & found
            numbers[there].append(index[both])
            observed[there].append(views[there].observed(pixels[both]))
            closing += int(np.count_nonzero(both)) if abs(angles[there] - angles[here]) > np.pi else 0
        points.append(own[kept])
        count += int(np.count_nonzero(kept))
    every = np.concatenate(points) if points else np.zeros((0, 3))
    return Tracks(every, tuple(_seen(ids, rows) for ids, rows in zip(numbers, observed, strict=True)), closing)


def _seen(numbers: list[Numbers], observed: list[Floats]) -> Seen:
    if not numbers:
        return Seen(np.zeros(0, np.int64), np.zeros((0, 3)))
    return Seen(np.concatenate(numbers), np.concatenate(observed))


def _neighbours(angles: Floats, here: int, *, across_turns: bool) -> list[int]:
    """Return the views that show nearly the same side: the nearest of those before and after, and of those one turn away."""
    away = angles - angles[here]
    turns = np.rint(away / (2 * np.pi))
    beside = away - turns * 2 * np.pi
    chosen: list[int] = []
    for turn in np.unique(turns) if across_turns else (0.0,):
        for sign in (-1, 1):
            side = np.flatnonzero((turns == turn) & (sign * beside >= 0) & (np.abs(beside) <= _REACH))
            side = side[side != here]
            chosen.extend(side[np.argsort(np.abs(beside[side]), kind="stable")][:_NEIGHBOURS].tolist())
    return sorted(set(chosen))


def _corners(view: View) -> NDArray[np.float32]:
    known = np.isfinite(view.depth_m).astype(np.uint8)
    inside = cv2.erode(known, np.ones((2 * _BORDER_PX + 1, 2 * _BORDER_PX + 1), np.uint8), borderValue=0)
    return new_corners(view.grey, np.zeros((0, 2), np.float32), _CORNERS, _APART_PX, inside > 0)


def _looked_for(
    here: Image, there: Image, corners: NDArray[np.float32], points_m: Floats, view: View
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Look for corners (N, 2) in another view, whose points (N, 3) are in its camera's axes; return where they are and which were found."""
    start = _projected(points_m, view.geometry)
    to, found = flow(here, there, corners, start, window_px=_WINDOW_PX, levels=_LEVELS)
    back, found_back = flow(there, here, to, corners.copy(), window_px=_WINDOW_PX, levels=_LEVELS)
    height, width = there.shape
    inside = (to >= _BORDER_PX).all(axis=1) & (to < (width - _BORDER_PX, height - _BORDER_PX)).all(axis=1)
    near = np.linalg.norm(back - corners, axis=1) < _THERE_AND_BACK_PX
    found = found & found_back & inside & near & (points_m[:, 2] > 0)
    places = np.rint(np.where(found[:, np.newaxis], to, 0)).astype(np.int64)
    depth = view.depth_m[places[:, 1], places[:, 0]].astype(np.float64)
    most = _DEPTH_SIGMAS * view.noise_per_m * points_m[:, 2] ** 2 + _DEPTH_SHARE * points_m[:, 2]
    return to, found & (np.abs(depth - points_m[:, 2]) <= most)


def _projected(points_m: Floats, geometry: StereoGeometry) -> NDArray[np.float32]:
    depth = np.maximum(points_m[:, 2:], 1e-3)
    centre = np.array([geometry.cx_px, geometry.cy_px])
    return np.asarray(geometry.focal_px * points_m[:, :2] / depth + centre, np.float32)


def _evened(grey: Image) -> Image:
    """Return a picture whose contrast and brightness are everywhere alike: the lamp stands still while the thing turns."""
    side = (_CONTRAST_PX, _CONTRAST_PX)
    values = grey.astype(np.float32)
    mean = cv2.blur(values, side)
    spread = np.sqrt(np.maximum(cv2.blur(values * values, side) - mean * mean, 0)) + _CONTRAST_FLOOR
    return np.clip(128 + 45 * (values - mean) / spread, 0, 255).astype(np.uint8)
