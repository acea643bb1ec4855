"""Least squares with many small blocks that only meet in shared parameters: Levenberg-Marquardt on the Schur complement. Pure.

In a calibration the cameras are shared and each board pose is a block; in a reconstruction it may be the other way round. The
normal equations are

    [ S    C^T ] [ shared ]   [ s ]
    [ C    B   ] [ blocks ] = [ b ]      B block diagonal,

so the blocks are eliminated one by one, and the cost grows linearly with their number.

Source: B. Triggs et al., "Bundle Adjustment - A Modern Synthesis", 2000, section 6.
"""

from dataclasses import dataclass
from typing import Final, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
State = TypeVar("State")

_MOST_STEPS: Final = 50
"""Rigs take 5 to 13; only what contradicts itself creeps on, in search of a lens that turns it inside out."""

CONVERGED: Final = 1e-9
"""Relative decrease of the cost at which the search ends; the baseline of a rig then moves by less than a micrometre."""

_TILE: Final = 16
_DEEP: Final = 1024
"""OpenBLAS works alone up to 262144 products: 16 x 16 x 1024."""

_ALONE: Final = 150
"""It solves systems up to 200 x 200 alone."""

_DAMPING_START, _DAMPING_LEAST, _DAMPING_MOST = 1e-3, 1e-12, 1e12


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class NormalEquations:
    """Normal equations in blocks.

    Attributes:
        shared: (G, G) of the shared parameters.
        coupling: (V, G, B) between them and each block.
        blocks: (V, B, B) of each block.
        shared_right: (G,) right side.
        blocks_right: (V, B) right side of each block.
    """

    shared: Floats
    coupling: Floats
    blocks: Floats
    shared_right: Floats
    blocks_right: Floats

    def reduced(self, damping: float, free: Flags) -> tuple[Floats, Floats, Floats]:
        """Eliminate the blocks.

        Args:
            damping: share of the diagonal that is added to it.
            free: (G,) which shared parameters are estimated.

        Returns:
            Matrix (F, F) and right side (F,) of the free parameters, and the inverse blocks (V, B, B).

        Raises:
            np.linalg.LinAlgError: a block is singular.
        """
        blocks = self.blocks + damping * self.blocks * np.eye(self.blocks.shape[1])
        coupling = self.coupling[:, free]
        inverse = np.asarray(np.linalg.inv(blocks), np.float64)
        wide = coupling.shape[1], blocks.shape[0] * blocks.shape[1]
        through, coupled = (np.swapaxes(each, 0, 1).reshape(wide) for each in (coupling @ inverse, coupling))
        matrix = self.shared[np.ix_(free, free)] + damping * np.diag(np.diag(self.shared)[free])
        return (
            matrix - _product(through, coupled),
            self.shared_right[free] - through @ self.blocks_right.ravel(),
            inverse,
        )

    def step(self, damping: float, free: Flags) -> tuple[Floats, Floats]:
        """Return the damped step: shared parameters (G,), 0 for those that are not free, and blocks (V, B).

        Raises:
            np.linalg.LinAlgError: the equations are singular.
        """
        matrix, right, inverse = self.reduced(damping, free)
        step = np.zeros(len(free))
        step[free] = solved(matrix, right)
        return step, np.einsum("vij,vj->vi", inverse, self.blocks_right - np.einsum("vij,i->vj", self.coupling, step))


def _product(one: Floats, other: Floats) -> Floats:
    """Return one @ other.T, (G, G), of two wide matrices (G, K), in tiles: too small for the linear algebra library to wake its threads.

    They spin while they wait for each other: on a busy machine that took ten times as long. One product for each block, and their sum, fills the
    memory instead.
    """
    rows, wide = one.shape
    tiles = [np.pad(each, ((0, -rows % _TILE), (0, 0))).reshape(-1, _TILE, wide) for each in (one, other)]
    product = np.zeros((len(tiles[0]), len(tiles[0]), _TILE, _TILE))
    for first in range(0, wide, _DEEP):
        here, there = (each[..., first : first + _DEEP] for each in tiles)
        product += here[:, np.newaxis] @ np.swapaxes(there, 1, 2)[np.newaxis]
    return np.asarray(product.transpose(0, 2, 1, 3).reshape(2 * (rows + -rows % _TILE,))[:rows, :rows], np.float64)


