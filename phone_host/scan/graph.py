"""Where parts of a scan stand against each other, from the loops between them: a pose graph. Pure.

Each loop says where one part, a piece or a stretch, is as seen from another. Errors are weighed as Cauchy would have it, so that one wrong loop among
right ones moves next to nothing. What tracking says of two parts cannot be wrong, only inexact: there errors are weighed as they are, and shared out.

Source: G. Grisetti et al., "A Tutorial on Graph-Based SLAM", 2010; P. Agarwal et al., "Robust Map Optimization using Dynamic Covariance
Scaling", 2013 (why a loop must be able to lose its say).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.geometry.schur import NormalEquations, minimise
from phone_host.geometry.se3 import SE3

Floats = NDArray[np.float64]

_CAUCHY_SIGMAS: Final = 3.0
"""At which an error's weight is a half: registered views agree within two standard deviations."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Loop:
    """Where a part is, as seen from another.

    Attributes:
        here: number of the one.
        there: number of the other.
        here_there: takes the other's points to the one.
        turn: standard deviation of its turn, rad, > 0.
        shift_m: and of its shift, m, > 0.
        is_tracked: whether tracking says it, and not a view that was recognised, which may have been taken for another.
    """

    here: int
    there: int
    here_there: SE3
    turn: float
    shift_m: float
    is_tracked: bool = False


def connected(loops: Sequence[Loop], first: int) -> set[int]:
    """Return the pieces that loops connect with one, and itself."""
    found, waiting = {first}, [first]
    while waiting:
        at = waiting.pop()
        for loop in loops:
            for one, other in ((loop.here, loop.there), (loop.there, loop.here)):
                if one == at and other not in found:
                    found.add(other)
                    waiting.append(other)
    return found


@dataclass(frozen=True, slots=True, eq=False)
class SettledGraph:
    """Parts that were put where their loops agree.

    Attributes:
        poses: where each part is; those that no loop connects with the one that stays as they were.
        loops: those that were used, without those that contradict the rest.
    """

    poses: dict[int, SE3]
    loops: tuple[Loop, ...]


def without_outliers(poses: dict[int, SE3], loops: Sequence[Loop], still: int, most_sigmas: float) -> SettledGraph:
    """Move parts until the loops agree, and take out those that contradict the rest: all whose residual stays, again and again.

    Args:
        poses: where each part is believed to be, in the world.
        loops: between them.
        still: the part that stays where it is.
        most_sigmas: residual of a loop at most, in its standard deviations; what tracking says is never taken out.
    """
    kept = list(loops)
    while True:
        found = settled(poses, kept, still)
        worst = [_residual(loop, found) for loop in kept]
        limit = max(most_sigmas, max(worst, default=0.0) / 2)  # the worst ones first: they pull the others away
        left = [loop for loop, sigmas in zip(kept, worst, strict=True) if sigmas <= limit or loop.is_tracked]
        if len(left) == len(kept):
            return SettledGraph(found, tuple(kept))
        kept = left


def _residual(loop: Loop, poses: dict[int, SE3]) -> float:
    """Return by how much a loop contradicts where its parts are, in its standard deviations."""
    if loop.here not in poses or loop.there not in poses:
        return 0.0
    off = (loop.here_there.inverse() @ poses[loop.here].inverse() @ poses[loop.there]).pose()
    return max(float(np.linalg.norm(off[:3])) / loop.turn, float(np.linalg.norm(off[3:])) / loop.shift_m)


