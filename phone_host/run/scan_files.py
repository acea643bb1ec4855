"""The results folder of `scan`: the model first, because it is what took the time."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from dataclasses import field as default
from pathlib import Path
from typing import Any, Final

from common.errors import DataError
from phone_host.output.atomic import write_bytes, write_text
from phone_host.output.json_text import json_text
from phone_host.output.ply import PointCloud, write_surface
from phone_host.output.result_files import replacing_results
from phone_host.output.trajectory_text import Station, tum_text
from phone_host.report.model_view import ShownModel
from phone_host.report.page_links import NextCommand
from phone_host.report.scan_json import scan_json
from phone_host.report.scan_next import next_commands
from phone_host.report.scan_page import scan_page
from phone_host.report.scan_report import MODEL, TRAJECTORY, ScanReport
from phone_host.report.stereo_report import ALWAYS
from phone_host.scan.field_bytes import KeptField, field_of
from phone_host.scan.scan_model import ScanModel
from phone_host.scan.scanned import PoseOrigin

FIELD: Final = "field.bin"
"""The field of a turn, to which another pass is added."""

NAMES: Final = r"model\.ply|trajectory\.txt|report\.json|index\.html|field\.bin"
"""The names that `scan` writes into its folder."""


@dataclass(frozen=True, slots=True, eq=False)
class FinishedScan:
    """What is written of a scan.

    Attributes:
        report: of it.
        model: its whole surface; the files hold it as `report.unseen` says.
        commands: what else to do next, for the page.
        field: its field as bytes, for another pass; empty: it takes none.
        command: the verb that made it.
        told: what that verb adds to report.json.
    """

    report: ScanReport
    model: ScanModel
    commands: tuple[NextCommand, ...] = ()
    field: bytes = b""
    command: str = "scan"
    told: Mapping[str, object] = default(default_factory=dict)


def write_scan(out: Path, scan: FinishedScan, partial: Callable[[Path], None] | None = None) -> None:
    """Write model.ply, trajectory.txt, report.json and index.html; when all are whole they take the place of an earlier run's.

    Where there is no earlier run, a model that is whole stays even if the others have no room.

    Args:
        out: the folder.
        scan: what is written.
        partial: see `replacing_results`; None: the scan is whole.

    Raises:
        UnavailableError: a file there was not written by this program.
        OSError: as the operating system reports it.
    """
    report, model = scan.report, scan.model.with_unseen(scan.report.unseen)
    mesh = model.mesh
    files = MODEL, TRAJECTORY, *ALWAYS, *([FIELD] if scan.field else [])
    with replacing_results(out, NAMES, files, first=MODEL, command=scan.command, partial=partial) as place:
        seen = model.seen if model.is_closed else None
        write_surface(place / MODEL, PointCloud(mesh.points_m, mesh.colours), mesh.triangles, report.axes, seen)
        write_text(place / TRAJECTORY, trajectory_of(report))
        write_text(
            place / "report.json",
            json_text(report_values(scan), indent=2) + "\n",
        )
        if scan.field:
            write_bytes(place / FIELD, scan.field)
        voxel_m = report.settings.voxel_m if report.settings else 1.0
        upright = report.axes if report.axes.is_upright else None
        shown = ShownModel(mesh, model.noise_m, voxel_m, upright=upright, seen=model.seen)
        write_text(place / "index.html", scan_page(report, shown, (*next_commands(report, out), *scan.commands)))


def report_values(scan: FinishedScan) -> dict[str, Any]:
    """Return the content of report.json."""
    return scan_json(scan.report) | {"command": scan.command, **scan.told}


def trajectory_of(report: ScanReport) -> str:
    """Return the content of trajectory.txt: the pairs whose pose is known, in the model or not, in the axes of model.ply."""
    stations = []
    for pair in report.scanned:
        if pair.pose_origin is not PoseOrigin.NONE:
            pose = pair.world_camera
            signs = report.axes.signs.astype(float)
            stations.append(Station(pair.stamp_s, signs[:, None] * pose.R, signs * pose.t_m))
    return tum_text(stations)


def read_field(folder: Path) -> KeptField:
    """Read the field that a scan has left.

    Raises:
        DataError: there is none, or it is damaged.
        OSError: as the operating system reports it.
    """
    path = folder / FIELD
    if not path.is_file():
        raise DataError(
            f"{folder} holds no {FIELD}", "give the --out folder of the first pass, scanned with --turntable"
        )
    return field_of(path.read_bytes(), str(path))
