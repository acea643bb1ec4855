"""Puts a scan together: what tells the poses, and how the surface is made, by what was asked for. Pure.

This is the only place that knows the classes of `PoseSource` and `Surface` by name.
"""

from collections.abc import Callable

from phone_host.scan.mat import MatInView
from phone_host.scan.mat_tracker import MatPoses
from phone_host.scan.pose_source import TablePoses, VisualPoses
from phone_host.scan.scan import Scan
from phone_host.scan.scan_wanted import ScanWanted
from phone_host.scan.surface import BoxSurface, TableSurface
from phone_host.scan.turntable import TurnSurface, TurntablePoses


def scan_for(wanted: ScanWanted, on_unused_mat: Callable[[MatInView], None] = lambda _: None) -> Scan:
    """Begin a scan: of cameras that move, around anything, a mat or an object on a table, or of an object that turns.

    Args:
        wanted: what for.
        on_unused_mat: is called when a printed mat is in view that the scan does not use, before the pair that shows it is taken.
    """
    if wanted.turntable:
        turning = TurntablePoses(wanted)
        return Scan(wanted, turning, TurnSurface(turning, wanted.onto), on_unused_mat)
    if wanted.on_table:
        on_table = TablePoses(wanted)
        return Scan(wanted, on_table, TableSurface(on_table, wanted.floor), on_unused_mat)
    poses = VisualPoses(wanted) if wanted.mat is None else MatPoses(wanted, wanted.mat)
    return Scan(wanted, poses, BoxSurface(wanted.floor), on_unused_mat)
