"""What the matcher corrected over a run: the median of each figure. Pure."""

from collections.abc import Callable
from statistics import median
from typing import Final

from phone_host.model import MatchReport

_MOST: Final = 256
"""Reports that are kept: the median of 256 is uncertain by 8 % of their spread."""

_SILENT: Final = MatchReport()
"""What a matcher is given that reports nothing; also a pair of which nothing was corrected."""


class MatchedMedians:
    """The reports of a run: all up to 256, then every 2nd, 4th, ... one."""

    def __init__(self) -> None:
        self._reports: list[MatchReport] = []
        self._stride, self._count = 1, 0
        self._told = False

    def add(self, report: MatchReport | None) -> None:
        """Take one pair's report; None is passed over."""
        if report is None:
            return
        self._told = self._told or report != _SILENT
        if self._count % self._stride == 0:
            self._reports.append(report)
            if len(self._reports) > _MOST:
                self._reports = self._reports[::2]
                self._stride *= 2
        self._count += 1

    def report(self) -> MatchReport | None:
        """Return the median of each figure, without confidence; None if the matcher told nothing, or corrected nothing."""
        if not self._told:
            return None

        def middle(figure: Callable[[MatchReport], float]) -> float:
            return median(figure(report) for report in self._reports)

        return MatchReport(
            vertical_px=middle(lambda report: report.vertical_px),
            gain=middle(lambda report: report.gain),
            offset_levels=middle(lambda report: report.offset_levels),
            vignetting_percent=middle(lambda report: report.vignetting_percent),
            shading_percent=middle(lambda report: report.shading_percent),
        )
