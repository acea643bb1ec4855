"""The root of a live scan: a run of the host whose pairs a model takes.

    host (receiver, camera, pairing, depth) -> sink: track, fuse

The sink takes one pair at a time, always the newest: while it is busy, pairs pass, and are counted. Where the cameras wait for the host,
as in a replay, it takes them all.
"""

import threading
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from common import now
from common.diagnostic import Diagnostic, Severity
from common.words import counted
from phone_host.diagnostics.codes import as_remark
from phone_host.diagnostics.run_rules import concerns
from phone_host.diagnostics.run_snapshot import RunSnapshot
from phone_host.model import Result, Side
from phone_host.output.axes import Axes
from phone_host.run.scan_job import FinishedScan, ScanWork
from phone_host.run.scan_result import own_axes, unused_mat
from phone_host.run.sinks import FunctionSink
from phone_host.scan.blocks import Box
from phone_host.scan.patches import Patch, Patches
from phone_host.scan.scan_wanted import ScanWanted
from phone_host.scan.scanned import ScannedPair, Submap
from phone_host.scan.tracking_words import OF_TABLE, OF_TURNING
from phone_host.scan.volume_settings import LEAST_WEIGHT

_SINK: Final = "scan"
_NS: Final = 1e9

_RENEW_NS: Final = 900_000_000
"""The surface is made again so often, if somebody watches."""

_WATCHED_NS: Final = 5_000_000_000
"""Who has not asked for so long does not watch any more."""


class LiveScan:
    """Takes the pairs of a run.

    Attributes:
        work: the scan and its folder; written when the run has ended.
        scan: what has become of them; whole once the run has ended.
        axes: that the model has from mat or table; None: those of the camera.
        patches: its surface, for whoever watches; while the run goes on, `surface_since` asks them.
        sink: for the host.

    Args:
        wanted: how the model is made.
        board_side: the side on which the board's camera stands.
        kept_in: folder for the submaps.
        resumed: submaps of a scan that was killed, to go on from.
        waits: whether no pair may be missed; then the same pairs come again, and those in the submaps pass.
        is_timeless: whether the images have no time, because they were shown on demand; their numbers stand for it.
    """

    def __init__(
        self,
        wanted: ScanWanted,
        board_side: Side,
        kept_in: Path,
        resumed: tuple[Submap, ...] = (),
        *,
        waits: bool,
        is_timeless: bool,
    ) -> None:
        self.work = ScanWork(wanted, kept_in, resumed)
        self.scan, self.axes, self._is_timeless = self.work.scan, own_axes(wanted), is_timeless
        self._earlier, self._is_replayed = self.scan.pairs, waits
        self.sink = FunctionSink(_SINK, self._take, depth=1, waits=waits)
        self._is_board_left = board_side is Side.LEFT
        self._last: ScannedPair | None = None
        self._has_ended = False
        self._first_ns: int | None = None
        self._counts = len(self._earlier), self.scan.fused
        self.patches = Patches(LEAST_WEIGHT)
        self._watching = threading.Lock()
        self._asked_ns = self._renewed_ns = -_WATCHED_NS

    @property
    def counts(self) -> tuple[int, int]:
        """Pairs that were taken, and those of them that are in the model."""
        return self._counts

    @property
    def last(self) -> ScannedPair | None:
        """What became of the last pair; None: there was none."""
        return self._last

    def surface_since(self, number: int, most_points: int) -> Sequence[Patch]:
        """Return what of the surface is newer than a patch. Safe from any thread; it is made again at most once a second.

        Args:
            number: of the newest patch that is known; 0: none is.
            most_points: of all patches together; one comes in any case.
        """
        with self._watching:
            self._asked_ns = now.monotonic_ns()
            return self.patches.since(number, most_points)

    def renew_surface(self) -> None:
        """Make the surface again. The run has ended, or calls this itself."""
        volume = self.scan.volume
        if volume is None:
            return
        with self._watching:
            self.patches.renew(volume)
            self._renewed_ns = now.monotonic_ns()

    def crop(self, box: Box | None) -> None:
        """Keep only what lies in a box, from now on until the model is written. Safe from any thread.

        Args:
            box: in the model's axes; None: everything.
        """
        self.scan.crop(box)

    @property
    def words(self) -> str:
        """What is to be told whoever holds the cameras: how many pairs are in the model, and what helps now."""
        last = self._last
        if last is None:
            return "no pair has come" if self._has_ended else "waiting for the first pair"
        count = f"{counted(self._counts[1], 'pair')} in the model"
        if self._has_ended:
            return f"{count}: all pairs have arrived, the model is being made"
        unused, weakness = unused_mat(self.scan), last.weakness
        if unused is not None and (not weakness.advice or weakness in (*OF_TURNING, *OF_TABLE)):
            return f"{count}: {unused.text}"
        return f"{count}: {weakness.advice}" if weakness.advice else f"{count}: go on"

    def end(self) -> None:
        """Note that no more pairs come: the run has ended."""
        self._has_ended = True

    def finished(self, snapshot: RunSnapshot, matcher: str, axes: Axes) -> FinishedScan:
        """Make the surface and the report. The run has ended."""
        self.end()
        remarks = [as_remark(concern) for concern in concerns(snapshot)]
        missed = sum(account.dropped for account in snapshot.sinks if account.name == _SINK)
        if missed:
            words = f"{counted(missed, 'pair')} came while others were taken into the model, and passed"
            remarks.append(Diagnostic(words, "a larger --voxel is faster", severity=Severity.NOTE))
        finished = self.work.finished(remarks, matcher=matcher, axes=axes)
        if self.scan.settings is not None:
            with self._watching:
                shown = finished.model.with_unseen(self.scan.wanted.unseen)
                self.patches.become(shown.mesh, self.scan.settings.voxel_m, shown.seen)
        return finished

    def _take(self, result: Result) -> None:
        ledger = result.ledger
        marks = ledger.board if self._is_board_left else ledger.host
        if self._first_ns is None:
            self._first_ns = marks.exposed_ns
        stamp_s = float(result.number) if self._is_timeless else (marks.exposed_ns - self._first_ns) / _NS
        number, earlier = result.number, self._earlier
        if self._is_replayed and any(pair.name == str(number) for pair in earlier):
            return
        if earlier and not self._is_replayed:  # numbers and times go on where they ended
            number, stamp_s = number + len(earlier), stamp_s + earlier[-1].stamp_s + 1
        skew_s = 0.0 if self._is_timeless else result.pair.time_skew_ns / _NS
        self._last = self.scan.take(str(number), stamp_s, result.processed, skew_s)
        # Not one more: with a pair, others that were lost may have become part of the model.
        self._counts = self._counts[0] + 1, self.scan.fused
        self.work.kept.after_pair()
        now_ns = now.monotonic_ns()
        if now_ns - self._asked_ns < _WATCHED_NS and now_ns - self._renewed_ns >= _RENEW_NS:
            self.renew_surface()
