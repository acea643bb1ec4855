"""The live table on a real terminal: log lines stand above it in lines of their own, it fits, and nothing of it stays."""

import io
import logging
import os
import pty
import termios
import threading
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, suppress
from dataclasses import replace

import pytest
from rich.console import Console

from common.diagnostic import Diagnostic, Severity
from common.program import logs
from common.program.terminal import headed, rows
from phone_host.diagnostics.run_snapshot import RunSnapshot
from phone_host.run.terminal_view import LiveTable
from tests.support.run_snapshots import run
from tests.support.screen import Screen

SENTENCE = "the left image is covered: 97% of it is dark in 12 of 12 judged pairs, and no depth comes from what is dark"
_LOG = logging.getLogger("phone_host.test")


class Terminal:
    """A pseudo terminal of a given size and what it shows."""

    def __init__(self, columns: int, lines: int) -> None:
        self.screen = Screen(columns, lines)
        self._master, slave = pty.openpty()
        termios.tcsetwinsize(slave, (lines, columns))
        self.file = os.fdopen(slave, "w", encoding="utf-8")
        self._reader = threading.Thread(target=self._read)
        self._reader.start()

    def _read(self) -> None:
        raw = b""
        with suppress(OSError):  # the last writer has closed the terminal
            while data := os.read(self._master, 65536):
                raw += data
        self.screen.feed(raw.decode())

    def close(self) -> None:
        """Close the terminal; afterwards the screen shows its end."""
        self.file.close()
        self._reader.join(10)
        os.close(self._master)


@contextmanager
def terminal(monkeypatch: pytest.MonkeyPatch, columns: int, lines: int) -> Iterator[tuple[Terminal, Console]]:
    """Give a terminal that is this process's stderr, as a console, with the log on it."""
    shown = Terminal(columns, lines)
    for name in ("COLUMNS", "LINES", "NO_COLOR"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("TERM", "xterm-256color")
    root = logging.getLogger()
    before, level = root.handlers[:], root.level
    try:
        with redirect_stderr(shown.file):
            logs.set_up(logging.WARNING)
            console = Console(stderr=True)
            # The sizes of a pseudo terminal that is not this process's own.
            console.size = os.get_terminal_size(shown.file.fileno())
            yield shown, console
    finally:
        root.handlers[:] = before
        root.setLevel(level)
        shown.close()


def covered(pairs: int) -> RunSnapshot:
    """Return a run with many things to say."""
    seen = run(pairs)
    return replace(seen, camera=replace(seen.camera, unplugged=3, missed=7, refused_controls=2))


@pytest.mark.parametrize(("columns", "lines"), [(50, 30), (50, 12), (100, 30), (80, 24)])
def test_log_lines_stand_above_the_table_and_nothing_stays_of_it(
    monkeypatch: pytest.MonkeyPatch, columns: int, lines: int
) -> None:
    """Of a run that logs between redraws, a terminal keeps the log's lines alone, each from a row's beginning; the cursor is back."""
    seen = [covered(31), run(5), covered(12), run(40)]
    with terminal(monkeypatch, columns, lines) as (shown, console):
        turn = iter(seen * 3)
        with LiveTable(lambda: next(turn), console, pairs=100, refresh_s=0.0) as live:
            for number in range(12):
                live.refresh()
                _LOG.warning(logs.event("depth_doubtful", number=number, problem=SENTENCE))
        _LOG.warning("after the end")
    kept = shown.screen.everything
    begun = [row for row in kept if " WARNING phone_host.test" in " " + row]
    assert len(begun) == 13
    assert all(row.startswith("20") for row in begun)
    text = " ".join(kept)
    assert [f"number={number} problem" in text for number in range(12)] == [True] * 12
    assert "pairs" not in text.replace("judged pairs", "")
    assert "clock" not in text
    assert shown.screen.is_cursor_shown


@pytest.mark.parametrize("lines", [3, 8, 12])
def test_a_low_terminal_shows_the_bar_and_the_table_first(lines: int) -> None:
    """On a low terminal the view leaves one row free, and the bar stays when the regime has no room."""
    stream, screen = io.StringIO(), Screen(50, lines)
    console = Console(file=stream, width=50, height=lines, force_terminal=True)
    with LiveTable(lambda: covered(31), console, pairs=100, refresh_s=0.0) as live:
        live.refresh()
        screen.feed(stream.getvalue().replace("\n", "\r\n"))
        assert "31/100" in "".join(screen.rows)
        assert screen.rows[-1] == ""
        assert "processor" not in "".join(screen.rows)
        stream.seek(0)
        stream.truncate()
    screen.feed(stream.getvalue().replace("\n", "\r\n"))
    assert screen.everything == []


def test_the_log_is_back_on_stderr_after_the_table(monkeypatch: pytest.MonkeyPatch) -> None:
    """The table takes the log only while it is shown, also if the run fails."""
    with terminal(monkeypatch, 80, 24) as (_, console):
        before = logging.getLogger().handlers[:]
        live = LiveTable(lambda: run(5), console)
        with pytest.raises(OSError, match="gone"), live:
            raise OSError("gone")
        assert logging.getLogger().handlers == before


def test_a_log_that_goes_elsewhere_stays_there() -> None:
    """Only the log's lines for stderr go through the table; a handler of somebody else keeps its lines."""
    elsewhere = io.StringIO()
    other = logging.StreamHandler(elsewhere)
    root = logging.getLogger()
    before, root.handlers[:] = root.handlers[:], [other]  # a command that ran in this process may have left its own
    try:
        with logs.written_by(pytest.fail):
            _LOG.error("to the file")
    finally:
        root.handlers[:] = before
    assert "to the file" in elsewhere.getvalue()


def test_a_summary_higher_than_the_terminal_says_its_headline_again() -> None:
    """The first line comes again as the last one where it would scroll off, and only there."""
    text = "the depth is right\n" + "\n".join(f"line {number}" for number in range(28))
    assert headed(text, 50, 30) == text
    assert headed(text, 50, 0) == text
    assert headed(text, 50, 29) == f"{text}\n\nthe depth is right"
    assert headed(text, 10, 29).endswith("\n\nthe depth\n  is right")
    assert rows(io.StringIO()) == 0


def test_a_limited_runs_bar_waits_for_the_first_pair_and_a_busy_board_is_named() -> None:
    """Its seconds count from the first pair: without one the bar stays empty, and the line below says who has the board."""
    drawn = io.StringIO()
    busy = replace(
        run(0), refused=Diagnostic("the board is busy with another host", "stop that one first", Severity.FAIL)
    )
    console = Console(file=drawn, width=100, height=40, force_terminal=True)
    with LiveTable(lambda: busy, console, seconds=5.0, refresh_s=0.0) as live:
        for _ in range(3):
            live.refresh()
        assert live.progress.tasks[0].completed == 0.0
        assert "the board is busy with another host: stop that one first" in drawn.getvalue()
        assert "waiting for the board" not in drawn.getvalue()
        busy = run(5)
        for _ in range(2):
            live.refresh()
        assert 0.0 < live.progress.tasks[0].completed <= 5.0
