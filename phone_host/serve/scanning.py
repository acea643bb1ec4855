"""The scan that goes on on the page, or the last one: how it goes in words, its surface, and where its files lie. Any thread may use it."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

from phone_host.live.scan import LiveScan
from phone_host.scan.scan import ScannedPair
from phone_host.scan.tracking_words import Tracking
from phone_host.serve.program import Scanned
from phone_host.web.source import ScanState, Surface

_LEVELS: Final = {
    Tracking.TRACKING: "good",
    Tracking.RELOCALISED: "good",
    Tracking.WEAK: "warning",
    Tracking.LOST: "bad",
}


class Scanning:
    """Knows the newest scan."""

    def __init__(self) -> None:
        self._live: LiveScan | None = None
        self._begun = 0
        self._is_live = False
        self._over: Scanned | None = None

    @contextmanager
    def shown(self, live: LiveScan, begun: int) -> Iterator[None]:
        """While the block runs, this scan goes on; after it, its surface stays.

        Args:
            live: the scan.
            begun: number of its activity.
        """
        self._live, self._begun, self._over, self._is_live = live, begun, None, True
        try:
            yield
        finally:
            self._is_live = False

    def over(self, scanned: Scanned) -> None:
        """Take what came of it."""
        self._over = scanned

    @property
    def folder(self) -> str:
        """Where its files lie; empty: nowhere."""
        return "" if self._over is None else str(self._over.folder)

    @property
    def state(self) -> ScanState | None:
        """How it goes; None: there was none."""
        live, over = self._live, self._over
        if live is None:
            return None
        pairs, fused = live.counts
        if over is not None:
            files = over.files
            return ScanState(
                words=over.words, level=over.level, pairs=pairs, fused=fused, folder=str(over.folder), files=files
            )
        if not self._is_live:
            return ScanState(words="stopped: nothing of it was written", pairs=pairs, fused=fused)
        return ScanState(words=live.words, level=_level(live.last), pairs=pairs, fused=fused)

    def surface(self, since: int, most_points: int) -> Surface | None:
        """See Source."""
        live = self._live
        return None if live is None else Surface(self._begun, live.surface_since(since, most_points))


def _level(last: ScannedPair | None) -> str:
    return "unknown" if last is None else _LEVELS[last.state]
