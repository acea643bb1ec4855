"""The books of a run: one ledger for each pair, and the totals."""

import threading
from collections import Counter, deque
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

from common.diagnostic import Diagnostic, Severity, diagnostic_of
from common.frame import FrameFault, SpoiledImageError
from common.ledger import HostMarks, PairLedger
from phone_host.accounts.delays import DelayStatistics, MatchedMedians, Sample
from phone_host.model import CutCounts, DepthAccount, FramePair, Processed

_MOST_REASONS: Final = 16
"""Reasons may name figures of a single image; beyond this many different ones they are counted together."""

_OTHER_REASONS: Final = Diagnostic("other reasons", "see the log", Severity.FAIL)

_MOST_GAPS: Final = 4096
"""This many pairs after a gap are remembered, the latest: as many as a page can show."""


@dataclass(frozen=True, slots=True)
class Books:
    """The totals of a run so far, as copies.

    Attributes:
        processed: pairs that were handed over.
        undecodable: pairs that could not be processed.
        spoiled_images: undecodable pairs with a spoiled image, by reason.
        failed_pairs: the other undecodable pairs, by reason, the most frequent first.
        first_done_ns: when the first pair was done; 0: none yet.
        last_done_ns: when the last pair was done; 0: none yet.
        delays: delays of all pairs.
        depth: what became of the pixels.
        gaps: how often the board was away between two pairs.
        gap_ns: time between those pairs, in all.
        after_gap_ns: when the first pair after each gap was done.
    """

    processed: int
    undecodable: int
    spoiled_images: tuple[tuple[str, int], ...]
    failed_pairs: tuple[tuple[Diagnostic, int], ...]
    first_done_ns: int
    last_done_ns: int
    delays: DelayStatistics
    depth: DepthAccount
    gaps: int = 0
    gap_ns: int = 0
    after_gap_ns: frozenset[int] = frozenset()


class Ledgerer:
    """Keeps the books. The worker's thread writes; any thread may read.

    Args:
        was_away: whether the board was away at some time between two moments, ns.
        is_timeless: whether the stamps of this run are no times, so that delays from an exposure mean nothing.
    """

    def __init__(
        self,
        was_away: Callable[[int, int], bool] = lambda _since_ns, _until_ns: False,
        is_timeless: Callable[[], bool] = lambda: False,
    ) -> None:
        self._was_away, self._is_timeless = was_away, is_timeless
        self._gaps = self._gap_ns = 0
        self._after_gap_ns: deque[int] = deque(maxlen=_MOST_GAPS)
        self._failed: Counter[Diagnostic] = Counter()
        self._lock = threading.Lock()
        self._delays, self._sample = DelayStatistics(), Sample()
        self._spoiled: Counter[FrameFault] = Counter()
        self._depth, self._corrected = DepthAccount(), MatchedMedians()
        self.last: Processed | None = None
        self.processed = self.undecodable = 0
        self.first_done_ns = self.last_done_ns = 0

    @property
    def spoiled(self) -> int:
        """The number of pairs that could not be processed because of a spoiled image."""
        return self._spoiled.total()

    def enter(
        self, pair: FramePair, processed: Processed, *, dequeued_ns: int, computed_ns: int, done_ns: int
    ) -> PairLedger:
        """Make a pair's ledger and enter it.

        Args:
            pair: its frames.
            processed: the outcome of processing.
            dequeued_ns: when the worker took the pair, CLOCK_MONOTONIC, as below.
            computed_ns: when the depth was ready, and the worker began to hand the result over.
            done_ns: when every sink had a place for the result.

        Returns:
            The ledger. Its delays add up exactly to end-to-end.
        """
        board = pair.board
        ledger = PairLedger(
            session=board.message.session,
            sequence=board.message.sequence,
            host_sequence=pair.host.sequence,
            bytes=len(board.message.payload),
            link=board.link,
            board=board.marks,
            received_ns=board.received_ns,
            paired_ns=pair.paired_ns,
            queued_ns=pair.queued_ns,
            dequeued_ns=dequeued_ns,
            done_ns=done_ns,
            previous_done_ns=self.last_done_ns or pair.queued_ns,
            stages=replace(processed.stages, write=done_ns - computed_ns),
            time_skew_ns=pair.time_skew_ns,
            offset_ns=board.offset_ns,
            uncertainty_ns=board.uncertainty_ns + pair.host.uncertainty_ns,
            host=HostMarks(exposed_ns=pair.host.exposed.ns, grabbed_ns=pair.host.grabbed.ns),
        )
        idle_ns = max(0, pair.queued_ns - self.last_done_ns) if self.last_done_ns else 0
        is_gap = idle_ns > 0 and self._was_away(self.last_done_ns, pair.queued_ns)
        with self._lock:
            self._gaps += is_gap
            if is_gap:
                self._gap_ns += idle_ns
                self._after_gap_ns.append(done_ns)
            self._delays.add(ledger, after_gap=is_gap, timeless=self._is_timeless())
            self._sample.add(ledger)
            self._depth = _with(self._depth, processed)
            self._corrected.add(processed.match_report)
            self.last = processed
            self.first_done_ns = self.first_done_ns or done_ns
            self.last_done_ns = done_ns
            self.processed += 1
        return ledger

    def enter_failed(self, error: Exception) -> None:
        """Count a pair that could not be processed."""
        with self._lock:
            self.undecodable += 1
            if isinstance(error, SpoiledImageError):
                self._spoiled[error.fault] += 1
            else:
                why = diagnostic_of(error)
                if why not in self._failed and len(self._failed) >= _MOST_REASONS:
                    why = _OTHER_REASONS
                self._failed[why] += 1

    def books(self) -> Books:
        """Return the totals so far."""
        with self._lock:
            return Books(
                processed=self.processed,
                undecodable=self.undecodable,
                spoiled_images=tuple((fault.value, count) for fault, count in self._spoiled.items()),
                failed_pairs=tuple(self._failed.most_common()),
                first_done_ns=self.first_done_ns,
                last_done_ns=self.last_done_ns,
                delays=self._delays.copy(),
                depth=replace(self._depth, median_report=self._corrected.report()),
                gaps=self._gaps,
                gap_ns=self._gap_ns,
                after_gap_ns=frozenset(self._after_gap_ns),
            )

    def sample(self) -> tuple[PairLedger, ...]:
        """Return ledgers for plots, in order: all of them, or an evenly spaced sample."""
        with self._lock:
            return tuple(self._sample.ledgers)


def _with(depth: DepthAccount, processed: Processed) -> DepthAccount:
    """Return the account with one more pair."""
    if processed.cut is None:
        return depth
    return DepthAccount(
        cut=(depth.cut or CutCounts()) + processed.cut,
        limits=processed.limits,
        search=processed.search,
        match_report=processed.match_report,
        epipolar=processed.pair.epipolar,
    )
