"""Printers that lie: each print ends in bounded time, in one clear line, and the lines that cool have been written."""

import os
import random
import signal
import subprocess
import sys
from pathlib import Path
from typing import Final

import pytest

from common.errors import TandemError
from phone_host.printers.door import Ended, Job, Phase, Wishes
from phone_host.printers.doors import door_to
from phone_host.printers.printer_uri import read_uri
from phone_host.printers.slicing import facts_of
from tests.print.test_print_verb import done, environment
from tests.support.lying_printer import Answer, LyingPrinter, lying_printer
from tests.support.marlin_printer import Faults, cube, printer
from tests.support.print_doors import until_or_over
from tests.support.programs import until

SLOW = pytest.mark.slow
_NOISE: Final = random.Random(5).randbytes(3000).replace(b"ok", b"")
_LIE_AFTER: Final = 12
"""Lines that a printer takes before it lies: both heaters are on by then."""


def after(lie: bytes) -> Answer:
    """A printer that takes some lines, then says the same to all."""
    return lambda _, count: b"ok\n" if count < _LIE_AFTER else lie


def asking_for(text: str) -> Answer:
    """A printer that says a request to every line from the tenth on; # stands for the number of the line that came."""

    def answer(line: str, count: int) -> bytes:
        number = line.partition(" ")[0].removeprefix("N")
        return b"ok\n" if count < _LIE_AFTER or not number.isdecimal() else text.replace("#", number).encode()

    return answer


LIES: Final = [
    pytest.param(after(b"Error:Heating failed, system stopped! Heater_ID: 0\n"), b"", "Heating failed", id="runaway"),
    pytest.param(after(b"start\n"), b"", "has restarted", id="reboot"),
    pytest.param(after(b"Resend: 99999\n"), b"", "asks for line 99999", id="future"),
    pytest.param(asking_for("Resend: 1\nok\n"), b"", "has restarted", id="reboot without a word"),
    pytest.param(after(b"fatal:Heater/sensor error - Printer stopped\n"), b"", "Heater/sensor error", id="fatal"),
    pytest.param(after(b"!! Klipper state: Shutdown\n"), b"", "Shutdown", id="shutdown"),
    pytest.param(after(b"//action:cancel\nok\n"), b"", "ended at the printer", id="display"),
    pytest.param(after(b"\x00\x00//action:poweroff\r\nok\r\n"), b"", "ended at the printer", id="power off"),
    pytest.param(asking_for("Resend: #\nok\n"), b"", "does not take line", marks=SLOW, id="same line"),
    pytest.param(asking_for("Resend: #\n" * 50), b"", "does not take line", marks=SLOW, id="flood of requests"),
    pytest.param(after(b""), b"", "does not answer", marks=SLOW, id="silence"),
    pytest.param(after(b""), b"x" * 5000, "does not answer", marks=SLOW, id="endless line"),
    pytest.param(after(_NOISE), b"", "the printer", marks=SLOW, id="noise"),
    pytest.param(after(b""), b"T:200.1 /200.0 B:60.0 /60.0\n", "does not take line", marks=SLOW, id="temperatures"),
    pytest.param(after(b"o"), b"\n", "the printer", marks=SLOW, id="half words"),
]  # fmt: skip


def _gcode(folder: Path, lines: int = 400) -> str:
    path = folder / "cube.gcode"
    path.write_text("\n".join(cube(lines)[:-3]) + "\n")
    return str(path)


def _sent(folder: Path, uri: str) -> Ended | TandemError:
    """Print in this process, which costs no start of another one; return how it ended."""
    gcode = Path(_gcode(folder))
    try:
        return door_to(read_uri(uri)).send(Job(gcode, gcode.name, facts_of(gcode)), Wishes(), lambda _: None)
    except TandemError as error:
        return error


@pytest.mark.parametrize(("answer", "chatter", "words"), LIES)
def test_a_printer_that_lies_is_given_up_and_cooled(answer: Answer, chatter: bytes, words: str, tmp_path: Path) -> None:
    """It fails in one line that says what the printer did; nozzle and bed were told to be cold behind everything that heats."""
    with lying_printer(answer, chatter) as there:
        ended = _sent(tmp_path, there.uri)
        until(lambda: there.is_told_to_cool, "it was told to cool")
    if isinstance(ended, TandemError):
        assert ended.exit_code == 3
    else:
        assert (ended.phase, bool(ended.remedy)) == (Phase.FAILED, True)
    assert words in ended.problem
    assert "\n" not in ended.problem
    assert len(there.lines) < 100


