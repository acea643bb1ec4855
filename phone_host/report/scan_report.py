"""The report of `scan`: what became of each pair, and how good the model is. Pure.

`scan_json`, `scan_lines` and `scan_page` tell it to programs, on a terminal and on a page.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from typing import Final, assert_never

import numpy as np

from common.diagnostic import Diagnostic
from common.words import counted, two_digits
from phone_host.model import StereoGeometry, UnseenSurface
from phone_host.output.axes import Axes
from phone_host.report.report_page import Headline
from phone_host.report.stereo_report import ALWAYS, FailedPair, Size
from phone_host.scan.mat import Mat
from phone_host.scan.mat_pose import MatSaid
from phone_host.scan.mesh import NO_SIZE, MeshSize
from phone_host.scan.scanned import ScannedPair
from phone_host.scan.surface_error import ErrorScope
from phone_host.scan.tracking_words import OF_TABLE, OF_TURNING, Tracking, Weakness
from phone_host.scan.volume_settings import VolumeSettings

_RIG_SIGMA: Final = 0.002
"""Of the rig's baseline and of a ruler on the print, as shares: a good calibration, and 0.2 mm on ten centimetres."""

_SIGMAS: Final = 3.0


@dataclass(frozen=True, slots=True, kw_only=True)
class MatFigures:
    """A mat in numbers.

    Attributes:
        name: as `--mat` takes it.
        pairs: that show it.
        corners: that it has.
        seen: corners seen in the left and the right image, median of these pairs.
        sigma_m: standard deviation of where the object stands, m, median.
        square_m: side of a square as its name says, m.
        measured_m: as the rig measures it, m.
        measured_sigma_m: its standard deviation, the rig's own included, m.
    """

    name: str
    pairs: int
    corners: int
    seen: tuple[float, float]
    sigma_m: float
    square_m: float
    measured_m: float
    measured_sigma_m: float

    @property
    def is_to_scale(self) -> bool:
        """Whether what the rig measures agrees with the mat's name."""
        return abs(self.measured_m - self.square_m) <= _SIGMAS * self.measured_sigma_m

    @property
    def remarks(self) -> tuple[Diagnostic, ...]:
        """What must be said of it."""
        if self.is_to_scale:
            return ()
        named, measured = (f"{length * 1e3:.4g} mm" for length in (self.square_m, self.measured_m))
        return (
            Diagnostic(
                f"the mat's squares are {measured} long as the rig measures them, and {named} by its name; the model has the rig's metre",
                "measure ten squares with a ruler: if the rig is right, give --mat that side or print at 100 %, else calibrate again",
            ),
        )


def mat_figures(mat: Mat, told: Sequence[MatSaid]) -> MatFigures:
    """Sum up what a mat told."""
    scale, square_m = told[-1].scale, mat.board.square_m
    left, right = np.median([each.seen for each in told], axis=0).tolist()
    return MatFigures(
        name=mat.name,
        pairs=len(told),
        corners=mat.board.columns * mat.board.rows,
        seen=(left, right),
        sigma_m=float(np.median([each.sigma_m for each in told])),
        square_m=square_m,
        measured_m=scale.value * square_m,
        measured_sigma_m=math.hypot(scale.sigma, _RIG_SIGMA) * square_m,
    )


MODEL, TRAJECTORY = "model.ply", "trajectory.txt"
_LEAST_SHARE: Final = 0.5
"""Of the pairs in the model; with fewer it is not what was walked around."""

_USUAL_SHARE: Final = 0.9


@dataclass(frozen=True, slots=True)
class Stretch:
    """Pairs in a row that went alike."""

    pairs: tuple[ScannedPair, ...]

    @property
    def sentence(self) -> str:
        """Which pairs, what happened, what helps."""
        first, last, one = self.pairs[0].name, self.pairs[-1].name, len(self.pairs) == 1
        which = f"pair {first} is" if one else f"pairs {first} to {last} are"
        how = "not in the model" if not self.pairs[0].is_fused else "in the model, but uncertain"
        return f"{which} {how}: {self.pairs[0].weakness.advice}"


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelFigures:
    """A model in numbers.

    Attributes:
        noise_m: median standard deviation of its points, m; NaN without points.
        noise_p95_m: of which 19 in 20 are better.
        error_scope: what these two cover.
        unseen_share: share of the closed surface that no view measured, 0..1, whether or not it is cut; NaN: nothing was closed.
        memory_bytes: of the field.
        left_out: blocks for which there was no memory.
    """

    points: int = 0
    triangles: int = 0
    size: MeshSize = NO_SIZE
    noise_m: float = math.nan
    noise_p95_m: float = math.nan
    error_scope: ErrorScope = ErrorScope.NOISE
    unseen_share: float = math.nan
    memory_bytes: int = 0
    left_out: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class ScanReport:
    """Everything that is told of a scan.

    Attributes:
        pairs: in order.
        settings: how the model was made; None: no pair had depth.
        geometry: of the rectified pairs; None: as above.
        axes: of model.ply.
        interrupted_of: how many pairs were to be taken when it was interrupted; 0: it was not.
        keeps_field: whether field.bin is written, too.
        mat: on which the object lies; None: there is none.
        unused_mat: what is said, among the remarks, of a printed mat that is in view and not used; None: there is none.
        unseen: what the files hold of the surface that no view measured.
    """

    pairs: tuple[ScannedPair | FailedPair, ...]
    model: ModelFigures
    settings: VolumeSettings | None
    geometry: StereoGeometry | None
    rectified_px: Size
    matcher: str
    axes: Axes = Axes.CAMERA
    remarks: tuple[Diagnostic, ...] = ()
    interrupted_of: int = 0
    keeps_field: bool = False
    mat: Mat | None = None
    unused_mat: Diagnostic | None = None
    unseen: UnseenSurface = UnseenSurface.FILL

    @property
    def files(self) -> tuple[str, ...]:
        """Names of what is written."""
        return (MODEL, TRAJECTORY, *ALWAYS, *(["field.bin"] if self.keeps_field else []))

    @property
    def scanned(self) -> tuple[ScannedPair, ...]:
        """The pairs that were computed."""
        return tuple(pair for pair in self.pairs if isinstance(pair, ScannedPair))

    @property
    def failed(self) -> tuple[FailedPair, ...]:
        """The pairs that were not."""
        return tuple(pair for pair in self.pairs if isinstance(pair, FailedPair))

    @property
    def fused(self) -> int:
        """Pairs that are in the model."""
        return sum(pair.is_fused for pair in self.scanned)

    @property
    def off_m(self) -> float:
        """Mean distance of a pair's depths from the model, median of the pairs in it, m; NaN: fewer than two are."""
        off = [pair.off_m for pair in self.scanned if pair.is_fused and math.isfinite(pair.off_m)]
        return float(np.median(off)) if off else math.nan

    @property
    def on_mat(self) -> MatFigures | None:
        """What the mat told; None: there is none, or no pair shows it."""
        told = [pair.mat for pair in self.scanned if pair.mat is not None]
        return None if self.mat is None or not told else mat_figures(self.mat, told)

    @property
    def stretches(self) -> tuple["Stretch", ...]:
        """Pairs in a row that are weak or lost; without those whose advice the unused mat replaces."""
        replaced = () if self.unused_mat is None else (*OF_TURNING, *OF_TABLE)
        return tuple(each for each in stretches(self.scanned) if each.pairs[0].weakness not in replaced)

    @property
    def path_m(self) -> float:
        """How far the camera went between the pairs in the model, m."""
        places = np.array([pair.world_camera.t_m for pair in self.scanned if pair.is_fused]).reshape(-1, 3)
        return float(np.linalg.norm(np.diff(places, axis=0), axis=1).sum())

    @property
    def is_sound(self) -> bool:
        """Whether there is a model of most pairs and nothing failed. Everything that makes the exit code 4 is here."""
        return scan_verdict(self)[0] is not Headline.BAD and not self.failed


