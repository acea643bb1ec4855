"""The result of a calibration, what it is good for in words, and the one thing that would help most.

The measures: the vertical error after rectification, because a matcher searches along rows (rows that are off by half a pixel cost
it more than blur or noise do; at one pixel a 9x7 census finds no partner); squares of boards that the rig was not fitted to;
the depth error that the uncertainty of the rig leaves. Each has a limit for good and one for usable. Of those that are exceeded, the
one by the largest factor gives the remedy: mending another would leave the verdict as it is.
"""

import math
from collections import Counter
from dataclasses import dataclass, field

import numpy as np

from common.errors import DataError
from common.words import counted
from phone_host.calibration.solve.bundle_problem import Bend, Vector
from phone_host.calibration.solve.next_view import DEPTH_M, Kind, NextView
from phone_host.calibration.target.pairs import Reason, Rejected
from phone_host.model import CameraModel, Rectification, Rig, Verdict
from phone_host.model.calibration_series import BoardInSpace, Limits


@dataclass(frozen=True, slots=True, eq=False)
class LensTrial:
    """How one formula did.

    Attributes:
        bend: the formula.
        model: the camera fitted to all views.
        held_out_px: (V,) root mean square error of each view, predicted by a camera that has not seen it, px.
        fitted_px: (V,) the same by the camera fitted to all views.
    """

    bend: Bend
    model: CameraModel
    held_out_px: Vector
    fitted_px: Vector

    @property
    def rms_px(self) -> float:
        """Root mean square over the views, px."""
        return float(np.sqrt((self.held_out_px**2).mean()))


@dataclass(frozen=True, slots=True, kw_only=True)
class Squares:
    """How large the squares of boards came out.

    Attributes:
        true_m: side of a square, m.
        mean_m: mean of those measured, m; NaN: not measured.
        sigma_m: their standard deviation, m.
        count: their number.
    """

    true_m: float
    mean_m: float
    sigma_m: float
    count: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Used:
    """A pair that is used, and how well it fits.

    Attributes:
        name: the pair.
        left_px: root mean square reprojection error in the left image, px.
        right_px: the same, right.
        vertical_px: root mean square vertical error after rectification, px; NaN when the rig cannot be rectified.
        in_space: the board as the rig sees it.
    """

    name: str
    left_px: float
    right_px: float
    vertical_px: float
    in_space: BoardInSpace


@dataclass(frozen=True, slots=True, eq=False)
class Calibration:
    """The result of a calibration.

    Attributes:
        rig: the two cameras.
        rectification: of the rig; None when the rig cannot be rectified (see `obstacle`).
        obstacle: why it cannot be rectified, and the remedy.
        used: pairs used.
        rejected: pairs that the calibration rejected.
        vertical_px: (M,) absolute vertical error of every corner used, after rectification.
        baseline_sigma_m: standard deviation of the baseline that the corners' noise leaves, m.
        tilts_deg: (V,) angle between each board and the image plane.
        spread: share of the image's width and height that the corners span, the smaller over both cameras.
        bends: which coefficients were estimated for the left and for the right camera.
        squares: how large the squares of boards came out that the rig had not seen.
        depths: depth and the standard uncertainty that the calibration leaves there, m, for some depths.
        advice: which view would teach most; None: it cannot be told.
        trials: how the formulas of the left and of the right lens did that were tried.
        poses: (V, 6) of the boards of the pairs used, in the left camera's axes.
        left_errors_px: (V, N, 2) of the pairs used, measured minus projected; NaN where a corner was not seen.
        right_errors_px: (V, N, 2), the same, right.
    """

    rig: Rig
    rectification: Rectification | None
    obstacle: DataError | None
    used: tuple[Used, ...]
    rejected: tuple[Rejected, ...]
    vertical_px: Vector
    baseline_sigma_m: float
    tilts_deg: Vector
    spread: float
    bends: tuple[Bend, Bend]
    squares: Squares
    depths: tuple[tuple[float, float], ...] = ()
    advice: NextView | None = None
    trials: tuple[tuple[LensTrial, ...], tuple[LensTrial, ...]] = ((), ())
    poses: Vector = field(default_factory=lambda: np.empty((0, 6)))
    left_errors_px: Vector = field(default_factory=lambda: np.empty((0, 0, 2)))
    right_errors_px: Vector = field(default_factory=lambda: np.empty((0, 0, 2)))


