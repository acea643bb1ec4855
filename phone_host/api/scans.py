"""Writes what a scan has come to: its surface alone, or the folder that `phone-host scan` leaves."""

from pathlib import Path

from phone_host.model import UnseenSurface
from phone_host.output.axes import Axes
from phone_host.output.ply import PointCloud, write_surface
from phone_host.run.scan_job import finished_scan, write_scan
from phone_host.run.scan_result import own_axes, require_something
from phone_host.scan.scan import Scan
from phone_host.scan.scan_model import ScanModel


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
