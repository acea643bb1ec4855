"""Names how the pairs of a series deviate from one stiff rig, if they do. Pure.

A rule is only believed if it explains much of what contradicts a stiff rig, and more than the scatter of the pairs would,
so that the imperfections that every good series has accuse nobody.
"""

import math
from dataclasses import dataclass, replace
from typing import Final

import cv2
import numpy as np

from common.diagnostic import Diagnostic
from phone_host.calibration.failure_modes.lone import apart_px, both_alone
from phone_host.calibration.failure_modes.loosened import (
    FOCUS_LEFT,
    FOCUS_RIGHT,
    MOVE,
    TURN,
    Loosened,
    Stiff,
    camera_arrays,
    loosen,
)
from phone_host.calibration.failure_modes.mistakes import Course, Mistake, Turned, mistaken
from phone_host.calibration.failure_modes.rules import Rule, Weighed, again, criterion, scatter, significance, weighed
from phone_host.calibration.solve.bundle_problem import Vector
from phone_host.calibration.solve.calibrate import Sizes
from phone_host.calibration.solve.verdict import REFERENCE_PX
from phone_host.calibration.target.corners import Board
from phone_host.calibration.target.pairs import BoardPair
from phone_host.model import CameraModel, Side, Verdict

_LEAST_PAIRS: Final = 6
"""With fewer, hardly a rule leaves anything to check it by."""

_USUAL_PAIRS: Final = 5
"""From this many on, a lens has all of its coefficients but k3; that from twice as many on."""

_MOST_PAIRS: Final = 60
"""More are thinned out: the work grows with their square."""

_EXPLAINED_SHARE: Final = 0.35
"""A rule with numbers for every pair must explain so much of the squares: on a good real series one explains 0.21."""

_EXPLAINED_PX: Final = 0.12
_SIGMAS: Final = 5.0
_LEAST_TURN_PX: Final = 0.15
_LEAST_FOCUS: Final = 0.001
_LEAST_ZOOM: Final = 0.003
"""Deviation of a focal length from view to view that an autofocus makes; lenses that breathe in a steady hand stay below."""

_APART_FACTOR, _APART_FLOOR_PX = 5.0, 3.0
_MOST_APART: Final = 0.3
_COMMON: Final = 0.5
"""The median pair must deviate by this share of the mean square, or a few pairs are wrong and not the series."""

_COURSES: Final = frozenset({Rule.DRIFT, Rule.KNOCK, Rule.FOCUS_LEFT, Rule.FOCUS_RIGHT})
_REFINED: Final = 4
"""So many rules of few numbers are fitted again around what they found: a change of 5 % is not small."""

