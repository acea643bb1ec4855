"""Rules that a series's pairs may follow, and how well each explains the deviations of a loosened rig. Pure.

A rule is a matrix: its columns say in which ways the deviations of all pairs may differ from one stiff rig. All rules
contain the stiff rig itself. They are compared by the Bayesian information criterion (Schwarz 1978): the squares that are
left, and a price for each column.
"""

import math
from dataclasses import dataclass
from enum import Enum
from typing import Final

import cv2
import numpy as np

from phone_host.calibration.failure_modes.loosened import (
    DEVIATIONS,
    FOCUS_LEFT,
    FOCUS_RIGHT,
    MOVE,
    ROWS_LEFT,
    ROWS_RIGHT,
    TURN,
    Loosened,
)
from phone_host.calibration.solve.bundle_problem import Vector

_PIVOTS: Final = (0.0, 0.5, 1.0)
"""About which the right camera may turn, from its own centre to the left camera's."""

_GAUGE: Final = 3
"""So many of a free rule's numbers are those of the stiff rig."""


class Rule(Enum):
    """How the pairs of a series deviate from one stiff rig.

    Attributes:
        STIFF: not at all.
        DRIFT: the cameras turned against each other, a little more with each pair.
        KNOCK: they turned once, between two pairs.
        LOOSE: they turned this way and that.
        SKEW: the board moved between the two exposures of each pair.
        FOCUS_LEFT: the left camera's focal length changed.
        FOCUS_RIGHT: the right one's.
        ROWS: rows of one image show different moments.
    """

    STIFF = "stiff"
    DRIFT = "drift"
    KNOCK = "knock"
    LOOSE = "loose"
    SKEW = "skew"
    FOCUS_LEFT = "focus left"
    FOCUS_RIGHT = "focus right"
    ROWS = "rolling shutter"


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Weighed:
    """How well a rule explains a series.

    Attributes:
        rule: the rule.
        columns: how many numbers describe it.
        squares_px2: what it leaves.
        criterion: the lower, the better.
        begins: the pair from which on something changed; -1: it does not apply.
        blocks: its columns (12 V, n), beside those of the stiff rig.
        found: (V, 12) the deviations that it gives to each pair.
        sigma: (12,) standard deviation of the last pair's deviations against the first's; 0 where they do not differ.
    """

    rule: Rule
    columns: int
    squares_px2: float
    criterion: float
    begins: int
    blocks: tuple[Vector, ...]
    found: Vector
    sigma: Vector


def weighed(loose: Loosened) -> list[Weighed]:
    """Weigh every rule in each of its forms, the best first, for a series whose pairs are in the order in which they were taken."""
    results = [_weigh(loose, rule, columns, begins) for rule, columns, begins in _rules(loose)]
    return sorted(results, key=lambda each: each.criterion)


def significance(one: Weighed, free: Weighed, loose: Loosened) -> Vector:
    """Return by how many standard deviations the last pair deviates from the first, (12,), judged by the scatter of the pairs.

    Args:
        one: a rule of few numbers, such as DRIFT.
        free: the rule that lets each pair deviate in the same way on its own, such as LOOSE: what it explains besides is
            scatter, which no corner's noise would show.
        loose: the loosened rig.
    """
    change = one.found[-1] - one.found[0]
    sigma = one.sigma * scatter(one, free, loose)
    return np.asarray(np.divide(change, sigma, out=np.zeros_like(change), where=sigma > 0), np.float64)


def scatter(one: Weighed, free: Weighed, loose: Loosened) -> float:
    """Return by which factor the pairs scatter about a rule more than their corners' noise tells; at least 1."""
    numbers = max(1, free.columns - one.columns - _GAUGE)
    noise_px2 = free.squares_px2 / max(1, loose.numbers - 6 * loose.count - free.columns)
    return math.sqrt(max(1.0, (one.squares_px2 - free.squares_px2) / numbers / noise_px2))


def again(loose: Loosened, before: Weighed) -> Weighed:
    """Weigh a rule once more, where the loosened rig already has the deviations that it found: it corrects them."""
    return _weigh(loose, before.rule, list(before.blocks), before.begins)


def criterion(squares_px2: float, columns: int, loose: Loosened) -> float:
    """Return the criterion of anything that leaves these squares with so many numbers of its own."""
    return loose.numbers * math.log(squares_px2 / loose.numbers) + columns * math.log(loose.numbers)


