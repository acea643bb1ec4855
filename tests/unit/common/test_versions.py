"""All versions are in one place, every command prints them, and peers of two versions are told which side to update."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from common import versions
from common.versions import PACKAGE_VERSION, PROTOCOL_VERSION, all_versions, other_protocol

ROOT = Path(__file__).resolve().parents[3]
BIN = Path(sys.executable).parent


@pytest.mark.parametrize("command", ["board-agent", "phone-host", "delay-bench"])
def test_every_command_prints_all_versions(command: str) -> None:
    """`--version` needs no verb, prints one line on stdout and exits with 0."""
    done = subprocess.run([BIN / command, "--version"], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout == all_versions() + "\n"


def test_the_line_names_each_version() -> None:
    """Package, wire and the six kinds of files."""
    found = re.fullmatch(
        r"tandemscan (\S+) \(protocol (\d+), rig\.yaml (\d+), delays\.jsonl (\d+), report\.json (\d+), cameras\.json (\d+), overlay\.yaml (\d+), capture\.json (\d+)\)",
        all_versions(),
    )
    assert found is not None
    formats = (
        versions.RIG_FORMAT,
        versions.LEDGER_FORMAT,
        versions.REPORT_FORMAT,
        versions.CAMERAS_FORMAT,
        versions.OVERLAY_FORMAT,
        versions.CAPTURE_FORMAT,
    )
    assert found.groups() == tuple(map(str, (PACKAGE_VERSION, PROTOCOL_VERSION, *formats)))


def test_the_changes_begin_with_this_version() -> None:
    """CHANGELOG.md's first heading is the package's version."""
    headings = re.findall(r"^## ([^,\s]+)", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert headings[0] == PACKAGE_VERSION


def test_the_boards_package_has_this_version() -> None:
    """The pattern by which build-deb finds the version matches exactly this one."""
    script = (ROOT / "deploy" / "board" / "build-deb").read_text(encoding="utf-8")
    (command,) = re.findall(r"^version=\$\((sed .*)\)$", script, re.MULTILINE)
    done = subprocess.run(["sh", "-c", f"root={ROOT}; {command}"], capture_output=True, text=True, check=True)
    assert done.stdout == PACKAGE_VERSION + "\n"


@pytest.mark.parametrize(
    ("theirs", "remedy"), [(PROTOCOL_VERSION - 1, "update the board's"), (PROTOCOL_VERSION + 1, "update this host's")]
)
def test_the_older_side_is_to_be_updated(theirs: int, remedy: str) -> None:
    """The message names both versions and the side with the lower one."""
    assert other_protocol(theirs, peer="the board", own="this host") == (
        f"the board speaks protocol {theirs}, this host protocol {PROTOCOL_VERSION}",
        f"{remedy} tandemscan",
    )
