"""Each run draws the same examples, programs find their signals as usual, and what is skipped is counted: whatever machine or parent started the tests."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.skipped import append_skips, listed

_ROOT = Path(__file__).resolve().parents[3]

_DRAW = """
import tests.conftest
from hypothesis import given, strategies
drawn = []
@given(strategies.binary(min_size=8))
def note(each): drawn.append(each)
note()
print(drawn)
"""

_SIGNALS = """
import subprocess, sys
import tests.conftest
ask = "import signal; print([signal.getsignal(signal.Signals(n)) is not signal.SIG_IGN for n in (1, 2, 3, 15)])"
print(subprocess.run([sys.executable, "-c", ask], capture_output=True, text=True, check=True).stdout)
"""


def _printed(command: list[str]) -> str:
    """What a program prints, in an environment that says nothing of continuous integration."""
    environment = {name: value for name, value in os.environ.items() if name != "CI"}
    done = subprocess.run(command, cwd=_ROOT, env=environment, capture_output=True, text=True, timeout=60, check=True)
    return done.stdout


def test_two_runs_draw_the_same_examples() -> None:
    """On any machine, also outside of continuous integration: a red run is red again."""
    first, second = (_printed([sys.executable, "-c", _DRAW]) for _ in range(2))
    assert first == second
    assert len(first) > 100


@pytest.mark.parametrize("ignored", ["INT QUIT", "HUP", "INT HUP QUIT TERM"])
def test_programs_of_tests_start_with_default_signals(ignored: str) -> None:
    """A background job of sh, or one under nohup, hands its ignored signals down; the programs that tests start react to them nevertheless."""
    shell = ["sh", "-c", f"trap '' {ignored}; exec \"$@\"", "sh", sys.executable, "-c", _SIGNALS]
    assert _printed(shell).strip() == "[True, True, True, True]"


def test_an_ignored_signal_does_not_end_the_tests() -> None:
    """Where Ctrl-C was ignored for the tests themselves, it stays so."""
    code = "import os, signal, tests.conftest; os.kill(os.getpid(), signal.SIGINT); print('on')"
    shell = ["sh", "-c", "trap '' INT; exec \"$@\"", "sh", sys.executable, "-c", code]
    assert _printed(shell) == "on\n"
    assert signal.getsignal(signal.SIGINT) is not signal.SIG_IGN


def test_skipped_tests_are_counted_by_reason(tmp_path: Path) -> None:
    """The most frequent reason comes first, whichever part of the suite it came from."""
    file = tmp_path / "skips"
    append_skips(file, [("a.py", 1, "Skipped: needs chromium")])
    append_skips(file, [("b.py", 2, "Skipped: needs npm"), ("b.py", 3, "Skipped: needs chromium")])
    assert listed(file.read_text().splitlines()) == ["skipped: 3", "     2  needs chromium", "     1  needs npm"]
    assert listed([]) == ["no test was skipped"]
