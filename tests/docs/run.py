"""Runs the documentation's command lines that need no hardware: `python -m tests.docs.run` (all of them; the tests run the quick ones).

Each page's commands run in order in one folder. It holds what the pages refer to: pictures of a chessboard from both
cameras, one pair, a calibration.
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.output.ply import PointCloud, write_surface
from phone_host.output.rig_yaml import write_rig
from phone_host.stereo.rectify import rectify_rig
from tests.docs.commands import Command, documented
from tests.support.boards import poses, render_pair
from tests.support.rigs import unlike_rig

_HARDWARE: Final = (
    "v4l2:",
    "192.168.",
    "http:",
    "serial:",
    "rfcomm:",
    "tcp://",
    "--udev",
    "BOARD",
    "host.toml",
    "wall",
    "session.mcap",
    "octoprint://",
    "--mat ",  # pictures of a thing on the mat: tests/scan/test_scan_mat.py
    "--object ",  # on a table: tests/scan/test_scan_table.py
    "--turntable",  # that turns: tests/scan/test_turntable.py and test_two_passes.py
    "walk/",  # pictures on the way around a thing: tests/scan/test_scan_command.py
    "--resume cup",  # after a scan that was killed: tests/scan/test_scan_resume.py
    "host.mcap",
    "opencv-bm",
    "phone-host serve",  # until it is stopped; tests/system/test_serve.py
    "--serve",
    "browser:",  # somebody has to open the page
    "sudo board-agent",  # on the board
    "XDG_RUNTIME_DIR",  # two programs in two terminals; tests/system runs such pairs
)
"""Stands for a device, an address or a name of the reader's own. `wall` has its own test (test_contributing.py)."""

_LONG: Final = ("demo", "delay-bench", "calibrate")
_MODULES: Final = {
    "phone-host": "phone_host.cli",
    "board-agent": "board_agent.cli",
    "delay-bench": "phone_host.bench.cli",
}
_PATIENCE_S: Final = 300


def needs_hardware(command: Command) -> bool:
    """Whether it needs a device, another machine or a file that only the reader has."""
    return command.is_mention or any(word in command.line for word in _HARDWARE)


def is_long(command: Command) -> bool:
    """Whether it takes more than 5 s."""
    return not {*command.words[:2]}.isdisjoint(_LONG)


def prepare(folder: Path) -> None:
    """Create what the pages assume to exist."""
    rig = unlike_rig()
    for side in ("left", "right"):
        (folder / side).mkdir()
    for number, pose in enumerate(poses(12, seed=5)):
        for side, image in zip(("left", "right"), render_pair(rig, pose), strict=True):
            cv2.imwrite(str(folder / side / f"{number:02d}.png"), image)
            cv2.imwrite(str(folder / f"{side}.png"), image)
    write_rig(folder / "rig.yaml", rig, rectify_rig(rig))
    wide = cv2.GaussianBlur(np.random.default_rng(3).integers(0, 256, (240, 340), dtype=np.uint8), (0, 0), 1.0)
    cv2.imwrite(str(folder / "im0.png"), wide[:, :320])
    cv2.imwrite(str(folder / "im1.png"), wide[:, 20:])  # rectified, 20 px of disparity everywhere
    (folder / "scan").mkdir()
    write_surface(folder / "scan" / "model.ply", *_cube())


def _cube() -> tuple[PointCloud, NDArray[np.int32]]:
    """A closed cube of 50 mm, as the model of a scan."""
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    squares = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]], np.int32)
    triangles = np.concatenate([squares[:, [0, 1, 2]], squares[:, [0, 2, 3]]])
    return PointCloud((0.05 * corners).astype(np.float32), (255 * corners).astype(np.uint8)), triangles


def run(command: Command, folder: Path) -> subprocess.CompletedProcess[str]:
    """Run it as printed, in that folder."""
    arguments = [sys.executable, "-P", "-m", _MODULES[command.words[0]], *command.words[1:]]
    environment = {**os.environ, "XDG_CONFIG_HOME": str(folder / "config")}
    return subprocess.run(
        arguments, cwd=folder, env=environment, capture_output=True, text=True, check=False, timeout=_PATIENCE_S
    )


def main() -> None:
    """Run all of them; exit code 4 when one fails."""
    failed = 0
    with tempfile.TemporaryDirectory() as name:
        prepare(Path(name))
        for command in documented():
            if needs_hardware(command):
                continue
            done = run(command, Path(name))
            failed += done.returncode != 0
            print(f"{'ok  ' if done.returncode == 0 else 'FAIL'} {command.page}: {command.line}")
            if done.returncode:
                print(done.stderr, file=sys.stderr)
    sys.exit(4 if failed else 0)


if __name__ == "__main__":
    main()
