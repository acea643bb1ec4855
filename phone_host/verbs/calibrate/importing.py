"""phone-host calibrate --import: calibrations of other programs become rig.yaml."""

import argparse
import re
from dataclasses import replace
from typing import Final

import numpy as np

from common.errors import DataError, SettingsError
from common.imagesize.head import size_text
from common.places import resolved
from common.program.terminal import say
from phone_host.calibration.failure_modes.name import BASELINE_OFF
from phone_host.jobs.output_folders import (
    announce_other_report,
    claim_names,
    require_alone,
    require_file,
    spare_names,
    stale_page,
    written_beside,
)
from phone_host.jobs.units import baseline_mm, length_mm
from phone_host.model import Rig, Side
from phone_host.output.atomic import write_text
from phone_host.output.json_text import json_text
from phone_host.output.report_owner import PAGE, REPORT
from phone_host.output.rig_files.imported import Imported, RigKind, import_rig
from phone_host.output.rig_yaml import read_rig_views
from phone_host.stereo.rectify import rectify_rig
from phone_host.verbs.calibrate.arguments import EXPORTS
from phone_host.verbs.calibrate.exporting import export_lines, write_exports
from phone_host.verbs.calibrate.given import require_import_alone
from phone_host.verbs.calibrate.report import ImportReport
from phone_host.verbs.calibrate.report_json import import_values
from phone_host.verbs.calibrate.rig_file import REFUSED, earlier_words, replace_rig, require_own

Sizes = tuple[tuple[int, int], tuple[int, int]]

_SIZE: Final = re.compile(r"([1-9]\d{0,5})x([1-9]\d{0,5})", re.ASCII)


def import_calibration(options: argparse.Namespace) -> int:
    """Read, check and write a calibration of another program."""
    require_import_alone(options)
    require_file(options.out)
    require_alone(options.out.parent)
    spare_names(options.out, REPORT, PAGE, *EXPORTS)
    found = import_rig(tuple(options.imported), _unit_m(options.unit), _sizes_px(options.size))
    _require_baseline(found.rig, options.baseline)
    side = Side(options.board_side or found.rig.board_side.value)
    rectification = rectify_rig(found.rig)
    same = resolved(options.out) in {resolved(path) for path in found.files}
    if same and found.kind is not RigKind.RIG:
        raise SettingsError(f"--out {options.out} is the file that is imported", "name another --out")
    if same and side is not found.rig.board_side:
        raise SettingsError(f"--board-side {side.value} would change {options.out}", "name another --out")
    found = replace(found, rig=_on_side(found.rig, side))
    if not same:
        require_own(options.out)
        announce_other_report(options.out.parent, "calibrate")
        claim_names(options.out.parent, options.out, options.out.name, REPORT)
    report = ImportReport(imported=found, exported=write_exports(options, found.rig, rectification, found.files))
    if not same:
        views = read_rig_views(found.files[0]) if found.kind is RigKind.RIG else None
        with written_beside(
            options.out, REPORT, replaces=stale_page(options.out.parent, "calibrate"), command="calibrate"
        ) as place:
            report = replace(report, earlier_rig=replace_rig(place, options.out, found.rig, rectification, views))
            write_text(place / REPORT, json_text(import_values(report), indent=2) + "\n")
    if options.json:
        print(json_text(import_values(report)))
    else:
        written = [] if same else [f"written to {options.out}{earlier_words(report.earlier_rig)}"]
        say(
            [
                *_lines(found, is_measured=options.baseline is not None),
                *export_lines(report.exported, rectification),
                *written,
            ]
        )
    return 0


def _require_baseline(rig: Rig, measured: str | None) -> None:
    """Compare the imported baseline with what a ruler says.

    Raises:
        DataError: they differ by more than a ruler is off.
    """
    if measured is None:
        return
    measured_mm, imported_mm = baseline_mm(measured), float(np.linalg.norm(rig.t_right_left_m)) * 1e3
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


def _unit_m(text: str | None) -> float | None:
    return None if text is None else length_mm(text, "--unit", "1mm") / 1000


def _sizes_px(text: str | None) -> Sizes | None:
    """Read --size: 640x480, or 640x480,1280x720.

    Raises:
        SettingsError: it is no size.
    """
    if text is None:
        return None
    sizes = [(int(found[1]), int(found[2])) for part in text.split(",") if (found := _SIZE.fullmatch(part.strip()))]
    if len(sizes) != text.count(",") + 1 or len(sizes) > 2:
        raise SettingsError(f"--size is {text!r}", "give width and height in px, such as 640x480")
    return sizes[0], sizes[-1]


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
