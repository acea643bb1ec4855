"""Whether followed points move as before one rigid camera: the bundle of a window, with and without a warp of each frame. Pure.

- Both use the same weights, from the bundle with warps: what follows a warp counts as little as an outlier in neither.
- Both begin with the points that move as one turning camera says, nearly; the others are tried again when poses are known.
- A bundle of points that leave a plane by little has more than one valley. Several are tried before a camera is accused.

The points to begin with: most of what a hand-held camera sees moves as its turn says; depth moves it by some pixels more. Somebody who walks
by moves by far more. A bundle that begins with all points may take him for the scene: then the scene is infinitely far, he alone has depth,
and what the scene's own depth leaves looks like a warp. So it begins without him. A thing that is close to the camera may be left out, too:
the bundle tries those again.
"""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from phone_host.doctor.camera_check.bundle import LIKELY, Flags, Floats, Problem, State, Tracks, moved
from phone_host.geometry.lens import rays_through
from phone_host.geometry.schur import solved
from phone_host.geometry.se3 import rotations_of
from phone_host.model import CameraModel

_TRIALS: Final = 48
_OF_TRIAL: Final = 3
_STEPS: Final = 4
_TUKEY: Final = 4.7
_FAR: Final = 4.0
"""Standard deviations of what the turns leave of points, beyond which one is left out."""

_LEAST_PX: Final = 2.0
_ROLLED: Final = 0.02
"""By how much a camera turns while its rows are read, radians."""


@dataclass(frozen=True, slots=True, eq=False)
class _Sights:
    """Where points are seen: at home (N, 3), in frames (F, N, 2), both in units of the focal length; row of each (F, N), -0.5 to 0.5."""

    home: Floats
    places: Floats
    rows: Floats


def still_points(tracks: Tracks, model: CameraModel) -> tuple[Flags, Floats]:
    """Find the largest part of the points that moves as one turning camera says, nearly.

    The turns of the best of some triples of points, then all points with robust weights.

    Args:
        tracks: at least three points in frames.
        model: the lens, or a guess.

    Returns:
        (N,) which points, and the turns (F, 3, 3) from the home frame's axes to each frame's.
    """
    frames, count = tracks.points_px.shape[:2]
    rays = rays_through(tracks.points_px.reshape(-1, 2), model).reshape(frames, count, 3)
    places = rays[..., :2] / rays[..., 2:]
    row = (tracks.points_px[..., 1] - (model.height_px - 1) / 2) / model.height_px
    sights = _Sights(np.column_stack([places[tracks.home], np.ones(count)]), places, row)
    seen, far_px = tracks.seen, np.full(count, np.inf)
    turns, rolled = np.tile(np.eye(3), (frames, 1, 1)), np.zeros((frames, 3))
    random = np.random.default_rng(count)  # the same film gives the same answer
    for _ in range(_TRIALS):
        some = random.choice(count, _OF_TRIAL, replace=False)
        few = _Sights(sights.home[some], places[:, some], row[:, some])
        tried = _turned(
            few, np.asarray(seen[:, some], np.float64), np.tile(np.eye(3), (frames, 1, 1)), np.zeros((frames, 3))
        )
        off_px = model.mean_focal_px * _off(sights, seen, *tried)
        if np.median(off_px) < np.median(far_px):
            (turns, rolled), far_px = tried, off_px
    for _ in range(_STEPS):
        off = np.linalg.norm(_unturned(sights, turns, rolled)[0], axis=2)
        sigma = max(float(np.median(far_px)) / 1.177, _LEAST_PX / _FAR) / model.mean_focal_px
        trust = np.asarray(np.where(seen, np.clip(1 - (off / (_TUKEY * sigma)) ** 2, 0, None) ** 2, 0.0), np.float64)
        turns, rolled = _turned(sights, trust, turns, rolled)
        far_px = model.mean_focal_px * _off(sights, seen, turns, rolled)
    limit_px = max(_FAR * float(np.median(far_px)) / 1.177, _LEAST_PX)
    return far_px <= limit_px, turns @ turns[tracks.home].T


def _off(sights: _Sights, seen: Flags, turns: Floats, rolled: Floats) -> Floats:
    """Return by how much each point is beside its place, (N,), in units of the focal length: root mean square of the frames that show it."""
    square = (_unturned(sights, turns, rolled)[0] ** 2).sum(axis=2)
    return np.asarray(np.sqrt((square * seen).sum(axis=0) / np.maximum(seen.sum(axis=0), 1)), np.float64)


