"""phone-host print in a terminal of its own: one that is closed or held never keeps a printer hot, and keys and the display go together."""

import fcntl
import os
import signal
import subprocess
import sys
import termios
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from tests.print.test_print_verb import environment
from tests.support.marlin_printer import Faults, cube, printer
from tests.support.programs import until


class Terminal:
    """A terminal in which a print runs.

    Attributes:
        process: the print.
        shown: what the terminal has got so far.
    """

    def __init__(self, folder: Path, uri: str) -> None:
        gcode = folder / "cube.gcode"
        gcode.write_text("\n".join(cube(3000)) + "\n")
        self._master, self._slave = os.openpty()
        self.shown = b""
        self.process = subprocess.Popen(
            [sys.executable, "-P", "-m", "phone_host.start", "print", str(gcode), "--printer", uri, "--yes"],
            env={**environment(folder), "TERM": "xterm"},
            stdin=self._slave,
            stdout=self._slave,
            stderr=self._slave,
            start_new_session=True,
            preexec_fn=self._take,  # noqa: PLW1509 - no thread of ours holds a lock then
        )
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def press(self, keys: bytes) -> None:
        """Press keys."""
        os.write(self._master, keys)

    def hold(self) -> None:
        """Take nothing more, as after Ctrl-S."""
        termios.tcflow(self._slave, termios.TCOOFF)

    def go_on(self) -> None:
        """Take what comes again."""
        termios.tcflow(self._slave, termios.TCOON)

    def close(self) -> None:
        """Close the window."""
        for descriptor in (self._slave, self._master):
            with suppress(OSError):
                os.close(descriptor)

    @staticmethod
    def _take() -> None:
        signal.signal(signal.SIGHUP, signal.SIG_DFL)
        fcntl.ioctl(0, termios.TIOCSCTTY, 0)

    def _read(self) -> None:
        with suppress(OSError):
            while data := os.read(self._master, 4096):
                self.shown += data


@contextmanager
def terminal(folder: Path, uri: str) -> Iterator[Terminal]:
    """A terminal that is there while the block runs."""
    made = Terminal(folder, uri)
    try:
        yield made
    finally:
        if made.process.poll() is None:
            made.process.kill()
            made.process.wait(60)
        made.close()


def test_a_terminal_that_is_closed_leaves_the_printer_cold(tmp_path: Path) -> None:
    """The window is closed, or ssh is lost: heaters off, exit 129."""
    with printer(Faults(delay_s=0.01), on_socket=True) as there, terminal(tmp_path, there.uri) as window:
        until(lambda: len(there.done) > 50, "it prints")
        assert not there.is_cold
        window.close()
        assert window.process.wait(60) == 129
        until(lambda: there.is_cold, "it is cold")


def test_a_terminal_that_is_held_stops_nothing(tmp_path: Path) -> None:
    """Ctrl-S stops what is shown. The print goes on meanwhile, and SIGTERM still cools."""
    with printer(Faults(delay_s=0.01), on_socket=True) as there, terminal(tmp_path, there.uri) as window:
        until(lambda: len(there.done) > 50, "it prints")
        window.hold()
        held_at = len(there.done)
        until(lambda: len(there.done) > held_at + 200, "it goes on")
        window.process.send_signal(signal.SIGTERM)
        until(lambda: there.is_cold, "it is cold")
        window.go_on()
        assert window.process.wait(60) == 130


def test_a_pause_at_the_display_is_ended_by_a_key(tmp_path: Path) -> None:
    """Whoever paused: the terminal says so, `p` goes on, and Ctrl-C in the terminal cancels."""
    with printer(Faults(delay_s=0.01, says={40: "//action:pause"}), on_socket=True) as there:
        with terminal(tmp_path, there.uri) as window:
            until(lambda: b"paused at the printer" in window.shown, "it is told")
            count = len(there.done)
            window.press(b"p")
            until(lambda: len(there.done) > count + 20, "it goes on")
            window.press(b"\x03")
            assert window.process.wait(60) == 130
        assert there.is_cold
