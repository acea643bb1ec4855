"""The progress bar: on a terminal it says what is done, how far it is and how long it takes; elsewhere nothing."""

import os
import pty
from contextlib import redirect_stderr

import pytest

from phone_host.run.progress_bar import step_bar


def test_nothing_is_shown_without_a_terminal(capfd: pytest.CaptureFixture[str]) -> None:
    """A log file gets no bar."""
    with step_bar("finding the board", 2) as step:
        step()
        step()
    assert capfd.readouterr() == ("", "")


def test_a_terminal_shows_what_is_done_how_far_and_the_time_left(monkeypatch: pytest.MonkeyPatch) -> None:
    """The words, 2/3 and the time left stand on one line of 50 columns."""
    for name in ("NO_COLOR", "FORCE_COLOR", "TTY_COMPATIBLE"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "50")
    control, terminal = pty.openpty()
    with os.fdopen(terminal, "w") as stderr, redirect_stderr(stderr), step_bar("finding the board", 3) as step:
        step()
        step()
    said = _all_of(control)
    assert "finding the board" in said
    assert "2/3" in said
    assert "left" in said


def _all_of(control: int) -> str:
    """Read what a closed terminal still holds. It gives its bytes in pieces."""
    said = b""
    try:
        while piece := os.read(control, 65536):
            said += piece
    except OSError:  # Linux: EIO once everything is read and the other end is closed
        pass
    os.close(control)
    return said.decode()