def _turned(sights: _Sights, trust: Floats, turns: Floats, rolled: Floats) -> tuple[Floats, Floats]:
    """Return the turns, and the turns over the rows, that fit best: Gauss and Newton."""
    prior = np.array([1e-6, 1e-6, 1e-6, *3 * [(0.002 / _ROLLED) ** 2]])
    for _ in range(_STEPS):
        rest, columns = _unturned(sights, turns, rolled)
        frames, count = trust.shape
        wide = columns.reshape(frames, 2 * count, 6)
        heavy = np.swapaxes(wide * np.repeat(trust, 2, axis=1)[..., np.newaxis], 1, 2)
        right = (heavy @ rest.reshape(frames, 2 * count, 1))[..., 0]
        right[:, 3:] -= prior[3:] * rolled
        solved = np.linalg.solve(heavy @ wide + np.diag(prior), right[..., np.newaxis])
        step = np.asarray(solved[..., 0], np.float64)
        turns, rolled = rotations_of(step[:, :3]) @ turns, rolled + step[:, 3:]
    return turns, rolled


def _unturned(sights: _Sights, turns: Floats, rolled: Floats) -> tuple[Floats, Floats]:
    """Return what turns, and turns over the rows, leave (F, N, 2), and the derivatives by both (F, N, 2, 6)."""
    moved = sights.home @ np.swapaxes(turns, 1, 2)
    row = sights.rows[..., np.newaxis]
    moved = moved + np.cross(rolled[:, np.newaxis] * row, moved)
    x, y = moved[..., 0] / moved[..., 2], moved[..., 1] / moved[..., 2]
    columns = np.empty((*x.shape, 2, 6))
    columns[..., 0, :3] = np.stack([-x * y, 1 + x**2, -y], axis=-1)
    columns[..., 1, :3] = np.stack([-1 - y**2, x * y, x], axis=-1)
    columns[..., 3:] = columns[..., :3] * row[..., np.newaxis]
    return sights.places - np.stack([x, y], axis=-1), columns


_NOISE_PX: Final = 0.1
"""Followed points of good images scatter by this."""

_MOST_STEPS: Final = 25
_SOME: Final = 70
_FEW_STEPS: Final = 12
"""With so many points, and steps, starts are compared: all take five times as long."""

_LEANS: Final = ((0.0, 0.0), (1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0))
"""How inverse depth grows across and down the picture: scenes that a flat start does not lead to lean much."""

_CONVERGED: Final = 5e-4


@dataclass(frozen=True, slots=True, eq=False)
class Compared:
    """The bundle without warps and the one with them.

    Attributes:
        rigid: what the one without leaves: weighted sum of squared residuals, in units of the noise.
        warped: what the other one leaves.
        common: (5,) of the rigid one: focal length (logarithm), middle (x, y; px), k1, readout (frame periods).
        readout_sigma: standard uncertainty of the readout, frame periods.
        trust: (F, N), 0 to 1: how much each sighting is trusted.
        noise_px: standard deviation of what the warped bundle leaves.
        parallax_px: by how much the camera's way moves the points, at most.
        off_plane_px: by how much of that they leave a plane: the median.
    """

    rigid: float
    warped: float
    common: Floats
    readout_sigma: float
    trust: Floats
    noise_px: float
    parallax_px: float
    off_plane_px: float


def _sigma(rest: Floats, seen: Flags) -> float:
    """Return the standard deviation of the residuals, px: the median length of two normal numbers is 1.177 of it."""
    return max(float(np.median(np.linalg.norm(rest, axis=2)[seen])) / 1.177, _NOISE_PX / 4)


def _trust(rest: Floats, seen: Flags, sigma: float) -> Floats:
    """Return Tukey's weights (F, N)."""
    off = np.linalg.norm(rest, axis=2)
    return np.where(seen, np.clip(1 - (off / (_TUKEY * sigma)) ** 2, 0, None) ** 2, 0.0)


def _fit(
    problem: Problem, state: State, seen: Flags, weights: Floats | None, *, warped: bool, steps: int = _MOST_STEPS
) -> State:
    """Minimise (Levenberg and Marquardt), with given weights or with those of Tukey, found on the way."""
    free, damping, small = problem.free(warped=warped), 1e-3, 0
    parts = problem.residuals(state)
    for _ in range(steps):
        if weights is None:
            sigma = _sigma(parts[0], seen)
            used = _trust(parts[0], seen, sigma) / sigma**2
        else:
            used = weights
        prior = problem.prior(state, warped=warped)
        before = problem.cost(state, parts[0], used, prior)
        equations = problem.equations(state, parts, used, prior)
        while True:
            tried = moved(state, *equations.step(damping, free))
            tried_parts = problem.residuals(tried)
            after = problem.cost(tried, tried_parts[0], used, prior)
            if after < before or damping > 1e3:
                break
            damping *= 10
        if not after < before:
            break
        state, parts, damping = tried, tried_parts, max(damping / 10, 1e-9)
        small = small + 1 if (before - after) < _CONVERGED * before else 0
        if small == 2:
            break
    return state