@pytest.mark.parametrize("answer", [lambda *_: b"ok\n" * 30, lambda line, _: line.encode() + b"\nok\n"], ids=["flood of ok", "echo"])  # fmt: skip
def test_what_can_be_borne_is_borne(answer: Answer, tmp_path: Path) -> None:
    """More answers than questions, and an echo of every line: the print goes on to its end, and leaves nothing hot."""
    with lying_printer(answer) as there:
        ended = _sent(tmp_path, there.uri)
        assert there.is_told_to_cool
    assert isinstance(ended, Ended)
    assert ended.phase is Phase.DONE


def _begun(folder: Path, uri: str, gcode: str = "") -> "subprocess.Popen[str]":
    return subprocess.Popen(
        [sys.executable, "-P", "-m", "phone_host.start", "print", gcode or _gcode(folder), "--printer", uri, "--yes"],
        env=environment(folder),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def test_a_printer_that_leaves_while_it_is_cancelled_is_told(tmp_path: Path) -> None:
    """It takes the first line that cools, and is gone: nobody says that it is cold."""
    there: LyingPrinter

    def answer(line: str, _: int) -> bytes:
        if "M104 S0" in line:
            there.is_over.set()
            return b""
        return b"ok\n"

    with lying_printer(answer) as there, _begun(tmp_path, there.uri) as process:
        until(lambda: len(there.lines) > 20, "it prints")
        process.send_signal(signal.SIGTERM)
        _, errors = process.communicate(timeout=60)
    assert process.returncode == 3
    assert "cannot be cooled from here" in errors
    assert len(errors.splitlines()) == 1


@pytest.mark.parametrize("twice", [False, True], ids=["once", "twice"])
def test_a_printer_that_is_deaf_while_it_heats_cools_when_it_hears(twice: bool, tmp_path: Path) -> None:  # noqa: FBT001 - a parameter of the test
    """No emergency parser: the host gives up, or is made to leave, and what it has written before is done after the wait."""
    gcode = tmp_path / "hot.gcode"
    gcode.write_text("M140 S60\nM104 T1 S190\nM109 S210\n" + "G1 X5 E1\nG1 X6 E2\n" * 50)
    faults = Faults(heating_s=5.0 if twice else 9.0, hears_at_once=False, greets=True)
    with printer(faults) as there:
        with _begun(tmp_path, there.uri, str(gcode)) as process:
            until(lambda: "M109 S210" in there.done, "it heats")
            process.send_signal(signal.SIGINT)
            if twice:
                until(lambda: b"M104" in there.waiting, "it is being cancelled")
                process.send_signal(signal.SIGINT)
            _, errors = process.communicate(timeout=60)
        assert "M109 S210" in there.done[-1], "the host has left before the printer hears"
        assert (there.nozzle, there.bed, there.tools) == (210.0, 60.0, {1: 190.0})
        until(lambda: there.is_cold, "both nozzles and the bed are cold")
    assert process.returncode == (130 if twice else 3)
    assert len(errors.splitlines()) == 1
    assert not any(text.startswith("G1") for text in there.done)
    if twice:  # nobody has seen the end: the next start says so
        told = done(tmp_path, str(gcode), "--printer", "serial:/dev/ttyNOPE", "--yes")
        assert "its heaters may be on" in told.stderr


def test_the_printer_s_own_guard_is_on_while_it_prints(tmp_path: Path) -> None:
    """A killed host leaves M85 on; a print that ends takes it back, and a printer without M85 prints all the same."""
    path = _gcode(tmp_path)
    with printer(Faults(delay_s=0.01, greets=True)) as there:
        with _begun(tmp_path, there.uri) as process:
            until(lambda: len(there.done) > 20, "it prints")
            process.kill()
            process.wait(60)
        assert there.inactivity_s == 900
    for faults, guards in ((Faults(), [900, 0]), (Faults(has_m85=False), [])):
        with printer(faults, on_socket=True) as there:
            assert done(tmp_path, path, "--printer", there.uri, "--yes").returncode == 0
            assert there.guards == guards
            assert there.is_cold


def test_an_answer_that_is_lost_among_temperatures_is_noticed(tmp_path: Path) -> None:
    """M155 reports all the while: the print goes on, and no line is done twice."""
    with printer(Faults(lost_answers={8}, chatter="T:200.1 /200.0 B:60.0 /60.0", greets=True)) as there:
        ended = _sent(tmp_path, there.uri)
    assert isinstance(ended, Ended)
    assert ended.phase is Phase.DONE
    assert there.lost == 1
    assert there.done == [*cube(400)[:-3], "M104 S0", "M140 S0"]


def test_two_prints_of_one_machine(tmp_path: Path) -> None:
    """To two printers they go side by side, each with an entry of its own; the second to one printer is refused."""
    with (
        printer(Faults(delay_s=0.02, greets=True)) as one,
        printer(Faults(delay_s=0.02), on_socket=True) as two,
        _begun(tmp_path, one.uri) as first,
    ):
        until(lambda: len(one.done) > 5, "one prints")
        with _begun(tmp_path, two.uri) as second:
            until(lambda: len(list(tmp_path.rglob("printing/*.json"))) == 2, "each has an entry")
            refused = done(tmp_path, _gcode(tmp_path), "--printer", two.uri, "--yes")
            assert refused.returncode == 3
            assert "another print goes to" in refused.stderr
            assert "was not finished" not in refused.stderr
            second.kill()
            second.wait(60)
        told = done(tmp_path, _gcode(tmp_path), "--printer", two.uri)
        assert told.stderr.count("was not finished") == 1
        first.send_signal(signal.SIGTERM)
        first.communicate(timeout=60)
        assert one.is_cold
    assert not list(tmp_path.rglob("printing/*.json"))


def test_the_api_locks_its_printer_and_keeps_a_journal(tmp_path: Path) -> None:
    """A command to the same printer is refused meanwhile; after a kill the next start says so; what `tell` raises cools."""
    path = _gcode(tmp_path, 3000)
    call = f"from phone_host.api import print_model; print_model({path!r}, sys.argv[1], tell=tell)"
    kill, fail = "def tell(_): pass", "def tell(progress):\n if progress.share > 0: raise KeyError('mine')"
    for body in (kill, fail):
        with printer(Faults(delay_s=0.01), on_socket=True) as there:
            script = [sys.executable, "-P", "-c", f"import sys\n{body}\n{call}", there.uri]
            with subprocess.Popen(script, env=environment(tmp_path), stderr=subprocess.PIPE, text=True) as process:
                if body is kill:
                    until_or_over(process, lambda: bool(list(tmp_path.rglob("printing/*.json"))), "it has an entry")
                    refused = done(tmp_path, path, "--printer", there.uri, "--yes")
                    assert (refused.returncode, "another print goes to" in refused.stderr) == (3, True), refused.stderr
                    process.kill()
                _, errors = process.communicate(timeout=60)
            assert ("KeyError: 'mine'" in errors) == (body is fail), errors
            assert there.is_cold == (body is fail)
        told = done(tmp_path, path, "--printer", there.uri, "--yes")
        assert ("was not finished" in told.stderr) == (body is kill), told.stderr


def test_a_file_that_is_cut_while_it_is_printed_leaves_nothing_hot(tmp_path: Path) -> None:
    """Its lines that cool are gone: the heaters are switched off all the same, and the file is named."""
    path = tmp_path / "cube.gcode"
    path.write_text("\n".join(cube(3000)) + "\n")
    with printer(Faults(delay_s=0.002), on_socket=True) as there:
        with _begun(tmp_path, there.uri, str(path)) as process:
            until(lambda: len(there.done) > 20, "it prints")
            os.truncate(path, 50_000)
            _, errors = process.communicate(timeout=60)
        assert process.returncode == 4
        assert f"{path} was changed while it was printed" in errors
        assert there.is_cold


@pytest.mark.parametrize("ends", [True, False], ids=["at its end", "cancelled"])
def test_a_printer_that_answers_and_stays_hot_is_told(ends: bool, tmp_path: Path) -> None:  # noqa: FBT001 - a parameter of the test
    """It says ok to every line that cools, twice, and heats: exit 3 in one line with both goals."""
    gcode = tmp_path / "cube.gcode"
    gcode.write_text("\n".join(cube(40 if ends else 3000)) + "\n")
    with printer(Faults(delay_s=0.005, stays_hot=True), on_socket=True) as there:
        with _begun(tmp_path, there.uri, str(gcode)) as process:
            if not ends:
                until(lambda: len(there.done) > 20, "it prints")
                process.send_signal(signal.SIGINT)
            _, errors = process.communicate(timeout=60)
        assert there.refused_to_cool >= 4
    assert process.returncode == 3
    assert "but still heats (nozzle 200 C, bed 60 C)" in errors
    assert len(errors.splitlines()) == 1


def test_a_printer_that_reports_no_goals_is_noted(tmp_path: Path) -> None:
    """It has answered what cools; that nobody can know more is said in one sentence."""
    with printer(Faults(reports=False), on_socket=True) as there:
        ended = _sent(tmp_path, there.uri)
    assert isinstance(ended, Ended)
    assert "does not report their target temperatures" in ended.notes[-1]
