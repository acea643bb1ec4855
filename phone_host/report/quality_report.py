"""The report of `quality`: how well a rig's depth shows a flat wall or board. Pure.

`quality_json`, `quality_lines` and `quality_page` tell it to programs, on a terminal and on a page.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final, assert_never

import numpy as np

from common.diagnostic import Diagnostic, Severity
from common.words import counted
from phone_host.model import PlaneQuality, Seen, StereoGeometry
from phone_host.report.report_page import Headline
from phone_host.report.stereo_report import FailedPair, Size

NO_TRUTH: Final = "give --distance, measured along the left camera's axis, or --board and --square, to learn the bias"

MOST_MAPS: Final = 30
"""Pairs that the page shows maps of; each takes 140 KB of it."""

MAPS_LEFT_OUT: Final = f"maps are those of the first {MOST_MAPS} pairs; report.json has the tiles of all"


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class MeasuredPair:
    """A pair that was computed.

    Attributes:
        name: for tables: the left image.
        left: path of the left image; `right` likewise.
        calibration_error_m: bias that the calibration's own uncertainty leads one to expect, plus or minus, m; NaN: not known.
        board_misfit_px: RMS distance of a board's corners from its pose, px; NaN: no board.
        corners_bias_share: bias of the depths of a board's corners, from their own disparities, as a share: that of the rig
            alone, without matching; NaN: not known.
        picture: the distances from the plane, JPEG; empty without a plane.
        picture_range_px: distance of its strongest colours, px.
    """

    name: str
    left: str
    right: str
    rectified_px: Size
    geometry: StereoGeometry
    quality: PlaneQuality
    calibration_error_m: float
    board_misfit_px: float
    corners_bias_share: float
    picture: bytes
    picture_range_px: float
    remarks: tuple[Diagnostic, ...] = ()

    @property
    def is_plane(self) -> bool:
        """Whether a plane was seen, so that the figures hold."""
        return self.quality.seen is Seen.PLANE


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class QualityReport:
    """All pairs.

    Attributes:
        pairs: in order.
        left_alone: left images without a partner; `right_alone` likewise.
        remarks: told once.
        interrupted_of: how many pairs were to be measured when the command was interrupted; 0: it was not.
    """

    pairs: tuple[MeasuredPair | FailedPair, ...]
    matcher: str
    left_alone: tuple[str, ...] = ()
    right_alone: tuple[str, ...] = ()
    remarks: tuple[Diagnostic, ...] = ()
    interrupted_of: int = 0

    @property
    def measured(self) -> tuple[MeasuredPair, ...]:
        """The pairs that were computed, with and without a plane."""
        return tuple(pair for pair in self.pairs if isinstance(pair, MeasuredPair))

    @property
    def planes(self) -> tuple[MeasuredPair, ...]:
        """The pairs that show a plane."""
        return tuple(pair for pair in self.measured if pair.is_plane)

    @property
    def is_sound(self) -> bool:
        """Whether every pair shows a plane."""
        return len(self.planes) == len(self.pairs)

    @property
    def knows_truth(self) -> bool:
        """Whether the true distance of some plane is known."""
        return any(math.isfinite(pair.quality.true_m) for pair in self.planes)

    @property
    def sigma_px(self) -> float:
        """Median sub-pixel RMS of the planes, px: sigma_d of theory; NaN without any."""
        found = [pair.quality.subpixel_rms_px for pair in self.planes]
        return float(np.median(found)) if found else math.nan

    def theory_m(self, distance_m: float) -> float:
        """Return z^2 sigma_d / (f b) at a distance, m, with the geometry of the first plane; NaN without any."""
        if not self.planes:
            return math.nan
        geometry = self.planes[0].geometry
        return distance_m**2 * self.sigma_px / (geometry.focal_px * geometry.baseline_m)


def flaw(quality: PlaneQuality) -> Diagnostic | None:
    """Say why the region shows no plane, and what helps; None if it is one."""
    match quality.seen:
        case Seen.PLANE:
            return None
        case Seen.TOO_FEW:
            return Diagnostic(
                f"no plane can be fitted: only {quality.fill:.1%} of the region has depth",
                "aim at a wall with texture (posters, newspaper), light it well, and stand no nearer than --near",
                severity=Severity.FAIL,
            )
        case Seen.OFF_PLANE:
            return Diagnostic(
                f"the region shows no plane: {quality.off_plane:.0%} of the disparities lie far off the best one",
                "aim at one flat textured wall with nothing before it, or choose a flat part with --roi X,Y,W,H",
                severity=Severity.FAIL,
            )
        case Seen.ENDLESS:
            return Diagnostic(
                "the plane in view reaches infinity inside the region",
                "aim at a wall, not along a floor or a table, or choose a nearer part with --roi X,Y,W,H",
                severity=Severity.FAIL,
            )
        case Seen.BENT:
            return Diagnostic(
                f"the region shows no plane: neighbouring disparities lie off it together, by {quality.bend_px:.2f} px RMS",
                "aim at one flat wall or board with nothing before it; if it is flat, the calibration's lens model is wrong: calibrate again",
                severity=Severity.FAIL,
            )
        case Seen.SCATTERED:
            return Diagnostic(
                f"the region shows no plane: disparities scatter by {quality.subpixel_rms_px:.1f} px around the best one",
                "aim at a textured wall, light it well, and check that the calibration fits these cameras",
                severity=Severity.FAIL,
            )
        case _:
            assert_never(quality.seen)


def quality_verdict(report: QualityReport) -> tuple[Headline, str]:
    """Return how the measurement went, and the first sentence of terminal and page."""
    planes, count = report.planes, len(report.pairs)
    if report.interrupted_of:
        verdict, sentence = quality_verdict(replace(report, interrupted_of=0))
        stopped = f"Interrupted after {count} of {counted(report.interrupted_of, 'pair')}."
        return Headline.WARNING if verdict is Headline.GOOD else verdict, f"{stopped} {sentence}"
    if not planes:
        first = report.pairs[0]
        if isinstance(first, FailedPair):
            return Headline.BAD, f"No pair was measured. The first: {first.failure.message}"
        problem = flaw(first.quality)
        assert problem is not None
        said = problem.message
        return (
            Headline.BAD,
            f"{said[0].upper()}{said[1:]}" if count == 1 else f"No pair shows a plane. The first: {said}",
        )
    grade = Headline.GOOD if report.is_sound else Headline.WARNING
    if count == 1:
        return grade, _one_words(planes[0].quality)
    few = "" if len(planes) == count else f"{len(planes)} of "
    near, far = _spread([pair.quality.distance_m for pair in planes])
    middle = (
        f"{few}{counted(count, 'pair')} show a plane, {near:.3f} to {far:.3f} m away. Medians: depth scatters by"
        f" {_median([pair.quality.rms_m for pair in planes]) * 1e3:.3g} mm"
        f" ({_median([pair.quality.rms_share for pair in planes]):.2%}) around it, disparity by {report.sigma_px:.3f} px;"
        f" {_median([pair.quality.fill for pair in planes]):.1%} filled"
    )
    if not report.knows_truth:
        return grade, middle
    biases = [pair.quality.bias_share for pair in planes if math.isfinite(pair.quality.bias_share)]
    return grade, f"{middle}; bias {signed(_median(biases) * 100, 2)}%"


def _one_words(quality: PlaneQuality) -> str:
    said = (
        f"At {quality.distance_m:.3f} m depth scatters by {quality.rms_m * 1e3:.3g} mm ({quality.rms_share:.2%}) around the"
        f" plane, disparity by {quality.subpixel_rms_px:.3f} px; {quality.fill:.1%} filled"
    )
    return f"{said}; bias {bias_words(quality)}" if math.isfinite(quality.bias_m) else said


def bias_words(quality: PlaneQuality) -> str:
    """Write the bias in mm and per cent: `+1.2 mm (+0.10%)`; a dash where it is not known."""
    if not math.isfinite(quality.bias_m):
        return "\u2013"
    return f"{signed(quality.bias_m * 1e3, 1)} mm ({signed(quality.bias_share * 100, 2)}%)"


def signed(value: float, digits: int) -> str:
    """Write a number with its sign, also a plus."""
    return f"{value:+.{digits}f}".replace("-", "\u2212")


def _median(values: Sequence[float]) -> float:
    return float(np.median(values))


def _spread(values: Sequence[float]) -> tuple[float, float]:
    return min(values), max(values)
