"""What a person does who hears the guide's words, and nothing else. Pure.

They know how to hold a board and roughly where the cameras are. They see no picture: how far the views reach, they learn from words. They
take their time, go too far or not far enough, mistake left for right, move when they should hold still, and get bored. If nothing new is
said for a while, they do more of the same, or try the other way.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from tests.support.novice.hands import GRIPS, Floats, Plan, Stroke

_LEAD_S: Final = 0.06
"""A stroke begins so long after it was decided, so that no camera has exposed that moment yet."""

_MEMORY_S: Final = 5.0
_NEAREST_M, _FARTHEST_M = 0.16, 1.1
"""Before the cameras' faces; at the end of the arms, a step back."""

_STEEPEST: Final = np.radians(50)
_HORIZONTAL: Final = {"left": -1, "right": 1}
_VERTICAL: Final = {"top": -1, "bottom": 1}
_SILENT: Final = ("taken", "done")
_HOLD: Final = "hold"
_LEARNS, _STEPS_BACK = 0.2, 0.06
"""How much of the way what they take for the middle moves to where the cameras saw the board; how much farther away it is taken to be
each time they did not."""


@dataclass(frozen=True, slots=True)
class Person:
    """How somebody is. Shares are probabilities.

    Attributes:
        tempo: how long movements take, times the usual.
        reaction_s: shortest and longest time from a word to a movement.
        patience_s: shortest and longest time until they try more of the same.
        clumsy: how far off a movement ends, as a share of it.
        mistakes: that a direction is mistaken.
        fidgets: that they move after all when told to hold still.
        bored_s: mean time between two movements of their own accord.
        careless: that a movement changes the grip to one that covers squares.
        middle_m: (3,) where they take the middle of both views to be.
    """

    tempo: float
    reaction_s: tuple[float, float]
    patience_s: tuple[float, float]
    clumsy: float
    mistakes: float
    fidgets: float
    bored_s: float
    careless: float
    middle_m: Floats

    @staticmethod
    def of(random: np.random.Generator, between_m: Floats) -> "Person":
        """Draw a person who faces two cameras; `between_m` is the point between them, (3,)."""
        return Person(
            tempo=random.uniform(0.7, 1.6),
            reaction_s=(0.4, random.uniform(0.8, 1.2)),
            patience_s=(2.0, random.uniform(3.0, 4.5)),
            clumsy=random.uniform(0.2, 0.5),
            mistakes=random.uniform(0.05, 0.2),
            fidgets=random.uniform(0.05, 0.25),
            bored_s=random.uniform(15, 40),
            careless=random.uniform(0.02, 0.1),
            middle_m=between_m + np.array([*random.normal(0, 0.025, 2), random.uniform(0.35, 0.6)]),
        )


