"""A bundle of some frames before one rigid camera, with and without a warp of each frame: its parameters and equations. Pure.

Each frame has a pose, and a turn and shift while its rows are read (rolling shutter); each point has a place in space. What is
left then is noise, if the camera is rigid. A stabiliser shifts and turns the finished image: its middle and its lens leave the
middle of the frame. So the same bundle is computed with a warp of every frame: a shift, a keystone and a zoom. If that explains
much more, the image was warped.

- A turn does what a shift does, but for the keystone of a wide image, its distortion, and what rolls with the rows. That is
  told only from points that are well spread, of motion in both directions.
- The stored lens may be off a little: its focal length and middle are estimated for all frames together, or, without a stored
  lens, its main distortion too.
"""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.geometry.lens import parameters_of, project_linearised, rays_through, with_parameters
from phone_host.geometry.schur import NormalEquations
from phone_host.geometry.se3 import cross_matrices, rotations_of, vectors_of
from phone_host.model import CameraModel

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

POSE, ROWS, WARP = slice(0, 6), slice(6, 9), slice(9, 14)
"""A frame's parameters: turn, translation; by how much more it turns from first to last row; shift, keystone, zoom."""

OF_FRAME: Final = 14
OF_ALL: Final = 5
"""Of all frames together: focal length (logarithm), middle (x, y; px), k1, readout (frame periods)."""

_READOUT: Final = 0.5
"""Rows of webcams and phones are read within 0.2 to 0.9 of a frame period."""

LIKELY: Final = np.array([0.0, 0.0, 0.0, 0.0, _READOUT])
_LEAST_COMMON: Final = np.array([-0.7, -np.inf, -np.inf, -1.0, 0.0])
_MOST_COMMON: Final = np.array([0.7, np.inf, np.inf, 1.0, 1.05])
_PLACING: Final = 5
"""Steps until a point lies where frames that do not move any more see it best."""

_SIDE: Final = 3
_SLOPE: Final = np.array([-1.0, 9.0, -45.0, 0.0, 45.0, -9.0, 1.0]) / 60
"""Speed from three frames on either side, to sixth order: right to 9 % for a hand that trembles with 8 Hz, seen at 30 frames/s."""

_COARSE: Final = np.array([0.0, 1.0, -8.0, 0.0, 8.0, -1.0, 0.0]) / 12
"""The same to fourth order, right to 19 %."""


@dataclass(frozen=True, slots=True, eq=False)
class Tracks:
    """Points that were followed through some frames.

    Attributes:
        points_px: (F, N, 2) float64, px.
        seen: (F, N) whether a point was found in a frame.
        home: the frame in which the points were chosen.
    """

    points_px: Floats
    seen: Flags
    home: int


@dataclass(frozen=True, slots=True, eq=False)
class State:
    """A guess: turns (F, 3, 3), translations (F, 3), more turn over the rows (F, 3), warps (F, 5), of all (5,), slopes and inverse depths (N, 3)."""

    turns: Floats
    shifts: Floats
    rows: Floats
    warps: Floats
    common: Floats
    points: Floats


