"""The real programs as child processes: started, watched by condition, stopped by their own pid."""

import json
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

PATIENCE_S = 60.0


class Program:
    """One running program with its output in files.

    Args:
        module: what `python -m` runs.
        arguments: of its command line.
        folder: for its output.
        name: of the files there.
        more: variables beside those of this process.
    """

    def __init__(
        self, module: str, arguments: list[str], folder: Path, name: str, more: Mapping[str, str] | None = None
    ) -> None:
        self.out = folder / f"{name}.out"
        self.err = folder / f"{name}.err"
        with self.out.open("wb") as out, self.err.open("wb") as err:
            # What a program remembers between its lives stays in the test's own folder, too.
            environment = {**os.environ, "XDG_CONFIG_HOME": str(folder / "config"), **(more or {})}
            command = [sys.executable, "-P", "-m", module, *arguments]
            self.process = subprocess.Popen(command, stdout=out, stderr=err, env=environment)

    @property
    def stderr(self) -> str:
        """What it has logged so far."""
        return self.err.read_text(errors="replace")

    def json(self) -> Any:
        """The JSON object that it printed."""
        return json.loads(self.out.read_text())

    def send(self, number: signal.Signals) -> None:
        """Send it a signal."""
        self.process.send_signal(number)

    def wait(self) -> int:
        """Wait for its end; gives the exit code."""
        return self.process.wait(PATIENCE_S)

    def stop(self, number: signal.Signals = signal.SIGTERM) -> int:
        """Ask it to end; gives the exit code."""
        self.send(number)
        return self.wait()


@contextmanager
def program(
    module: str, arguments: list[str], folder: Path, name: str, more: Mapping[str, str] | None = None
) -> Iterator[Program]:
    """Run a program for the length of a block."""
    running = Program(module, arguments, folder, name, more)
    try:
        yield running
    finally:
        if running.process.poll() is None:
            running.process.kill()
            running.process.wait()


def board(arguments: list[str], folder: Path, name: str = "board", more: Mapping[str, str] | None = None) -> Any:
    """Run board-agent for the length of a block."""
    return program("board_agent.cli", arguments, folder, name, more)


def host(arguments: list[str], folder: Path, name: str = "host", more: Mapping[str, str] | None = None) -> Any:
    """Run phone-host for the length of a block."""
    return program("phone_host.cli", arguments, folder, name, more)


def until(condition: Callable[[], bool], what: str) -> None:
    """Wait for a condition; fails after a minute saying what did not come."""
    deadline = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < deadline, f"not within {PATIENCE_S:.0f} s: {what}"
        time.sleep(0.02)


def lines(path: Path) -> int:
    """Whole lines in a file; 0 while there is none."""
    return path.read_bytes().count(b"\n") if path.exists() else 0


def ledgers(out: Path) -> list[dict[str, Any]]:
    """All whole lines of delays.jsonl; of one that is just being written a part may be there."""
    return [json.loads(line) for line in (out / "delays.jsonl").read_text().rpartition("\n")[0].splitlines()]


def free_port() -> int:
    """A TCP port of the loopback interface that nobody has now."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])
