"""Says in words what a calibration is good for and what to do about it.

The measure is the vertical error after rectification, because a matcher searches along rows. Rows that are off by half
a pixel cost it more than blur or noise do; at one pixel a 9x7 census finds no partner.
"""

from collections import Counter
from dataclasses import dataclass
from enum import Enum

import numpy as np

from common.words import counted
from phone_host.calibration.board_pairs import Calibration, Reason, Rejected
from phone_host.model import Rig

GOOD_PX, USABLE_PX = 0.25, 0.5
"""Limits of the 95th percentile of the vertical error, for images of up to `REFERENCE_PX`."""

REFERENCE_PX = 1280
"""The longer side of the images for which the limits hold. Larger ones are matched smaller, at about this width, and a
lens's blur covers more of their pixels: limits grow with their size."""

# Real rigs fit to 0.15 to 0.4 px. Beyond this no tuning helps; something basic is wrong. Grows with the size too.
_CONTRADICTION_PX = 1.0
# A baseline known to 1 % gives depth known to 1 %; at 5 % there is practically no scale.
_BASELINE_GOOD, _BASELINE_USABLE = 0.01, 0.05
_FEW_PAIRS = 6
_WANTED_PAIRS = 10
# Corners that span less leave the polynomial undetermined in the rest of the image.
_WANTED_SPREAD = 0.6
# Only foreshortening reveals the focal length: 1 - cos(15 deg) = 3 %.
_WANTED_TILT_DEG = 15.0
_MANY_REJECTED = 1 / 3


class Verdict(Enum):
    """What the calibration is good for."""

    GOOD = "good"
    USABLE = "usable"
    REJECT = "reject"


@dataclass(frozen=True, slots=True)
class Assessment:
    """The verdict and what to do next.

    Attributes:
        verdict: the verdict.
        remedies: sentences, the most important first; empty when nothing needs to improve.
    """

    verdict: Verdict
    remedies: tuple[str, ...]


def vertical_p95_px(calibration: Calibration) -> float:
    """The 95th percentile of the vertical error, px; NaN when the rig cannot be rectified."""
    return float(np.percentile(calibration.vertical_px, 95))


def size_factor(rig: Rig) -> float:
    """Return by which factor limits in px are wider for this rig's images; at least 1. Rectified images are as coarse as the coarser camera's."""
    longest = min(max(model.width_px, model.height_px) for model in (rig.left, rig.right))
    return max(1.0, longest / REFERENCE_PX)


def judge(calibration: Calibration, rejected: tuple[Rejected, ...]) -> Assessment:
    """Judge a calibration.

    Args:
        calibration: the result to judge.
        rejected: all pairs that are not used, including those the calibration never saw.

    Returns:
        The verdict with remedies.
    """
    contradictions = []
    factor = size_factor(calibration.rig)
    if calibration.rig.rms_stereo_px > _CONTRADICTION_PX * factor:
        contradictions.append(
            f"the views contradict each other by {calibration.rig.rms_stereo_px:.1f} px: check --board (inner corners), that"
            " each LEFT image belongs to its RIGHT one, and that neither camera mirrors its image"
        )
    if calibration.obstacle is not None:
        obstacle = f"{calibration.obstacle.problem}: {calibration.obstacle.remedy}"
        return Assessment(Verdict.REJECT, (*contradictions, obstacle))
    p95_px = vertical_p95_px(calibration)
    baseline_m = float(np.linalg.norm(calibration.rig.t_right_left_m))
    open_share = calibration.baseline_sigma_m / baseline_m
    pairs = len(calibration.used)
    rejects, limits, hints = contradictions, list[str](), list[str]()
    if p95_px > USABLE_PX * factor:
        rejects.append(
            f"rows of the two views differ by {p95_px:.2f} px (95 %): fix focus and zoom, hold board and cameras still in each"
            " pair, glue the print to a flat plate, check --board, and take new pairs"
        )
    elif p95_px > GOOD_PX * factor:
        limits.append(
            f"rows of the two views differ by {p95_px:.2f} px (95 %), {GOOD_PX * factor:.2f} px is good: hold the board still, flat, sharp and"
            " larger in the image"
        )
    if open_share > _BASELINE_USABLE:
        rejects.append(_open_baseline(calibration, baseline_m))
    elif open_share > _BASELINE_GOOD:
        limits.append(_open_baseline(calibration, baseline_m))
    if pairs < _FEW_PAIRS:
        limits.append(f"{pairs} pairs are few: take 15")
    elif pairs < _WANTED_PAIRS:
        hints.append(f"{pairs} pairs are few: take 15")
    hints += _hints(calibration, rejected)
    verdict = Verdict.REJECT if rejects else Verdict.USABLE if limits else Verdict.GOOD
    return Assessment(verdict, (*rejects, *limits, *hints))


def _open_baseline(calibration: Calibration, baseline_m: float) -> str:
    return (
        f"these views leave the baseline open by {calibration.baseline_sigma_m * 1e3:.2f} of {baseline_m * 1e3:.1f} mm: show the"
        " board nearer and farther, and tilted by 20 to 45 degrees"
    )


def _hints(calibration: Calibration, rejected: tuple[Rejected, ...]) -> list[str]:
    """Return what would make the next calibration better; none of it changes the verdict."""
    hints = []
    if calibration.spread < _WANTED_SPREAD:
        hints.append(
            f"the board covered {calibration.spread:.0%} of an image's width or height only: show it in the corners too"
        )
    if calibration.tilts_deg.max() < _WANTED_TILT_DEG:
        hints.append(
            f"no board is tilted by more than {calibration.tilts_deg.max():.0f} degrees: tilt it by 20 to 45 degrees, in all"
            " directions"
        )
    if len(rejected) > _MANY_REJECTED * (len(rejected) + len(calibration.used)):
        reason, count = Counter(each.reason for each in rejected).most_common(1)[0]
        hints.append(
            f"{counted(len(rejected), 'pair was', 'pairs were')} rejected, {count} of them: {reason.value}: {_CURES[reason]}"
        )
    return hints


_CURES = {
    Reason.NO_PARTNER: "give both images of a pair the same number",
    Reason.UNREADABLE: "copy the images again",
    Reason.OTHER_SIZE: "take all images of one camera at one resolution",
    Reason.TURNED: (
        "hold each camera the same way in all images; if only a phone's EXIF tag differs, remove the tag from all of them"
    ),
    Reason.NOT_FOUND_LEFT: "show the whole board, sharp and evenly lit, and check --board (inner corners)",
    Reason.NOT_FOUND_RIGHT: "show the whole board, sharp and evenly lit, and check --board (inner corners)",
    Reason.NOT_FOUND_BOTH: "show the whole board, sharp and evenly lit, and check --board (inner corners)",
    Reason.CORNERS_LEFT: "avoid glare and blur",
    Reason.CORNERS_RIGHT: "avoid glare and blur",
    Reason.MOVED: "hold the board still, or put it down, until both cameras have their image",
}
