"""Whether followed points move as before one rigid camera: the bundle of a window, with and without a warp of each frame. Pure.

- Both use the same weights, from the bundle with warps: what follows a warp counts as little as an outlier in neither.
- Both begin with the points that move as one turning camera says, nearly; the others are tried again when poses are known.
- A bundle of points that leave a plane by little has more than one valley. Several are tried before a camera is accused.
"""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from phone_host.doctor.camera_check.bundle import LIKELY, Flags, Floats, Problem, State, Tracks, moved
from phone_host.doctor.camera_check.consensus import still_points
from phone_host.geometry.schur import solved
from phone_host.geometry.se3 import rotations_of
from phone_host.model import CameraModel

_NOISE_PX: Final = 0.1
"""Followed points of good images scatter by this."""

_MOST_STEPS: Final = 25
_SOME: Final = 70
_FEW_STEPS: Final = 12
"""With so many points, and steps, starts are compared: all take five times as long."""

_LEANS: Final = ((0.0, 0.0), (1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0))
"""How inverse depth grows across and down the picture: scenes that a flat start does not lead to lean much."""

_CONVERGED: Final = 5e-4
_TUKEY: Final = 4.7


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
