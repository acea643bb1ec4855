"""Whatever ends `phone-host print`, the printer ends cold: every signal, in every state, by every door."""

import itertools
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Final

import pytest
from _pytest.mark import ParameterSet

from phone_host.printers.printer_uri import ServerKind
from tests.print.test_print_verb import environment
from tests.support.print_doors import Door, Scene, State, gcode_of, scene, server_scene, until_or_over
from tests.support.print_server import ServerFaults, print_server
from tests.support.programs import until

INT, TERM, HUP, QUIT = signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT
SIGNALS: Final = {"int": [INT], "int twice": [INT, INT], "term": [TERM], "hup": [HUP], "quit": [QUIT]}
CODES: Final = {"hup": 129}
"""Of the others: 130."""

_NAMES, _STATES, _DOORS = list(SIGNALS), list(State), list(Door)


def _cases() -> list[ParameterSet]:
    """All combinations. Every day run those that hold each signal in each state, and each signal and each state by each door."""
    cases = []
    for (row, name), (column, state), (number, door) in itertools.product(
        enumerate(_NAMES), enumerate(_STATES), enumerate(_DOORS)
    ):
        marks = [] if number == (row + column) % len(_DOORS) else [pytest.mark.slow]
        cases.append(pytest.param(name, state, door, id=f"{name} {state.value} {door.value}", marks=marks))
    return cases


def _reset_signals() -> None:
    """Give the signals their usual meaning: whoever runs the tests may have ignored them."""
    for number in (INT, TERM, HUP, QUIT):
        signal.signal(number, signal.SIG_DFL)


def _ignore_hang_up() -> None:
    """Do as nohup does."""
    _reset_signals()
    signal.signal(HUP, signal.SIG_IGN)


def _started(
    home: Path, state: State, there: Scene, prepare: Callable[[], None] = _reset_signals
) -> "subprocess.Popen[str]":
    gcode = home / "cube.gcode"
    gcode.write_text(gcode_of(state))
    return subprocess.Popen(
        [sys.executable, "-P", "-m", "phone_host.start", "print", str(gcode), *there.options, "--yes"],
        env=environment(home),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=prepare,  # noqa: PLW1509 - no thread of ours holds a lock then
    )


@pytest.mark.parametrize(("name", "state", "door"), _cases())
def test_a_print_ends_cold(name: str, state: State, door: Door, tmp_path: Path) -> None:
    """Both heaters were on, and are off after the signal; one line at most, no traceback, and the exit code of the signal."""
    with scene(door, state, tmp_path) as there, _started(tmp_path, state, there) as process:
        until_or_over(process, there.is_there, f"it is {state.value}")
        assert there.is_hot()
        if state is State.CANCELLING:
            process.send_signal(TERM)
            until_or_over(process, there.is_cancelling, "it is being cancelled")
        first, *second = SIGNALS[name]
        process.send_signal(first)
        if second:
            until_or_over(process, there.is_cancelling, "it is being cancelled")
            if process.poll() is None:
                process.send_signal(second[0])
        there.obey()
        _, errors = process.communicate(timeout=60)
        until(there.is_cold, "both heaters are off")
    assert process.returncode == CODES.get(name, 130), errors
    assert len(errors.splitlines()) <= 1, errors
    assert "Traceback" not in errors


def test_a_print_under_nohup_goes_on(tmp_path: Path) -> None:
    """SIGHUP that the parent ignores stays ignored: lines follow after it; SIGTERM still cools."""
    with (
        scene(Door.SOCKET, State.PRINTING, tmp_path) as there,
        _started(tmp_path, State.PRINTING, there, _ignore_hang_up) as process,
    ):
        until_or_over(process, there.is_there, "it prints")
        process.send_signal(HUP)
        before = there.count()
        until_or_over(process, lambda: there.count() > before + 50, "it goes on")
        assert process.poll() is None
        process.send_signal(TERM)
        _, errors = process.communicate(timeout=60)
        until(there.is_cold, "both heaters are off")
    assert process.returncode == 130, errors


def _ended_or_signalled(process: "subprocess.Popen[str]") -> bool:
    """Send Ctrl-C unless the process has ended; return whether it has."""
    if process.poll() is not None:
        return True
    process.send_signal(INT)
    return False


@pytest.mark.parametrize("holds", [{"GET"}, {"GET", "POST"}], ids=["questions", "orders, too"])
def test_a_second_ctrl_c_orders_the_end_and_cold_heaters_though_no_answer_comes(
    holds: set[str], tmp_path: Path
) -> None:
    """Both orders are given before it leaves; without an answer to them, one line says that heaters may be on, with exit 3."""
    with print_server(ServerKind.OCTOPRINT, ServerFaults(rate=0.001)) as server:
        there = server_scene(server, State.PRINTING, tmp_path)
        with _started(tmp_path, State.PRINTING, there) as process:
            until_or_over(process, there.is_there, "it prints")
            server.faults.holds = frozenset(holds)
            asked = server.answers
            until_or_over(process, lambda: server.answers > asked, "a question waits for its answer")
            until(lambda: _ended_or_signalled(process), "it leaves, however often it is told to")
            _, errors = process.communicate(timeout=60)
        assert there.is_cold()
        assert server.condition == "cancelled"
    assert process.returncode == (3 if "POST" in holds else 130), errors
    assert ("go and look" in errors) == ("POST" in holds)
    assert len(errors.splitlines()) == 1, errors
