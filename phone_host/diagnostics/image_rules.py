"""Judges from the evidence in the images whether depth can be right, for one pair or over a run. Pure.

`phone_host.stereo.evidence` measures the evidence. Where the images hold too little, nothing is named. `arrangement` knows images
that lie to each other as they should not. Figures behind the limits: `tests/bench/bench_trust.py` and decision 0029.
"""

import math
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from common.diagnostic import Diagnostic, Severity
from phone_host.diagnostics.arrangement import LEAST_SUPPORT, ImageSource, arrangement_doubts
from phone_host.diagnostics.codes import Code, diagnose, gravest_first
from phone_host.model import Arrangement, Evidence, Exposure


@dataclass(frozen=True, slots=True, kw_only=True)
class ImageFigures:
    """Medians over some judgements; NaN = not measured.

    Attributes:
        density: share of the left image's pixels that have a disparity.
        consistency: share of sampled disparities that are confirmed from right to left.
        vertical_px: distance of features from their rows, px.
        vertical_offset_px: how far too low the right image lies, px.
        disparity_px: the middle one of the disparities between the limits of depth, px.
        scattered_share: share of the disparities that lie in pieces too small for a surface.
        matched_scale: size of the images that were matched, as a share of the full size in whose px all this is.
    """

    density: float = math.nan
    consistency: float = math.nan
    vertical_px: float = math.nan
    vertical_offset_px: float = math.nan
    disparity_px: float = math.nan
    scattered_share: float = math.nan
    matched_scale: float = 1.0


def median_figures(found: Sequence[Evidence]) -> ImageFigures:
    """Return the medians of what was measured."""

    def median(name: str) -> float:
        values = [value for value in (getattr(item, name) for item in found) if not math.isnan(value)]
        return float(np.median(values)) if values else math.nan

    return ImageFigures(
        density=median("density"),
        consistency=median("consistency"),
        vertical_px=median("vertical_px"),
        vertical_offset_px=median("vertical_offset_px"),
        disparity_px=median("disparity_px"),
        scattered_share=median("scattered_share"),
        matched_scale=median("matched_scale") if found else 1.0,
    )


_BEHIND_SHARE: Final = 0.05
"""False matches put fewer points there; a sky may put more, where doffs is large and negative."""

_REMEDY: Final = "give the calib.txt that was published with these images"


def _off_middle(evidence: Evidence) -> Iterator[Diagnostic]:
    """Say that the principal point lies where that of other images lies."""
    seen = evidence.off_middle
    if seen is not None:
        yield diagnose(
            Code.GEOMETRY,
            f"calib.txt or --center may belong to other images: the principal point {seen.cx_px:.0f},{seen.cy_px:.0f}"
            f" lies far from the middle of {seen.width_px}x{seen.height_px} px, and metres are wrong then",
            _REMEDY,
        )


def _behind(evidence: Evidence) -> Iterator[Diagnostic]:
    if evidence.behind_share > _BEHIND_SHARE:
        yield diagnose(
            Code.GEOMETRY,
            f"{evidence.behind_share:.0%} of the points would lie at infinity or behind it: doffs may be that of other images",
            f"{_REMEDY}, or --doffs: cx of the right camera minus cx of the left one, px",
        )


_FLAT: Final = 2.0

_FLAT_RATIO: Final = 5.0
"""An image of less structure, grey levels, shows nothing if it is dark or the other one shows five times as much."""

_DARK_MEAN: Final = 25.0

_DARK_BRIGHT: Final = 50.0
"""An image is dark if its mean and its bright parts are below these levels: a tenth of what a camera's exposure aims at."""

_PLAIN: Final = 5.0
"""Structure, grey levels, below which an image shows nothing but a plain surface. Bare walls in even and uneven light, with noise and
JPEG, have up to 2.8; of 90 given pairs and 60 rendered rooms the plainest has 12.6 in its richer image."""

_BLURRED_PX: Final = 2.0

_BLURRED_RATIO: Final = 1.8

_BLURRED_BESIDE_PX: Final = 1.5
"""Sharp images measure 0.8 to 1.3 px at up to 640 px of width, and 1.8 px if nothing in the scene has a sharp edge."""


