"""Judges one processed pair of images from files: its doubts, and the answer to whether its depth is right."""

from dataclasses import replace
from typing import Final

from common.orientation import UPRIGHT, Orientation
from phone_host.measure.file_remedies import ImageSource
from phone_host.measure.headline import answer
from phone_host.measure.image_doubts import image_doubts
from phone_host.measure.image_trust import median_figures
from phone_host.measure.no_depth import no_depth
from phone_host.measure.orient_words import with_final_options
from phone_host.measure.trust import REJECTED_RIG, Doubt, gravest_first
from phone_host.model import Processed
from phone_host.report.depth_data import density
from phone_host.report.stereo_trust import PairTrust
from phone_host.stereo.core import StereoCore
from phone_host.stereo.evidence import Examined, has_depth, look_at, maps_of

_UNMATCHED: Final = no_depth(None, None)
_OF_FILES: Final = "check that the scene has texture, and that --calibration or --rectified fits the images"


def judge_pair(
    core: StereoCore,
    processed: Processed,
    mounted: tuple[Orientation, Orientation] = (UPRIGHT, UPRIGHT),
    look: Examined | None = None,
) -> PairTrust:
    """Judge one pair.

    Args:
        core: the core that processed it.
        processed: its result.
        mounted: what the user gave to make the left and the right image upright.
        look: what was seen in it; None: it is looked at.
    """
    evidence = (look or look_at(processed, maps_of(core, processed))).evidence
    seen = image_doubts(evidence, ImageSource.FILES)
    found = tuple(with_final_options(concern, mounted, ImageSource.FILES) for concern in seen)
    if not has_depth(processed) and not any(concern.is_certain for concern in found):
        why = no_depth(processed.cut, processed.limits, found)
        # That there are few disparities, too, says nothing more; nor does the cause, once it is named.
        further = (item for item in found if item.doubt is not Doubt.LOW_DENSITY and item.sentence not in why.sentence)
        remedy = _OF_FILES if why == _UNMATCHED else why.remedy
        pixels = "hardly any pixel has" if density(processed) > 0 else "no pixel has"
        sentence = why.sentence.replace("no pair has", pixels, 1)  # it may be the only pair
        found = gravest_first((replace(why, sentence=sentence, remedy=remedy), *further))
    if core.rig is not None and core.rig.is_rejected:
        found = gravest_first((REJECTED_RIG, *found))
    figures = median_figures((evidence,))
    error_px = float("nan") if processed.limits is None else processed.limits.disparity_error_px
    # The headline counts the pixels that have a point, where metres are known. What the user has cut away is no loss.
    limits = processed.limits
    is_own_cut = limits is not None and (not limits.from_rig or limits.near_m > 0)
    shown = figures if is_own_cut else replace(figures, density=density(processed))
    return PairTrust(figures, found, answer(shown, found, processed.geometry, error_px, processed.cut))
