"""Names how two images lie to each other if not as they should: exchanged, turned, mirrored, or both from one place. Pure.

A mistake is named only if clearly more features agree with it than with the right arrangement. Figures: decision 0029.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from typing import Final, assert_never

from common.diagnostic import Diagnostic
from common.orientation import UPRIGHT, Flip, Orientation
from phone_host.diagnostics.codes import Code, Misplaced, diagnose
from phone_host.model import Arrangement, Evidence


class ImageSource(Enum):
    """Where the images come from, and so what a remedy may name."""

    CAMERAS = "cameras"
    FILES = "files"


EXCHANGE: Final = "LEFT RIGHT"
"""Stands for the two images exchanged on the command line, where other tries are options."""


@dataclass(frozen=True, slots=True)
class FileRemedy:
    """A remedy for image files.

    Attributes:
        words: what to do.
        tries: the options that may mend it, each as words of a command line; the user sees in the pictures which one does.
    """

    words: str
    tries: tuple[tuple[str, ...], ...] = ()


_LEFT_180: Final = ("--rotate-left", "180")

_RIGHT_180: Final = ("--rotate-right", "180")

FILE_REMEDIES: Final[Mapping[Arrangement, FileRemedy]] = {
    Arrangement.SWAPPED: FileRemedy(
        "swap LEFT and RIGHT; if each is what it should be, both are upside down (--rotate-left 180 --rotate-right 180) or both are mirror images (--flip-left h --flip-right h)",
        ((EXCHANGE,),),
    ),
    Arrangement.TURNED: FileRemedy(
        "give --rotate-left 180 or --rotate-right 180, for the image that is upside down",
        (_LEFT_180, _RIGHT_180),
    ),
    Arrangement.TURNED_BY_QUARTER: FileRemedy(
        "give --rotate-left or --rotate-right with 90 or 270 (clockwise), for the image that lies on its side",
        tuple((f"--rotate-{side}", turn) for side in ("left", "right") for turn in ("90", "270")),
    ),
    Arrangement.BOTH_TURNED: FileRemedy("give --rotate-left 180 --rotate-right 180", ((*_LEFT_180, *_RIGHT_180),)),
    Arrangement.BOTH_MIRRORED: FileRemedy(
        "give --flip-left h --flip-right h", (("--flip-left", "h", "--flip-right", "h"),)
    ),
    Arrangement.BOTH_TURNED_BY_QUARTER: FileRemedy(
        "give --rotate-left and --rotate-right, both with 90 or both with 270 (clockwise)",
        tuple(("--rotate-left", turn, "--rotate-right", turn) for turn in ("90", "270")),
    ),
    Arrangement.MIRRORED: FileRemedy(
        "give --flip-left or --flip-right, for the image that is mirrored: h if left and right are exchanged in it, v if top and bottom are",
        tuple((f"--flip-{side}", flip) for side in ("left", "right") for flip in ("h", "v")),
    ),
    Arrangement.SAME_PLACE: FileRemedy(
        "give the images of two cameras that are apart; if these are, everything in them is too far away"
    ),
}


def tries_of(remedy: str) -> tuple[tuple[str, ...], ...]:
    """Return the options that may carry out a remedy for files; empty if there are none."""
    return next((known.tries for known in FILE_REMEDIES.values() if known.words == remedy), ())


LEAST_SUPPORT: Final = 12
"""Features that must agree with a mistake before it is named. Pairs of unlike scenes reach 3 by chance, good ones 50 and more."""

_MARGIN: Final = 2.0
"""How many times more features must agree with a mistake than with the right arrangement. A chessboard mirrored looks
like itself and reaches a third."""

_CLEARLY_MORE: Final = 1.3
"""How many times more features tell cameras on their heads, or mirrored ones, from exchanged ones behind a rig."""

_SAME_SHARE: Final = 0.75
"""Share of the features that have not moved in two images from one place; noise moves some. In a street scene 2 % have not."""

_NAMED: Final = {
    Arrangement.SWAPPED: diagnose(
        Code.SWAPPED,
        "left and right are exchanged: the scene moves the wrong way from the left image to the right one",
        "swap LEFT and RIGHT or --board-side; if each is where it should be, both cameras are upside down (rotate=180) or both mirror their images (flip=h)",
    ),
    Arrangement.TURNED: diagnose(
        Code.TURNED,
        "one camera is upside down: the two images are turned by 180 degrees to each other",
        "mount it upright, or give that camera rotate=180",
        evidence=Misplaced(Arrangement.TURNED),
    ),
    Arrangement.TURNED_BY_QUARTER: diagnose(
        Code.TURNED_BY_QUARTER,
        "one camera lies on its side: the two images are turned by 90 degrees to each other",
        "mount it upright, or give that camera rotate=90 or rotate=270",
        evidence=Misplaced(Arrangement.TURNED_BY_QUARTER),
    ),
    Arrangement.BOTH_TURNED: diagnose(
        Code.TURNED,
        "both cameras are upside down: their images fit the calibration only when turned by 180 degrees",
        "mount them upright, or give both cameras rotate=180",
        evidence=Misplaced(Arrangement.BOTH_TURNED),
    ),
    Arrangement.BOTH_MIRRORED: diagnose(
        Code.MIRRORED,
        "both images are mirrored: they fit the calibration only when flipped",
        "switch mirroring off in both cameras, or give both flip=h (flip=v if top and bottom are exchanged)",
        evidence=Misplaced(Arrangement.BOTH_MIRRORED),
    ),
    Arrangement.BOTH_TURNED_BY_QUARTER: diagnose(
        Code.TURNED_BY_QUARTER,
        "both cameras lie on their sides: the scene moves up or down from one image to the other",
        "mount them upright, or give both cameras rotate=90 or rotate=270",
        evidence=Misplaced(Arrangement.BOTH_TURNED_BY_QUARTER),
    ),
    Arrangement.MIRRORED: diagnose(
        Code.MIRRORED,
        "one of the two images is a mirror image",
        "switch mirroring off in the camera's app, or give that camera flip=h (flip=v if top and bottom are exchanged)",
        evidence=Misplaced(Arrangement.MIRRORED),
    ),
    Arrangement.SAME_PLACE: diagnose(
        Code.SAME_IMAGE,
        "both images show the scene from the same place: nothing is shifted between them",
        "give two different cameras or files, and keep the cameras apart; if they are, everything is too far away",
    ),
}

_OF_BOTH: Final = (
    Arrangement.SWAPPED,
    Arrangement.BOTH_TURNED,
    Arrangement.BOTH_MIRRORED,
    Arrangement.BOTH_TURNED_BY_QUARTER,
)
"""Mistakes that leave the features of both images in the same direction; the first wins a tie."""


def arrangement_doubts(evidence: Evidence, source: ImageSource) -> tuple[Diagnostic, ...]:
    """Name the mistake that clearly more features agree with than with the right arrangement; empty if none.

    Args:
        evidence: of the pair, with supports.
        source: where the images come from: remedies name the options of a camera's address, or those for files.
    """
    support = {item.arrangement: item.features for item in evidence.supports}
    found = _arranged(support)
    if found is None:
        return ()
    concern = _NAMED[found]
    if source is ImageSource.FILES:
        concern = replace(concern, remedy=FILE_REMEDIES[found].words)
    if found is Arrangement.TURNED_BY_QUARTER:
        concern = replace(concern, evidence=Misplaced(found, max(item.quarters for item in evidence.supports)))
    return (concern,)


def _arranged(support: dict[Arrangement, int]) -> Arrangement | None:
    """Return how the images lie if clearly not as they should."""
    related = max(support[Arrangement.RIGHT], support[Arrangement.TILTED])
    if support[Arrangement.SAME_PLACE] >= max(LEAST_SUPPORT, _SAME_SHARE * related):
        return Arrangement.SAME_PLACE
    # These turn the features themselves: not even tilted rows explain them.
    turned = (Arrangement.TURNED, Arrangement.TURNED_BY_QUARTER, Arrangement.MIRRORED)
    best = max(turned, key=lambda arrangement: support[arrangement])
    if support[best] >= max(LEAST_SUPPORT, _MARGIN * related):
        return best
    best = max(_OF_BOTH, key=lambda arrangement: support[arrangement])
    if support[best] < max(LEAST_SUPPORT, _MARGIN * support[Arrangement.RIGHT]):
        return None
    # Without a rig the three cannot be told apart; the remedy of exchanged ones names them all.
    return Arrangement.SWAPPED if support[best] < _CLEARLY_MORE * support[Arrangement.SWAPPED] else best


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

_BOTH_WRONG: Final = frozenset({Arrangement.BOTH_TURNED, Arrangement.BOTH_TURNED_BY_QUARTER, Arrangement.BOTH_MIRRORED})


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
    concern: Diagnostic, present: Sequence[Orientation], source: ImageSource = ImageSource.CAMERAS
) -> Diagnostic:
    """Return a concern whose remedy names the options to be given in the end, if it is mended by turning or mirroring."""
    seen = concern.evidence
    if not isinstance(seen, Misplaced) or seen.arrangement not in _TURNS:
        return concern
    is_plain = all(orientation == UPRIGHT for orientation in present)
    if is_plain and (source is ImageSource.FILES or not seen.quarters):
        return concern  # the options are known by their kind alone
    both = seen.arrangement in _BOTH_WRONG
    turns = _TURNS[seen.arrangement]
    choices = [
        _words(
            side,
            present[side],
            [_further(present[side], turn) for turn in _of_side(turns, seen.quarters, side)],
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
