"""Judges from the evidence in the images whether depth can be right, for one pair or over a run. Pure.

`phone_host.stereo.evidence` measures the evidence. A mistake is named only if clearly more features agree with it than
with the right arrangement; where the images hold too little, nothing is named. Figures behind the limits:
`tests/bench/bench_trust.py` and decision 0029.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from phone_host.measure.doubt_history import Episode
from phone_host.measure.file_remedies import FILE_REMEDIES, ImageSource
from phone_host.measure.search_doubts import ambiguous, is_pattern, too_short
from phone_host.measure.trust import Concern, Doubt
from phone_host.model import Arrangement, Evidence, Exposure, StereoGeometry

_LEAST_SUPPORT: Final = 12
"""Features that must agree with a mistake before it is named. Pairs of unlike scenes reach 3 by chance, good ones 50 and more."""

_MARGIN: Final = 2.0
"""How many times more features must agree with a mistake than with the right arrangement. A chessboard mirrored looks
like itself and reaches a third."""

_CLEARLY_MORE: Final = 1.3
"""How many times more features tell cameras on their heads, or mirrored ones, from exchanged ones behind a rig."""

_STRANGERS: Final = 6
_STRANGERS_SHARE: Final = 0.03
_ENOUGH_FEATURES: Final = 100
_STRANGERS_DENSITY: Final = 0.3
"""Two images show unlike scenes if both have plenty of features, not more than these agree, and matching finds little."""

_SAME_SHARE: Final = 0.75
"""Share of the features that have not moved in two images from one place; noise moves some. In a street scene 2 % have not."""

_FLAT: Final = 2.0
_FLAT_RATIO: Final = 5.0
"""An image of less structure, grey levels, shows nothing if it is dark or the other one shows five times as much."""

_DARK_MEAN: Final = 25.0
_DARK_BRIGHT: Final = 50.0
"""An image is dark if its mean and its bright parts are below these levels: a tenth of what a camera's exposure aims at."""

_BLURRED_PX: Final = 2.0
_BLURRED_RATIO: Final = 1.8
_BLURRED_BESIDE_PX: Final = 1.5
"""Sharp images measure 0.8 to 1.3 px at up to 640 px of width, and 1.8 px if nothing in the scene has a sharp edge."""

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

_MOVED: Final = "check that both images are of one moment; else the calibration does not fit these cameras any more, or never did: calibrate the rig again"
_NOT_RECTIFIED: Final = "these images are not rectified: calibrate your cameras and give --calibration rig.yaml"

_BEHIND_SHARE: Final = 0.05
"""False matches put fewer points there; a sky may put more, where doffs is large and negative."""

_EDGE_TO_EDGE: Final = 3.5
"""The full height of a ramp relative to its root mean square."""

_TILTED_SHARE: Final = 0.3
"""If fewer of the related features than this share their rows, the rectification does not fit the cameras."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ImageFigures:
    """Medians over some judgements; NaN = not measured.

    Attributes:
        density: share of the left image's pixels that have a disparity.
        consistency: share of sampled disparities that are found again from right to left.
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


@dataclass(frozen=True, slots=True, kw_only=True)
class ImageTrust:
    """What a run's images say about its depth.

    Attributes:
        judged: number of judged pairs.
        wants_depth: whether a rig or rectified images were given.
        has_depth: whether any pair had depth.
        start: figures over the first judgements.
        now: figures over those of the latest ones that have exactly the standing doubts.
        concerns: the standing doubts, gravest first.
        newest: the doubts of the newest judged pair, gravest first.
        history: what stood for a while, and what stands.
        geometry: converts disparity to metres; None if it is not known.
        disparity_error_px: error of a disparity, px; NaN if the core states none.
    """

    judged: int = 0
    wants_depth: bool = False
    has_depth: bool = False
    start: ImageFigures = ImageFigures()
    now: ImageFigures = ImageFigures()
    concerns: tuple[Concern, ...] = ()
    newest: tuple[Concern, ...] = ()
    history: tuple[Episode, ...] = ()
    geometry: StereoGeometry | None = None
    disparity_error_px: float = math.nan

    @property
    def is_settled(self) -> bool:
        """Whether the newest judged pair has exactly the standing doubts."""
        return {concern.doubt for concern in self.newest} == {concern.doubt for concern in self.concerns}


def gravest_first(found: tuple[Concern, ...]) -> tuple[Concern, ...]:
    """Sort concerns: blocking ones first, then the others that are certain, else in their order."""
    return tuple(sorted(found, key=lambda concern: (not concern.doubt.blocks, not concern.is_certain)))