def _begun(tracks: Tracks, model: CameraModel, still: Flags, turns: Floats, *, knows_lens: bool) -> State:
    """Return a state to begin with: the best of scenes that lean this way or that, as some of the points tell, and of its reversal."""
    some = np.flatnonzero(still)[:: max(1, int(still.sum()) // _SOME)]
    few = Tracks(tracks.points_px[:, some], tracks.seen[:, some], tracks.home)
    problem, seen = Problem(few, model, knows_lens=knows_lens), few.seen
    flat = problem.start(turns)
    lean = [
        replace(flat, points=flat.points + np.outer(flat.points @ [across, down, 0.0], [0, 0, 1]))
        for across, down in _LEANS
    ]
    found = [_fit(problem, each, seen, None, warped=False, steps=_FEW_STEPS) for each in lean]
    best = _best(problem, found, seen)
    best = _best(
        problem, [best, _fit(problem, reversed_in_depth(best), seen, None, warped=False, steps=_FEW_STEPS)], seen
    )
    whole = Problem(tracks, model, knows_lens=knows_lens)
    points = whole.start(turns).points
    points[some] = best.points
    others = np.ones(len(points), bool)
    others[some] = False
    return whole.placed(replace(best, points=points), others)


def _best(problem: Problem, states: list[State], seen: Flags) -> State:
    """Return the state that leaves the least, outliers counted alike."""
    off = [np.linalg.norm(problem.residuals(each)[0], axis=2)[seen] for each in states]
    most = _TUKEY * min(float(np.median(each)) for each in off)
    return states[int(np.argmin([float((np.minimum(each, most) ** 2).sum()) for each in off]))]


def reversed_in_depth(state: State) -> State:
    """Return the reversal of a state in depth (Necker's): near for far and there for back looks nearly the same."""
    depth = float(np.median(state.points[:, 2]))
    back = 2 * depth * state.shifts
    turns = rotations_of(np.column_stack([-back[:, 1], back[:, 0], np.zeros(len(back))])) @ state.turns
    points = np.column_stack([state.points[:, :2], 2 * depth - state.points[:, 2]])
    return State(turns, -state.shifts, np.zeros_like(state.rows), state.warps, LIKELY.copy(), points)


def compare(tracks: Tracks, model: CameraModel, *, knows_lens: bool) -> Compared:
    """Compute both bundles of a window.

    Args:
        tracks: at least 20 points in at least 7 frames.
        model: the lens, or a guess.
        knows_lens: whether it was calibrated.

    Raises:
        np.linalg.LinAlgError: the points tell nothing.
    """
    problem = Problem(tracks, model, knows_lens=knows_lens)
    still, turns = still_points(tracks, model)
    seen = tracks.seen & still
    begun = _begun(tracks, model, still, turns, knows_lens=knows_lens)
    rigid = _fit(problem, begun, seen, None, warped=False)
    warped = problem.placed(_fit(problem, rigid, seen, None, warped=True), ~still)
    rest = problem.residuals(warped)[0]
    sigma = _sigma(rest, seen)
    trust = _trust(rest, tracks.seen, sigma)
    weights = trust / sigma**2
    straight = replace(warped, warps=np.zeros_like(warped.warps), rows=rigid.rows, common=rigid.common)
    both = [_fit(problem, start, seen, weights, warped=False) for start in (rigid, straight)]
    rigid = min(both, key=lambda each: _left(problem, each, weights))
    return Compared(
        _left(problem, rigid, weights),
        _left(problem, warped, weights),
        rigid.common,
        _readout_sigma(problem, rigid, weights),
        trust,
        sigma,
        *_parallax(rigid, model, trust),
    )


def _parallax(state: State, model: CameraModel, trust: Floats) -> tuple[float, float]:
    """Return by how much the camera's way moves the points, and by how much they leave a plane, px."""
    points = state.points[trust.mean(axis=0) >= np.median(trust.mean(axis=0)) / 2]
    places = np.column_stack([np.ones(len(points)), points[:, :2]])
    plane = np.linalg.lstsq(places, points[:, 2], rcond=None)[0]
    way_px = model.mean_focal_px * float(np.linalg.norm(state.shifts, axis=1).max())
    off = float(np.median(np.abs(points[:, 2] - places @ plane)))
    return way_px * float(np.median(points[:, 2])), way_px * off


def _left(problem: Problem, state: State, weights: Floats) -> float:
    return float((weights[..., np.newaxis] * problem.residuals(state)[0] ** 2).sum())


def _readout_sigma(problem: Problem, state: State, weights: Floats) -> float:
    free, prior = problem.free(warped=False), problem.prior(state, warped=False)
    matrix = problem.equations(state, problem.residuals(state), weights, prior).reduced(0.0, free)[0]
    unit = np.zeros(len(matrix))
    unit[-1] = 1.0
    return float(np.sqrt(solved(matrix, unit)[-1]))
