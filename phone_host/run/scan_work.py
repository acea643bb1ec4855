"""A scan at work, from files or live: what came of its pairs is kept on the disk, and it ends in one way."""

from collections.abc import Callable, Sequence
from pathlib import Path

from common.diagnostic import Diagnostic
from phone_host.output.axes import Axes
from phone_host.report.stereo_report import FailedPair
from phone_host.run.kept_submaps import KeptSubmaps
from phone_host.run.scan_files import FinishedScan, write_scan
from phone_host.run.scan_result import field_of_turn, report_of, require_something, turn_remarks, unused_mat
from phone_host.scan.factory import scan_for
from phone_host.scan.mat import MatInView
from phone_host.scan.scan import Scan
from phone_host.scan.scan_wanted import ScanWanted
from phone_host.scan.scanned import ScannedPair, Submap


class ScanWork:
    """One scan, and the folder that it is written to.

    Attributes:
        scan: what has become of the pairs.
        kept: its submaps on the disk.

    Args:
        wanted: how the model is made.
        out: the results folder.
        resumed: submaps of a scan that was killed, to go on from.
        tell: takes a line that the user should know at once.
    """

    def __init__(
        self,
        wanted: ScanWanted,
        out: Path,
        resumed: Sequence[Submap] = (),
        tell: Callable[[str], None] = lambda _: None,
    ) -> None:
        self.scan, self._out, self._tell = scan_for(wanted, self._tell_of_mat), out, tell
        self.kept = KeptSubmaps(out, self.scan, resumed)

    def _tell_of_mat(self, _: MatInView) -> None:
        if remark := unused_mat(self.scan):
            self._tell(remark.line)

    def finished(
        self,
        remarks: Sequence[Diagnostic],
        pairs: Sequence[ScannedPair | FailedPair] | None = None,
        *,
        matcher: str,
        axes: Axes,
    ) -> FinishedScan:
        """Make the surface and the report of the pairs so far; see `finished_scan`."""
        told = (*remarks, *self.kept.remarks)
        return finished_scan(self.scan, told, pairs, matcher=matcher, axes=axes)

    def write(self, finished: FinishedScan, partial: Callable[[Path], None] | None = None) -> None:
        """Write a scan that is over. Its submaps go when it is on the disk.

        Raises:
            DataError: there is nothing of it; see `require_something`.
            UnavailableError: a file in the folder was not written by this program.
            OSError: the results cannot be written.
        """
        require_something(finished.report)
        write_scan(self._out, finished, partial)
        self.kept.done()


def finished_scan(
    scan: Scan,
    remarks: Sequence[Diagnostic] = (),
    pairs: Sequence[ScannedPair | FailedPair] | None = None,
    *,
    matcher: str,
    axes: Axes,
) -> FinishedScan:
    """Make the surface and the report of a scan.

    Args:
        scan: that took the pairs.
        remarks: what must be said besides what the scan itself tells.
        pairs: all, with those that could not be computed; None: those of the scan.
        matcher: its name.
        axes: of the files.
    """
    model = scan.model()
    final = scan.pairs if pairs is None else [p if isinstance(p, FailedPair) else scan.final(p) for p in pairs]
    told = (*remarks, *turn_remarks(scan))
    report = report_of(scan, model, final, told, matcher=matcher, axes=axes)
    return FinishedScan(report, model, field=field_of_turn(scan))
