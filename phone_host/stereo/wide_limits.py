"""Says why the limits of a measured point lie far apart: the largest part of its uncertainty. Pure."""

import math
from enum import Enum
from typing import Final

import numpy as np

from phone_host.model import Epipolar
from phone_host.stereo.measured_point import MeasuredPoint
from phone_host.stereo.point_match import PointMatch
from phone_host.stereo.point_window import HALF_PX

_WIDE: Final = 0.02
"""Half of the distance between the limits, as a share of the distance itself: nobody asks why below."""

_MISSED: Final = 2.0
"""Rays that miss each other by so many times the noise have another reason than noise."""

_USUAL_PX: Final = 0.1
"""A match on good texture is surer; median of the rendered rooms of bench_measure: 0.05 px."""

_FEW_SHARE: Final = 0.5


class Wide(Enum):
    """Why limits lie far apart; the value says it to the user."""

    RIG = "the rig's calibration is uncertain: calibrate with more pictures"
    MISSED = "its two rays miss each other: the rig or the object moved, or this is another point"
    NEIGHBOURS = "few pixels around it lie on the same surface"
    TEXTURE = "there is little texture around it"
    FAR = "it is far away for this baseline"


def why_wide(point: MeasuredPoint, match: PointMatch, epipolar: Epipolar = Epipolar.LEFT) -> Wide | None:
    """Return why a point's limits are wide; None if they are not.

    Args:
        point: as measured, before infinity.
        match: from which it was.
        epipolar: which way its epipolar lines run.
    """
    length = point.distance
    if length.high_m - length.low_m <= 2 * _WIDE * length.value_m:
        return None
    if float(np.square(point.rig_m[:, 2]).sum()) > point.covariance_m2[2, 2]:
        return Wide.RIG
    if point.noise_factor > _MISSED:
        return Wide.MISSED
    along = int(epipolar.is_vertical)
    if math.sqrt(match.covariance_px2[along, along]) <= _USUAL_PX:
        return Wide.FAR
    few = match.pixels < _FEW_SHARE * (2 * HALF_PX + 1) ** 2
    return Wide.NEIGHBOURS if few else Wide.TEXTURE