class Problem:
    """The equations of one window."""

    def __init__(self, tracks: Tracks, model: CameraModel, *, knows_lens: bool) -> None:
        self._tracks, self._model, self._knows_lens = tracks, model, knows_lens
        self.frames, self.count = tracks.points_px.shape[:2]
        middle = (np.array([model.width_px, model.height_px], np.float64) - 1) / 2
        self._row = (tracks.points_px[:, :, 1] - middle[1]) / model.height_px
        self._place = (tracks.points_px - middle) / model.width_px
        self._values = parameters_of(model)
        width = model.width_px
        self._warp_prior = np.full(5, 0.05 * width)
        lens = [0.3, 0.005 * width, 0.005 * width, 0.005] if knows_lens else [0.3, 0.01 * width, 0.01 * width, 0.2]
        self._common_prior = np.array([*lens, 0.5])
        self.point_prior = np.array([0.0, 0.0, 1.0])

    def prior(self, state: State, *, warped: bool) -> Floats:
        """Return one over the variance of each parameter, which is about 0.

        How a rigid camera turns while its rows are read follows from how it turns from frame to frame, as far as that is known: the
        difference of two formulas for its speed tells. At both ends of the window it is not known.
        """
        speeds, coarse = self.speeds(state)[:, :3], self.speeds(state, _COARSE)[:, :3]
        speed = float(np.sqrt((speeds**2).sum(axis=1).mean())) + 1e-4
        rows = np.full(self.frames, speed)
        if not warped:
            rows[_SIDE:-_SIDE] = np.linalg.norm(speeds - coarse, axis=1)[_SIDE:-_SIDE] / 2 + 1e-6
        frame = np.empty((self.frames, OF_FRAME))
        frame[:, POSE] = 1.0
        frame[:, ROWS] = rows[:, np.newaxis]
        frame[:, WARP] = self._warp_prior
        return np.concatenate([frame.ravel(), self._common_prior]) ** -2.0

    def free(self, *, warped: bool) -> Flags:
        """Return which parameters are estimated."""
        frame = np.ones((self.frames, OF_FRAME), bool)
        frame[self._tracks.home, POSE] = False
        frame[:, WARP] = warped
        common = np.ones(OF_ALL, bool)
        common[0] = warped or not self._knows_lens
        return np.concatenate([frame.ravel(), common])

    def start(self, turns: Floats) -> State:
        """Return the guess that the camera turns (F, 3, 3), does not move, and all is equally far."""
        rays = rays_through(self._tracks.points_px[self._tracks.home], self._model)
        points = np.column_stack([rays[:, :2] / rays[:, 2:], np.ones(len(rays))])
        none = np.zeros((self.frames, 3))
        return State(turns, none, none, np.zeros((self.frames, 5)), LIKELY.copy(), points)

    def speeds(self, state: State, formula: Floats = _SLOPE) -> Floats:
        """Return how each frame moves, (F, 6): turn and translation per frame period, in its own axes."""
        at = np.arange(self.frames)
        first = np.clip(at - _SIDE, 0, self.frames - len(_SLOPE))
        near = first[:, np.newaxis] + np.arange(len(_SLOPE))
        turns = state.turns[near] @ np.swapaxes(state.turns, 1, 2)[:, np.newaxis]
        shifts = state.shifts[near] - (turns @ state.shifts[:, np.newaxis, :, np.newaxis])[..., 0]
        inside = (first == at - _SIDE)[:, np.newaxis]
        slopes = np.where(inside, formula, _SLOPES[at - first])
        return np.asarray(
            np.einsum("fk,fkj->fj", slopes, np.concatenate([vectors_of(turns), shifts], axis=2)), np.float64
        )

    def residuals(self, state: State) -> tuple[Floats, Floats, Floats]:
        """Return what is left, (F, N, 2) px, and the derivatives by frame and all (F, N, 2, 14 + 5) and by point (F, N, 2, 3)."""
        f, n = self.frames, self.count
        direction = np.column_stack([state.points[:, :2], np.ones(n)])
        rho, row = state.points[:, 2], self._row[..., np.newaxis, np.newaxis]
        speeds, readout = self.speeds(state), state.common[4]
        turning, shifting = readout * speeds[:, :3] + state.rows, readout * speeds[:, 3:]
        still = np.einsum("fij,nj->fni", state.turns, direction) + rho[:, np.newaxis] * state.shifts[:, np.newaxis]
        spin = rotations_of(turning[:, np.newaxis] * row[..., 0])
        moved = np.einsum("fnij,fnj->fni", spin, still) + row[..., 0] * rho[:, np.newaxis] * shifting[:, np.newaxis]
        values = self._values.copy()
        values[:2] *= np.exp(state.common[0])
        values[2:5] += state.common[1:4]
        seen, by_point, by_lens = project_linearised(moved.reshape(-1, 3), with_parameters(self._model, values))
        seen, by_point, by_lens = seen.reshape(f, n, 2), by_point.reshape(f, n, 2, 3), by_lens.reshape(f, n, 2, -1)
        columns = np.zeros((f, n, 2, OF_FRAME + OF_ALL))
        columns[..., 0:3] = -by_point @ cross_matrices(moved)
        columns[..., 3:6] = by_point * rho[:, np.newaxis, np.newaxis]
        columns[..., ROWS] = columns[..., 0:3] * row
        columns[..., 0, 9] = columns[..., 1, 10] = 1.0
        columns[..., 11] = self._place * self._place[..., :1]
        columns[..., 12] = self._place * self._place[..., 1:]
        columns[..., 13] = self._place
        columns[..., 14] = by_lens[..., 0] * values[0] + by_lens[..., 1] * values[1]
        columns[..., 15:18] = by_lens[..., 2:5]
        columns[..., 18] = np.einsum("fnij,fj->fni", columns[..., POSE], speeds) * row[..., 0]
        seen = seen + np.einsum("fnij,fj->fni", columns[..., WARP], state.warps)
        through = by_point @ spin
        by_place = np.empty((f, n, 2, 3))
        by_place[..., :2] = through @ state.turns[:, np.newaxis, :, :2]
        by_place[..., 2] = np.einsum("fnij,fj->fni", through, state.shifts)
        by_place[..., 2] += row[..., 0] * np.einsum("fnij,fj->fni", by_point, shifting)
        rest = np.where(self._tracks.seen[..., np.newaxis], self._tracks.points_px - seen, 0.0)
        return rest, columns, by_place

    def cost(self, state: State, rest: Floats, weights: Floats, prior: Floats) -> float:
        """Return the cost of a state with its residuals."""
        depth = float((self.point_prior * (state.points - 1.0) ** 2).sum())
        return float((weights[..., np.newaxis] * rest**2).sum() + prior @ _deviations(state) ** 2) + depth

    def equations(
        self, state: State, parts: tuple[Floats, Floats, Floats], weights: Floats, prior: Floats
    ) -> NormalEquations:
        """Return the normal equations at a state with its residuals and derivatives."""
        rest, columns, by_place = parts
        f, n, own = self.frames, self.count, OF_FRAME
        size = f * own + OF_ALL
        left = columns.transpose(0, 3, 1, 2).reshape(f, own + OF_ALL, n * 2)
        heavy = left * np.repeat(weights, 2, axis=1)[:, np.newaxis]
        square = heavy @ left.transpose(0, 2, 1)
        right = (heavy @ rest.reshape(f, n * 2, 1))[..., 0]
        shared, shared_right = np.diag(prior), -prior * _deviations(state)
        for each in range(f):
            at = slice(each * own, (each + 1) * own)
            shared[at, at] += square[each, :own, :own]
            shared[at, -OF_ALL:] += square[each, :own, own:]
            shared[-OF_ALL:, at] += square[each, own:, :own]
            shared_right[at] += right[each, :own]
        shared[-OF_ALL:, -OF_ALL:] += square[:, own:, own:].sum(axis=0)
        shared_right[-OF_ALL:] += right[:, own:].sum(axis=0)
        heavy_place = by_place * weights[..., np.newaxis, np.newaxis]
        cross = np.swapaxes(columns, 2, 3) @ heavy_place
        coupling = np.empty((n, size, 3))
        coupling[:, : f * own] = cross[:, :, :own].transpose(1, 0, 2, 3).reshape(n, f * own, 3)
        coupling[:, f * own :] = cross[:, :, own:].sum(axis=0)
        blocks = (np.swapaxes(by_place, 2, 3) @ heavy_place).sum(axis=0) + np.diag(self.point_prior + 1e-9)
        blocks_right = (np.swapaxes(heavy_place, 2, 3) @ rest[..., np.newaxis])[..., 0].sum(axis=0)
        blocks_right -= self.point_prior * (state.points - 1.0)
        return NormalEquations(
            shared=shared, coupling=coupling, blocks=blocks, shared_right=shared_right, blocks_right=blocks_right
        )

    def placed(self, state: State, which: Flags) -> State:
        """Return a state in which some points (N,) lie where the frames see them best, the frames as they are."""
        points = np.where(
            which[:, np.newaxis],
            np.column_stack([state.points[:, :2], np.full(self.count, np.median(state.points[:, 2]))]),
            state.points,
        )
        for _ in range(_PLACING):
            rest, _, by_place = self.residuals(replace(state, points=points))
            by_place = by_place * self._tracks.seen[..., np.newaxis, np.newaxis]
            matrix = np.einsum("fnik,fnil->nkl", by_place, by_place) + np.diag(self.point_prior + 1e-9)
            right = np.einsum("fnik,fni->nk", by_place, rest) - self.point_prior * (points - 1.0)
            points = points + which[:, np.newaxis] * np.linalg.solve(matrix, right[..., np.newaxis])[..., 0]
        return replace(state, points=points)


