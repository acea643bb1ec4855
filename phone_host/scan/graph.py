"""Where parts of a scan stand against each other, from the loops between them: a pose graph. Pure.

Each loop says where one part, a piece or a stretch, is as seen from another. Errors are weighed as Cauchy would have it, so that one wrong loop among
right ones moves next to nothing. What tracking says of two parts cannot be wrong, only inexact: there errors are weighed as they are, and shared out.
So a loose tie may take up the error of a wrong loop, whose residual is small then: a loop is also judged by what all others say without it.

Source: G. Grisetti et al., "A Tutorial on Graph-Based SLAM", 2010; P. Agarwal et al., "Robust Map Optimization using Dynamic Covariance
Scaling", 2013 (why a loop must be able to lose its say).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.geometry.schur import NormalEquations, minimise, solved
from phone_host.geometry.se3 import SE3

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

_CAUCHY_SIGMAS: Final = 3.0
"""At which an error's weight is a half: registered views agree within two standard deviations."""

_ALONE: Final = 1e-6
"""Share of a loop's information that others give: with less it alone connects its parts, and nothing can contradict it."""


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


def chained(poses: dict[int, SE3], loops: Sequence[Loop], still: int) -> dict[int, SE3]:
    """Put parts where loops, one after another, put them, from one that stays: where a graph is settled from.

    Args:
        poses: where each part is believed to be, in the world.
        loops: between them; of several to one part the first counts.
        still: the part that stays where it is.

    Returns:
        Where they are; those that no loop connects with `still` as they were.
    """
    placed, waiting = {still: poses[still]}, [still]
    while waiting:
        at = waiting.pop()
        for loop in loops:
            if loop.here == at and loop.there not in placed:
                other, pose = loop.there, placed[at] @ loop.here_there
            elif loop.there == at and loop.here not in placed:
                other, pose = loop.here, placed[at] @ loop.here_there.inverse()
            else:
                continue
            placed[other] = pose
            waiting.append(other)
    return {**poses, **placed}


@dataclass(frozen=True, slots=True, eq=False)
class SettledGraph:
    """Parts that were put where their loops agree.

    Attributes:
        poses: where each part is; those that no loop connects with the one that stays as they were.
        loops: those that were used, without those that contradict the rest.
    """

    poses: dict[int, SE3]
    loops: tuple[Loop, ...]


def without_outliers(poses: dict[int, SE3], loops: Sequence[Loop], still: int, max_sigmas: float) -> SettledGraph:
    """Move parts until the loops agree, and take out those that contradict the rest: all whose residual stays, again and again.

    Args:
        poses: where each part is believed to be, in the world.
        loops: between them.
        still: the part that stays where it is.
        max_sigmas: residual of a loop at most, in its standard deviations; what tracking says is never taken out.
    """
    left = list(loops)
    while True:
        found = settled(poses, left, still)
        sigmas = [0.0 if loop.is_tracked else _residual(loop, found) for loop in left]
        outliers = _worst(sigmas, max_sigmas) or _shielded(found, left, still, max_sigmas)
        if not outliers:
            return SettledGraph(found, tuple(left))
        left = [loop for number, loop in enumerate(left) if number not in outliers]


def _residual(loop: Loop, poses: dict[int, SE3]) -> float:
    """Return by how much a loop contradicts where its parts are, in its standard deviations."""
    if loop.here not in poses or loop.there not in poses:
        return 0.0
    off = (loop.here_there.inverse() @ poses[loop.here].inverse() @ poses[loop.there]).pose()
    return max(float(np.linalg.norm(off[:3])) / loop.turn, float(np.linalg.norm(off[3:])) / loop.shift_m)


def _worst(sigmas: Sequence[float], max_sigmas: float) -> set[int]:
    """Return the numbers of the loops that are too far off, those first that are farthest off: they pull the others away."""
    limit = max(max_sigmas, max(sigmas, default=0.0) / 2)
    return {number for number, of in enumerate(sigmas) if of > limit}