GOOD_PX, USABLE_PX = 0.25, 0.5
"""Limits of the 95th percentile of the vertical error, for images of up to `REFERENCE_PX`."""

REFERENCE_PX = 1280
"""The longer side of the images for which the limits hold. Larger ones are matched smaller, at about this width, and a
lens's blur covers more of their pixels: limits grow with their size."""

# Real rigs fit to 0.15 to 0.4 px. Beyond this no tuning helps; something basic is wrong. Grows with the size too.
_CONTRADICTION_PX = 1.0
# A baseline known to 1 % gives depth known to 1 %; at 5 % there is practically no scale.
SHARE_GOOD, _SHARE_USABLE = 0.01, 0.05
"""Limits of the uncertainty of baseline and depth, and of what squares are off, as shares."""

_JUST_BEYOND = math.nextafter(1.0, 2.0)
"""What is not known is never good, and what is known to be worse gives the remedy."""

_UNKNOWN = (
    "how exactly baseline and depth are known cannot be told, because the earlier calibration does not say how exact its"
    " lenses are: calibrate from pictures of a board without --pose-only"
)

_FEW_PAIRS = 6
_WANTED_PAIRS = 15
_MANY_REJECTED = 1 / 3


@dataclass(frozen=True, slots=True)
class Assessment:
    """The verdict and what to do next.

    Attributes:
        verdict: the verdict.
        remedy: the one sentence that helps most; empty when the verdict is good.
    """

    verdict: Verdict
    remedy: str


@dataclass(frozen=True, slots=True)
class _Measure:
    """One measure of a calibration, in units of its limits.

    Attributes:
        of_good: by which factor it exceeds the limit for good; up to 1: it does not.
        of_usable: the same of the limit for usable.
        remedy: what to do about it.
    """

    of_good: float
    of_usable: float
    remedy: str


def vertical_p95_px(calibration: Calibration) -> float:
    """The 95th percentile of the vertical error, px; NaN when the rig cannot be rectified."""
    return float(np.percentile(calibration.vertical_px, 95))


def size_factor(rig: Rig) -> float:
    """Return by which factor limits in px are wider for this rig's images; at least 1. Rectified images are as coarse as the coarser camera's."""
    longest = min(max(model.width_px, model.height_px) for model in (rig.left, rig.right))
    return max(1.0, longest / REFERENCE_PX)


def limits_of(rig: Rig) -> Limits:
    """Return up to where the figures of a rig are good and usable."""
    factor = size_factor(rig)
    return Limits(
        good_px=GOOD_PX * factor,
        usable_px=USABLE_PX * factor,
        good_share=SHARE_GOOD,
        usable_share=_SHARE_USABLE,
    )


def judge(calibration: Calibration, rejected: tuple[Rejected, ...]) -> Assessment:
    """Judge a calibration.

    Args:
        calibration: the result to judge.
        rejected: all pairs that are not used, including those the calibration never saw.

    Returns:
        The verdict, with the remedy that helps most unless it is good.
    """
    if calibration.rig.rms_stereo_px > _CONTRADICTION_PX * size_factor(calibration.rig):
        contradiction = (
            f"the views contradict each other by {calibration.rig.rms_stereo_px:.1f} px: check --board, that"
            " each LEFT image belongs to its RIGHT one, and that neither camera mirrors its image"
        )
        return Assessment(Verdict.REJECT, contradiction)
    if calibration.obstacle is not None:
        obstacle = f"{calibration.obstacle.problem}: {calibration.obstacle.remedy}"
        return Assessment(Verdict.REJECT, obstacle)
    measures = [_rows(calibration), _baseline(calibration), _depth(calibration), _squares(calibration)]
    worst = max(measures, key=lambda each: each.of_good)
    few = len(calibration.used) < _FEW_PAIRS
    if not few and worst.of_good <= 1:
        return Assessment(Verdict.GOOD, "")
    verdict = Verdict.REJECT if max(each.of_usable for each in measures) > 1 else Verdict.USABLE
    return Assessment(verdict, _remedy(calibration, rejected, worst))


