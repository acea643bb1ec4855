"""Output to a reader that has gone, or to a full disk."""

import os
import subprocess
import sys

import pytest

COMMANDS = [
    ["board_agent.cli", "settings", "--json"],
    ["board_agent.cli", "run", "--help"],
    ["phone_host.cli", "settings"],
    ["phone_host.cli", "stereo", "--help"],
    ["phone_host.bench.cli", "--help"],
]


def run(command: list[str], stdout: int) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-P", "-m", *command],
        stdout=stdout,
        stderr=subprocess.PIPE,
        text=True,
        check=False,
        timeout=60,
    )


@pytest.mark.parametrize("command", COMMANDS, ids=" ".join)
def test_a_full_disk_behind_stdout_is_one_line_and_exit_3(command: list[str]) -> None:
    """On /dev/full each command says in one line that stdout cannot be written."""
    full = os.open("/dev/full", os.O_WRONLY)
    try:
        done = run(command, full)
    finally:
        os.close(full)
    assert done.returncode == 3, done.stderr
    assert done.stderr.count("\n") == 1, done.stderr
    assert "error: stdout cannot be written (No space left on device)" in done.stderr


@pytest.mark.parametrize("command", COMMANDS, ids=" ".join)
def test_a_reader_that_has_gone_is_no_error(command: list[str]) -> None:
    """If the pipe's other end is closed, each command ends with exit 0 and without a word."""
    reader, writer = os.pipe()
    os.close(reader)
    try:
        done = run(command, writer)
    finally:
        os.close(writer)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""


def test_the_exit_code_of_a_failed_command_outlives_its_reader() -> None:
    """Wrong usage is exit 2 even if nobody reads stdout."""
    reader, writer = os.pipe()
    os.close(reader)
    try:
        assert run(["board_agent.cli", "settings", "--config", "/nowhere.toml"], writer).returncode == 2
    finally:
        os.close(writer)
