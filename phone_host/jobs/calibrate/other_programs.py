"""phone-host calibrate --import and --export: calibrations of other programs become rig.yaml, and rig.yaml files of theirs."""

from dataclasses import replace
from itertools import groupby
from pathlib import Path
from typing import Final

import numpy as np

from common.errors import DataError, SettingsError
from common.imagesize.head import size_text
from common.places import resolved
from phone_host.calibration.failure_modes.name import BASELINE_OFF
from phone_host.declared_settings import NEAR_M
from phone_host.jobs.calibrate.request import EXPORTS, CalibrateRequest
from phone_host.jobs.calibrate.rig_file import replace_rig, require_own
from phone_host.jobs.output_folders import (
    announce_other_report,
    claim_names,
    require_alone,
    require_file,
    spare_names,
    stale_page,
    written_together,
)
from phone_host.model import Rectification, Rig, Side
from phone_host.output.atomic import write_text
from phone_host.output.json_text import json_text
from phone_host.output.report_owner import PAGE, REPORT
from phone_host.output.rig_files.imported import Imported, RigKind, export_texts, import_rig
from phone_host.output.rig_yaml import read_rig_views
from phone_host.report.calibration_lines import REFUSED, earlier_words
from phone_host.report.calibration_report import Exported, ImportReport
from phone_host.report.calibration_result import import_values
from phone_host.run.progress_bar import tell
from phone_host.stereo.rectify import rectify_rig
from phone_host.stereo.reproject import disparities_for_near

_OF_RECTIFIED: Final = frozenset({RigKind.MIDDLEBURY, RigKind.KITTI})


def import_calibration(request: CalibrateRequest) -> tuple[ImportReport, list[str]]:
    """Read, check and write a calibration of another program.

    Returns:
        What came of it, and its summary.

    Raises:
        SettingsError: options contradict each other, or would replace what is imported.
        DataError: it cannot be read, or is not what the user measured.
        UnavailableError: a file cannot be written.
    """
    request.require_import_alone()
    require_file(request.out)
    require_alone(request.out.parent)
    spare_names(request.out, REPORT, PAGE, *EXPORTS)
    found = import_rig(request.imported or (), request.unit_m, request.sizes_px)
    _require_baseline(found.rig, request.baseline_m)
    side = request.board_side or found.rig.board_side
    rectification = rectify_rig(found.rig)
    same = resolved(request.out) in {resolved(path) for path in found.files}
    if same and found.kind is not RigKind.RIG:
        raise SettingsError(f"--out {request.out} is the file that is imported", "name another --out")
    if same and side is not found.rig.board_side:
        raise SettingsError(f"--board-side {side.value} would change {request.out}", "name another --out")
    found = replace(found, rig=_on_side(found.rig, side))
    if not same:
        require_own(request.out)
        announce_other_report(request.out.parent, "calibrate", tell)
        claim_names(request.out.parent, request.out, request.out.name, REPORT)
    report = ImportReport(imported=found, exported=write_exports(request, found.rig, rectification, found.files))
    if not same:
        views = read_rig_views(found.files[0]) if found.kind is RigKind.RIG else None
        with written_together(
            request.out.parent, REPORT, replaces=stale_page(request.out.parent, "calibrate"), command="calibrate"
        ) as place:
            report = replace(report, earlier_rig=replace_rig(place, request.out, found.rig, rectification, views))
            write_text(place / REPORT, json_text(import_values(report), indent=2) + "\n")
    written = [] if same else [f"written to {request.out}{earlier_words(report.earlier_rig)}"]
    lines = _lines(found, is_measured=request.baseline_m is not None)
    return report, [*lines, *export_lines(report.exported, rectification), *written]


