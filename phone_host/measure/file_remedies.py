"""What to do about exchanged, turned and mirrored images that are files: the options of `stereo`. Pure."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Final

from phone_host.model import Arrangement


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
    """Return the options that may carry out a remedy for files; empty if there are none.

    Args:
        remedy: the words of one.
    """
    return next((known.tries for known in FILE_REMEDIES.values() if known.words == remedy), ())