_ROUNDS: Final = 2
_ANY_BETTER: Final = 10.0
"""A difference in the criterion that says anything: "very strong" (Kass and Raftery 1995)."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class _Fitted:
    """A series's pairs, its loosened rig, and what its rules say.

    Attributes:
        apart_px: (V,) how far each pair's right view is from where the rig that most agree on predicts it, px.
        lone_px2: the squares that each view leaves on its own: no rule about the two cameras leaves less.
        results: the rules, the best first; those of few numbers are refined.
    """

    kept: list[BoardPair]
    loose: Loosened
    apart_px: Vector
    lone_px2: float
    results: list[Weighed]

    def free(self, rule: Rule, columns: int) -> Weighed:
        """Return the best form of a rule with so many numbers."""
        return next(each for each in self.results if each.rule is rule and each.columns == columns)

    @property
    def stiff(self) -> Weighed:
        """The stiff rig."""
        return self.free(Rule.STIFF, 0)


def deviation(pairs: tuple[BoardPair, ...], board: Board, sizes_px: Sizes) -> Diagnostic | None:
    """Name how the pairs, in the order in which they were taken, deviate from one stiff rig.

    Returns:
        The mistake; None if they do not deviate, or nothing explains how.
    """
    taken = _thinned(pairs)
    try:
        fitted = _fitted(taken, board, sizes_px)
        if fitted is None:
            return None
        found = _named(fitted, sizes_px)
        together = _together(fitted)  # a few pairs that fit nothing are not the series's mistake
        is_lone = together is not None and len(fitted.kept) - len(together) == 1
        if found is not None and found.code in {Mistake.UNSTIFF, Mistake.FOCUS} and not is_lone:
            return found  # many pairs lie apart for it; a single one may only look like it
        if together is None or len(together) == len(taken):
            return found
        again_fitted = _fitted(together, board, sizes_px)
        return None if again_fitted is None else _named(again_fitted, sizes_px)
    except (cv2.error, np.linalg.LinAlgError):
        return None


def _fitted(pairs: list[BoardPair], board: Board, sizes_px: Sizes) -> _Fitted | None:
    if len(pairs) < _LEAST_PAIRS:
        return None
    points_m = board.points_m()
    alone = both_alone(pairs, points_m, sizes_px)
    if alone is None or len(alone[0]) < _LEAST_PAIRS:
        return None
    kept, left, right = alone
    apart, rig = apart_px(kept, left, right, points_m)
    start = Stiff(
        left=left.lens,
        right=right.lens,
        rotation=rig.rotation,
        translation_m=rig.translation_m,
        poses=left.camera.poses,
    )
    free = np.array([1, 1, 1, 1, 1, *[len(kept) >= _USUAL_PAIRS] * 3, len(kept) >= 2 * _USUAL_PAIRS], bool)

    def at(state: Stiff, given: Vector | None = None) -> Loosened:
        return loosen(kept, points_m, state, free, sizes_px=sizes_px, given=given)

    loose = at(start)
    results = weighed(loose)
    chosen = _worth_refining(results, loose)
    refined = []
    for each in chosen:
        best = each
        for _ in range(_ROUNDS):
            onto = again(at(loose.state, best.found), best)
            best = replace(onto, found=best.found + onto.found)
        refined.append(best)
    others = [each for each in results if each not in chosen]
    return _Fitted(
        kept=kept,
        loose=loose,
        apart_px=apart,
        lone_px2=left.squares_px2 + right.squares_px2,
        results=sorted([*others, *refined], key=lambda each: each.criterion),
    )


def _worth_refining(results: list[Weighed], loose: Loosened) -> list[Weighed]:
    """Return the rules that may explain a series and are not yet exact: the best of few numbers, and the best form of each other."""
    stiff = next(each for each in results if each.rule is Rule.STIFF)
    better = [each for each in results if each.criterion < stiff.criterion - _ANY_BETTER]
    chosen = [each for each in better if each.rule in _COURSES and each.columns < loose.count][:_REFINED]
    for rule in (Rule.LOOSE, Rule.SKEW, Rule.ROWS, Rule.FOCUS_LEFT, Rule.FOCUS_RIGHT):
        best = next((each for each in better if each.rule is rule and each.columns >= loose.count), None)
        if best is not None and best.squares_px2 < (1 - _EXPLAINED_SHARE) * stiff.squares_px2:
            chosen.append(best)
    return chosen


def _together(fitted: _Fitted) -> list[BoardPair] | None:
    """Return the pairs that one rig predicts roughly; None if many are not among those."""
    inside = fitted.apart_px <= max(_APART_FACTOR * float(np.median(fitted.apart_px)), _APART_FLOOR_PX)
    if (~inside).mean() > _MOST_APART:
        return None
    return [pair for pair, good in zip(fitted.kept, inside, strict=True) if good]


def _named(fitted: _Fitted, sizes_px: Sizes) -> Diagnostic | None:
    # Two rigs that have nothing in common but their lenses leave at least what each view leaves alone.
    least = criterion(max(fitted.lone_px2, 1e-12), 6 * fitted.loose.count, fitted.loose)
    courses = [
        each
        for each in fitted.results
        if each.rule in _COURSES and each.columns < fitted.loose.count and each.criterion < least
    ]
    for each in [*courses, *(other for other in fitted.results if other not in courses)]:
        if each.criterion >= fitted.stiff.criterion:
            continue
        found = _believed(each, fitted, sizes_px)
        if found is not None:
            return replace(found, evidence=replace(found.evidence, explained_px=_explained_px(each, fitted)))
    return None


def _explained_px(each: Weighed, fitted: _Fitted) -> float:
    return math.sqrt(max(0.0, 2 * (fitted.stiff.squares_px2 - each.squares_px2) / fitted.loose.numbers))


def _believed(each: Weighed, fitted: _Fitted, sizes_px: Sizes) -> Diagnostic | None:
    """Return what a rule other than STIFF says, if it says something that a good series would not."""
    match each.rule:
        case Rule.DRIFT | Rule.KNOCK:
            return _turned(each, fitted, sizes_px[1])
        case Rule.FOCUS_LEFT | Rule.FOCUS_RIGHT:
            is_free = each.columns >= fitted.loose.count
            return _focus(each, fitted) if not is_free or _explains_much(each, fitted, sizes_px) else None
        case _:
            return _scattered(each, fitted, sizes_px)


def _turned(each: Weighed, fitted: _Fitted, size_px: tuple[int, int]) -> Diagnostic | None:
    loose, kept = fitted.loose, fitted.kept
    free = fitted.free(Rule.LOOSE, 3 * loose.count)
    sigmas = significance(each, free, loose)[TURN]
    turns = each.found[:, TURN]
    change = turns[-1] - turns[0]
    focal_px, half_px = float(loose.state.right[1]), float(loose.state.right[2])
    effect_px = np.abs(change * [focal_px, focal_px, half_px])
    if not ((np.abs(sigmas) >= _SIGMAS) & (effect_px >= _LEAST_TURN_PX)).any():
        return None
    lens = _model(loose.state.right, size_px)
    turned = Turned(
        course=Course.DRIFT if each.rule is Rule.DRIFT else Course.KNOCK,
        turn_rad=change,
        sigma_rad=each.sigma[TURN] * scatter(each, free, loose),
        begins=each.begins,
        names=tuple(pair.name for pair in kept),
        turns_rad=turns,
        lens=lens,
        rows_px=_rows_px(change[np.newaxis], lens),
        depth_at_1_m_m=abs(float(change[1])) / float(np.linalg.norm(loose.state.translation_m)),
    )
    return _unstiff(turned, kept)


def _model(lens: Vector, size_px: tuple[int, int]) -> CameraModel:
    matrix, distortion = camera_arrays(lens)
    return CameraModel(width_px=size_px[0], height_px=size_px[1], matrix=matrix, distortion=distortion)


def _rows_px(turns: Vector, model: CameraModel) -> float:
    """Return by how much turns (M, 3), rad, of a camera move its rows where they do so most: root mean square of the turns, px.

    A roll leaves the middle where it is and moves the edges by pixels.
    """
    sides = ([0.0, (side - 1) / 2, side - 1.0] for side in (model.width_px, model.height_px))
    x, y = (axis.ravel() for axis in np.meshgrid(*sides))
    (fx, _, cx), (_, fy, cy) = model.matrix[:2]
    a, b = (x - cx) / fx, (y - cy) / fy
    moved = fy * (turns @ np.stack([-(1 + b * b), a * b, a]))
    return float(np.sqrt(np.square(moved).mean(axis=0)).max())


def _unstiff(turned: Turned, kept: list[BoardPair]) -> Diagnostic:
    degrees = math.degrees(float(np.linalg.norm(turned.turn_rad)))
    along = turned.turn_rad / np.linalg.norm(turned.turn_rad)
    sigma = math.degrees(float(np.linalg.norm(along * turned.sigma_rad)))
    how = (
        "while you took the views"
        if turned.course is Course.DRIFT
        else f"at once before pair {kept[turned.begins].name}"
    )
    cost = (
        f"rows differ by up to {turned.rows_px:.2f} px and depth at 1 m by {turned.depth_at_1_m_m * 1e3:.1f} mm for it"
    )
    return mistaken(
        Mistake.UNSTIFF,
        f"the cameras turned against each other by {degrees:.3f} +- {sigma:.3f} degrees {how}: {cost}",
        "tighten the bar and calibrate again",
        turned=turned,
        most=Verdict.USABLE,
    )


def _focus(each: Weighed, fitted: _Fitted) -> Diagnostic | None:
    loose, kept = fitted.loose, fitted.kept
    free = fitted.free(each.rule, loose.count)
    which = FOCUS_LEFT if each.rule is Rule.FOCUS_LEFT else FOCUS_RIGHT
    side = Side.LEFT if each.rule is Rule.FOCUS_LEFT else Side.RIGHT
    if each is free:
        scattered = float(each.found[:, which].std())
        return _focus_found(side, f"changes by {scattered:.1%} from view to view") if scattered >= _LEAST_ZOOM else None
    change = float((each.found[-1] - each.found[0])[which][0])
    if abs(significance(each, free, loose)[which][0]) < _SIGMAS or abs(change) < _LEAST_FOCUS:
        return None
    when = f"from pair {kept[each.begins].name} on" if each.begins > 0 else "from the first pair to the last"
    return _focus_found(side, f"changed by {change:+.1%} {when}")


def _focus_found(side: Side, what: str) -> Diagnostic:
    return mistaken(
        Mistake.FOCUS,
        f"the {side.value} camera's focal length {what}",
        "switch autofocus and zoom off in that camera, and take all views again",
        most=Verdict.USABLE,
    )


def _explains_much(each: Weighed, fitted: _Fitted, sizes_px: Sizes) -> bool:
    """Return whether a rule with numbers for every pair explains more than it would of a good series."""
    factor = max(1.0, min(max(size) for size in sizes_px) / REFERENCE_PX)
    explained = 1 - each.squares_px2 / fitted.stiff.squares_px2
    enough = explained >= _EXPLAINED_SHARE and _explained_px(each, fitted) >= _EXPLAINED_PX * factor
    return enough and _is_common(each, fitted.loose)


def _scattered(each: Weighed, fitted: _Fitted, sizes_px: Sizes) -> Diagnostic | None:
    loose = fitted.loose
    if each.rule is Rule.ROWS and each.squares_px2 > (1 - _EXPLAINED_SHARE) * fitted.lone_px2:
        return None  # each view alone is whole: its rows belong to one moment
    if not _explains_much(each, fitted, sizes_px):
        return None
    if each.rule is Rule.LOOSE:
        angles = each.found[:, TURN] - each.found[:, TURN].mean(axis=0)
        lens = _model(loose.state.right, sizes_px[1])
        turned = Turned(
            course=Course.LOOSE,
            turn_rad=angles.std(axis=0),
            sigma_rad=np.zeros(3),
            begins=-1,
            names=tuple(pair.name for pair in fitted.kept),
            turns_rad=angles,
            lens=lens,
            rows_px=_rows_px(angles, lens),
            depth_at_1_m_m=float(angles[:, 1].std() / np.linalg.norm(loose.state.translation_m)),
        )
        degrees = math.degrees(float(np.linalg.norm(turned.turn_rad)))
        return mistaken(
            Mistake.UNSTIFF,
            f"the cameras turned against each other by {degrees:.3f} degrees from view to view, this way and that",
            "tighten the bar, or put the rig down if you held it in your hands, because its cameras do not expose at the same moment",
            turned=turned,
            most=Verdict.USABLE,
        )
    if each.rule is Rule.SKEW:
        moved_mm = float(np.linalg.norm(each.found[:, MOVE] - each.found[:, MOVE].mean(axis=0), axis=1).mean()) * 1e3
        return mistaken(
            Mistake.SKEW,
            f"the board moved by {moved_mm:.1f} mm between the left and the right exposure of a pair",
            "hold the board still, or put it down, until both cameras have their image",
        )
    return mistaken(
        Mistake.ROWS,
        f"rows of an image show different moments, which explains {_explained_px(each, fitted):.2f} px: the board or the cameras moved under a rolling shutter",
        "hold board and cameras still in each view",
    )


def _is_common(each: Weighed, loose: Loosened) -> bool:
    """Return whether the median pair deviates much, too: beside the others, or, by its rows, beside the noise that the rule leaves."""
    off = each.found - each.found.mean(axis=0)
    size = off.shape[1]
    own_px2 = np.array(
        [
            deviation @ loose.information[i * size : (i + 1) * size, i * size : (i + 1) * size] @ deviation
            for i, deviation in enumerate(off)
        ]
    )
    noise_px2 = each.squares_px2 / loose.numbers * each.columns / loose.count
    usual_px2 = float(np.median(own_px2))
    if usual_px2 >= _COMMON**2 * float(own_px2.mean()):
        return True
    # One pair that moved drags the others' common pose along, and all seem to deviate; rows within a view it leaves straight.
    return each.rule is Rule.ROWS and usual_px2 >= _SIGMAS**2 * noise_px2


def _thinned(pairs: tuple[BoardPair, ...]) -> list[BoardPair]:
    if len(pairs) <= _MOST_PAIRS:
        return list(pairs)
    return [pairs[index] for index in np.linspace(0, len(pairs) - 1, _MOST_PAIRS).astype(int)]
