"""Measures the depth of pairs of image files that show a flat wall or board. The root of `quality`.

A pair that cannot be computed ends the work only if it is the only one. One that shows no plane is reported as that.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from common.diagnostic import Diagnostic
from phone_host.calibration.solve.board_pose import BoardPlane, find_board_plane
from phone_host.calibration.target.corners import Board
from phone_host.diagnostics.codes import Code
from phone_host.diagnostics.headline import depth_error_m
from phone_host.model import Crop, PlaneQuality, Processed, Seen
from phone_host.output.atomic import write_text
from phone_host.output.json_text import json_text
from phone_host.output.residual_view import residual_jpeg
from phone_host.output.result_files import replacing_results
from phone_host.report.quality_json import quality_json
from phone_host.report.quality_page import quality_page
from phone_host.report.quality_report import MeasuredPair, QualityReport
from phone_host.report.stereo_report import ALWAYS, FailedPair, Size
from phone_host.run.file_pairs import ComputedPair, FilePairs, Watcher, compute_pairs
from phone_host.run.stereo_remarks import judge_pair, turned_remarks
from phone_host.stereo.core import StereoCore
from phone_host.stereo.depth_limits import crop_inside
from phone_host.stereo.images import size_px
from phone_host.stereo.plane_quality import (
    KnownPlane,
    NoTruth,
    StatedDistance,
    Truth,
    measure_plane,
    middle_of,
    off_plane_px,
)

NAMES: Final = r"report\.json|index\.html"
"""The names that `quality` writes into its folder."""

_ONE_WIDE_PX, _MANY_WIDE_PX = 800, 480  # of the pictures on the page
_LEAST_RANGE_PX: Final = 0.5
_RANGE_SIGMAS: Final = 4.0


@dataclass(frozen=True, slots=True, kw_only=True)
class QualityJob:
    """What to measure.

    Attributes:
        pairs: the files, and where the results go; their core has geometry.
        distances_m: true distances along the left camera's optical axis, m: one for each pair, one for all, or none.
        board: a board that gives the true plane; None: there is none.
        roi: the region that counts, px of the rectified left image; None: the board's outline, or the middle.
    """

    pairs: FilePairs
    distances_m: tuple[float, ...] = ()
    board: Board | None = None
    roi: Crop | None = None


def run_quality(job: QualityJob, watcher: Watcher) -> QualityReport:
    """Measure all pairs, and write report.json and index.html; after Ctrl-C those of the pairs so far.

    Raises:
        DataError: the only pair, or all pairs, could not be computed.
        SettingsError: the core cannot be made so.
        UnavailableError: a file in the results folder was not written by this program.
        OSError: the results cannot be written.
    """
    pairs = job.pairs

    def report(done: Sequence[MeasuredPair | FailedPair]) -> QualityReport:
        return QualityReport(
            pairs=tuple(done),
            matcher=pairs.matcher,
            left_alone=tuple(map(str, pairs.files.left_alone)),
            right_alone=tuple(map(str, pairs.files.right_alone)),
            remarks=pairs.remarks,
        )

    def keep(done: Sequence[MeasuredPair | FailedPair]) -> None:
        so_far = replace(report(done), interrupted_of=len(pairs.files.pairs))
        if so_far.measured:
            _write(pairs.out, so_far, lambda place: pairs.tell_of_partial(place, len(done)))

    def take(pair: ComputedPair) -> MeasuredPair:
        watcher.say(f"measuring {pair.label}")
        return _measured(job, pair)

    whole = compute_pairs(pairs, watcher, take, report, keep, label=lambda _number, _name, left: left.name)
    _write(pairs.out, whole)
    return whole


def _write(out: Path, report: QualityReport, partial: Callable[[Path], None] | None = None) -> None:
    texts = json_text(quality_json(report), indent=2) + "\n", quality_page(report)
    with replacing_results(out, NAMES, ALWAYS, command="quality", partial=partial) as place:
        for name, text in zip(ALWAYS, texts, strict=True):
            write_text(place / name, text)


def _measured(job: QualityJob, pair: ComputedPair) -> MeasuredPair:
    """Measure one pair."""
    core, processed = pair.core, pair.processed
    assert processed.geometry is not None
    board = None
    if job.board is not None:
        board = find_board_plane(processed.pair, job.board, processed.geometry, pair.label)
    quality = _quality(job, core, processed, board, pair.number)
    range_px = float(f"{max(_LEAST_RANGE_PX, _RANGE_SIGMAS * quality.subpixel_rms_px):.1g}")
    widest_px = _ONE_WIDE_PX if len(job.pairs.files.pairs) == 1 else _MANY_WIDE_PX
    return MeasuredPair(
        name=pair.label,
        left=pair.opened[0].name,
        right=pair.opened[1].name,
        rectified_px=size_px(processed.pair.left),
        geometry=processed.geometry,
        quality=quality,
        calibration_error_m=_calibration_error_m(core, processed, quality.distance_m),
        board_misfit_px=math.nan if board is None else board.misfit_px,
        corners_bias_share=math.nan if board is None else board.corners_bias_share,
        picture=_picture(processed, quality, range_px, widest_px),
        picture_range_px=range_px,
        remarks=(*turned_remarks(*pair.opened), *_doubts(core, processed, job, quality)),
    )


def _picture(processed: Processed, quality: PlaneQuality, range_px: float, widest_px: int) -> bytes:
    """Draw the distances from the plane; empty without one."""
    if quality.seen is Seen.TOO_FEW or processed.disparity is None or processed.geometry is None:
        return b""
    off_px = off_plane_px(processed.disparity, processed.geometry, quality.plane)
    return residual_jpeg(off_px, quality.roi, range_px, widest_px)


def _quality(
    job: QualityJob, core: StereoCore, processed: Processed, board: BoardPlane | None, index: int
) -> PlaneQuality:
    """Measure a pair against what is known of its plane."""
    assert processed.geometry is not None
    assert processed.disparity is not None
    width, height = size_px(processed.pair.left)
    whole = Crop(x_px=0, y_px=0, width_px=width, height_px=height)
    roi = middle_of(width, height) if job.roi is None else crop_inside(job.roi, width, height, "--roi")
    counts, area = np.zeros((height, width), np.bool_), whole if job.roi is None else roi
    counts[roi.y_px : roi.y_px + roi.height_px, roi.x_px : roi.x_px + roi.width_px] = True
    truth: Truth = NoTruth(roi.x_px + (roi.width_px - 1) / 2, roi.y_px + (roi.height_px - 1) / 2)
    if board is not None:
        truth = KnownPlane(plane=board.plane, x_px=board.middle_px[0], y_px=board.middle_px[1])
        if job.roi is None:
            counts, area = board.covers(width, height), _around(board, whole)
    elif job.distances_m:
        distance_m = job.distances_m[index if len(job.distances_m) > 1 else 0]
        truth = StatedDistance(distance_m=distance_m, axis=_axis(core, (width, height)))
    unit_px = 1.0 if processed.search is None else 1 / processed.search.scale
    return measure_plane(processed.disparity, processed.geometry, counts, area=area, truth=truth, unit_px=unit_px)


def _around(board: BoardPlane, whole: Crop) -> Crop:
    """Return the box around a board."""
    left, top = (max(0, math.floor(side)) for side in board.outline_px.min(axis=0))
    right, bottom = (math.ceil(side) + 1 for side in board.outline_px.max(axis=0))
    return Crop(
        x_px=left,
        y_px=top,
        width_px=min(right, whole.width_px) - left,
        height_px=min(bottom, whole.height_px) - top,
    )


def _axis(core: StereoCore, size: Size) -> tuple[float, float, float]:
    """Return the left camera's own optical axis in the rectified axes."""
    rectifier = core.rectifier_for(size)
    if rectifier is None:
        return 0.0, 0.0, 1.0
    x, y, z = rectifier.rectification.R_left[:, 2].tolist()
    return x, y, z


def _calibration_error_m(core: StereoCore, processed: Processed, distance_m: float) -> float:
    """Return the error of a depth that the uncertainty of the rig's disparity zero gives, m; NaN: not known."""
    rectifier = core.rectifier_for(size_px(processed.pair.left))
    if rectifier is None or processed.geometry is None:
        return math.nan
    return depth_error_m(processed.geometry, distance_m, rectifier.rig.zero_sigma_px)


def _doubts(core: StereoCore, processed: Processed, job: QualityJob, quality: PlaneQuality) -> tuple[Diagnostic, ...]:
    """Return what makes the depth wrong for certain; without a plane, the gravest doubt too: it may be why.

    That there is no depth is told already.
    """
    concerns = [one for one in judge_pair(core, processed, job.pairs.mounted).concerns if one.code != Code.NO_DEPTH]
    told = [one for one in concerns if one.is_failure]
    if not told and quality.seen is not Seen.PLANE:
        told = concerns[:1]
    return tuple(told)