class Novice:
    """Somebody with a board.

    Args:
        random: what they are drawn from, and what they decide by.
        between_m: (3,) the point between the two cameras, which they see before them.
        now_s: CLOCK_MONOTONIC, s.
    """

    def __init__(self, random: np.random.Generator, between_m: Floats, now_s: float) -> None:
        self._random, self.person = random, Person.of(random, between_m)
        aside = random.uniform(-0.2, 0.2, 2) * [1.0, 0.7]
        turned = [*np.radians(random.normal(0, 15, 2)), np.radians(random.normal(0, 8))]
        start = np.array([*(self.person.middle_m[:2] + aside), random.uniform(0.2, 1.0), *turned])
        self.plan = Plan((Stroke(now_s - 10, 1.0, start),))
        self._words, self._times, self._way = "", 0, 1
        self._middle_m = self.person.middle_m.copy()
        self._acts_s, self.bored_at_s = np.inf, now_s + random.exponential(self.person.bored_s)

    def hear(self, words: str, now_s: float) -> None:
        """Hear what is said. Whatever was said before and not done yet is forgotten."""
        if words.startswith(_SILENT):
            self._acts_s = np.inf
            return
        if words.startswith(_HOLD):  # they see it now: so far the views reach
            self._middle_m += _LEARNS * (self.plan.at(now_s)[:3] - self._middle_m)
        elif "farther" in words or "whole" in words:  # a step back cannot be wrong
            self._middle_m[2] *= 1 + _STEPS_BACK
        self._words, self._times = words, 0
        self._way = -1 if self._random.random() < self.person.mistakes else 1
        self._acts_s = now_s + self._random.uniform(*self.person.reaction_s)

    def act(self, now_s: float) -> bool:
        """Move, if it is time to; returns whether the plan has changed."""
        if now_s >= self._acts_s:
            goal = self._understood(now_s)
            self._times += 1
            self._acts_s = now_s + self._random.uniform(*self.person.patience_s)
            if self._times > 1 and self._random.random() < 0.5:  # a coin
                self._way = 1  # it was not that way, it seems
        elif now_s >= self.bored_at_s and not self._words.startswith(_HOLD):
            goal = self._stirred(self.plan.goal, 0.08, 12)
        else:
            return False
        if now_s >= self.bored_at_s:
            self.bored_at_s = now_s + self._random.exponential(self.person.bored_s)
        self._move(goal, now_s)
        return True

    def _move(self, goal: Floats, now_s: float) -> None:
        goal = goal.copy()
        goal[2] = np.clip(goal[2], _NEAREST_M, _FARTHEST_M)
        goal[3:5] = np.clip(goal[3:5], -_STEEPEST, _STEEPEST)
        start_s = now_s + _LEAD_S
        by = goal - self.plan.goal
        length = float(np.linalg.norm(by[:3])) + 0.15 * float(np.linalg.norm(by[3:]))
        lasts_s = self.person.tempo * self._random.uniform(0.8, 1.3) * (0.45 + 2.0 * length)
        grip = int(self._random.integers(1, GRIPS)) if self._random.random() < self.person.careless else 0
        if self._words.startswith(_HOLD):
            grip = self.plan.grip(np.inf)
        stroke = Stroke(start_s, lasts_s, by, grip)
        self.plan = replace(
            self.plan.since(now_s - _MEMORY_S), strokes=(*self.plan.since(now_s - _MEMORY_S).strokes, stroke)
        )

    def _understood(self, now_s: float) -> Floats:
        """Return where the board is to go, (6,), after the words as they are understood."""
        goal = self.plan.goal
        for part in self._words.split(", "):
            goal = self._meaning(part)(goal, part, now_s)
        return goal

    def _meaning(self, part: str) -> Callable[[Floats, str, float], Floats]:
        meanings: tuple[tuple[str, Callable[[Floats, str, float], Floats]], ...] = (
            ("hold still", self._held),
            ("too blurred", self._held),
            ("sees too little", self._shown_to),
            ("back from", self._back),
            ("farther", self._nearer),
            ("away", self._tilted),
            ("corner", self._aside),
            ("edge", self._aside),
            ("closer", self._nearer),
            ("a little", self._nudged),
            ("show", self._shown),
            ("board", self._shown),
        )
        return next((meaning for word, meaning in meanings if word in part), self._puzzled)

    def _about(self, size: float) -> float:
        """Return a size as it comes out."""
        return size * max(0.1, 1 + self.person.clumsy * float(self._random.normal()))

    def _shaken(self, goal: Floats, m: float = 0.015, deg: float = 4) -> Floats:
        """Return a pose with what changes although nobody asked for it."""
        shift = self._random.normal(0, m, 3)
        return np.asarray(goal + np.r_[shift, np.radians(self._random.normal(0, deg, 3) * [1, 1, 0.5])])

    def _stirred(self, goal: Floats, m: float, deg: float) -> Floats:
        return self._shaken(goal, m, deg)

    def _puzzled(self, goal: Floats, part: str, now_s: float) -> Floats:
        del part, now_s
        return self._shaken(goal, 0.03, 8)

    def _held(self, goal: Floats, part: str, now_s: float) -> Floats:
        """Stop where the board is; or not quite."""
        if self._random.random() < self.person.fidgets:
            return self._shaken(goal, 0.02, 5)
        if self._times:
            return goal
        stopped = self.plan.at(now_s + _LEAD_S + 0.2)
        if "blurred" in part and self._random.random() < 0.5:  # a coin
            stopped[2] *= 1.1
        return stopped

    def _shown(self, goal: Floats, part: str, now_s: float) -> Floats:
        """Bring the board to where the middle is thought to be, facing the cameras more than before."""
        del part, now_s
        middle = self._middle_m + self._random.normal(0, 0.03, 3) + [0, 0, 0.08 * self._times]
        share = min(1.0, max(0.4, self._about(0.8)))
        return self._shaken(np.r_[goal[:3] + share * (middle - goal[:3]), goal[3:5] * 0.5, goal[5] * 0.8])

    def _shown_to(self, goal: Floats, part: str, now_s: float) -> Floats:
        """Move towards the camera that is named, rather back than not, and take the fingers off."""
        del now_s
        step_m = np.array([-0.08 if "left" in part else 0.08, 0, 0.08 * goal[2]])
        moved = goal[:3] + step_m * self._about(0.7)
        moved[1] += 0.4 * (self._middle_m[1] - moved[1])
        return self._shaken(np.r_[moved, goal[3:5] * 0.8, goal[5]])

    def _tilted(self, goal: Floats, part: str, now_s: float) -> Floats:
        """Turn the edge that is named away, by what is taken for thirty degrees; more of it when it is said for long."""
        del now_s
        by = self._way * self._about(np.radians(30)) * (1 + 0.3 * self._times)
        wanted = np.zeros(2)
        for name, sign in _HORIZONTAL.items():
            wanted[1] += -sign * by if name in part else 0
        for name, sign in _VERTICAL.items():
            wanted[0] += sign * by if name in part else 0
        rest = np.where(wanted == 0, goal[3:5] * 0.4, 0)
        return self._shaken(np.r_[goal[:3], wanted + rest, goal[5]])

    def _aside(self, goal: Floats, part: str, now_s: float) -> Floats:
        """Move towards an edge or a corner: first a large step from the middle, then small ones."""
        del now_s
        towards = np.array(
            [
                sum(sign for name, sign in _HORIZONTAL.items() if name in part) * self._way,
                sum(sign for name, sign in _VERTICAL.items() if name in part),
            ]
        )
        is_corner = "corner" in part and self._times == 0
        step = self._about(0.2 if is_corner else 0.08) * goal[2]
        start = self._middle_m[:2] if is_corner else goal[:2]
        place = np.where(towards != 0, start + towards * step * [1, 0.75], goal[:2])
        return self._shaken(np.r_[place, goal[2], goal[3:5] * 0.6, goal[5]], 0.01)

    def _back(self, goal: Floats, part: str, now_s: float) -> Floats:
        """Move away from an edge or a corner, by a part of the way to the middle."""
        del now_s
        share = min(1.0, self._about(0.4 + 0.2 * self._times))
        is_across = any(name in part for name in _HORIZONTAL), any(name in part for name in _VERTICAL)
        back = goal[:2] + share * (self._middle_m[:2] - goal[:2])
        return self._shaken(np.r_[np.where(is_across, back, goal[:2]), goal[2:]], 0.01, 3)

    def _nearer(self, goal: Floats, part: str, now_s: float) -> Floats:
        del now_s
        share = self._about(0.25)
        factor = 1 / (1 + share) if "closer" in part else 1 + share
        return self._shaken(np.r_[goal[:2], goal[2] * factor, goal[3:]], 0.01)

    def _nudged(self, goal: Floats, part: str, now_s: float) -> Floats:
        del now_s
        return self._shaken(goal, 0.01, 10) if "turn" in part else self._shaken(goal, 0.04, 6)
