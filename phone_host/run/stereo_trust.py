"""Judges one processed pair of images from files: its doubts, and the answer to whether its depth is right."""

from common.camera.orientation import UPRIGHT, Orientation
from phone_host.measure.headline import answer
from phone_host.measure.image_doubts import gravest_first, image_doubts, median_figures
from phone_host.measure.orient_words import Spelling, with_final_options
from phone_host.measure.trust import NO_DEPTH, REJECTED_RIG
from phone_host.model import Processed
from phone_host.report.stereo_trust import PairTrust
from phone_host.stereo.core import StereoCore
from phone_host.stereo.evidence import has_depth, maps_of, measure_evidence


def judge_pair(
    core: StereoCore, processed: Processed, mounted: tuple[Orientation, Orientation] = (UPRIGHT, UPRIGHT)
) -> PairTrust:
    """Judge one pair.

    Args:
        core: the core that processed it.
        processed: its result.
        mounted: what the user gave to make the left and the right image upright.
    """
    evidence = measure_evidence(processed, maps_of(core, processed))
    found = tuple(with_final_options(concern, mounted, Spelling.OF_FILES) for concern in image_doubts(evidence))
    if not has_depth(processed) and not any(concern.doubt.blocks for concern in found):
        found = gravest_first((NO_DEPTH, *found))
    if core.rig is not None and core.rig.is_rejected:
        found = gravest_first((REJECTED_RIG, *found))
    figures = median_figures((evidence,))
    error_px = float("nan") if processed.limits is None else processed.limits.disparity_error_px
    return PairTrust(figures, found, answer(figures, found, processed.geometry, error_px))
