"""Least squares with eliminated blocks: the same answer and covariance as the whole system at once."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from phone_host.geometry.schur import NormalEquations, inverse_of, minimise, solved


@dataclass(frozen=True, slots=True, eq=False)
class Lines:
    """Measured values y = slope x + curve x^2 + an offset of each group: two shared parameters, one block a group."""

    x: np.ndarray
    y: np.ndarray

    def errors(self, state: "State") -> np.ndarray:
        """Measured minus predicted."""
        return np.asarray(
            self.y - state.shared[0] * self.x - state.shared[1] * self.x**2 - state.offsets[:, np.newaxis]
        )

    def cost(self, state: "State") -> float:
        """See Problem."""
        return float((self.errors(state) ** 2).sum())

    def linearised(self, state: "State") -> NormalEquations:
        """See Problem."""
        errors, ones = self.errors(state), np.ones((*self.x.shape, 1))
        shared = np.stack([self.x, self.x**2], axis=2)
        return NormalEquations(
            shared=np.einsum("vni,vnj->ij", shared, shared),
            coupling=np.einsum("vni,vnj->vij", shared, ones),
            blocks=np.einsum("vni,vnj->vij", ones, ones),
            shared_right=np.einsum("vni,vn->i", shared, errors),
            blocks_right=np.einsum("vni,vn->vi", ones, errors),
        )

    def moved(self, state: "State", shared: np.ndarray, blocks: np.ndarray) -> "State":
        """See Problem."""
        return replace(state, shared=state.shared + shared, offsets=state.offsets + blocks[:, 0])


@dataclass(frozen=True, slots=True, eq=False)
class State:
    shared: np.ndarray
    offsets: np.ndarray


def problem() -> Lines:
    random = np.random.default_rng(5)
    x = random.uniform(-2, 3, (6, 9))
    return Lines(x, 1.5 * x - 0.2 * x**2 + np.arange(6.0)[:, np.newaxis] + random.normal(0, 0.1, x.shape))


START = State(np.zeros(2), np.zeros(6))


@pytest.mark.parametrize("free", [(True, True), (True, False)])
def test_the_answer_is_that_of_the_whole_system(free: tuple[bool, bool]) -> None:
    """Also when a shared parameter is held at its start."""
    lines, flags = problem(), np.array(free)
    found = minimise(lines, START, flags)
    columns = [column for column, is_free in zip((lines.x, lines.x**2), free, strict=True) if is_free]
    groups = [np.repeat(np.eye(6)[:, [index]], 9, axis=1) for index in range(6)]
    design = np.column_stack([each.ravel() for each in (*columns, *groups)])
    expected = np.linalg.lstsq(design, lines.y.ravel(), rcond=None)[0]
    np.testing.assert_allclose(found.shared[flags], expected[: sum(free)], atol=1e-6)
    np.testing.assert_allclose(found.offsets, expected[sum(free) :], atol=1e-6)
    covariance = inverse_of(lines.linearised(found).reduced(0.0, flags)[0])
    whole = np.linalg.inv(design.T @ design)[: sum(free), : sum(free)]
    np.testing.assert_allclose(covariance, whole, rtol=1e-9)


def test_with_nothing_free_the_blocks_alone_are_fitted() -> None:
    """Each offset becomes the mean of its group's errors."""
    lines = problem()
    found = minimise(lines, START, np.zeros(2, bool))
    np.testing.assert_allclose(found.offsets, lines.y.mean(axis=1), atol=1e-6)


def test_a_singular_system_leaves_the_start() -> None:
    """Groups that nothing measures cannot be solved for: the search ends where it began, without an error."""

    class Nothing(Lines):
        def linearised(self, state: State) -> NormalEquations:
            made = super().linearised(state)
            return replace(made, blocks=np.zeros_like(made.blocks))

    lines = problem()
    assert minimise(Nothing(lines.x, lines.y), START, np.array([True, True])) is START


@pytest.mark.parametrize("size", [20, 151, 190])
def test_large_systems_are_solved_in_parts(size: int) -> None:
    """The solution of a system of any size, also with several right sides, satisfies it; a singular one is refused."""
    random = np.random.default_rng(size)
    half = random.normal(size=(size, size + 5))
    matrix, right = half @ half.T, random.normal(size=(size, 2))
    assert matrix @ solved(matrix, right) == pytest.approx(right, abs=1e-6)
    assert matrix @ solved(matrix, right[:, 0]) == pytest.approx(right[:, 0], abs=1e-6)
    matrix[:, 3] = matrix[3] = 0.0
    with pytest.raises(np.linalg.LinAlgError):
        solved(matrix, right)
