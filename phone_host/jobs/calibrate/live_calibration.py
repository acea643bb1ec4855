"""The root of a live calibration: a run of the host whose pairs a guide looks at, in threads beside it.

    host (receiver, camera, pairing, decoding) -> sink: find the board, gates ─┬ calibrate so far (newest views only)
                                                                               └ pictures of the views that are taken

The sink looks at one pair at a time, always at the newest: while it is busy, pairs pass. One lock guards the guide.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from threading import Lock
from typing import Final

from common import now
from common.camera.base import Camera
from common.errors import SettingsError
from common.link.base import Link
from phone_host.calibration.guide.gates import Gate, Glance, View
from phone_host.calibration.guide.guide import Guide
from phone_host.calibration.guide.snapshot import Ended, GuideSnapshot, Progress, before_board
from phone_host.calibration.guide.wants import Want, Words
from phone_host.calibration.target.board_views import Size
from phone_host.calibration.target.corners import Board, Corners
from phone_host.calibration.target.moving_board import BoardFinder, SizeCheck, SizeFinder
from phone_host.calibration.target.sharpness import look_at
from phone_host.diagnostics.run_snapshot import unused
from phone_host.jobs.calibrate.newest import Newest
from phone_host.model import Image, Result
from phone_host.recording.chosen_views import Pictures, ViewFolders
from phone_host.report.summary import camera_troubles
from phone_host.run.host import Host
from phone_host.run.host_settings import EndReason, HostSettings
from phone_host.run.sinks import FunctionSink, Sink, SinkQueue
from phone_host.stereo.images import to_grey
from phone_host.stream.demand_clock import has_own_time

_NO_PAIRS_NS: Final = 5_000_000_000
"""So long after a board was met its first pair may take: a clock is known after a second."""

_SILENT_NS: Final = 3_000_000_000
"""A link that is back within this needs no words."""

_LEAST_VIEWS: Final = 3
"""Fewer give no calibration."""

_MISSES: Final = 60
"""So many looks in turn without a board of the size that was counted: it may have been counted wrongly."""

_HELP_NS: Final = 20_000_000_000

Grow = Callable[[tuple[View, ...], Board, tuple[Size, Size]], Progress]
"""Calibrates from the views so far."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LiveSettings:
    """What a live calibration is to do.

    Attributes:
        host: the run beneath.
        board: None: its size is found.
        square_m: side of its squares, m.
        most_views: end after so many.
        left: folder for the left pictures.
        right: folder for the right ones.
        seen: the image corners that are known from an earlier calibration.
    """

    host: HostSettings
    board: Board | None
    square_m: float
    most_views: int
    left: Path
    right: Path
    seen: frozenset[Want] = frozenset()


