"""What kept pairs from being processed, in words: an error that ended a run, a board's refusal, a pair's fault. Pure."""

from collections import Counter
from dataclasses import dataclass
from enum import Enum
from typing import Final

from common.errors import TandemError
from common.plain_text import printable
from phone_host.model import Arrangement

_MOST_KINDS: Final = 16
"""Reasons may name figures of a single image; beyond this many different ones they are counted together."""

_OTHERS: Final = "other reasons"


@dataclass(frozen=True, slots=True)
class Trouble:
    """One reason.

    Attributes:
        problem: what is wrong, in words.
        remedy: what to do about it.
    """

    problem: str
    remedy: str

    @property
    def sentences(self) -> str:
        """Problem and remedy as they follow a colon."""
        return f"{self.problem}. Remedy: {self.remedy}."


def trouble_of(error: BaseException) -> Trouble:
    """Return an error in words. One that is none of ours is a mistake of the program, and named by its kind.

    Args:
        error: what ended the run, or a pair.
    """
    if isinstance(error, TandemError):
        return Trouble(printable(error.problem), printable(error.remedy))
    told = printable(f"{type(error).__name__}: {error}")
    return Trouble(f"the program itself failed ({told})", "run it again with --debug and report what it prints")


class Troubles:
    """Counts reasons in bounded memory."""

    def __init__(self) -> None:
        self._counts: Counter[Trouble] = Counter()

    def add(self, error: Exception) -> None:
        """Count one more."""
        trouble = trouble_of(error)
        if trouble not in self._counts and len(self._counts) >= _MOST_KINDS:
            trouble = Trouble(_OTHERS, "see the log")
        self._counts[trouble] += 1

    def counts(self) -> tuple[tuple[Trouble, int], ...]:
        """Return each reason with its number, the most frequent first."""
        return tuple(self._counts.most_common())


class Doubt(Enum):
    """Why not to trust the depth or where it is."""

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

    @property
    def blocks(self) -> bool:
        """Whether the depth cannot be right as long as this doubt stands: a run that ends with it fails."""
        return self in _BLOCKING


_BLOCKING: Final = frozenset(
    {
        Doubt.SWAPPED,
        Doubt.TURNED,
        Doubt.TURNED_BY_QUARTER,
        Doubt.MIRRORED,
        Doubt.SAME_IMAGE,
        Doubt.OTHER_SCENE,
        Doubt.COVERED,
        Doubt.IMAGES_APART,
        Doubt.NO_DEPTH,
        Doubt.NO_WHOLE_IMAGE,
    }
)


@dataclass(frozen=True, slots=True)
class Concern:
    """One reason not to trust the depth.

    Attributes:
        doubt: the kind of reason.
        sentence: the reason in words, with figures.
        remedy: what helps.
        is_severe: whether the figures leave no hope, though the kind of reason alone would.
        arrangement: how the images lie to each other, if that is the reason.
        quarters: by how many quarters the right image is turned clockwise against the left one; 0: not known.
        spares_depth: whether it does not say that depth is wrong: results are old, or images were not used.
    """

    doubt: Doubt
    sentence: str
    remedy: str
    is_severe: bool = False
    arrangement: Arrangement | None = None
    quarters: int = 0
    spares_depth: bool = False

    @property
    def is_certain(self) -> bool:
        """Whether depth cannot be right."""
        return self.doubt.blocks or self.is_severe


def gravest_first(found: tuple[Concern, ...]) -> tuple[Concern, ...]:
    """Sort concerns: blocking ones first, then the others that are certain, else in their order."""
    return tuple(sorted(found, key=lambda concern: (not concern.doubt.blocks, not concern.is_certain)))


REJECTED_RIG: Final = Concern(
    Doubt.REJECTED_RIG,
    "the calibration itself was rejected: it does not fit its own images (verdict reject)",
    "calibrate again; its report says what was wrong with the images",
)
"""For a rig that is used because the user insists."""