def _where(left: Exposure, right: Exposure, is_so: Callable[[Exposure, Exposure], bool]) -> dict[str, Exposure]:
    """Return the cameras for whose image, beside the other one, something holds."""
    both = {"left": (left, right), "right": (right, left)}
    return {name: here for name, (here, there) in both.items() if is_so(here, there)}


def _cameras(names: Collection[str]) -> str:
    return "both cameras see" if len(names) == 2 else f"the {next(iter(names))} camera sees"


def _is_dark(exposure: Exposure) -> bool:
    return exposure.mean_level < _DARK_MEAN and exposure.bright_level < _DARK_BRIGHT


def _is_blind(here: Exposure, there: Exposure) -> bool:
    stands_out = there.structure > max(_FLAT_RATIO * here.structure, _FLAT)
    return here.structure < _FLAT and (_is_dark(here) or stands_out)


def _is_blurred(here: Exposure, there: Exposure) -> bool:
    beside = here.blur_px > _BLURRED_BESIDE_PX and here.blur_px > _BLURRED_RATIO * there.blur_px
    return here.blur_px > _BLURRED_PX or beside


def _covered(left: Exposure, right: Exposure) -> Iterator[Diagnostic]:
    if blind := _where(left, right, _is_blind):
        camera_sees = _cameras(blind)
        yield diagnose(
            Code.COVERED, f"{camera_sees} no scene at all", "take off the lens cap, the shutter or the finger"
        )


def _dark(left: Exposure, right: Exposure) -> Iterator[Diagnostic]:
    if dark := _where(left, right, lambda here, _: _is_dark(here)):
        level = min(left.mean_level, right.mean_level)
        camera_sees = _cameras(dark)
        yield diagnose(
            Code.DARK,
            f"{camera_sees} almost nothing because it is too dark (mean level {level:.0f} of 255)",
            "switch on a light, or give the camera a longer exposure",
        )


def _unfocused(left: Exposure, right: Exposure) -> Iterator[Diagnostic]:
    if blurred := _where(left, right, _is_blurred):
        width = max(each.blur_px for each in blurred.values())
        camera_sees = _cameras(blurred)
        yield diagnose(
            Code.UNFOCUSED,
            f"{camera_sees} blurred edges ({width:.1f} px)",
            "clean and focus the lens, and switch its autofocus off before you calibrate",
        )


def _is_plain(left: Exposure, right: Exposure) -> bool:
    """Tell whether both images show nothing but a plain surface: what is found in them is noise."""
    return max(left.structure, right.structure) < _PLAIN


_BEYOND_SHARE: Final = 0.05

_MOSTLY_BEYOND: Final = 0.5
"""Wrong matches put 1 % of the features beyond a search that is wide enough."""

_AMBIGUOUS_SHARE: Final = 0.75
"""Good pairs of scenes measure 0.2 at most, of chessboards before a wall 0.61; regular stripes and checks 0.9 and more."""

_PATTERN_SHARE: Final = 0.8
"""Given scenes with any mistake measure 0.41 at most, where depth was found at all."""

_HALF: Final = 0.5

_FEW: Final = 24
"""A fence before a wall: half of the patches repeat, and fewer features agree with anything. Chessboards have 80 and more."""


def _is_pattern(evidence: Evidence) -> bool:
    """Tell whether so much of what the images show repeats that matched features prove nothing."""
    most = max((item.features for item in evidence.supports), default=0)
    return evidence.ambiguous_share > _PATTERN_SHARE or (evidence.ambiguous_share > _HALF and most < _FEW)


def _too_short(evidence: Evidence) -> Iterator[Diagnostic]:
    """Say how much of the scene is nearer than was searched."""
    share = evidence.beyond_share
    if not share > _BEYOND_SHARE:
        return
    remedy = f"give --disparities {evidence.enough_disparities}"
    if not math.isnan(evidence.enough_from_m):
        remedy = f"give --near {_rounded_down(evidence.enough_from_m)}m without --disparities, or --disparities {evidence.enough_disparities}"
    yield diagnose(
        Code.SEARCH_TOO_SHORT,
        f"{share:.0%} of the scene is nearer than was searched, and what is nearer gets a wrong depth",
        remedy,
        severity=Severity.FAIL if share > _MOSTLY_BEYOND else None,
    )