def settled(poses: dict[int, SE3], loops: Sequence[Loop], still: int) -> dict[int, SE3]:
    """Move pieces until the loops agree as well as they can.

    Args:
        poses: where each piece is believed to be, in the world.
        loops: between them; others do not count.
        still: the piece that stays where it is.

    Returns:
        Where they are; those that no loop connects with `still` as they were.
    """
    reached = connected(loops, still)
    numbers = sorted(number for number in poses if number in reached)
    at = {number: index for index, number in enumerate(numbers)}
    used = tuple(loop for loop in loops if loop.here in at and loop.there in at)
    if len(numbers) < 2 or not used:
        return dict(poses)
    problem = _Problem(
        used,
        np.array([at[loop.here] for loop in used]),
        np.array([at[loop.there] for loop in used]),
        np.array([np.repeat([1 / loop.turn, 1 / loop.shift_m], 3) for loop in used]),
        np.array([loop.is_tracked for loop in used]),
    )
    start = tuple(poses[number] for number in numbers)
    free = np.repeat([number != still for number in numbers], 6)
    found = minimise(problem, start, free)
    return {**poses, **dict(zip(numbers, found, strict=True))}


@dataclass(frozen=True, slots=True, eq=False)
class _Problem:
    """See `geometry.schur.Problem`: poses are the shared parameters, there are no blocks. (L,) pieces, (L, 6) 1 / standard deviations, (L,) flags."""

    loops: tuple[Loop, ...]
    here: NDArray[np.int64]
    there: NDArray[np.int64]
    roots: Floats
    tracked: NDArray[np.bool_]

    def cost(self, state: tuple[SE3, ...]) -> float:
        """Return Cauchy's cost of all loops, and the squares of what tracking says."""
        square = (self._errors(state) ** 2).sum(axis=1) / _CAUCHY_SIGMAS**2
        total = float((_CAUCHY_SIGMAS**2 * np.where(self.tracked, square, np.log1p(square))).sum())
        return total if np.isfinite(total) else float("inf")

    def linearised(self, state: tuple[SE3, ...]) -> NormalEquations:
        """Linearise at a state: a small motion of a piece, in its own axes, moves the loop's error by as much."""
        size, errors = 6 * len(state), self._errors(state)
        matrix, right = np.zeros((size, size)), np.zeros(size)
        weights = np.where(self.tracked, 1, 1 / (1 + (errors**2).sum(axis=1) / _CAUCHY_SIGMAS**2))
        for number in range(len(self.loops)):
            # error = log(measured^-1 here^-1 there); by the other's motion I, by the one's -Ad(there^-1 here), to first order.
            seen = state[self.there[number]].inverse() @ state[self.here[number]]
            slopes = np.concatenate([-_adjoint(seen), np.eye(6)], axis=1) * self.roots[number][:, np.newaxis]
            rows = np.concatenate([6 * at + np.arange(6) for at in (self.here[number], self.there[number])])
            matrix[np.ix_(rows, rows)] += weights[number] * slopes.T @ slopes
            right[rows] -= weights[number] * slopes.T @ errors[number]
        nothing = np.zeros((1, size, 1)), np.ones((1, 1, 1)), np.zeros((1, 1))
        return NormalEquations(
            shared=matrix, coupling=nothing[0], blocks=nothing[1], shared_right=right, blocks_right=nothing[2]
        )

    def moved(self, state: tuple[SE3, ...], shared: Floats, blocks: Floats) -> tuple[SE3, ...]:
        """Return a state after a step, each piece in its own axes."""
        del blocks
        return tuple(pose @ SE3.of(step) for pose, step in zip(state, shared.reshape(-1, 6), strict=True))

    def _errors(self, state: tuple[SE3, ...]) -> Floats:
        """Return (L, 6) errors in standard deviations."""
        off = [
            (loop.here_there.inverse() @ state[here].inverse() @ state[there]).pose()
            for loop, here, there in zip(self.loops, self.here.tolist(), self.there.tolist(), strict=True)
        ]
        return np.asarray(np.array(off) * self.roots, np.float64)


def _adjoint(pose: SE3) -> Floats:
    """Return (6, 6): takes a small motion, turn and shift, of b's axes to the same motion in a's."""
    x, y, z = pose.t_m
    across = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    matrix = np.zeros((6, 6))
    matrix[:3, :3] = matrix[3:, 3:] = pose.R
    matrix[3:, :3] = across @ pose.R
    return matrix
