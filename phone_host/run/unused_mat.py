"""Says that a printed mat is in view of a scan that does not use it, before its first pair is fused."""

from phone_host.model import Processed
from phone_host.report.stereo_report import Remark
from phone_host.scan.mat_in_view import MatDetector
from phone_host.scan.scan_wanted import ScanWanted


class UnusedMat:
    """Looks for a printed mat where none is asked for.

    Attributes:
        remark: what must be said of the mat that was found; None: none was.

    Args:
        wanted: what is scanned.
    """

    def __init__(self, wanted: ScanWanted) -> None:
        self._detector = MatDetector() if wanted.mat is None else None
        other = "--turntable" if wanted.turntable else "--object" if wanted.on_table else ""
        self._in_place = f" in place of {other}" if other else ""
        self.remark: Remark | None = None

    def look(self, processed: Processed) -> Remark | None:
        """Look for it in the next pair, before the scan takes it.

        Args:
            processed: the pair.

        Returns:
            What must be said; None: nothing, or nothing new.
        """
        detector = self._detector
        if detector is None or not detector.take(processed.pair.left) or detector.result is None:
            return None
        remedy = f"use {detector.result.option}{self._in_place} to scan the object on it, or take the mat away"
        self.remark = Remark("a printed mat is in view, but the scan does not use it", remedy)
        return self.remark