def _remedy(calibration: Calibration, rejected: tuple[Rejected, ...], worst: _Measure) -> str:
    """Return what helps most. What made most pairs useless comes first: it would spoil the next ones too."""
    used = len(calibration.used)
    if len(rejected) > _MANY_REJECTED * (len(rejected) + used):
        reason, count = Counter(each.reason for each in rejected).most_common(1)[0]
        return f"{count} of {len(rejected) + used} pairs were rejected: {reason.value}: {_CURES[reason]}"
    if used < _FEW_PAIRS and worst.of_usable <= 1:
        return f"{counted(used, 'pair')} {'is' if used == 1 else 'are'} few: take {_WANTED_PAIRS}"
    return worst.remedy


def _rows(calibration: Calibration) -> _Measure:
    p95_px, limits = vertical_p95_px(calibration), limits_of(calibration.rig)
    if p95_px > limits.usable_px:
        remedy = (
            f"rows of the two views differ by {p95_px:.2f} px (95 %): fix focus and zoom, hold board and cameras still in each"
            " pair, glue the print to a flat plate, check --board, and take new pairs"
        )
    else:
        remedy = (
            f"rows of the two views differ by {p95_px:.2f} px (95 %), {limits.good_px:.2f} px is good: hold the board still,"
            " flat, sharp and larger in the image"
        )
    return _Measure(p95_px / limits.good_px, p95_px / limits.usable_px, remedy)


def _baseline(calibration: Calibration) -> _Measure:
    baseline_m = float(np.linalg.norm(calibration.rig.t_right_left_m))
    share = calibration.baseline_sigma_m / baseline_m
    if not math.isfinite(share):
        return _Measure(_JUST_BEYOND, 0.0, _UNKNOWN)
    remedy = (
        f"these views leave the baseline open by {calibration.baseline_sigma_m * 1e3:.2f} of {baseline_m * 1e3:.1f} mm:"
        f" {_what_to_show(calibration)}"
    )
    return _Measure(share / SHARE_GOOD, share / _SHARE_USABLE, remedy)


def _depth(calibration: Calibration) -> _Measure:
    """Judge the depth error at 1 m; a rig that sees nothing there, or knows nothing of it, is judged by its baseline and rows alone."""
    sigma_m = dict(calibration.depths).get(DEPTH_M, math.nan)
    share = sigma_m / DEPTH_M if math.isfinite(sigma_m) else 0.0
    remedy = f"these views leave depth open by {share * 1e3:.0f} mm at {DEPTH_M:g} m: {_what_to_show(calibration)}"
    return _Measure(share / SHARE_GOOD, share / _SHARE_USABLE, remedy)


def _squares(calibration: Calibration) -> _Measure:
    squares = calibration.squares
    share = abs(squares.mean_m / squares.true_m - 1) if squares.count else 0.0
    remedy = (
        f"squares of boards that were held out measure {squares.mean_m * 1e3:.2f} instead of {squares.true_m * 1e3:.2f} mm:"
        f" {_what_to_show(calibration)}"
    )
    return _Measure(share / SHARE_GOOD, share / _SHARE_USABLE, remedy)


def _what_to_show(calibration: Calibration) -> str:
    if calibration.advice is None:
        return _SHOW[Kind.MORE]
    return _SHOW[calibration.advice.kind]


_SHOW = {
    Kind.TILTED: "take pairs with the board tilted by 20 to 45 degrees, in all directions",
    Kind.CORNERS: "take pairs with the board in the corners of both images",
    Kind.NEAR: "take pairs with the board so near that it fills more than half of the image's width",
    Kind.FAR: "take pairs with the board farther away, at a fifth of the image's width",
    Kind.MORE: "take more pairs like these",
}

_CURES = {
    Reason.NO_PARTNER: "give both images of a pair the same number",
    Reason.UNREADABLE: "copy the images again",
    Reason.OTHER_SIZE: "take all images of one camera at one resolution",
    Reason.TURNED: (
        "hold each camera the same way in all images; if only a phone's EXIF tag differs, remove the tag from all of them"
    ),
    Reason.NOT_FOUND_LEFT: "show the board sharp and evenly lit, a chessboard whole, and check --board",
    Reason.NOT_FOUND_RIGHT: "show the board sharp and evenly lit, a chessboard whole, and check --board",
    Reason.NOT_FOUND_BOTH: "show the board sharp and evenly lit, a chessboard whole, and check --board",
    Reason.CORNERS_LEFT: "avoid glare and blur",
    Reason.CORNERS_RIGHT: "avoid glare and blur",
    Reason.MOVED: "hold the board still, or put it down, until both cameras have their image",
    Reason.REPEATED: "delete the copies, and take pairs with the board elsewhere in their place",
}
