"""Where the board is at any moment: a sum of strokes of the arm, plus what no hand holds still. Pure.

A stroke is a point-to-point movement whose speed is bell-shaped; a correction begins before the last stroke has ended and adds to
it (T. Flash and E. Henis, "Arm trajectory modifications during reaching towards visual targets", 1991). So the pose is smooth
whatever is decided when. Tremor is that of a raised arm: 7 to 11 Hz, some tenths of a millimetre; sway is slower and wider.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.geometry.se3 import SE3, rotations_of

Floats = NDArray[np.float64]

_WAVES: Final = 3
"""Sines in each component of sway and of tremor."""

GRIPS: Final = 3
"""Ways to hold the board: by its margin, and with a hand over the left or over the right squares."""


@dataclass(frozen=True, slots=True)
class Stroke:
    """One movement.

    Attributes:
        start_s: when it begins, CLOCK_MONOTONIC, s.
        lasts_s: how long it takes, s; above 0.
        by: (6,) what it adds to the pose (see `motion`).
        grip: how the board is held from the middle of the stroke on, below `GRIPS`.
    """

    start_s: float
    lasts_s: float
    by: Floats
    grip: int = 0

    def share(self, at_s: float) -> float:
        """How much of it is done, 0 to 1: the minimum-jerk profile of Flash and Hogan, 1985."""
        t = min(1.0, max(0.0, (at_s - self.start_s) / self.lasts_s))
        return t**3 * (10 - 15 * t + 6 * t * t)


@dataclass(frozen=True, slots=True)
class Plan:
    """All strokes so far, the oldest first. The first one says where the board starts."""

    strokes: tuple[Stroke, ...]

    def at(self, at_s: float) -> Floats:
        """The (6,) pose without tremor."""
        return np.asarray(np.sum([each.share(at_s) * each.by for each in self.strokes], axis=0))

    @property
    def goal(self) -> Floats:
        """The (6,) pose when all strokes are done."""
        return np.asarray(np.sum([each.by for each in self.strokes], axis=0))

    def grip(self, at_s: float) -> int:
        """How the board is held."""
        return [0, *(each.grip for each in self.strokes if each.start_s + each.lasts_s / 2 <= at_s)][-1]

    def since(self, then_s: float) -> "Plan":
        """Return a shorter plan that is the same from a moment on: strokes that were over are one."""
        over = [each for each in self.strokes if each.start_s + each.lasts_s < then_s]
        if not over:
            return self
        first = Stroke(over[0].start_s, over[0].lasts_s, np.sum([each.by for each in over], axis=0), over[-1].grip)
        return Plan((first, *(each for each in self.strokes if each.start_s + each.lasts_s >= then_s)))


@dataclass(frozen=True, slots=True)
class Unrest:
    """What a hand does while it holds still: six sums of sines.

    Attributes:
        sizes: (2 * _WAVES, 6) m or rad.
        rates: the same, rad/s.
        phases: the same, rad.
    """

    sizes: Floats
    rates: Floats
    phases: Floats

    @staticmethod
    def of(random: np.random.Generator) -> "Unrest":
        """Draw a person: sway of 0.6 to 2 mm and 0.1 to 0.4 degrees at 0.1 to 0.6 Hz, tremor of 0.03 to 0.12 mm (rms)."""
        sway_m, tremor_m = random.uniform(0.6e-3, 2e-3), random.uniform(0.03e-3, 0.12e-3)
        sway, tremor = np.r_[[sway_m] * 3, [sway_m * 3] * 3], np.r_[[tremor_m] * 3, [tremor_m * 3] * 3]
        share = np.sqrt(2 / _WAVES)
        sizes = np.concatenate([np.tile(each * share, (_WAVES, 1)) for each in (sway, tremor)])
        slow, fast = random.uniform(0.1, 0.6, (_WAVES, 6)), random.uniform(7, 11, (_WAVES, 6))
        return Unrest(
            sizes * random.uniform(0.6, 1.4, sizes.shape),
            2 * np.pi * np.concatenate([slow, fast]),
            random.uniform(0, 2 * np.pi, sizes.shape),
        )

    def at(self, at_s: float) -> Floats:
        """The (6,) deviation from the pose that was meant."""
        return np.asarray((self.sizes * np.sin(self.rates * at_s + self.phases)).sum(axis=0))


def motion(pose: Floats, middle_m: Floats) -> SE3:
    """Return where a board is.

    Args:
        pose: (6,) its middle, m, in the axes of the left camera; tilt about their x and y, rad; roll about its own z, rad.
        middle_m: (3,) the middle in the board's own axes.

    Returns:
        The motion that takes board coordinates to the rig's.
    """
    turn = rotations_of(np.array([pose[3], pose[4], 0])) @ rotations_of(np.array([0, 0, pose[5]]))
    return SE3(turn, pose[:3] - turn @ middle_m)


def write_plan(path: Path, plan: Plan) -> None:
    """Write a plan so that readers see the old one or the new one, whole."""
    rows = np.array([[each.start_s, each.lasts_s, *each.by, each.grip] for each in plan.strokes])
    draft = path.with_suffix(".draft.npy")
    np.save(draft, rows)
    draft.replace(path)


def read_plan(path: Path) -> Plan:
    """Read what `write_plan` wrote."""
    return Plan(tuple(Stroke(row[0], row[1], row[2:8], int(row[8])) for row in np.load(path)))
