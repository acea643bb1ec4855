"""Ctrl-C out of native code: the terminal is left in order, and a stderr that nobody reads keeps nobody alive."""

import os
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import pytest

from tests.support.terminal import in_terminal

_STUCK = """
import hashlib, os
from common.program.interrupts import interruptible, leave_at_once
leave_at_once()
said = False
with interruptible(native=True):
    while True:
        try:
            if not said:
                said = True
                os.write({begun}, {said!r})
            hashlib.pbkdf2_hmac("sha256", b"", b"", 10**9)
        except KeyboardInterrupt:
            pass
"""
"""A command in native code that looks at no signal and takes minutes, also if the signal comes just before."""

_IN_PYTHON = """
import argparse, os, time
from common.program.commandline import ExamplesFirstParser, run_command
from common.program.interrupts import interruptible, leave_at_once
leave_at_once()
def command(options):
    with interruptible():
        os.write(1, b"begun")
        time.sleep(60)
raise SystemExit(run_command(ExamplesFirstParser("sample"), [], command))
"""


_KEEPS = """
import argparse, os, sys, time
from common.program.commandline import ExamplesFirstParser, run_command
from common.program.interrupts import interruptible, leave_at_once
from phone_host.run.kept import kept_if_interrupted
leave_at_once()
def write():
    os.write(1, b"writing")
    time.sleep(float(sys.argv[1]))
    os.write(1, b" written")
def command(options):
    with interruptible(native=True), kept_if_interrupted(write):
        os.write(1, b"begun")
        time.sleep(60)
raise SystemExit(run_command(ExamplesFirstParser("sample"), [], command))
"""
"""A command that writes, in so many seconds, what it has come to."""


def test_the_cursor_comes_back_and_the_line_stands_alone(tmp_path: Path) -> None:
    """A bar has hidden the cursor and stands in its line; after Ctrl-C the bar is gone, the cursor is there, and one line says why."""
    code = _STUCK.format(begun=2, said=b"\x1b[?25lmatching 40%")
    with in_terminal([sys.executable, "-P", "-c", code], 50, tmp_path) as running:
        running.read_until(b"40%")
        running.process.send_signal(signal.SIGINT)
        assert running.read_all() == 130
    assert running.seen.endswith(b"40%\r\x1b[K\x1b[?25hinterrupted\r\n")


@pytest.mark.parametrize("code", [_STUCK.format(begun=1, said=b"begun"), _IN_PYTHON])
def test_a_full_pipe_keeps_nobody_alive(code: str) -> None:
    """Nobody empties stderr, and it is full; Ctrl-C ends the process with 130 all the same, in native code and in Python."""
    unread, stderr = os.pipe()
    os.set_blocking(stderr, False)
    with suppress(BlockingIOError):
        while True:
            os.write(stderr, bytes(4096))
    os.set_blocking(stderr, True)
    with subprocess.Popen([sys.executable, "-P", "-c", code], stdout=subprocess.PIPE, stderr=stderr) as running:
        assert running.stdout is not None
        assert running.stdout.read(5) == b"begun"
        running.send_signal(signal.SIGINT)
        try:
            assert running.wait(60) == 130
        finally:
            running.kill()
    os.close(unread)
    os.close(stderr)


_WORDS = {signal.SIGTERM: (b"terminated", 143), signal.SIGHUP: (b"hung up", 129), signal.SIGQUIT: (b"quit", 131)}


@pytest.mark.parametrize("number", _WORDS)
@pytest.mark.parametrize("code", [_STUCK.format(begun=1, said=b"begun"), _IN_PYTHON])
def test_a_signal_ends_a_computation_with_one_line(code: str, number: signal.Signals) -> None:
    """In native code and in Python: 128 + its number, one word on stderr, and no core file."""
    with subprocess.Popen(
        [sys.executable, "-P", "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as process:
        assert process.stdout is not None
        assert os.read(process.stdout.fileno(), 5) == b"begun"
        process.send_signal(number)
        assert process.communicate(timeout=60)[1] == _WORDS[number][0] + b"\n"
        assert process.returncode == _WORDS[number][1]


@pytest.mark.parametrize(("number", "code"), [(signal.SIGTERM, 143), (signal.SIGINT, 130), (signal.SIGHUP, 129)])
def test_what_was_computed_is_written_however_long_it_takes(number: signal.Signals, code: int) -> None:
    """Longer than a command may take to leave; a second signal ends that, too."""
    for seconds, again, written in ((2, False, b" written"), (60, True, b"")):
        command = [sys.executable, "-P", "-c", _KEEPS, str(seconds)]
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
            assert process.stdout is not None
            assert os.read(process.stdout.fileno(), 5) == b"begun"
            process.send_signal(number)
            assert os.read(process.stdout.fileno(), 7) == b"writing"
            if again:
                process.send_signal(number)
            out, told = process.communicate(timeout=60)
        assert out == written
        assert told.endswith(_WORDS.get(number, (b"interrupted", 130))[0] + b"\n")
        assert process.returncode == code