def _rounded_down(depth_m: float) -> str:
    """Write a depth with two digits, not farther than it is."""
    step = 10.0 ** (math.floor(math.log10(depth_m)) - 1)
    return f"{math.floor(depth_m / step + 1e-9) * step:.6g}"


def _ambiguous(evidence: Evidence) -> Iterator[Diagnostic]:
    if evidence.ambiguous_share > _AMBIGUOUS_SHARE or _is_pattern(evidence):
        yield diagnose(
            Code.AMBIGUOUS,
            f"the pattern repeats: {evidence.ambiguous_share:.0%} of the places looked at fit elsewhere as well, and depth may be off by whole repeats",
            "show a scene with irregular texture, or put irregular things before the pattern",
        )


_STRANGERS: Final = 6

_STRANGERS_SHARE: Final = 0.03

_ENOUGH_FEATURES: Final = 100

_STRANGERS_DENSITY: Final = 0.3
"""Two images show unlike scenes if both have plenty of features, not more than these agree, and matching finds little."""

_LEAST_DENSITY: Final = 0.15
"""Chessboards before white walls reach 0.23, the hardest textured pairs 0.33; swapped ones mostly stay below 0.1."""

_LEAST_CONSISTENCY: Final = 0.25
"""Good pairs reach 0.33 and more, the worst of them before white walls."""

_MOST_VERTICAL_PX: Final = 2.0
"""Matchers correct up to 2 px of common offset; beyond it they lose points. In px of the images that they match."""

_LOST_VERTICAL_PX: Final = 5.0

_LOST_DENSITY: Final = 0.4
"""With rows off by more and less depth than this, depth is wrong: of 13 given pairs whose right image was lowered by 5 px,
SGBM found 3 to 22 % of the former depth again, except on two of 463 px of width and less, which kept a density of half and more."""

_MOST_SKEW_PX: Final = 0.9
"""Given pairs measure 0.78 px (KITTI) and less; a camera turned aside by 1 degree 1.04 px and more on 800 to 1280 px of width."""

_MOVED: Final = "check that both images were taken at the same moment; otherwise the calibration does not fit these cameras: calibrate the rig again"

_NOT_RECTIFIED: Final = "these images are not rectified: calibrate your cameras and give --calibration rig.yaml"

_EDGE_TO_EDGE: Final = 3.5
"""The full height of a ramp relative to its root mean square."""

_TILTED_SHARE: Final = 0.3
"""If fewer of the related features than this share their rows, the rectification does not fit the cameras."""


def image_doubts(evidence: Evidence, source: ImageSource = ImageSource.CAMERAS) -> tuple[Diagnostic, ...]:
    """Say what the images of one pair make doubtful, gravest first; empty if nothing.

    Args:
        evidence: of the pair; without supports (an unrectified pair) only brightness is judged.
        source: where the images come from: remedies name the options of a camera's address, or those for files.
    """
    foreign, seen = tuple(_off_middle(evidence)), _seen(evidence, source)
    if foreign:  # doffs is then that of other images, too: one doubt of a kind is enough
        seen = (*foreign, *(item for item in seen if item.code != Code.GEOMETRY))
    return gravest_first(seen)


def _seen(evidence: Evidence, source: ImageSource) -> tuple[Diagnostic, ...]:
    """Say what the images themselves make doubtful."""
    support = {item.arrangement: item.features for item in evidence.supports}
    sees = max(support.values(), default=0) >= LEAST_SUPPORT
    exposures = evidence.left, evidence.right
    if not sees and (covered := tuple(_covered(*exposures))):
        return covered
    dark = tuple(_dark(*exposures))
    if not support:
        return dark
    light = (*dark, *_unfocused(*exposures))
    if not sees and _is_plain(*exposures) and not evidence.density >= _STRANGERS_DENSITY:
        return light or (_NO_TEXTURE,)  # features of noise agree with nothing: that is no other scene
    mistake = arrangement_doubts(evidence, source)
    if _is_pattern(evidence) and not any(item.code == Code.SAME_IMAGE for item in mistake):
        return *light, *_ambiguous(evidence)  # features of a pattern match any repeat: mistakes they show are chance
    if not mistake and not light and _are_strangers(evidence, support):
        mistake = (_OTHER_SCENE,)
    return (*mistake, *light) if mistake else (*light, *_figures(evidence, support))