def _shielded(poses: dict[int, SE3], loops: Sequence[Loop], still: int, max_sigmas: float) -> set[int]:
    """Return the numbers of loops whose error what tracking says has taken up, so that their own residuals are small.

    Each loop is compared with where all others put its parts, and once more with where those put them that do not say the same. Of those that contradict
    others, those in the smallest group are taken out.

    Args:
        poses: where the parts were settled.
        loops: between them.
        still: the part that stays where it is.
        max_sigmas: of a contradiction at most, by the uncertainty of both sides.
    """
    numbered = _problem(poses, loops, still)
    if numbered is None or not any(loop.is_tracked for loop in loops):
        return set()
    problem, state, free, numbers = numbered
    judged = [at for at, loop in enumerate(problem.loops) if not loop.is_tracked]
    if not judged:
        return set()
    leverage = _leverage(problem, state, free, judged)
    sigmas, sizes = [0.0] * len(loops), [0] * len(loops)
    for group in _groups(problem, judged):
        together = leverage.left_out(group)
        for at, of in zip(group, together, strict=True):
            sigmas[numbers[judged[at]]] = max(of, *leverage.left_out([at]))
            sizes[numbers[judged[at]]] = len(group)
    outliers = _worst(sigmas, max_sigmas)
    fewest = min((sizes[number] for number in outliers), default=0)
    return {number for number in outliers if sizes[number] == fewest}


def _groups(problem: "_Problem", judged: Sequence[int]) -> list[list[int]]:
    """Return which of some loops say the same: those between the same parts, between parts that are tied to these, and so on."""
    ties = {frozenset((loop.here, loop.there)) for loop in problem.loops if loop.is_tracked}

    def is_beside(one: int, other: int) -> bool:
        return one == other or frozenset((one, other)) in ties

    groups, left = [], list(range(len(judged)))
    while left:
        group, waiting = [], [left.pop(0)]
        while waiting:
            group.append(waiting.pop())
            loop = problem.loops[judged[group[-1]]]
            beside = [
                at
                for at in left
                if is_beside(loop.here, problem.loops[judged[at]].here)
                and is_beside(loop.there, problem.loops[judged[at]].there)
            ]
            waiting += beside
            left = [at for at in left if at not in beside]
        groups.append(sorted(group))
    return groups


@dataclass(frozen=True, slots=True, eq=False)
class _Leverage:
    """How much K loops determine the parts that they connect, with their weights: (K, 6) errors, (K,) weights, and (6 K, 6 K) leverages.

    Source: R. D. Cook and S. Weisberg, "Residuals and Influence in Regression", 1982, section 2.2: residuals of observations that are left out.
    """

    errors: Floats
    weights: Floats
    leverages: Floats

    def left_out(self, group: Sequence[int]) -> list[float]:
        """Return by how many standard deviations each loop of a group contradicts the others without that group; next to 0: nothing else connects its parts."""
        rows = (6 * np.array(group)[:, np.newaxis] + np.arange(6)).ravel()
        whole = np.eye(len(rows))
        inverse = solved((1 + _ALONE) * whole - self.leverages[np.ix_(rows, rows)], whole)
        roots = np.repeat(np.sqrt(self.weights[group]), 6)
        errors = (inverse @ (roots * self.errors[group].ravel())) / roots
        result = []
        for at, weight in enumerate(self.weights[group]):
            own = slice(6 * at, 6 * at + 6)
            variance, error = np.eye(6) + (inverse[own, own] - np.eye(6)) / weight, errors[own]
            parts = (slice(0, 3), slice(3, 6))
            result.append(max(float(np.sqrt(error[of] @ np.linalg.solve(variance[of, of], error[of]))) for of in parts))
        return result


def _leverage(problem: "_Problem", state: tuple[SE3, ...], free: Flags, judged: Sequence[int]) -> _Leverage:
    """Return the leverages of some loops at a settled state."""
    errors = problem.errors(state)
    weights = problem.weights(errors)[judged]
    slopes = np.zeros((6 * len(judged), 6 * len(state)))
    for row, number in enumerate(judged):
        rows, columns = problem.slopes(state, number)
        slopes[6 * row : 6 * row + 6, rows] = np.sqrt(weights[row]) * columns
    slopes = slopes[:, free]
    matrix = problem.linearised(state).shared[np.ix_(free, free)]
    return _Leverage(errors[judged], weights, np.asarray(slopes @ solved(matrix, slopes.T), np.float64))