def image_doubts(evidence: Evidence, source: ImageSource = ImageSource.CAMERAS) -> tuple[Concern, ...]:
    """Say what the images of one pair make doubtful, gravest first; empty if nothing.

    Args:
        evidence: of the pair; without supports (an unrectified pair) only brightness is judged.
        source: where the images come from: remedies name the options of a camera's address, or those for files.
    """
    support = {item.arrangement: item.features for item in evidence.supports}
    sees = max(support.values(), default=0) >= _LEAST_SUPPORT
    covered = () if sees else _covered(evidence.left, evidence.right)
    if covered:
        return covered
    dark = _dark(evidence.left, evidence.right)
    if not support:
        return dark
    light = (*dark, *_unfocused(evidence.left, evidence.right))
    mistake = tuple(_with_direction(item, evidence) for item in _arrangement(support, source))
    if is_pattern(evidence) and not any(item.doubt is Doubt.SAME_IMAGE for item in mistake):
        return *light, *ambiguous(evidence)  # features of a pattern match any repeat: mistakes they show are chance
    if not mistake and not light and _are_strangers(evidence, support):
        mistake = (_OTHER_SCENE,)
    return (*mistake, *light) if mistake else (*light, *_figures(evidence, support))


def _covered(left: Exposure, right: Exposure) -> tuple[Concern, ...]:
    blind = [
        name
        for name, here, there in (("left", left, right), ("right", right, left))
        if here.structure < _FLAT and (_is_dark(here) or there.structure > max(_FLAT_RATIO * here.structure, _FLAT))
    ]
    if not blind:
        return ()
    camera_sees = _cameras(blind)
    return (
        Concern(Doubt.COVERED, f"{camera_sees} no scene at all", "take off the lens cap, the shutter or the finger"),
    )


def _cameras(names: list[str]) -> str:
    return "both cameras see" if len(names) == 2 else f"the {names[0]} camera sees"


def _is_dark(exposure: Exposure) -> bool:
    return exposure.mean_level < _DARK_MEAN and exposure.bright_level < _DARK_BRIGHT


def _dark(left: Exposure, right: Exposure) -> tuple[Concern, ...]:
    dark = [name for name, exposure in (("left", left), ("right", right)) if _is_dark(exposure)]
    if not dark:
        return ()
    level = min(left.mean_level, right.mean_level)
    camera_sees = _cameras(dark)
    return (
        Concern(
            Doubt.DARK,
            f"{camera_sees} almost nothing for want of light (mean level {level:.0f} of 255)",
            "switch on a light, or give the camera a longer exposure",
        ),
    )


def _unfocused(left: Exposure, right: Exposure) -> tuple[Concern, ...]:
    blurred = [
        (name, here.blur_px)
        for name, here, there in (("left", left, right), ("right", right, left))
        if here.blur_px > _BLURRED_PX
        or (here.blur_px > _BLURRED_BESIDE_PX and here.blur_px > _BLURRED_RATIO * there.blur_px)
    ]
    if not blurred:
        return ()
    width = max(blur for _, blur in blurred)
    camera_sees = _cameras([name for name, _ in blurred])
    return (
        Concern(
            Doubt.UNFOCUSED,
            f"{camera_sees} blurred edges ({width:.1f} px)",
            "clean and focus the lens, and switch its autofocus off before you calibrate",
        ),
    )