def _slopes() -> Floats:
    """Return the weights of seven values for the derivative at each of them, (7, 7): fourth-order at the ends, from the five next to it."""
    found = np.zeros((len(_SLOPE), len(_SLOPE)))
    for at in range(len(_SLOPE)):
        used = np.arange(5) if at < _SIDE else np.arange(2, 7)
        powers = np.vander(used - float(at), 5, increasing=True).T
        found[at, used] = np.linalg.solve(powers, np.eye(5)[1])
    return found


_SLOPES: Final = _slopes()


def _deviations(state: State) -> Floats:
    turns = np.zeros_like(state.shifts)  # a turn has no likely value
    frame = np.concatenate([turns, state.shifts, state.rows, state.warps], axis=1)
    return np.concatenate([frame.ravel(), state.common - LIKELY])


def moved(state: State, shared: Floats, points: Floats) -> State:
    """Return a state after a step: of the frames and all (F * 14 + 5,), and of the points (N, 3)."""
    frame = shared[:-OF_ALL].reshape(len(state.turns), OF_FRAME)
    turn = rotations_of(frame[:, :3])
    return State(
        turn @ state.turns,
        (turn @ state.shifts[..., np.newaxis])[..., 0] + frame[:, 3:6],
        state.rows + frame[:, ROWS],
        state.warps + frame[:, WARP],
        np.clip(state.common + shared[-OF_ALL:], _LEAST_COMMON, _MOST_COMMON),
        state.points + points,
    )
