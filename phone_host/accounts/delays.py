"""Percentiles of a run's delays, of a recording's beside them, of its sinks and of what its matcher corrected, in bounded memory. Pure."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from statistics import median
from typing import Final

import numpy as np

from common.ledger import PairLedger, StageTimes
from phone_host.model import MatchReport

EXACT: Final = 65536
"""Percentiles are exact up to this many pairs (36 minutes at 30/s). Beyond, every 2nd, 4th, … pair is kept."""

SAMPLE: Final = 4096
"""More points than a plot has pixels; about 3 MB."""

DELAYS: Final = ("capture", "outbox", "propagation", "pairing", "queuing", "processing", "end_to_end", "starvation")

IDLE_STAGE_NS: Final = 20_000
"""A stage whose longest time is shorter did nothing: it takes 1 to 11 us to find that out (delay-bench, two cores)."""

STAGES: Final = tuple(stage.name for stage in fields(StageTimes))

OTHERS: Final = ("time_skew", "uncertainty")

FROM_EXPOSURE: Final = ("capture", "end_to_end", "time_skew")
"""What is counted from the moment of an exposure. Images shown on demand have none."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Spread:
    """The distribution of a quantity, in ns; NaN if nothing was measured.

    Attributes:
        count: number of values.
        p50_ns: median.
        p95_ns: 95th percentile.
        p99_ns: 99th percentile.
        max_ns: greatest, exact for any number of values.
        mean_ns: mean, exact for any number of values.
    """

    count: int
    p50_ns: float
    p95_ns: float
    p99_ns: float
    max_ns: float
    mean_ns: float