class LiveCalibration:
    """One live calibration.

    Attributes:
        guide: it; None: no board was seen yet.
        lock: held by whoever reads or changes the guide.

    Args:
        settings: what to do.
        camera: the host camera, open.
        links: open links to the board.
        grow: calibrates from the views so far; called in a thread of its own.
        sinks: further ones, such as for who wants to see the pictures.

    Raises:
        SettingsError: the host camera has no clock.
        UnavailableError: the folders hold other pictures.
        OSError: they cannot be written to.
    """

    def __init__(
        self, settings: LiveSettings, camera: Camera, links: Sequence[Link], grow: Grow, sinks: Sequence[Sink] = ()
    ) -> None:
        if not has_own_time(camera.description.pacing):
            raise SettingsError("--camera has pace=demand, and so no clock", "give it fps= or pace=clock")
        self._settings, self._grow = settings, grow
        self._folders = ViewFolders(settings.left, settings.right, are_taken_live=True)
        self.lock = Lock()
        self._began_ns = now.monotonic_ns()
        self.guide: Guide | None = None
        self._finder: BoardFinder | None = None
        self._size_finder = SizeFinder(settings.square_m)
        self._check: SizeCheck | None = None
        self._misses = 0
        if settings.board is not None:
            self._know(settings.board)
        self._solver = Newest[tuple[View, ...]]("calibrating", self._solve)
        self._pictures = SinkQueue[Pictures]("views", self._folders.write, depth=settings.most_views)
        self._looker = FunctionSink("guide", self._look, depth=1)
        self._met_ns: int | None = None
        self._looked_ns = self._began_ns
        self.host = Host(settings.host, camera, links, None, (self._looker, *sinks))

    def run(self, stop: Callable[[], bool], watch: Callable[[], None]) -> Ended:
        """Take views until it is enough, `stop` returns True or a stream ends.

        Returns:
            Why it ended.

        Raises:
            UnavailableError: no board came in time, or it does not talk to this host.
            DataError: a stream or the board cannot be used.
            SettingsError: the person shows another board than was named.
        """

        def stop_or_done() -> bool:
            self._raise_failures()
            return stop() or self._ended is not Ended.RUNNING

        try:
            reason = self.host.run(stop_or_done, watch)
        finally:
            self._solver.finish(patience_s=0.0)
            self._pictures.finish()
            self._folders.close(self.host.cameras_text())
        self._raise_failures()
        with self.lock:
            if self.guide is not None and self.guide.ended is Ended.RUNNING:
                self.guide.ended = Ended.STREAM_ENDED if reason is EndReason.STREAM_ENDED else Ended.STOPPED
        return self._ended if self.guide is not None else Ended.STOPPED

    @property
    def trouble(self) -> str:
        """Why no pairs come though the board was met; empty: nothing is wrong yet."""
        now_ns = now.monotonic_ns()
        if not self.host.has_met_board:
            return ""
        if self.host.first_done_ns:
            return self._silence(now_ns)
        self._met_ns = self._met_ns or now_ns
        if now_ns - self._met_ns < _NO_PAIRS_NS:
            return ""
        run = self.host.snapshot()
        if run.estimate is None:
            return "no pairs yet: the board's clock is not known, because no echo of it has come back; check the link"
        lost = ", ".join(item.told for item in unused(run)) or "no frames come"
        return f"no pairs yet: {lost}; check both cameras, or give --tolerance"

    def _silence(self, now_ns: int) -> str:
        """Return why pairs that came come no longer."""
        silent_ns = now_ns - self._looked_ns
        if silent_ns < _SILENT_NS:
            return ""
        run = self.host.snapshot()
        last = run.away[-1] if run.away else None
        if last is not None and last.is_over:
            back_ns = self.host.started_ns + round((last.at_s + last.seconds) * 1e9)
            if now_ns - back_ns < _NO_PAIRS_NS:
                return "the board is back: pairs come in a moment; the views so far are kept"
        is_away = last is not None and not last.is_over
        what = (
            "the board is away: check its power and its link"
            if is_away
            else "; ".join(camera_troubles(run.camera)) or "a camera sends nothing: is it plugged in?"
        )
        return f"no pairs for some seconds: {what}; the views so far are kept"

    def snapshot(self) -> GuideSnapshot:
        """Return everything that presenters show, with the words that are to be said now."""
        return self.shown()[0]

    def shown(self) -> tuple[GuideSnapshot, tuple[View, ...]]:
        """Return the snapshot, and the views that were taken by then."""
        now_ns = now.monotonic_ns()
        with self.lock:
            if self.guide is not None:
                self.guide.words(now_ns)
                return self.guide.snapshot(now_ns), tuple(self.guide.views)
        words = (
            Words.HELP if self.host.first_done_ns and now_ns - self.host.first_done_ns > _HELP_NS else Words.SHOW_BOTH
        )
        return before_board(words.value, self._settings.most_views, (now_ns - self._began_ns) / 1e9), ()

    @property
    def _ended(self) -> Ended:
        guide = self.guide  # once: the looker may drop it in between
        return Ended.RUNNING if guide is None else guide.ended

    def _raise_failures(self) -> None:
        for failure in (self._solver.failure, self._pictures.failure):
            if failure is not None:
                raise failure

    def _know(self, board: Board) -> None:
        self._finder = BoardFinder(board)
        self._check = SizeCheck(board) if self._settings.board is not None else None
        with self.lock:
            self.guide = Guide(board, self._settings.most_views, now.monotonic_ns(), self._settings.seen)

    def _look(self, result: Result) -> None:
        """Look at a pair: called in the sink's thread."""
        self._looked_ns = now.monotonic_ns()
        pair = result.processed.pair
        left, right = to_grey(pair.left), to_grey(pair.right)
        if self.guide is None or self._finder is None:
            board = self._size_finder.find(left, right)
            if board is not None:
                self._know(board)
            return
        guide, finder = self.guide, self._finder

        def glance(corners: tuple[Corners, Corners]) -> Glance:
            return Glance(
                at_ns=result.ledger.host.exposed_ns,
                skew_ns=result.pair.time_skew_ns,
                left_px=corners[0],
                right_px=corners[1],
                sizes_px=((left.shape[1], left.shape[0]), (right.shape[1], right.shape[0])),
            )

        seen = glance(finder.find(left, right))
        with self.lock:
            gate = guide.see(seen, now.monotonic_ns())
        if gate is Gate.NOT_FOUND and not guide.views:
            self._missed(left, right)
        else:
            self._misses = 0
        if gate is Gate.READY:
            self._examine(guide, glance(finder.find_exactly(left, right)), (left, right), (pair.left, pair.right))

    def _missed(self, left: Image, right: Image) -> None:
        """Check a board that is never found: one that was named, against what is shown; one that was counted is counted anew."""
        self._misses += 1
        if self._check is not None:
            self._check.missed(left, right)
        elif self._misses >= _MISSES:
            self._misses, self._finder, self._size_finder = 0, None, SizeFinder(self._settings.square_m)
            with self.lock:
                self.guide = None

    def _examine(self, guide: Guide, exact: Glance, greys: tuple[Image, Image], images: tuple[Image, Image]) -> None:
        looks = [
            look_at(grey, corners, guide.board)
            for grey, corners in zip(greys, (exact.left_px, exact.right_px), strict=True)
        ]
        with self.lock:
            gate = guide.examine(exact, (looks[0], looks[1]), now.monotonic_ns())
            views = tuple(guide.views)
        if gate is Gate.TAKEN:
            self._pictures.offer(Pictures(views[-1].name, *images))
            if len(views) >= _LEAST_VIEWS:
                self._solver.offer(views)

    def _solve(self, views: tuple[View, ...]) -> None:
        assert self.guide is not None
        progress = self._grow(views, self.guide.board, views[0].glance.sizes_px)
        with self.lock:
            self.guide.grow(progress, now.monotonic_ns())