_NO_TEXTURE: Final = diagnose(
    Code.NO_TEXTURE,
    "both images show hardly any texture, as of a bare wall: too little for depth, and to judge whether they belong together",
    "put patterned things into the scene, or turn both cameras towards some",
)

_OTHER_SCENE: Final = diagnose(
    Code.OTHER_SCENE,
    "the two images show different scenes: hardly anything in one is found in the other",
    "turn both cameras towards the same scene, and check that LEFT and RIGHT belong together",
)

_CROPPED: Final = diagnose(
    Code.CROPPED_RIG,
    "an image is smaller than in the calibration and has another aspect ratio: it is treated as the centre of that one",
    "use a size with the calibration's aspect ratio; or calibrate at this size, if the camera may crop elsewhere or stretch",
)


def _are_strangers(evidence: Evidence, support: dict[Arrangement, int]) -> bool:
    fewest = min(evidence.left.features, evidence.right.features)
    most = max(_STRANGERS, _STRANGERS_SHARE * fewest)
    return fewest >= _ENOUGH_FEATURES and max(support.values()) <= most and not evidence.density >= _STRANGERS_DENSITY


def _figures(evidence: Evidence, support: dict[Arrangement, int]) -> tuple[Diagnostic, ...]:
    related, right = support[Arrangement.TILTED], support[Arrangement.RIGHT]
    is_tilted = related >= 2 * LEAST_SUPPORT and right < _TILTED_SHARE * related
    plain = figure_doubts(median_figures((evidence,)), is_tilted=is_tilted)
    rows = [item for item in plain if item.code == Code.VERTICAL_ERROR] or list(_skewed(evidence))
    if evidence.is_cropped or not evidence.from_rig:
        mended = _CROPPED.remedy if evidence.is_cropped else _NOT_RECTIFIED
        rows = [replace(item, remedy=mended) for item in rows]
    unsure = (*_too_short(evidence), *_ambiguous(evidence))
    sparse = () if unsure else (item for item in plain if item.code != Code.VERTICAL_ERROR)
    return (*_behind(evidence), *rows, *unsure, *sparse, *((_CROPPED,) if evidence.is_cropped else ()))


def _skewed(evidence: Evidence) -> Iterator[Diagnostic]:
    if evidence.skew_px > _MOST_SKEW_PX:
        off_px = _EDGE_TO_EDGE * evidence.skew_px
        sentence = f"the rows of the two images do not agree (one edge is off against the other by {off_px:.1f} px)"
        yield diagnose(Code.VERTICAL_ERROR, sentence, _MOVED)


def _percent(share: float) -> str:
    return f"{share:.0%}" if share >= 0.01 or not share else "less than 1%"


def figure_doubts(figures: ImageFigures, *, is_tilted: bool = False) -> tuple[Diagnostic, ...]:
    """Say which figures are not those of right depth; empty if all may be.

    Args:
        figures: of one judgement or of some that agree.
        is_tilted: whether most features share rows only if those are tilted or bent.
    """
    found = []
    is_off = figures.vertical_px * figures.matched_scale > _MOST_VERTICAL_PX
    is_lost = figures.vertical_px * figures.matched_scale > _LOST_VERTICAL_PX and figures.density < _LOST_DENSITY
    if is_tilted or is_off:
        found.append(
            diagnose(
                Code.VERTICAL_ERROR,
                "the rows of the two images do not agree" + (f" by {figures.vertical_px:.1f} px" if is_off else ""),
                _MOVED,
                severity=Severity.FAIL if is_lost else None,
            )
        )
    if figures.density < _LEAST_DENSITY:
        found.append(
            diagnose(
                Code.LOW_DENSITY,
                f"only {_percent(figures.density)} of the pixels have depth",
                "plain walls and tables give none: light the scene well and put patterned things into it; else check that --calibration or --rectified fits the images, and that nothing is nearer than --near",
            )
        )
    elif figures.consistency < _LEAST_CONSISTENCY:
        found.append(
            diagnose(
                Code.LOW_CONSISTENCY,
                f"only {figures.consistency:.0%} of the depth is confirmed from right to left",
                "light the scene well, and give it texture; plain and repeated surfaces mislead the matcher",
            )
        )
    return tuple(found)
