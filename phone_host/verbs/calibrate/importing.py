"""phone-host calibrate --import and --export: calibrations of other programs become rig.yaml, and rig.yaml becomes theirs."""

import argparse
import re
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from common.errors import DataError, SettingsError, UnavailableError
from common.imagesize.head import size_text
from common.places import Kind, kind_of, resolved
from common.program.terminal import say
from common.versions import REPORT_FORMAT
from phone_host.calibration.causes.name import BASELINE_OFF
from phone_host.declared_settings import NEAR_M
from phone_host.model import Rectification, Rig, Side
from phone_host.output.atomic import write_text
from phone_host.output.json_text import json_text
from phone_host.output.rig_files.imported import Imported, RigKind, export_texts, import_rig
from phone_host.output.rig_yaml import is_rig, read_rig_views
from phone_host.stereo.rectify import rectify_rig
from phone_host.stereo.reproject import disparities_for_near
from phone_host.verbs.calibrate.arguments import EXPORTS
from phone_host.verbs.calibrate.given import require_import_alone
from phone_host.verbs.calibrate.rig_file import earlier_words, replace_rig
from phone_host.verbs.output_folders import (
    PAGE,
    REPORT,
    claim_names,
    drop_page,
    keep_other_report,
    require_file,
    spare_names,
    unwritable,
)
from phone_host.verbs.units import baseline_mm, length_mm

Sizes = tuple[tuple[int, int], tuple[int, int]]

_SIZE: Final = re.compile(r"([1-9]\d{0,5})x([1-9]\d{0,5})", re.ASCII)
_OF_RECTIFIED: Final = frozenset({RigKind.MIDDLEBURY.value, RigKind.KITTI.value})

REFUSED: Final = "run and stereo refuse this calibration unless --use-rejected-rig is given"


def import_calibration(options: argparse.Namespace) -> int:
    """Read, check and write a calibration of another program."""
    require_import_alone(options)
    require_file(options.out)
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
    report = _report(found)
    if not same:
        _require_own(options.out)
        keep_other_report(options.out.parent, "calibrate")
        drop_page(options.out.parent, "calibrate")
        claim_names(options.out.parent, options.out, options.out.name, REPORT)
    report |= write_exports(options, found.rig, rectification, found.files)
    if not same:
        try:
            views = read_rig_views(found.files[0]) if found.kind is RigKind.RIG else None
            report |= replace_rig(options.out, found.rig, rectification, views)
            write_text(options.out.with_name(REPORT), json_text(report, indent=2) + "\n")
        except OSError as error:
            raise unwritable(options.out, error) from error
    if options.json:
        print(json_text(report))
    else:
        written = [] if same else [f"written to {options.out}{earlier_words(report)}"]
        say([*_lines(found, report), *export_lines(report, rectification), *written])
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


def _require_own(out: Path) -> None:
    if kind_of(out) is not Kind.MISSING and not is_rig(out):
        raise UnavailableError(f"{out} is not a calibration, and would be replaced", "name another --out")


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


def _report(found: Imported) -> dict[str, Any]:
    rig = found.rig
    cameras = {"left": rig.left, "right": rig.right}
    return {
        "format_version": REPORT_FORMAT,
        "command": "calibrate",
        "imported": {
            "kind": found.kind.value,
            "files": [str(path) for path in found.files],
            "notes": list(found.notes),
        },
        "baseline_mm": round(float(np.linalg.norm(rig.t_right_left_m)) * 1e3, 4),
        "focal_px": {side: [round(float(model.matrix[i, i]), 3) for i in (0, 1)] for side, model in cameras.items()},
        "sizes": {side: f"{model.width_px}x{model.height_px}" for side, model in cameras.items()},
        "board_side": rig.board_side.value,
        "verdict": None if rig.verdict is None else rig.verdict.value,
    }


def _lines(found: Imported, report: dict[str, Any]) -> list[str]:
    sizes, focal = report["sizes"], report["focal_px"]
    return [
        f"imported {found.kind.value}: {' and '.join(map(str, found.files))}",
        *(f"note     {note}" for note in found.notes),
        f"images   left {sizes['left']}, right {sizes['right']} px",
        f"focal    left {focal['left'][0]:.1f}, right {focal['right'][0]:.1f} px",
        f"baseline {report['baseline_mm']:.2f} mm",
        "         compare it with a ruler: it shows a wrong unit",
        *([f"verdict  {report['verdict']}"] if report["verdict"] else []),
        *([REFUSED] if found.rig.is_rejected else []),
    ]


def write_exports(
    options: argparse.Namespace, rig: Rig, rectification: Rectification, inputs: tuple[Path, ...] = ()
) -> dict[str, Any]:
    """Write a rig as files of the programs that --export names, into a folder for each beside --out.

    Args:
        options: as parsed.
        rig: two cameras.
        rectification: computed from the same rig.
        inputs: files that must stay as they are.

    Returns:
        For the report: the files of each kind; empty without --export.

    Raises:
        DataError: a program cannot hold the rig.
        SettingsError: an input would be replaced.
        UnavailableError: a file cannot be written, or is not ours.
    """
    along_px = rectification.height_px if rectification.epipolar.is_vertical else rectification.width_px
    disparities = disparities_for_near(rectification.geometry, NEAR_M, along_px)
    kinds = [RigKind(name) for name in dict.fromkeys(options.exports)]
    texts = {kind: export_texts(rig, rectification, kind, disparities) for kind in kinds}
    kept = {resolved(path) for path in inputs}
    written: dict[str, list[str]] = {}
    for kind, made in texts.items():
        for each in made:
            path = options.out.parent / kind.value / each.name
            if resolved(path) in kept:
                raise SettingsError(
                    f"--export {kind.value} would replace {path}, which is imported", "name another --out"
                )
            claim_names(path.parent, options.out, path.name)
            try:
                write_text(path, each.text)
            except OSError as error:
                raise unwritable(options.out, error) from error
            written.setdefault(kind.value, []).append(str(path))
    return {"exported": written} if written else {}


def export_lines(report: dict[str, Any], rectification: Rectification) -> list[str]:
    """Return a line for each exported kind, and which images a calib.txt is for."""
    exported: dict[str, list[str]] = report.get("exported", {})
    lines = [f"exported {kind}: {', '.join(files)}" for kind, files in exported.items()]
    if not _OF_RECTIFIED.isdisjoint(exported):
        size = size_text((rectification.width_px, rectification.height_px))
        lines.append(
            f"         calib.txt is for rectified images of {size} px, not for images as the cameras take them"
        )
    return lines
