"""The scan that goes on on the page, or the last one: how it goes in words, its surface, and where its files lie. Any thread may use it."""

import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from common.errors import SettingsError
from phone_host.jobs.scan_request import box_of
from phone_host.output.axes import Axes
from phone_host.report.report_page import Headline
from phone_host.report.scan_report import MODEL, TRAJECTORY, ScanReport, scan_verdict
from phone_host.report.stereo_report import ALWAYS
from phone_host.run.live_scan import LiveScan
from phone_host.scan.patches import Patches
from phone_host.scan.scanned import ScannedPair
from phone_host.scan.tracking_words import Tracking
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


@dataclass(frozen=True, slots=True, kw_only=True)
class Scanned:
    """What came of a scan.

    Attributes:
        words: one sentence.
        level: good, warning or bad.
        folder: where its files lie.
        files: their names.
    """

    words: str
    level: str
    folder: Path
    files: tuple[str, ...] = (MODEL, TRAJECTORY, *ALWAYS)


def scanned(report: ScanReport, folder: Path, *, is_early: bool = False) -> Scanned:
    """Return what came of a scan.

    Args:
        report: of it.
        folder: where its files lie.
        is_early: whether an error ended it.
    """
    verdict, words = scan_verdict(report)
    if report.model.triangles:
        wide, high, deep = (1000 * side for side in report.model.size.extent_m)
        words += f" Size: {wide:.0f} x {high:.0f} x {deep:.0f} mm"
    if is_early:
        words, verdict = f"ended early: {words}", Headline.WARNING if verdict is Headline.GOOD else verdict
    return Scanned(words=words, level=verdict.value, folder=folder)


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

    def crop(self, text: str) -> str:
        """Keep only what lies in a box; return what to say.

        Args:
            text: the box, as `scan` has it; empty: everything.

        Raises:
            SettingsError: it is no box, or no scan is active.
        """
        box = box_of(text) if text.strip() else None
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
