"""Chooses constants without tuning them to the scenes that judge them: leave one scene out, choose on the others, score on it.

    variants = {f"cost {cost}": lambda count, cost=cost: MyMatcher(count, cost) for cost in (8, 12, 16)}
    print(leave_one_out(variants, default_cases()))

For constants of the C sources: depth_variants. All cases of a scene are left out together: its JPEG is the same scene. A choice is sound when the held-out scenes choose
alike, and when the score that the choices reach on scenes unseen stays near the best that was possible on each.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from tests.bench.depth_accuracy import ANCHORS, Case, MakeMatcher, Row, evaluate

Objective = Callable[[Row, Row], float]
"""A case's score from our row and the anchor's; less is better."""

_LEAST_PERCENT: Final = 0.25
"""Below this an anchor's share of wrong pixels is noise, and a ratio to it would rule the mean."""


def half_bad_half_filled(ours: Row, anchor: Row) -> float:
    """Mean ratio to the anchor of bad2, fill2 and bad1, the figures by which matchers are judged; 1: the anchor's."""
    pairs = ((getattr(ours, name), getattr(anchor, name)) for name in ("bad2", "fill2", "bad1"))
    return float(np.mean([(mine + _LEAST_PERCENT) / (theirs + _LEAST_PERCENT) for mine, theirs in pairs]))


@dataclass(frozen=True, slots=True)
class HeldOut:
    """One scene that took no part in the choice.

    Attributes:
        scene: its name.
        chosen: the variant that the other scenes choose.
        score: of the chosen variant on this scene.
        best: the variant that would have been best here.
        best_score: of that.
        rows: the chosen variant's rows on this scene.
    """

    scene: str
    chosen: str
    score: float
    best: str
    best_score: float
    rows: tuple[Row, ...]


@dataclass(frozen=True, slots=True)
class Choices:
    """The whole table.

    Attributes:
        held_out: one line a scene.
        scores: of each variant over all scenes.
    """

    held_out: tuple[HeldOut, ...]
    scores: Mapping[str, float]

    @property
    def chosen(self) -> str:
        """The variant that is best over all scenes."""
        return min(self.scores, key=lambda name: self.scores[name])

    def __str__(self) -> str:
        """The table as text."""
        wide = max(12, *(len(name) for name in self.scores))
        lines = [f"{'held out':20} {'chosen':{wide}}  score  {'best here':{wide}}  score   bad2   fill2"]
        for held in self.held_out:
            bad2, fill2 = (float(np.mean([getattr(row, name) for row in held.rows])) for name in ("bad2", "fill2"))
            scores = f"{held.chosen:{wide}}  {held.score:5.3f}  {held.best:{wide}}  {held.best_score:5.3f}"
            lines.append(f"{held.scene:20} {scores}  {bad2:5.2f}   {fill2:5.2f}")
        reached = float(np.mean([held.score for held in self.held_out]))
        possible = float(np.mean([held.best_score for held in self.held_out]))
        lines.append(f"{'mean':20} {'':{wide}}  {reached:5.3f}  {'':{wide}}  {possible:5.3f}")
        ranked = sorted(self.scores.items(), key=lambda item: item[1])
        return "\n".join([*lines, *(f"on all scenes: {name:{wide}}  {value:5.3f}" for name, value in ranked)])


def leave_one_out(
    variants: Mapping[str, MakeMatcher | str],
    cases: Sequence[Case],
    objective: Objective = half_bad_half_filled,
) -> Choices:
    """Match all cases by all variants and tell for each scene what the others would have chosen.

    Args:
        variants: by name: a matcher's name, or a callable that makes a matcher from N.
        cases: of two scenes or more.
        objective: the score of one case.

    Returns:
        The table. Every scene weighs the same, however many cases show it.
    """
    return choices(
        {name: evaluate(make, cases) for name, make in variants.items()}, evaluate(ANCHORS[0], cases), objective
    )


def choices(
    rows: Mapping[str, Sequence[Row]], anchor: Sequence[Row], objective: Objective = half_bad_half_filled
) -> Choices:
    """The same from rows that were measured before.

    Args:
        rows: of each variant, one a case.
        anchor: of the anchor, in the same order.
        objective: the score of one case.
    """
    scenes = list(dict.fromkeys(row.scene for row in anchor))
    table = {
        name: {
            scene: float(np.mean([objective(o, a) for o, a in zip(mine, anchor, strict=True) if o.scene == scene]))
            for scene in scenes
        }
        for name, mine in rows.items()
    }

    def best_on(chosen: Sequence[str]) -> str:
        return min(table, key=lambda name: float(np.mean([table[name][scene] for scene in chosen])))

    held = []
    for scene in scenes:
        chosen, best = best_on([other for other in scenes if other != scene]), best_on([scene])
        seen = tuple(row for row in rows[chosen] if row.scene == scene)
        held.append(HeldOut(scene, chosen, table[chosen][scene], best, table[best][scene], seen))
    return Choices(tuple(held), {name: float(np.mean(list(by.values()))) for name, by in table.items()})
