"""Says which final options turn a camera upright, given those that it already has. Pure."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Final, assert_never

from common.orientation import UPRIGHT, Flip, Orientation
from phone_host.measure.file_remedies import ImageSource
from phone_host.measure.trust import Concern
from phone_host.model import Arrangement

_SIDES: Final = ("left", "right")

_TURNS: Final = {
    Arrangement.TURNED: (180,),
    Arrangement.BOTH_TURNED: (180,),
    Arrangement.TURNED_BY_QUARTER: (90, 270),
    Arrangement.BOTH_TURNED_BY_QUARTER: (90, 270),
    Arrangement.MIRRORED: (0,),
    Arrangement.BOTH_MIRRORED: (0,),
}
"""By which clockwise turns of the images now seen a mistake may be undone; 0: by mirroring them."""

_OF_BOTH: Final = frozenset({Arrangement.BOTH_TURNED, Arrangement.BOTH_TURNED_BY_QUARTER, Arrangement.BOTH_MIRRORED})


def turned_further(present: Orientation, turn_deg: int) -> Orientation:
    """Return the orientation whose images are those of another one, turned clockwise.

    Args:
        present: the other one.
        turn_deg: by how much, a multiple of 90 degrees.
    """
    # The turn comes first, then the mirroring: behind a mirror, a turn goes the other way round.
    signed = turn_deg if present.flip is Flip.NONE else -turn_deg
    return Orientation((present.rotate_deg + signed) % 360, present.flip)


def mirrored_further(present: Orientation) -> Orientation:
    """Return the orientation whose images are those of another one, mirrored left to right."""
    match present.flip:
        case Flip.NONE:
            return Orientation(present.rotate_deg, Flip.H)
        case Flip.H:
            return Orientation(present.rotate_deg)
        case Flip.V:  # mirrored both ways is turned by 180 degrees
            return Orientation((present.rotate_deg + 180) % 360)
        case _:
            assert_never(present.flip)


def with_final_options(
    concern: Concern, present: Sequence[Orientation], source: ImageSource = ImageSource.CAMERAS
) -> Concern:
    """Return a concern whose remedy names the options to be given in the end, if it is mended by turning or mirroring.

    Args:
        concern: any concern.
        present: the orientations that the left and the right camera have been given.
        source: where the images come from, and so how the user states them.
    """
    if concern.arrangement not in _TURNS:
        return concern
    is_plain = all(orientation == UPRIGHT for orientation in present)
    if is_plain and (source is ImageSource.FILES or not concern.quarters):
        return concern  # the options are known by their kind alone
    both = concern.arrangement in _OF_BOTH
    turns = _TURNS[concern.arrangement]
    choices = [
        _words(
            side,
            present[side],
            [_further(present[side], turn) for turn in _of_side(turns, concern.quarters, side)],
            source,
        )
        for side in _by_suspicion(present)
    ]
    whom = "both cameras" if both else "the wrong camera"
    how = f"switch mirroring off in {whom}" if turns == (0,) else f"mount {whom} upright"
    return replace(concern, remedy=f"{how}, or give {(' and ' if both else ', or else ').join(choices)}")


def _of_side(turns: tuple[int, ...], quarters: int, side: int) -> tuple[int, ...]:
    """Return the turns that may undo the mistake on one side: the right image, turned by `quarters`, is turned back."""
    if not quarters or len(turns) == 1:
        return turns
    return ((90 * quarters if side == 0 else -90 * quarters) % 360,)


def _further(present: Orientation, turn_deg: int) -> Orientation:
    return turned_further(present, turn_deg) if turn_deg else mirrored_further(present)


def _by_suspicion(present: Sequence[Orientation]) -> list[int]:
    """Return the sides, first the one that was given an orientation: where something was done, it was more likely wrong."""
    return sorted((0, 1), key=lambda side: present[side] == UPRIGHT)


def _words(side: int, present: Orientation, wanted: Sequence[Orientation], source: ImageSource) -> str:
    name = _SIDES[side]
    if source is ImageSource.FILES:
        options = " or ".join(_of_files(item, name) for item in wanted)
        instead = "" if present == UPRIGHT else f" in place of {_of_files(present, name)}"
        return f"{options}{instead}"
    options = " or ".join(str(item) or "neither rotate= nor flip=" for item in wanted)
    instead = "" if present == UPRIGHT else f" in place of {present}"
    return f"the {name} camera {options}{instead}"


def _of_files(wanted: Orientation, name: str) -> str:
    parts = [
        *([f"--rotate-{name} {wanted.rotate_deg}"] if wanted.rotate_deg else []),
        *([f"--flip-{name} {wanted.flip.value}"] if wanted.flip is not Flip.NONE else []),
    ]
    return " ".join(parts) or f"neither --rotate-{name} nor --flip-{name}"
