"""The documentation's quick command lines, run as printed; and the worked example for contributors, followed to the letter."""

import os
import re
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

from tests.docs.commands import ROOT, Command, documented
from tests.docs.run import is_long, needs_hardware, prepare, run
from tests.support.planes import noise
from tests.support.point_files import read_pfm

_QUICK = [command for command in documented() if not needs_hardware(command) and not is_long(command)]
_SHIFT_PX = 7


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder where a reader would be."""
    here = tmp_path_factory.mktemp("reader")
    prepare(here)
    return here


@pytest.mark.parametrize("command", _QUICK, ids=lambda command: f"{command.page} {command.line}"[:90])
def test_a_quick_command_does_what_the_page_says(command: Command, folder: Path) -> None:
    """The command ends with exit 0; a check of the machine may warn, but not fail."""
    done = run(command, folder)
    assert done.returncode == 0, done.stderr


def test_there_are_quick_commands() -> None:
    """The pages have commands that anybody can run."""
    assert len(_QUICK) >= 4


def test_the_matcher_of_contributing_is_found_by_its_name(tmp_path: Path) -> None:
    """Its two files, installed as the page says, give a wall's uniform disparity."""
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    package = tmp_path / "wall-matcher"
    package.mkdir()
    for name, block in re.findall(r"`([\w.]+)`:\n\n```\w+\n(.*?)```", text, re.DOTALL):
        (package / name).write_text(block, encoding="utf-8")
    assert sorted(path.name for path in package.iterdir()) == ["pyproject.toml", "wall_matcher.py"]
    commands = [line.strip() for line in text.splitlines() if "wall" in line and line.startswith("    ")]
    install, use = (line.split()[1:] for line in commands)
    site = tmp_path / "site"
    pip = [sys.executable, "-m", "pip", "-qq", *install, "--target", str(site)]
    subprocess.run(pip, cwd=tmp_path, check=True, capture_output=True)
    _write_wall(tmp_path)
    environment = {**os.environ, "PYTHONPATH": str(site)}
    command = [sys.executable, "-m", "phone_host.cli", *use]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert np.unique(read_pfm(tmp_path / "scan" / "disparity.pfm")).tolist() == [_SHIFT_PX]


def _write_wall(folder: Path) -> None:
    """A wall seen by both cameras: noise, shifted."""
    wide = noise(120 + _SHIFT_PX, 80, 3)
    cv2.imwrite(str(folder / "left.png"), wide[:, :120])
    cv2.imwrite(str(folder / "right.png"), wide[:, _SHIFT_PX:])
