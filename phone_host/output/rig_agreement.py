"""Whether a rig and the rectification that is written beside it tell the same. Pure.

A rig.yaml holds the rig, from which this program computes the rectification, and the rectification for other programs. A digit
that was spoiled in one of the two is seen in the other.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from common.errors import DataError
from phone_host.model import CameraModel

Problem = Callable[[str, str, str], DataError]
"""Makes the error of a key, from what is wrong with it and the remedy."""

Matrix = NDArray[np.float64]

_TOLERANCE: Final = 1e-3
"""Files typed with four digits."""

_REMEDY: Final = "calibrate again, or remove the wrong one of the two"


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class KeptRectification:
    """What a file holds of a rectification, under OpenCV's names; None: nothing.

    Attributes:
        R1: (3, 3) from the left camera's axes to the rectified ones.
        R2: (3, 3), the same, right.
        P1: (3, 4) projection of rectified points, left.
        P2: (3, 4), right.
        Q: (4, 4) disparity to metres.
    """

    R1: Matrix | None
    R2: Matrix | None
    P1: Matrix | None
    P2: Matrix | None
    Q: Matrix | None


def require_agreement(kept: KeptRectification, rotation: Matrix, baseline_m: Matrix, problem: Problem) -> None:
    """Check a rectification against the rig that it belongs to, as far as it is there.

    Args:
        kept: the rectification.
        rotation: (3, 3) R, from the left camera's axes to the right one's.
        baseline_m: (3,) T, m.
        problem: makes errors that name file and key.

    Raises:
        DataError: the two contradict each other.
    """
    length_m = float(np.linalg.norm(baseline_m))
    if kept.P2 is not None:
        focal_px = kept.P2[0, 0]
        projected_m = float(np.abs(kept.P2[:2, 3]).max()) / focal_px if focal_px >= 1 else np.nan
        if not abs(projected_m - length_m) <= _TOLERANCE * length_m:
            differ = f"has a baseline of {projected_m * 1e3:.2f} mm, but T one of {length_m * 1e3:.2f} mm"
            raise problem("P2", differ, _REMEDY)
    if kept.R1 is not None and kept.R2 is not None and np.abs(kept.R2 @ rotation - kept.R1).max() > _TOLERANCE:
        raise problem("R", "contradicts R1 and R2", _REMEDY)
    if kept.R2 is not None:
        along = np.abs(kept.R2 @ baseline_m) / length_m
        if np.sort(along)[1] > _TOLERANCE:  # both cameras' rows, or columns, run along the baseline
            raise problem("T", "contradicts R2", _REMEDY)
    if kept.P1 is not None:
        focal_px = kept.P1[0, 0]
        if kept.P2 is not None and not abs(kept.P2[0, 0] - focal_px) <= _TOLERANCE * focal_px:
            raise problem("P2", "has another focal length than P1", _REMEDY)
        told = None if kept.Q is None else kept.Q[:3, 3] + [kept.P1[0, 2], kept.P1[1, 2], -focal_px]
        if told is not None and not (np.abs(told) <= _TOLERANCE * focal_px).all():
            raise problem("Q", "contradicts P1", _REMEDY)


def require_own_focal(kept: KeptRectification, left: CameraModel, right: CameraModel, problem: Problem) -> None:
    """Check the focal length of a rectification that this program computed: it is the shorter one of the two cameras'.

    Raises:
        DataError: it is not.
    """
    shorter, key = min((left.mean_focal_px, "M1"), (right.mean_focal_px, "M2"))
    focal_px = np.nan if kept.P1 is None else kept.P1[0, 0]
    if abs(focal_px - shorter) > _TOLERANCE * shorter:
        differ = f"has a focal length of {shorter:.2f} px, but P1 was made of one of {focal_px:.2f} px"
        raise problem(key, differ, _REMEDY)
