"""The scan that goes on on the page, or the last one: how it goes in words, its surface, and where its files lie. Any thread may use it."""

import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Final

from common.errors import SettingsError
from phone_host.live.scan import LiveScan
from phone_host.output.axes import Axes
from phone_host.scan.box import Box
from phone_host.scan.patches import Patches
from phone_host.scan.scanned import ScannedPair
from phone_host.scan.tracking_words import Tracking
from phone_host.serve.program import Scanned
from phone_host.web.source import ScanState, Surface

_LEVELS: Final = {
    Tracking.TRACKING: "good",
    Tracking.RELOCALISED: "good",
    Tracking.WEAK: "warning",
    Tracking.LOST: "bad",
}

_ON_THE_PAGE: Final = (
    (
        r"use --mat(?: (\S+))?(?: in place of --\w+)? to scan the object on it",
        lambda found: f"press Stop and choose \u201cAn object on a mat\u201d{f' ({found[1]})' if found[1] else ''}",
    ),
    (r"a larger --memory or --voxel", "a larger number in Detail"),
    (r"move or enlarge --box, or leave it out", "move, enlarge or remove the box"),
    (r"leave --turntable out", "choose another kind in \u201cWhat to scan\u201d"),
)
"""What helps by an option of the command line, and by what the page has in its place."""


class Scanning:
    """Knows the newest scan."""

    def __init__(self) -> None:
        self._live: LiveScan | None = None
        self._begun = 0
        self._patches: Patches | None = None  # of a scan that is over: its volume, which is large, is not kept
        self._counts, self._axes = (0, 0), Axes.CAMERA.value
        self._over: Scanned | None = None
        self._options: Mapping[str, str] = {}

    @contextmanager
    def shown(self, live: LiveScan, begun: int, options: Mapping[str, str]) -> Iterator[None]:
        """While the block runs, this scan goes on; after it, its surface stays.

        Args:
            live: the scan.
            begun: number of its activity.
            options: of `scan` by name, with which it was started.
        """
        self._live, self._begun, self._over, self._patches = live, begun, None, None
        self._options = dict(options)
        self._axes = (Axes.CAMERA if live.axes is None else Axes.MAT).value
        try:
            yield
        finally:
            self._patches, self._counts, self._live = live.patches, live.counts, None

    def over(self, scanned: Scanned | None) -> None:
        """Take what came of it; None: nothing was written."""
        self._over = scanned

    def crop(self, box: Box | None, text: str) -> str:
        """Keep only what lies in a box; return what to say.

        Args:
            box: None: everything.
            text: the box as it was typed.

        Raises:
            SettingsError: no scan is active.
        """
        if (live := self._live) is None:
            raise SettingsError("no scan is active", "start one: the box can also be set before it starts")
        live.crop(box)
        self._options = {**self._options, "box": text}
        return "everything is saved" if box is None else "only what is inside the box is saved"

    @property
    def folder(self) -> str:
        """Where its files lie; empty: nowhere."""
        return "" if self._over is None else str(self._over.folder)

    @property
    def state(self) -> ScanState | None:
        """How it goes; None: there was none."""
        if (live := self._live) is not None:
            pairs, fused = live.counts
            return ScanState(
                words=page_words(live.words), level=_level(live.last), pairs=pairs, fused=fused, options=self._options
            )
        if self._patches is None:
            return None
        (pairs, fused), over = self._counts, self._over
        if over is None:
            return ScanState(words="the scan ended without a result", pairs=pairs, fused=fused, options=self._options)
        return ScanState(
            words=over.words,
            level=over.level,
            pairs=pairs,
            fused=fused,
            folder=str(over.folder),
            files=over.files,
            options=self._options,
        )

    def surface(self, since: int, most_points: int) -> Surface | None:
        """See Source."""
        if (live := self._live) is not None:
            return Surface(self._begun, live.surface_since(since, most_points), self._axes)
        return (
            None if self._patches is None else Surface(self._begun, self._patches.since(since, most_points), self._axes)
        )


def page_words(words: str) -> str:
    """Return advice with the page's fields in place of the command's options."""
    for option, field in _ON_THE_PAGE:
        words = re.sub(option, field, words)
    return words


def _level(last: ScannedPair | None) -> str:
    return "unknown" if last is None else _LEVELS[last.state]