_NAMED: Final = {
    Arrangement.SWAPPED: Concern(
        Doubt.SWAPPED,
        "left and right are exchanged: the scene moves the wrong way from the left image to the right one",
        "swap LEFT and RIGHT or --board-side; if each is where it should be, both cameras are on their heads (rotate=180) or both mirror their images (flip=h)",
    ),
    Arrangement.TURNED: Concern(
        Doubt.TURNED,
        "one camera is on its head: the two images are turned by 180 degrees to each other",
        "mount it upright, or give that camera rotate=180",
        arrangement=Arrangement.TURNED,
    ),
    Arrangement.TURNED_BY_QUARTER: Concern(
        Doubt.TURNED_BY_QUARTER,
        "one camera lies on its side: the two images are turned by 90 degrees to each other",
        "mount it upright, or give that camera rotate=90 or rotate=270",
        arrangement=Arrangement.TURNED_BY_QUARTER,
    ),
    Arrangement.BOTH_TURNED: Concern(
        Doubt.TURNED,
        "both cameras are on their heads: only turned by 180 degrees do their images fit the calibration",
        "mount them upright, or give both cameras rotate=180",
        arrangement=Arrangement.BOTH_TURNED,
    ),
    Arrangement.BOTH_MIRRORED: Concern(
        Doubt.MIRRORED,
        "both images are mirror images: only mirrored do they fit the calibration",
        "switch mirroring off in both cameras, or give both flip=h (flip=v if top and bottom are exchanged)",
        arrangement=Arrangement.BOTH_MIRRORED,
    ),
    Arrangement.BOTH_TURNED_BY_QUARTER: Concern(
        Doubt.TURNED_BY_QUARTER,
        "both cameras lie on their sides: the scene moves up or down from one image to the other",
        "mount them upright, or give both cameras rotate=90 or rotate=270",
        arrangement=Arrangement.BOTH_TURNED_BY_QUARTER,
    ),
    Arrangement.MIRRORED: Concern(
        Doubt.MIRRORED,
        "one of the two images is a mirror image",
        "switch mirroring off in the camera's app, or give that camera flip=h (flip=v if top and bottom are exchanged)",
        arrangement=Arrangement.MIRRORED,
    ),
    Arrangement.SAME_PLACE: Concern(
        Doubt.SAME_IMAGE,
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

_OTHER_SCENE: Final = Concern(
    Doubt.OTHER_SCENE,
    "the two images show different scenes: hardly anything in one is found in the other",
    "turn both cameras towards the same scene, and check that LEFT and RIGHT belong together",
)


_CROPPED: Final = Concern(
    Doubt.CROPPED_RIG,
    "an image is smaller than in the calibration and has another shape: it was taken for the middle of that one",
    "use a size of the calibration's shape; or calibrate at this size, if the camera may cut elsewhere or squeeze",
)


def _named(arrangement: Arrangement, source: ImageSource) -> Concern:
    concern = _NAMED[arrangement]
    return concern if source is ImageSource.CAMERAS else replace(concern, remedy=FILE_REMEDIES[arrangement].words)


def _arrangement(support: dict[Arrangement, int], source: ImageSource) -> tuple[Concern, ...]:
    """Name the mistake that clearly more features agree with than with the right arrangement."""
    related = max(support[Arrangement.RIGHT], support[Arrangement.TILTED])
    same = support[Arrangement.SAME_PLACE]
    if same >= max(_LEAST_SUPPORT, _SAME_SHARE * related):
        return (_named(Arrangement.SAME_PLACE, source),)
    # These turn the features themselves: not even tilted rows explain them.
    turned = (Arrangement.TURNED, Arrangement.TURNED_BY_QUARTER, Arrangement.MIRRORED)
    best = max(turned, key=lambda arrangement: support[arrangement])
    if support[best] >= max(_LEAST_SUPPORT, _MARGIN * related):
        return (_named(best, source),)
    best = max(_OF_BOTH, key=lambda arrangement: support[arrangement])
    if support[best] < max(_LEAST_SUPPORT, _MARGIN * support[Arrangement.RIGHT]):
        return ()
    if support[best] < _CLEARLY_MORE * support[Arrangement.SWAPPED]:
        best = Arrangement.SWAPPED  # without a rig the three cannot be told apart; its remedy names them all
    return (_named(best, source),)


def _with_direction(concern: Concern, evidence: Evidence) -> Concern:
    """Add by how many quarters one camera is turned against the other, if that is the mistake."""
    if concern.arrangement is not Arrangement.TURNED_BY_QUARTER:
        return concern
    return replace(concern, quarters=max(item.quarters for item in evidence.supports))


def _are_strangers(evidence: Evidence, support: dict[Arrangement, int]) -> bool:
    fewest = min(evidence.left.features, evidence.right.features)
    most = max(_STRANGERS, _STRANGERS_SHARE * fewest)
    return fewest >= _ENOUGH_FEATURES and max(support.values()) <= most and not evidence.density >= _STRANGERS_DENSITY


def _figures(evidence: Evidence, support: dict[Arrangement, int]) -> tuple[Concern, ...]:
    related, right = support[Arrangement.TILTED], support[Arrangement.RIGHT]
    is_tilted = related >= 2 * _LEAST_SUPPORT and right < _TILTED_SHARE * related
    plain = figure_doubts(median_figures((evidence,)), is_tilted=is_tilted)
    rows = tuple(item for item in plain if item.doubt is Doubt.VERTICAL_ERROR) or _skewed(evidence)
    if not evidence.from_rig:
        rows = tuple(replace(item, remedy=_NOT_RECTIFIED) for item in rows)
    short, unsure = too_short(evidence), ambiguous(evidence)
    sparse = (item for item in plain if item.doubt is not Doubt.VERTICAL_ERROR)
    cropped = (_CROPPED,) if evidence.is_cropped else ()
    if evidence.is_cropped:
        rows = tuple(replace(item, remedy=_CROPPED.remedy) for item in rows)
    return (*_behind(evidence), *rows, *short, *unsure, *(() if short or unsure else sparse), *cropped)


def _behind(evidence: Evidence) -> tuple[Concern, ...]:
    if not evidence.behind_share > _BEHIND_SHARE:
        return ()
    return (
        Concern(
            Doubt.GEOMETRY,
            f"{evidence.behind_share:.0%} of the points would lie at infinity or behind it: doffs may be that of other images",
            "give the calib.txt that was published with these images, or --doffs: cx of the right camera minus cx of the left one, px",
        ),
    )


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
                f"only {figures.consistency:.0%} of the depth is found again from right to left",
                "light the scene well, and give it texture; plain and repeated surfaces deceive the matcher",
            )
        )
    return tuple(found)


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