def _require_baseline(rig: Rig, measured_m: float | None) -> None:
    """Compare the imported baseline with what a ruler says.

    Raises:
        DataError: they differ by more than a ruler is off.
    """
    if measured_m is None:
        return
    measured_mm, imported_mm = measured_m * 1e3, float(np.linalg.norm(rig.t_right_left_m)) * 1e3
    if abs(measured_mm / imported_mm - 1) > BASELINE_OFF:
        raise DataError(
            f"the imported cameras are {imported_mm:.1f} mm apart, and you measured {measured_mm:.1f} mm",
            "say with --unit what 1 in the file's lengths is, or measure again",
        )


def _on_side(rig: Rig, side: Side) -> Rig:
    """Return the rig with the board's camera on a side; its time offset is of the host's camera against the board's."""
    if side is rig.board_side:
        return rig
    offset = replace(rig.time_offset, offset_ns=-rig.time_offset.offset_ns)
    return replace(rig, board_side=side, time_offset=offset)


def _lines(found: Imported, *, is_measured: bool) -> list[str]:
    rig = found.rig
    left, right = (size_text((model.width_px, model.height_px)) for model in (rig.left, rig.right))
    return [
        f"imported {found.kind.value}: {' and '.join(map(str, found.files))}",
        *(f"note     {note}" for note in found.notes),
        f"images   left {left}, right {right} px",
        f"focal    left {rig.left.matrix[0, 0]:.1f}, right {rig.right.matrix[0, 0]:.1f} px",
        f"baseline {np.linalg.norm(rig.t_right_left_m) * 1e3:.2f} mm",
        *([] if is_measured else ["         compare it with a ruler: it shows a wrong unit"]),
        *([] if rig.verdict is None else [f"verdict  {rig.verdict.value}"]),
        *([REFUSED] if rig.is_rejected else []),
    ]


def write_exports(
    request: CalibrateRequest, rig: Rig, rectification: Rectification, inputs: tuple[Path, ...] = ()
) -> tuple[Exported, ...]:
    """Write a rig as files of the programs that --export names, into a folder for each beside --out.

    Args:
        request: of the calibration.
        rig: two cameras.
        rectification: computed from the same rig.
        inputs: files that must stay as they are.

    Returns:
        The files of each kind; empty without --export.

    Raises:
        DataError: a program cannot hold the rig.
        SettingsError: an input would be replaced.
        UnavailableError: a file cannot be written, or is not ours.
    """
    along_px = rectification.height_px if rectification.epipolar.is_vertical else rectification.width_px
    disparities = disparities_for_near(rectification.geometry, NEAR_M, along_px)
    kinds = [RigKind(name) for name in dict.fromkeys(request.exports)]
    texts = [
        (kind, export_texts(rig, rectification, kind, disparities)) for kind in kinds
    ]  # all, before one is written
    kept = {resolved(path) for path in inputs}
    written = []
    for kind, made in texts:
        folder = request.out.parent / kind.value
        for path in (folder / each.name for each in made):
            if resolved(path) in kept:
                raise SettingsError(
                    f"--export {kind.value} would replace {path}, which is imported", "name another --out"
                )
        paths = {folder / each.name: each.text for each in made}
        for inner, group in groupby(paths, lambda path: path.parent):  # EuRoC's lie in a folder for each camera
            names = [path.name for path in group]
            with written_together(inner, *names) as place:
                for name in names:
                    write_text(place / name, paths[inner / name])
        written.append(Exported(kind, tuple(paths)))
    return tuple(written)


def export_lines(exported: tuple[Exported, ...], rectification: Rectification | None) -> list[str]:
    """Return a line for each exported kind, and which images a calib.txt is for; nothing was exported of a rig that cannot be rectified."""
    lines = [f"exported {each.kind.value}: {', '.join(map(str, each.files))}" for each in exported]
    if rectification is not None and not _OF_RECTIFIED.isdisjoint(each.kind for each in exported):
        size = size_text((rectification.width_px, rectification.height_px))
        lines.append(
            f"         calib.txt is for rectified images of {size} px, not for images as the cameras take them"
        )
    return lines
