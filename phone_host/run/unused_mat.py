"""Says that a printed mat is in view of a scan that does not use it."""

from phone_host.report.stereo_report import Remark
from phone_host.scan.scan import Scan


def unused_mat(scan: Scan) -> Remark | None:
    """Return what must be said of a printed mat that is in view, though none is asked for; None: none was found.

    Args:
        scan: that looks for it in its pairs.
    """
    if scan.unused_mat is None:
        return None
    other = "--turntable" if scan.wanted.turntable else "--object" if scan.wanted.on_table else ""
    in_place = f" in place of {other}" if other else ""
    remedy = f"use {scan.unused_mat.option}{in_place} to scan the object on it, or take the mat away"
    return Remark("a printed mat is in view, but the scan does not use it", remedy)
