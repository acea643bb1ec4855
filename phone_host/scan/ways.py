"""The ways to scan: what takes the pairs, by what was asked for. Pure."""

from phone_host.scan.scan import Scan
from phone_host.scan.scan_wanted import ScanWanted
from phone_host.scan.table_scan import TableScan
from phone_host.scan.turntable import TurntableScan


def scan_for(wanted: ScanWanted) -> Scan:
    """Begin a scan: of cameras that move, around anything, a mat or a thing on a table, or of an object that turns.

    Args:
        wanted: what for.
    """
    if wanted.on_table:
        return TableScan(wanted)
    return TurntableScan(wanted) if wanted.turntable else Scan(wanted)