def solved(matrix: Floats, right: Floats) -> Floats:
    """Solve matrix @ x = right, in parts that are too small for the linear algebra library to wake its threads; see `_product`.

    Args:
        matrix: (F, F), symmetric and positive definite.
        right: (F,) or (F, K).

    Returns:
        x, as large as `right`.

    Raises:
        np.linalg.LinAlgError: the matrix is singular.
    """
    size = len(matrix)
    if size <= _ALONE:
        return np.asarray(np.linalg.solve(matrix, right), np.float64)
    rest, factor, found = matrix.copy(), np.zeros_like(matrix), np.array(right, np.float64)
    parts = [slice(first, min(first + 2 * _TILE, size)) for first in range(0, size, 2 * _TILE)]
    for here in parts:
        below = slice(here.stop, size)
        factor[here, here] = np.linalg.cholesky(rest[here, here])
        factor[below, here] = np.linalg.solve(factor[here, here], rest[below, here].T).T
        rest[below, below] -= _product(factor[below, here], factor[below, here])
        found[here] = np.linalg.solve(factor[here, here], found[here])
        found[below] -= factor[below, here] @ found[here]
    for here in reversed(parts):
        found[here] -= factor[here.stop :, here].T @ found[here.stop :]
        found[here] = np.linalg.solve(factor[here, here].T, found[here])
    return found


def eliminated(coupling: Floats, blocks: Floats, right: Floats) -> tuple[Floats, Floats, Floats]:
    """Eliminate blocks, each on its own.

    Args:
        coupling: (V, F, B) between the shared parameters and each block.
        blocks: (V, B, B).
        right: (V, B) right side of each block.

    Returns:
        What each takes from the shared equations: (V, F, F) of their matrix, (V, F) of their right side; the inverse blocks (V, B, B).

    Raises:
        np.linalg.LinAlgError: a block is singular.
    """
    inverse = np.asarray(np.linalg.inv(blocks), np.float64)
    through = coupling @ inverse
    return through @ np.swapaxes(coupling, 1, 2), (through @ right[..., np.newaxis])[..., 0], inverse


def inverse_of(matrix: Floats) -> Floats:
    """Return the pseudo-inverse (F, F) of a symmetric matrix whose rows may differ in unit: scaled to a unit diagonal first."""
    scale = 1 / np.sqrt(np.maximum(np.diag(matrix), np.finfo(float).tiny))
    inverse = np.linalg.pinv(matrix * np.outer(scale, scale), hermitian=True)
    return np.asarray(inverse * np.outer(scale, scale), np.float64)


class Problem(Protocol[State]):
    """What is minimised."""

    def cost(self, state: State) -> float:
        """Return the cost of a state; infinite if its numbers are invalid."""

    def linearised(self, state: State) -> NormalEquations:
        """Return the normal equations at a state."""

    def moved(self, state: State, shared: Floats, blocks: Floats) -> State:
        """Return a state after a step: shared parameters (G,), blocks (V, B)."""


def minimise(problem: Problem[State], state: State, free: Flags, converged: float = CONVERGED) -> State:
    """Run Levenberg-Marquardt until the cost stops falling.

    Args:
        problem: what is minimised.
        state: where to start.
        free: (G,) which shared parameters are estimated; blocks always are.
        converged: relative decrease of the cost at which the search ends.

    Returns:
        The best state found.
    """
    damping, cost, system = _DAMPING_START, problem.cost(state), problem.linearised(state)
    for _ in range(_MOST_STEPS):
        try:
            tried = problem.moved(state, *system.step(damping, free))
            tried_cost = problem.cost(tried)
        except np.linalg.LinAlgError:
            tried, tried_cost = state, np.inf
        if tried_cost < cost:
            gain, state, cost = (cost - tried_cost) / cost, tried, tried_cost
            damping = max(damping / 5, _DAMPING_LEAST)
            if gain < converged:
                break
            system = problem.linearised(state)
        else:
            damping *= 10
            if damping > _DAMPING_MOST:
                break
    return state
