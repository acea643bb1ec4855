"""What a pair's images say about its depth. No behaviour, no I/O."""

from dataclasses import dataclass
from enum import Enum


class Arrangement(Enum):
    """How the two images of a pair may lie to each other. All but the first are mistakes."""

    RIGHT = "right"
    TILTED = "tilted"
    SWAPPED = "swapped"
    TURNED = "turned"
    TURNED_BY_QUARTER = "turned_by_quarter"
    BOTH_TURNED = "both_turned"
    BOTH_MIRRORED = "both_mirrored"
    BOTH_TURNED_BY_QUARTER = "both_turned_by_quarter"
    MIRRORED = "mirrored"
    SAME_PLACE = "same_place"


@dataclass(frozen=True, slots=True)
class Support:
    """How many matched features agree with one arrangement of the two images.

    Attributes:
        arrangement: the arrangement.
        features: features whose positions and directions fit it.
        quarters: for `turned_by_quarter`: 1 or 3, by how many quarters the right image is turned clockwise against the
            left one; else 0.
    """

    arrangement: Arrangement
    features: int
    quarters: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Exposure:
    """What one camera's image holds, at the size it is judged at; NaN = not measured.

    Attributes:
        mean_level: mean grey level, 0 to 255.
        bright_level: level that 2 % of the image exceed.
        structure: 90th percentile of the contrast after noise was averaged away, grey levels.
        blur_px: blur of the sharpest edges, px of an image at most 640 px wide; NaN with too few edges.
        features: number of features found, at most a few hundred.
    """

    mean_level: float
    bright_level: float
    structure: float
    blur_px: float
    features: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class OffMiddle:
    """A principal point that lies far from its image's middle.

    Attributes:
        cx_px: its x, px.
        cy_px: its y, px.
        width_px: width of the image, px.
        height_px: height of the image, px.
    """

    cx_px: float
    cy_px: float
    width_px: int
    height_px: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Evidence:
    """What a pair's images say about its depth; NaN = not measured.

    Attributes:
        left: the left image.
        right: the right image.
        density: share of the left image's pixels that have a disparity.
        consistency: share of sampled disparities that are confirmed from right to left.
        vertical_px: median distance of matched features from their rows, px.
        vertical_offset_px: how far too low the right image lies, px.
        supports: how many features agree with each arrangement; empty without a core.
        disparity_px: the middle one of the disparities between the limits of depth, px.
        behind_share: share of the disparities at infinity and behind it, where no scene lies; 0 if infinity is no larger disparity.
        scattered_share: share of the disparities that lie in pieces too small for a surface.
        beyond_share: share of the image, as far as features tell, that is nearer than was searched.
        enough_disparities: a search that reaches all but a few features, px; 0: not known.
        enough_from_m: the same as a depth, m.
        ambiguous_share: share of sampled patches that fit another place of the search as well as the best one.
        skew_px: how unevenly rows are off over the image once the common offset is taken away, px of the matched images.
        from_rig: whether a rig has rectified the pair.
        is_cropped: whether the pair was taken for the middle of the images that the rig was calibrated with.
        off_middle: the given principal point, if it lies far from the middle; None: it does not, or a rig brought its own.
        matched_scale: size of the images that were matched, as a share of the full size in whose px all this is.
    """

    left: Exposure
    right: Exposure
    density: float = float("nan")
    consistency: float = float("nan")
    vertical_px: float = float("nan")
    vertical_offset_px: float = float("nan")
    supports: tuple[Support, ...] = ()
    disparity_px: float = float("nan")
    behind_share: float = 0.0
    scattered_share: float = float("nan")
    beyond_share: float = float("nan")
    enough_disparities: int = 0
    enough_from_m: float = float("nan")
    ambiguous_share: float = float("nan")
    skew_px: float = float("nan")
    from_rig: bool = True
    is_cropped: bool = False
    off_middle: OffMiddle | None = None
    matched_scale: float = 1.0
