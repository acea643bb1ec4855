"""Long work says on a terminal what is being done and how long it still takes, and nothing elsewhere."""

import io
import time

import pytest
from rich.console import Console

from phone_host.run.progress_bar import announced, busy_bar, share_bar


def console(*, terminal: bool) -> tuple[Console, io.StringIO]:
    """A console of 60 columns, and what it has shown."""
    shown = io.StringIO()
    return Console(file=shown, force_terminal=terminal, width=60, color_system=None, legacy_windows=False), shown


def test_a_bar_names_the_work_and_the_time_left() -> None:
    """Waiting and working have different words; the time left counts the work alone."""
    drawn, shown = console(terminal=True)
    with share_bar("waiting for the board", then="filming", console=drawn) as advance:
        advance(0.0)
    assert "waiting for the board" in shown.getvalue()
    assert "filming" not in shown.getvalue()
    with share_bar("waiting for the board", then="filming", console=drawn) as advance:
        for share in (0.1, 0.5, 1.0):
            advance(share)
    last = [line for line in shown.getvalue().splitlines() if "%" in line][-1]
    assert "filming" in last
    assert "0:00:00" in last


def test_work_of_unknown_length_is_named() -> None:
    """There is no time left to show, only the time that has passed."""
    drawn, shown = console(terminal=True)
    with busy_bar("writing the page", drawn):
        pass
    assert "writing the page" in shown.getvalue()
    assert "left" not in shown.getvalue()
    assert "0:00:00" in shown.getvalue()


def test_nothing_is_drawn_where_nobody_looks() -> None:
    """Into a file or a pipe not a byte is written."""
    drawn, shown = console(terminal=False)
    with share_bar("measuring", console=drawn) as advance, busy_bar("asking", drawn):
        advance(0.5)
    assert shown.getvalue() == ""


def test_a_stage_is_announced_again_and_again_where_its_bar_is_hidden() -> None:
    """A log holds a line when it begins, and from time to time how far it is; on a terminal the bar says it."""
    drawn, shown = console(terminal=False)
    with announced("rendering", drawn, lambda: "40 %", 0.001):
        while shown.getvalue().count("\n") < 3:
            time.sleep(0.001)
    lines = shown.getvalue().splitlines()
    assert lines[0] == "phone-host: rendering"
    assert set(lines[1:]) == {"phone-host: rendering: 40 %"}
    drawn, shown = console(terminal=True)
    with announced("rendering", drawn, lambda: "40 %", 0.0):
        pass
    assert shown.getvalue() == ""


def test_a_failure_leaves_no_bar_behind() -> None:
    """The error comes through, and the bar's line is erased."""
    drawn, shown = console(terminal=True)

    def fail() -> None:
        with share_bar("measuring", console=drawn) as advance:
            advance(0.5)
            raise ValueError("broken")

    with pytest.raises(ValueError, match="broken"):
        fail()
    assert shown.getvalue().endswith("\x1b[2K")