def _rules(loose: Loosened) -> list[tuple[Rule, list[Vector], int]]:
    """Return each rule as blocks of columns (12 V, n), beside those of the stiff rig."""
    count = loose.count
    order = np.linspace(-0.5, 0.5, count)
    each = np.eye(count)
    rules = list[tuple[Rule, list[Vector], int]]()
    rules.append((Rule.STIFF, [], -1))
    turns = _turns(loose)
    rules += [(Rule.DRIFT, [_along(order, turn)], -1) for turn in turns]
    rules += [(Rule.LOOSE, [_along(each, turn)], -1) for turn in turns]
    for first in range(2, count - 1):
        after = (np.arange(count) >= first).astype(float)
        rules += [(Rule.KNOCK, [_along(after, turn)], first) for turn in turns]
        rules += [(Rule.FOCUS_LEFT, [_along(after, _kind(FOCUS_LEFT))], first)]
        rules += [(Rule.FOCUS_RIGHT, [_along(after, _kind(FOCUS_RIGHT))], first)]
    for course in (order, each):
        rules += [(Rule.FOCUS_LEFT, [_along(course, _kind(FOCUS_LEFT))], -1)]
        rules += [(Rule.FOCUS_RIGHT, [_along(course, _kind(FOCUS_RIGHT))], -1)]
    apart = [_along(each, _kind(MOVE)), _along(each, _kind(TURN))]
    rules += [(Rule.SKEW, apart[:1], -1), (Rule.SKEW, apart, -1)]
    rows = [_along(each, _kind(ROWS_LEFT)), _along(each, _kind(ROWS_RIGHT))]
    rules += [(Rule.ROWS, rows[:1], -1), (Rule.ROWS, rows[1:], -1), (Rule.ROWS, rows, -1)]
    rules += [(Rule.ROWS, [*rows, *apart], -1)]
    return rules


def _turns(loose: Loosened) -> list[Vector]:
    """Return the ways to turn the right camera, (12, 3) each: about its own centre, the bar's middle and the left camera's centre.

    A turn w about p, in the right camera's axes, is a turn about its centre and the shift p x w, which is the same as moving
    the board by R^T (p x w) in the left camera's axes.
    """
    rotation = np.asarray(cv2.Rodrigues(loose.state.rotation)[0])
    result = []
    for share in _PIVOTS:
        x, y, z = share * loose.state.translation_m  # the left camera's centre lies at t
        kind = _kind(TURN)
        kind[MOVE] = rotation.T @ np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        result.append(kind)
    return result


def _kind(which: slice) -> Vector:
    """Return columns (12, n) of plain deviations."""
    return np.eye(DEVIATIONS)[:, which].copy()


def _along(course: Vector, kind: Vector) -> Vector:
    """Return the columns of deviations that follow a course over the pairs: (12 V, n) for a course (V,), or for each of (V, V)."""
    return np.asarray(np.kron(course[:, np.newaxis] if course.ndim == 1 else course, kind), np.float64)


def _weigh(loose: Loosened, rule: Rule, blocks: list[Vector], begins: int) -> Weighed:
    count = loose.count
    stiff = np.hstack([_along(np.ones(count), _kind(TURN)), _along(np.ones(count), _kind(MOVE))])
    columns = np.hstack([stiff, *blocks])
    gradient = columns.T @ loose.gradient
    # Columns that repeat the stiff rig's (all pairs turned alike) take the least length: only their sum is determined.
    inverse = np.linalg.pinv(columns.T @ loose.information @ columns, rcond=1e-10, hermitian=True)
    numbers = inverse @ gradient
    squares = max(loose.squares_px2 - float(gradient @ numbers), 1e-12)
    number = sum(block.shape[1] for block in blocks)
    across = columns[-DEVIATIONS:] - columns[:DEVIATIONS]
    noise = squares / max(1, loose.numbers - 6 * count)
    return Weighed(
        rule=rule,
        columns=number,
        squares_px2=squares,
        criterion=criterion(squares, number, loose),
        begins=begins,
        blocks=tuple(blocks),
        found=(columns @ numbers).reshape(count, DEVIATIONS),
        sigma=np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", across, inverse, across) * noise, 0.0)),
    )
