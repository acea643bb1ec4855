"""Judges from the evidence in the images whether depth can be right, for one pair or over a run. Pure.

`phone_host.stereo.evidence` measures the evidence. Where the images hold too little, nothing is named. `arrangement_doubts`,
`geometry_doubts`, `light_doubts` and `search_doubts` know one kind each. Figures behind the limits: `tests/bench/bench_trust.py` and decision 0029.
"""

from dataclasses import replace
from typing import Final

from phone_host.measure.arrangement_doubts import LEAST_SUPPORT, arrangement_doubts
from phone_host.measure.file_remedies import ImageSource
from phone_host.measure.geometry_doubts import behind, off_middle
from phone_host.measure.image_trust import ImageFigures, median_figures
from phone_host.measure.light_doubts import covered_doubts, dark_doubts, is_plain, unfocused_doubts
from phone_host.measure.search_doubts import ambiguous, is_pattern, too_short
from phone_host.measure.trust import Concern, Doubt, gravest_first
from phone_host.model import Arrangement, Evidence

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


def image_doubts(evidence: Evidence, source: ImageSource = ImageSource.CAMERAS) -> tuple[Concern, ...]:
    """Say what the images of one pair make doubtful, gravest first; empty if nothing.

    Args:
        evidence: of the pair; without supports (an unrectified pair) only brightness is judged.
        source: where the images come from: remedies name the options of a camera's address, or those for files.
    """
    foreign, seen = off_middle(evidence), _seen(evidence, source)
    if foreign:  # doffs is then that of other images, too: one doubt of a kind is enough
        seen = (*foreign, *(item for item in seen if item.doubt is not Doubt.GEOMETRY))
    return gravest_first(seen)


def _seen(evidence: Evidence, source: ImageSource) -> tuple[Concern, ...]:
    """Say what the images themselves make doubtful."""
    support = {item.arrangement: item.features for item in evidence.supports}
    sees = max(support.values(), default=0) >= LEAST_SUPPORT
    covered = () if sees else covered_doubts(evidence.left, evidence.right)
    if covered:
        return covered
    dark = dark_doubts(evidence.left, evidence.right)
    if not support:
        return dark
    light = (*dark, *unfocused_doubts(evidence.left, evidence.right))
    if not sees and is_plain(evidence.left, evidence.right) and not evidence.density >= _STRANGERS_DENSITY:
        return light or (_NO_TEXTURE,)  # features of noise agree with nothing: that is no other scene
    mistake = arrangement_doubts(evidence, source)
    if is_pattern(evidence) and not any(item.doubt is Doubt.SAME_IMAGE for item in mistake):
        return *light, *ambiguous(evidence)  # features of a pattern match any repeat: mistakes they show are chance
    if not mistake and not light and _are_strangers(evidence, support):
        mistake = (_OTHER_SCENE,)
    return (*mistake, *light) if mistake else (*light, *_figures(evidence, support))


_NO_TEXTURE: Final = Concern(
    Doubt.NO_TEXTURE,
    "both images show hardly any texture, as of a bare wall: too little for depth, and to judge whether they belong together",
    "put patterned things into the scene, or turn both cameras towards some",
)


_OTHER_SCENE: Final = Concern(
    Doubt.OTHER_SCENE,
    "the two images show different scenes: hardly anything in one is found in the other",
    "turn both cameras towards the same scene, and check that LEFT and RIGHT belong together",
)


_CROPPED: Final = Concern(
    Doubt.CROPPED_RIG,
    "an image is smaller than in the calibration and has another aspect ratio: it is treated as the centre of that one",
    "use a size with the calibration's aspect ratio; or calibrate at this size, if the camera may crop elsewhere or stretch",
)


def _are_strangers(evidence: Evidence, support: dict[Arrangement, int]) -> bool:
    fewest = min(evidence.left.features, evidence.right.features)
    most = max(_STRANGERS, _STRANGERS_SHARE * fewest)
    return fewest >= _ENOUGH_FEATURES and max(support.values()) <= most and not evidence.density >= _STRANGERS_DENSITY


def _figures(evidence: Evidence, support: dict[Arrangement, int]) -> tuple[Concern, ...]:
    related, right = support[Arrangement.TILTED], support[Arrangement.RIGHT]
    is_tilted = related >= 2 * LEAST_SUPPORT and right < _TILTED_SHARE * related
    plain = figure_doubts(median_figures((evidence,)), is_tilted=is_tilted)
    rows = tuple(item for item in plain if item.doubt is Doubt.VERTICAL_ERROR) or _skewed(evidence)
    if not evidence.from_rig:
        rows = tuple(replace(item, remedy=_NOT_RECTIFIED) for item in rows)
    short, unsure = too_short(evidence), ambiguous(evidence)
    sparse = (item for item in plain if item.doubt is not Doubt.VERTICAL_ERROR)
    cropped = (_CROPPED,) if evidence.is_cropped else ()
    if evidence.is_cropped:
        rows = tuple(replace(item, remedy=_CROPPED.remedy) for item in rows)
    return (*behind(evidence), *rows, *short, *unsure, *(() if short or unsure else sparse), *cropped)


def _skewed(evidence: Evidence) -> tuple[Concern, ...]:
    if not evidence.skew_px > _MOST_SKEW_PX:
        return ()
    off_px = _EDGE_TO_EDGE * evidence.skew_px
    sentence = f"the rows of the two images do not agree (one edge is off against the other by {off_px:.1f} px)"
    return (Concern(Doubt.VERTICAL_ERROR, sentence, _MOVED),)


def _percent(share: float) -> str:
    return f"{share:.0%}" if share >= 0.01 or not share else "less than 1%"


def figure_doubts(figures: ImageFigures, *, is_tilted: bool = False) -> tuple[Concern, ...]:
    """Say which figures are not those of right depth; empty if all may be.

    Args:
        figures: of one judgement or of some that agree.
        is_tilted: whether most features share rows only if those are tilted or bent.
    """
    found = []
    is_off = figures.vertical_px * figures.matched_scale > _MOST_VERTICAL_PX
    if is_tilted or is_off:
        found.append(
            Concern(
                Doubt.VERTICAL_ERROR,
                "the rows of the two images do not agree" + (f" by {figures.vertical_px:.1f} px" if is_off else ""),
                _MOVED,
                is_severe=figures.vertical_px * figures.matched_scale > _LOST_VERTICAL_PX
                and figures.density < _LOST_DENSITY,
            )
        )
    if figures.density < _LEAST_DENSITY:
        found.append(
            Concern(
                Doubt.LOW_DENSITY,
                f"only {_percent(figures.density)} of the pixels have depth",
                "plain walls and tables give none: light the scene well and put patterned things into it; else check that --calibration or --rectified fits the images, and that nothing is nearer than --near",
            )
        )
    elif figures.consistency < _LEAST_CONSISTENCY:
        found.append(
            Concern(
                Doubt.LOW_CONSISTENCY,
                f"only {figures.consistency:.0%} of the depth is confirmed from right to left",
                "light the scene well, and give it texture; plain and repeated surfaces mislead the matcher",
            )
        )
    return tuple(found)