def stretches(pairs: Sequence[ScannedPair]) -> tuple[Stretch, ...]:
    """Gather pairs in a row that are weak or lost for the same reason."""
    groups = groupby(pairs, lambda pair: (pair.is_fused, pair.weakness))
    return tuple(Stretch(tuple(group)) for (_, weakness), group in groups if weakness is not Weakness.NONE)


def scan_verdict(report: ScanReport) -> tuple[Headline, str]:
    """Judge a scan."""
    if report.interrupted_of:
        verdict, sentence = scan_verdict(replace(report, interrupted_of=0))
        stopped = f"Interrupted after {len(report.pairs)} of {counted(report.interrupted_of, 'pair')}. "
        return Headline.WARNING if verdict is Headline.GOOD else verdict, stopped + sentence
    blocking = next((remark.message for remark in report.remarks if remark.is_failure), "")
    fused, count = report.fused, len(report.pairs)
    if blocking:
        return Headline.BAD, f"The model cannot be right: {blocking}."
    unseen = report.model.unseen_share
    if unseen >= 1:
        return (
            Headline.BAD,
            f"No part of the surface was in view: {fused} of {counted(count, 'pair')} could be aligned.",
        )
    if not report.model.triangles:
        return Headline.BAD, f"There is no surface: {fused} of {counted(count, 'pair')} could be aligned."
    told = f"{fused} of {counted(count, 'pair')} are in the model"
    if fused < max(2, _LEAST_SHARE * count):
        return Headline.BAD, f"Only {told}."
    sure = sum(pair.state in {Tracking.TRACKING, Tracking.RELOCALISED} for pair in report.scanned)
    model, is_stated = report.model, math.isfinite(report.model.noise_m)
    known = f". {surface_error_sentence(model.noise_m, model.error_scope)}" if is_stated else ""
    is_doubtful = report.unused_mat is not None or (is_stated and model.error_scope is ErrorScope.NOISE)
    verdict = Headline.GOOD if not is_doubtful and min(fused, sure + 1) >= _USUAL_SHARE * count else Headline.WARNING
    closed = "" if math.isnan(unseen) else f". {unseen_sentence(unseen, report.unseen)}"
    return verdict, f"{f'All {count} pairs are in the model' if fused == count else told}{known}{closed}."


def surface_error_sentence(error_m: float, scope: ErrorScope) -> str:
    """State the expected error of a model's surface, without a full stop.

    Args:
        error_m: median standard deviation of the surface's points, m.
        scope: what it covers.
    """
    return f"Expected surface error: \u00b1{two_digits(error_m * 1e3)} mm ({scope.value})"


def unseen_sentence(share: float, choice: UnseenSurface) -> str:
    """Say how much of the surface no view measured, and what the files hold of it, without a full stop.

    Args:
        share: 0..1.
        choice: what the files hold.
    """
    return f"{share_text(share)} was never in view and {unseen_words(choice)}"


def unseen_words(choice: UnseenSurface) -> str:
    """Say what the files hold of the surface that no view measured, to follow `was never in view and`."""
    match choice:
        case UnseenSurface.FILL:
            return "is filled in"
        case UnseenSurface.PINK:
            return "is filled in, in pink"
        case UnseenSurface.CUT:
            return "is cut, so the surface is open"
    assert_never(choice)


def share_text(share: float) -> str:
    """Write a share in percent: `12 %`, `0.4 %`, `0 %`."""
    return f"{100 * share:.0f} %" if share >= 0.01 or share == 0 else f"{100 * share:.1g} %"