def settled(poses: dict[int, SE3], loops: Sequence[Loop], still: int) -> dict[int, SE3]:
    """Move pieces until the loops agree as well as they can; those that no loop connects with `still` stay as they were."""
    numbered = _problem(poses, loops, still)
    if numbered is None:
        return dict(poses)
    problem, start, free, _ = numbered
    found: tuple[SE3, ...] = minimise(problem, start, free)
    return {**poses, **dict(zip(problem.parts, found, strict=True))}


def _problem(
    poses: dict[int, SE3], loops: Sequence[Loop], still: int
) -> "tuple[_Problem, tuple[SE3, ...], Flags, list[int]] | None":
    """Return what is minimised, from where, which parameters are free, and the numbers of its loops; None: nothing can move."""
    reached = connected(loops, still)
    parts = sorted(number for number in poses if number in reached)
    at = {number: index for index, number in enumerate(parts)}
    numbers = [number for number, loop in enumerate(loops) if loop.here in at and loop.there in at]
    if len(parts) < 2 or not numbers:
        return None
    used = tuple(loops[number] for number in numbers)
    problem = _Problem(
        used,
        tuple(parts),
        np.array([at[loop.here] for loop in used]),
        np.array([at[loop.there] for loop in used]),
        np.array([np.repeat([1 / loop.turn, 1 / loop.shift_m], 3) for loop in used]),
        np.array([loop.is_tracked for loop in used]),
    )
    return (
        problem,
        tuple(poses[number] for number in parts),
        np.repeat([number != still for number in parts], 6),
        numbers,
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Problem:
    """See `geometry.schur.Problem`: poses are the shared parameters, there are no blocks. The numbers of the parts, (L,) places among these, (L, 6) 1 / standard deviations, (L,) flags."""

    loops: tuple[Loop, ...]
    parts: tuple[int, ...]
    here: NDArray[np.int64]
    there: NDArray[np.int64]
    roots: Floats
    tracked: NDArray[np.bool_]

    def cost(self, state: tuple[SE3, ...]) -> float:
        """Return Cauchy's cost of all loops, and the squares of what tracking says."""
        square = (self.errors(state) ** 2).sum(axis=1) / _CAUCHY_SIGMAS**2
        total = float((_CAUCHY_SIGMAS**2 * np.where(self.tracked, square, np.log1p(square))).sum())
        return total if np.isfinite(total) else float("inf")

    def linearised(self, state: tuple[SE3, ...]) -> NormalEquations:
        """Linearise at a state: a small motion of a piece, in its own axes, moves the loop's error by as much."""
        size, errors = 6 * len(state), self.errors(state)
        matrix, right = np.zeros((size, size)), np.zeros(size)
        weights = self.weights(errors)
        for number in range(len(self.loops)):
            rows, slopes = self.slopes(state, number)
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

    def slopes(self, state: tuple[SE3, ...], number: int) -> tuple[NDArray[np.int64], Floats]:
        """Return which parameters a loop's error depends on, (12,), and how, (6, 12), in standard deviations."""
        # error = log(measured^-1 here^-1 there); by the other's motion I, by the one's -Ad(there^-1 here), to first order.
        seen = state[self.there[number]].inverse() @ state[self.here[number]]
        slopes = np.concatenate([-_adjoint(seen), np.eye(6)], axis=1) * self.roots[number][:, np.newaxis]
        return np.concatenate([6 * at + np.arange(6) for at in (self.here[number], self.there[number])]), slopes

    def weights(self, errors: Floats) -> Floats:
        """Return (L,) weights of the loops with such errors: Cauchy's, and 1 of what tracking says."""
        return np.asarray(np.where(self.tracked, 1, 1 / (1 + (errors**2).sum(axis=1) / _CAUCHY_SIGMAS**2)), np.float64)

    def errors(self, state: tuple[SE3, ...]) -> Floats:
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
