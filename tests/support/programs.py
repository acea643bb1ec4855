"""The real programs as child processes: started, awaited by condition, stopped by their own pid."""

import json
import os
import resource
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

PATIENCE_S = 60.0


class Program:
    """One running program with its output in files.

    Args:
        module: what `python -m` runs.
        arguments: of its command line.
        folder: for its output.
        name: of the output files.
        more: environment variables in addition to those of this process.
    """

    def __init__(
        self, module: str, arguments: list[str], folder: Path, name: str, more: Mapping[str, str] | None = None
    ) -> None:
        self.out = folder / f"{name}.out"
        self.err = folder / f"{name}.err"
        with self.out.open("wb") as out, self.err.open("wb") as err:
            # What a program remembers between runs stays in the test's own folder too.
            environment = {**os.environ, "XDG_CONFIG_HOME": str(folder / "config"), **(more or {})}
            command = [sys.executable, "-P", "-m", module, *arguments]
            self.process = subprocess.Popen(command, stdout=out, stderr=err, env=environment)

    @property
    def stderr(self) -> str:
        """Its log so far."""
        return self.err.read_text(errors="replace")

    def json(self) -> Any:
        """The JSON object that it printed."""
        return json.loads(self.out.read_text())

    def send(self, number: signal.Signals) -> None:
        """Send it a signal."""
        self.process.send_signal(number)

    def wait(self) -> int:
        """Wait for it to end; returns the exit code."""
        return self.process.wait(PATIENCE_S)

    def stop(self, number: signal.Signals = signal.SIGTERM) -> int:
        """Ask it to end; returns the exit code."""
        self.send(number)
        return self.wait()


@contextmanager
def program(
    module: str, arguments: list[str], folder: Path, name: str, more: Mapping[str, str] | None = None
) -> Iterator[Program]:
    """Run a program while the block lasts."""
    running = Program(module, arguments, folder, name, more)
    try:
        yield running
    finally:
        if running.process.poll() is None:
            running.process.kill()
            running.process.wait()


def board(arguments: list[str], folder: Path, name: str = "board", more: Mapping[str, str] | None = None) -> Any:
    """Run board-agent while the block lasts."""
    return program("board_agent.cli", arguments, folder, name, more)


def host(arguments: list[str], folder: Path, name: str = "host", more: Mapping[str, str] | None = None) -> Any:
    """Run phone-host while the block lasts."""
    return program("phone_host.cli", arguments, folder, name, more)


def on_a_full_disk(
    module: str, arguments: list[str], folder: Path, most_bytes: int
) -> "subprocess.CompletedProcess[str]":
    """Run a program to its end whose files may take so much and no more.

    Args:
        module: the program.
        arguments: its command line.
        folder: for its settings.
        most_bytes: of a file.
    """

    def limit() -> None:
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (most_bytes, most_bytes))

    return subprocess.run(
        [sys.executable, "-P", "-m", module, *arguments],
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
        preexec_fn=limit,
        env={**os.environ, "XDG_CONFIG_HOME": str(folder / "config")},
    )


def until(condition: Callable[[], bool], what: str) -> None:
    """Wait for a condition; after a minute, fail and say what is missing."""
    deadline = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < deadline, f"not within {PATIENCE_S:.0f} s: {what}"
        time.sleep(0.02)


def lines(path: Path) -> int:
    """Number of whole lines in a file; 0 if it does not exist."""
    return path.read_bytes().count(b"\n") if path.exists() else 0


def ledgers(out: Path) -> list[dict[str, Any]]:
    """All whole lines of delays.jsonl; a line being written may be incomplete and is left out."""
    return [json.loads(line) for line in (out / "delays.jsonl").read_text().rpartition("\n")[0].splitlines()]


def free_port() -> int:
    """A TCP port of the loopback interface that nobody uses now."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def children_of(pid: int) -> list[int]:
    """The processes that a process has started and that live, proc_pid_task_children(5)."""
    children: list[int] = []
    for task in Path(f"/proc/{pid}/task").glob("*/children"):
        with suppress(OSError):
            children += map(int, task.read_text().split())
    return children


def command_of(pid: int) -> bytes:
    """The command line of a process, its words separated by NUL; empty: it has ended."""
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes()
    except OSError:
        return b""
