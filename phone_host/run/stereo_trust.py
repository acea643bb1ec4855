"""Judges one processed pair of images from files: its doubts, and the answer to whether its depth is right."""

from phone_host.measure.headline import answer
from phone_host.measure.image_doubts import gravest_first, image_doubts, median_figures
from phone_host.measure.no_depth import no_depth
from phone_host.model import Processed
from phone_host.report.stereo_trust import PairTrust
from phone_host.stereo.core import StereoCore
from phone_host.stereo.evidence import has_depth, maps_of, measure_evidence


def judge_pair(core: StereoCore, processed: Processed) -> PairTrust:
    """Judge one pair.

    Args:
        core: the core that processed it.
        processed: its result.
    """
    evidence = measure_evidence(processed, maps_of(core, processed))
    found = image_doubts(evidence)
    if not has_depth(processed) and not any(concern.doubt.blocks for concern in found):
        found = gravest_first((no_depth(processed.cut, processed.limits), *found))
    figures = median_figures((evidence,))
    error_px = float("nan") if processed.limits is None else processed.limits.disparity_error_px
    return PairTrust(figures, found, answer(figures, found, processed.geometry, error_px))
