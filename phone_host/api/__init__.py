"""The Python API of tandemscan: open two cameras and iterate over the results.

    from phone_host.api import open_scanner

    with open_scanner(link="tcp://192.168.7.2:5555", camera="v4l2:/dev/video0", rig="rig.yaml") as scanner:
        for result in scanner:
            print(result.number, result.ledger.end_to_end_ns, result.processed.cloud.shape)

A result holds the rectified images, the disparity, the point cloud in metres and the pair's delays
(`phone_host.model.Result`). A program that is slower than the cameras gets the newest results; `scanner.snapshot()`
counts those it missed. With `lossless=True`, or if the host camera gives images on demand, the scanner waits for the
program and skips no result.

`scan_for` begins a model of such results, of any of the ways that `phone-host scan` knows; `save_scan` writes its folder.

This door stays backward compatible. The modules below it may change.
"""

from pathlib import Path

from common.frame import PixelFormat
from common.recording.opened import open_recorded
from phone_host.accounts.delays import DELAYS
from phone_host.api.opening import open_scanner
from phone_host.api.scanner import Scanner
from phone_host.diagnostics.run_snapshot import RunSnapshot
from phone_host.geometry.se3 import SE3
from phone_host.geometry.triangulate import Intersections, triangulate
from phone_host.model import Disparity, Image, RectifiedPair, Result, StereoGeometry, UnseenSurface
from phone_host.output.axes import Axes
from phone_host.output.meshes.printable import Printer, Problem
from phone_host.output.ply import PointCloud, write_ply, write_surface
from phone_host.output.rig_files.imported import Imported, import_rig
from phone_host.printers.bed import Bed
from phone_host.printers.door import Ended, Phase, Progress, Wishes
from phone_host.run.model_job import check_model, export_model, print_model
from phone_host.run.scan_job import finished_scan, read_field, write_scan
from phone_host.run.scan_result import own_axes, require_something
from phone_host.scan.blocks import Box
from phone_host.scan.field_bytes import KeptField
from phone_host.scan.mat import Mat, parse_mat
from phone_host.scan.scan import Scan, scan_for
from phone_host.scan.scan_model import ScanModel
from phone_host.scan.scan_wanted import ScanWanted
from phone_host.scan.scanned import ScannedPair
from phone_host.stereo.matcher_protocol import Matcher, ReportingMatcher

__all__ = [
    "DELAYS",
    "SE3",
    "Bed",
    "Box",
    "Disparity",
    "Ended",
    "Image",
    "Imported",
    "Intersections",
    "KeptField",
    "Mat",
    "Matcher",
    "Phase",
    "PixelFormat",
    "Printer",
    "Problem",
    "Progress",
    "RectifiedPair",
    "ReportingMatcher",
    "Result",
    "RunSnapshot",
    "Scan",
    "ScanModel",
    "ScanWanted",
    "ScannedPair",
    "Scanner",
    "StereoGeometry",
    "UnseenSurface",
    "Wishes",
    "check_model",
    "export_model",
    "import_rig",
    "open_recorded",
    "open_scanner",
    "parse_mat",
    "print_model",
    "read_field",
    "save_scan",
    "scan_for",
    "triangulate",
    "write_model",
    "write_ply",
]


def save_scan(folder: str | Path, scan: Scan, *, matcher: str = "unknown") -> None:
    """Write model.ply, trajectory.txt, report.json and index.html as `phone-host scan` does; of a turn also field.bin, for another pass.

    Args:
        folder: created if missing; the files of an earlier scan in it are replaced.
        scan: with all its pairs.
        matcher: the name of what matched them, for the report.

    Raises:
        DataError: no pair has depth, or none shows what was asked for: the mat, a table with an object, something that turns.
        UnavailableError: a file in the folder was not written by this program.
        OSError: it cannot be written.
    """
    finished = finished_scan(scan, matcher=matcher, axes=own_axes(scan.wanted) or Axes.CAMERA)
    require_something(finished.report)
    write_scan(Path(folder), finished)


def write_model(path: str | Path, model: ScanModel, unseen: UnseenSurface = UnseenSurface.FILL) -> None:
    """Write the surface of a scan as PLY: metres, in the axes of the rectified left camera at the first pair that has depth, or of the mat or table.

    Args:
        path: the file; it appears whole or not at all.
        model: from `Scan.model()`.
        unseen: what becomes of the part of a closed surface that no view measured.

    Raises:
        OSError: it cannot be written.
    """
    written = model.with_unseen(unseen)
    mesh, seen = written.mesh, written.seen if written.is_closed else None
    write_surface(Path(path), PointCloud(mesh.points_m, mesh.colours), mesh.triangles, seen=seen)
