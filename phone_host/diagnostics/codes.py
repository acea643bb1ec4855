"""The table of codes: every reason not to trust the depth, and how grave it is. Pure."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Final

from common.diagnostic import Diagnostic, Severity
from phone_host.model import Arrangement


class Code(StrEnum):
    """Why not to trust the depth or where it is, as report.json names it."""

    TIME_SKEW = "time_skew"
    CLOCK = "clock"
    STAMPS = "stamps"
    AGE = "age"
    CLOCK_STEPPED = "clock_stepped"
    DISBELIEVED = "disbelieved"
    SPOILED_IMAGES = "spoiled_images"
    CAMERA_SETTINGS = "camera_settings"
    IMAGE_NUMBERS = "image_numbers"
    IMAGES_APART = "images_apart"
    REJECTED_RIG = "rejected_rig"
    CROPPED_RIG = "cropped_rig"
    GEOMETRY = "geometry"
    RIG_MOVED = "rig_moved"
    FOCUS_CHANGED = "focus_changed"
    LATE_IMAGES = "late_images"
    BOARD_GONE = "board_gone"
    CAMERA_GONE = "camera_gone"
    NO_WHOLE_IMAGE = "no_whole_image"
    SWAPPED = "swapped"
    TURNED = "turned"
    TURNED_BY_QUARTER = "turned_by_quarter"
    MIRRORED = "mirrored"
    SAME_IMAGE = "same_image"
    OTHER_SCENE = "other_scene"
    COVERED = "covered"
    DARK = "dark"
    UNFOCUSED = "unfocused"
    NO_TEXTURE = "no_texture"
    LOW_DENSITY = "low_density"
    LOW_CONSISTENCY = "low_consistency"
    VERTICAL_ERROR = "vertical_error"
    SEARCH_TOO_SHORT = "search_too_short"
    AMBIGUOUS = "ambiguous"
    NO_DEPTH = "no_depth"


BLOCKING: Final = frozenset(
    {
        Code.SWAPPED,
        Code.TURNED,
        Code.TURNED_BY_QUARTER,
        Code.MIRRORED,
        Code.SAME_IMAGE,
        Code.OTHER_SCENE,
        Code.COVERED,
        Code.IMAGES_APART,
        Code.NO_DEPTH,
        Code.NO_WHOLE_IMAGE,
    }
)
"""Depth cannot be right as long as one of these stands: a run that ends with it fails."""

_SPARING: Final = frozenset({Code.AGE, Code.SPOILED_IMAGES})
"""These do not say that depth is wrong: results are old, or images were not used."""


@dataclass(frozen=True, slots=True)
class Misplaced:
    """Evidence of images that lie to each other as they should not.

    Attributes:
        arrangement: how they lie.
        quarters: by how many quarters the right image is turned clockwise against the left one; 0: not known.
    """

    arrangement: Arrangement
    quarters: int = 0


def diagnose(
    code: Code, message: str, remedy: str, *, severity: Severity | None = None, evidence: Misplaced | int | None = None
) -> Diagnostic:
    """Make a diagnostic of a code.

    Args:
        code: the kind of reason.
        message: the reason in words, with figures.
        remedy: what helps.
        severity: None: that of the code. Figures may leave no hope, though the kind of reason alone would.
        evidence: what rules need of the reason.
    """
    usual = Severity.FAIL if code in BLOCKING else Severity.NOTE if code in _SPARING else Severity.WARN
    return Diagnostic(message, remedy, severity or usual, code, evidence)


def gravest_first(found: Sequence[Diagnostic]) -> tuple[Diagnostic, ...]:
    """Sort doubts: blocking ones first, then the others that are certain, else in their order."""
    return tuple(sorted(found, key=lambda one: (one.code not in BLOCKING, not one.is_failure)))


def as_remark(doubt: Diagnostic) -> Diagnostic:
    """Return a doubt as it is told beside a result. That one pair of several has no depth fails nothing: only if none has any."""
    is_failure = doubt.is_failure and doubt.code != Code.NO_DEPTH
    return replace(doubt, severity=Severity.FAIL if is_failure else Severity.WARN)


REJECTED_RIG: Final = diagnose(
    Code.REJECTED_RIG,
    "the calibration itself was rejected: it does not fit its own images (verdict reject)",
    "calibrate again; its report says what was wrong with the images",
)
"""For a rig that is used because the user insists."""