class Series:
    """A series of integers, thinned evenly when there are many.

    All memory is allocated at once, so memory use stays flat in a long run.
    """

    def __init__(self) -> None:
        # Not zeros: the kernel would provide their pages only on the first write.
        self._values = np.ones(EXACT, np.int64)
        self._places = self._values.data  # written to without numpy, which costs several us a frame
        self._kept = 0
        self._stride = 1
        self._count = 0
        self._sum = 0
        self._max: int | None = None

    def add(self, value: int) -> None:
        """Add one value."""
        if self._count % self._stride == 0:
            if self._kept == EXACT:
                self._kept //= 2
                self._stride *= 2
                thinned = np.ones(EXACT, np.int64)  # a new array: copies still use the old one
                thinned[: self._kept] = self._values[::2]
                self._values, self._places = thinned, thinned.data
            self._places[self._kept] = value
            self._kept += 1
        self._count += 1
        self._sum += value
        self._max = value if self._max is None else max(self._max, value)

    def copy(self) -> "Series":
        """Return a frozen copy, to which nothing can be added.

        It costs nothing, because values never change in place.
        """
        copied = Series.__new__(Series)
        copied.__dict__ |= self.__dict__ | {"_values": self._values[: self._kept]}
        return copied

    def spread(self, last: int | None = None) -> Spread:
        """Summarise all values, or restrict percentiles and maximum to the newest ones.

        Args:
            last: number of newest values to use; None for all.
        """
        wanted = self._kept if last is None else -(-last // self._stride)
        values = self._values[max(0, self._kept - wanted) : self._kept]
        if not len(values) or self._max is None:
            nan = float("nan")
            return Spread(count=0, p50_ns=nan, p95_ns=nan, p99_ns=nan, max_ns=nan, mean_ns=nan)
        p50, p95, p99 = (float(p) for p in np.percentile(values, (50, 95, 99)))
        greatest = float(self._max if last is None else values.max())
        return Spread(
            count=self._count, p50_ns=p50, p95_ns=p95, p99_ns=p99, max_ns=greatest, mean_ns=self._sum / self._count
        )


class Sample:
    """Ledgers of a run for its plots: all up to SAMPLE, then every 2nd, 4th, … one."""

    def __init__(self) -> None:
        self.ledgers: list[PairLedger] = []
        self._stride = 1
        self._count = 0

    def add(self, ledger: PairLedger) -> None:
        """Take one pair's ledger."""
        if self._count % self._stride == 0:
            self.ledgers.append(ledger)
            if len(self.ledgers) > SAMPLE:
                self.ledgers = self.ledgers[::2]
                self._stride *= 2
        self._count += 1


class DelayStatistics:
    """The delays of a run, pair by pair."""

    def __init__(self) -> None:
        self._series = {name: Series() for name in (*DELAYS, *STAGES, *OTHERS)}
        self._bytes = 0

    def copy(self) -> "DelayStatistics":
        """Return a frozen copy of the delays so far."""
        copied = DelayStatistics.__new__(DelayStatistics)
        series = {name: series.copy() for name, series in self._series.items()}
        copied.__dict__ |= self.__dict__ | {"_series": series}
        return copied

    def add(self, ledger: PairLedger, *, after_gap: bool = False, timeless: bool = False) -> None:
        """Take one pair's ledger.

        Args:
            ledger: its marks and delays.
            after_gap: whether the board was away before it, so that the processor's wait says nothing of the link.
            timeless: whether its stamps are labels, so that nothing may be counted from its exposure.
        """
        left_out = {*(FROM_EXPOSURE if timeless else ()), *(("starvation",) if after_gap else ())}
        for name in DELAYS:
            if name not in left_out:
                self._series[name].add(getattr(ledger, f"{name}_ns"))
        for name in STAGES:
            self._series[name].add(getattr(ledger.stages, name))
        if not timeless:
            self._series["time_skew"].add(abs(ledger.time_skew_ns))
        self._series["uncertainty"].add(ledger.uncertainty_ns)
        self._bytes += ledger.bytes

    @property
    def frame_bytes(self) -> float:
        """Mean length of the pairs' board frames, bytes; NaN without a pair."""
        pairs = self._series["uncertainty"].spread(1).count
        return self._bytes / pairs if pairs else float("nan")

    def spread(self, name: str, last: int | None = None) -> Spread:
        """Summarise one of DELAYS, STAGES or OTHERS (time skews as absolute values)."""
        return self._series[name].spread(last)


@dataclass(frozen=True, slots=True)
class ReplayFacts:
    """What is played.

    Attributes:
        file: the recording.
        pace: clock or demand.
        pairs: how many pairs were processed when it was recorded.
        delays: their delays.
    """

    file: str
    pace: str
    pairs: int
    delays: DelayStatistics


def replay_facts(file: str, pace: str, ledgers: Sequence[PairLedger]) -> ReplayFacts:
    """Sum up the ledgers of then.

    Args:
        file: the recording.
        pace: clock or demand.
        ledgers: of the pairs that were processed then.
    """
    delays = DelayStatistics()
    for ledger in ledgers:
        delays.add(ledger)
    return ReplayFacts(file, pace, len(ledgers), delays)


def side_by_side(replay: ReplayFacts, now: DelayStatistics, *, is_timeless: bool) -> list[str]:
    """Return a table: delays of then and of this run; nothing without pairs of then."""
    if not replay.pairs or is_timeless:
        return []
    lines = [f"{'delay, ms':14} {'then p50':>9} {'now p50':>9} {'then p95':>9} {'now p95':>9}"]
    for name in (*DELAYS, "time_skew"):
        then, today = replay.delays.spread(name), now.spread(name)
        if then.count and today.count:
            values = (then.p50_ns, today.p50_ns, then.p95_ns, today.p95_ns)
            lines.append(f"{name.replace('_', '-'):14} " + " ".join(f"{value / 1e6:9.3f}" for value in values))
    return lines


@dataclass(frozen=True, slots=True, kw_only=True)
class SinkAccount:
    """What became of the results that were handed to one sink.

    Attributes:
        name: name of the sink.
        written: results that it has finished.
        dropped: results that it had no place for.
        failed: results that it took but could not write.
        waiting: results in its queue now.
        delay: time from a result's hand-over until the sink finished it, over all finished results, ns.
    """

    name: str
    written: int
    dropped: int
    failed: int
    waiting: int
    delay: Spread


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
