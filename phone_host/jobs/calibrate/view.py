"""Shows a live calibration: on a terminal as a picture that is redrawn, elsewhere as lines that are written once."""

import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Final, Protocol

from rich.console import Console
from rich.text import Text

from common import now
from common.places import make_folder
from common.program.terminal import say
from phone_host.calibration.guide.gates import View
from phone_host.calibration.guide.snapshot import (
    Ended,
    GuideSnapshot,
    figure_lines,
    guide_svg,
    picture_lines,
    verdict_lines,
)
from phone_host.output.atomic import write_bytes
from phone_host.output.json_text import json_text
from phone_host.run.terminal_view import Part, Redrawn

_EVERY_NS: Final = 250_000_000
"""Pictures are redrawn, and snapshots written, at most so often."""

_SIDES: Final = "left and right are those of the pictures: face the cameras, and their left is at your right hand"


class Shows(Protocol):
    """Shows snapshots."""

    def show(self, snapshot: GuideSnapshot, views: tuple[View, ...], note: str) -> None:
        """Show the present state; called several times a second."""


class Lines:
    """Writes each new instruction, view, verdict and note as one line to stderr, at once."""

    def __init__(self) -> None:
        self._words = self._note = ""
        self._views = 0
        self._verdict: tuple[str, ...] = ()

    def show(self, snapshot: GuideSnapshot, views: tuple[View, ...], note: str) -> None:
        """See Shows."""
        for view in views[self._views :]:
            edges = [f"edges {look.edge_px:.1f} px" for look in view.looks]
            shares = [f"{100 * coverage.share:.0f} % covered" for coverage in snapshot.coverage]
            left, right = (f"{edge}, {share}" for edge, share in zip(edges, shares, strict=True))
            _write(f"taken: {view.name.lstrip('0')}  left {left}  right {right}")
        self._views = len(views)
        if (verdict := verdict_lines(snapshot)) != self._verdict:
            self._verdict = verdict
            _write("so far: " + "; ".join(verdict))
        if snapshot.words != self._words:
            self._words = snapshot.words
            _write(f"say: {self._words}")
        if note != self._note:
            self._note = note
            if note:
                _write(f"note: {note}")


class Picture(Redrawn):
    """Redraws the picture on a terminal; a context manager.

    Args:
        console: where to draw; stderr by default, so that stdout is free for results.
        rings: whether the terminal's bell tells that a view was taken.
    """

    def __init__(self, console: Console | None = None, *, rings: bool = False) -> None:
        super().__init__(console)
        self.rings = rings
        self._views = 0
        self._shown_ns = 0

    def show(self, snapshot: GuideSnapshot, views: tuple[View, ...], note: str) -> None:
        """See Shows."""
        now_ns = now.monotonic_ns()
        if now_ns - self._shown_ns < _EVERY_NS and len(views) == self._views:
            return
        self._shown_ns = now_ns
        parts = [Part(0, Text(snapshot.words, style="bold reverse"))]
        parts += [Part(1, Text(note, style="yellow"))] if note else []
        parts += [Part(2, Text(line)) for line in figure_lines(snapshot)]
        parts += [Part(4, Text(snapshot.remedy, style="dim"))] if snapshot.remedy else []
        parts += [Part(3, Text(line, no_wrap=True)) for line in picture_lines(snapshot)]
        self.draw(parts, rings=self.rings and len(views) > self._views)
        self._views = len(views)


class SnapshotValues:
    """Hands on what guide.json holds, at most four times a second, and at the end."""

    def __init__(self, take: Callable[[GuideSnapshot, Mapping[str, object]], None]) -> None:
        self._take = take
        self._due_ns = 0

    def show(self, snapshot: GuideSnapshot, views: tuple[View, ...], note: str) -> None:
        """See Shows."""
        del views
        now_ns = now.monotonic_ns()
        if now_ns < self._due_ns and snapshot.ended is Ended.RUNNING:
            return
        self._due_ns = now_ns + _EVERY_NS
        self._take(snapshot, {**snapshot.as_json(), "note": note})


class SnapshotFiles(SnapshotValues):
    """Writes guide.json and guide.svg whenever something has changed, for whoever renders them.

    Raises:
        OSError: it cannot be written to.
    """

    def __init__(self, folder: Path) -> None:
        super().__init__(self._write)
        make_folder(folder)
        self._folder = folder
        self._written = ""

    def _write(self, snapshot: GuideSnapshot, values: Mapping[str, object]) -> None:
        text = json_text(values, indent=2) + "\n"
        if text == self._written:
            return
        self._written = text
        write_bytes(self._folder / "guide.svg", guide_svg(snapshot).encode())
        write_bytes(self._folder / "guide.json", text.encode())


class Spoken:
    """Hands new words to a voice."""

    def __init__(self, voice: Callable[[str], None]) -> None:
        self._voice, self._words = voice, ""

    def show(self, snapshot: GuideSnapshot, views: tuple[View, ...], note: str) -> None:
        """See Shows."""
        del views, note
        if snapshot.words != self._words:
            self._words = snapshot.words
            self._voice(self._words)


def tell_sides() -> None:
    """Say once which left and right are meant."""
    say(f"phone-host: {_SIDES}", sys.stderr, flush=True)


def _write(line: str) -> None:
    say([line], sys.stderr, flush=True)
