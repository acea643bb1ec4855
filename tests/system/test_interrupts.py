"""Ctrl-C ends a command wherever it comes: while Python imports, and while native code computes on large images."""

import signal
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

from tests.support.programs import PATIENCE_S, program, until

_START = """
import sys
from {module} import {start} as start
from common.program.interrupts import leave_at_once
leave_at_once()
print("begun", flush=True)
sys.exit(start())
"""


@pytest.mark.parametrize(
    ("module", "start", "mapped"),
    [
        ("phone_host.start", "phone_host", ""),
        ("phone_host.start", "phone_host", "cv2"),
        ("board_agent.start", "main", ""),
    ],
)
def test_ctrl_c_while_a_command_is_imported_is_one_line_and_130(
    module: str, start: str, mapped: str, tmp_path: Path
) -> None:
    """At the very start, and while OpenCV is being loaded, there is no traceback."""
    arguments = ["stereo", str(tmp_path), str(tmp_path), "--out", str(tmp_path)] if mapped else ["settings"]
    command = [sys.executable, "-P", "-c", _START.format(module=module, start=start), *arguments]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as running:
        assert running.stdout is not None
        assert running.stdout.readline() == "begun\n"
        maps = Path(f"/proc/{running.pid}/maps")
        until(lambda: mapped in maps.read_text(), "the library is being loaded")
        running.send_signal(signal.SIGINT)
        _, error = running.communicate(timeout=PATIENCE_S)
    assert running.returncode == 130
    assert error in {"interrupted\n", "phone-host: interrupted\n"}


def test_ctrl_c_during_a_long_match_leaves_nothing_half_written(tmp_path: Path) -> None:
    """The matcher would need a minute for these 50 megapixels; the command ends before it returns, with 130, and writes no result."""
    tile = np.random.default_rng(1).integers(0, 256, (722, 1083), dtype=np.uint8)
    images = [str(tmp_path / f"{side}.jpg") for side in ("left", "right")]
    for image in images:
        cv2.imwrite(image, np.tile(tile, (8, 8)))
    out = tmp_path / "out"
    arguments = ["stereo", *images, "--rectified", "--disparities", "1024", "--scale", "1", "--max-megapixels", "64"]
    with program("phone_host.start", [*arguments, "--out", str(out)], tmp_path, "stereo") as running:
        clock = Path(f"/proc/{running.process.pid}/stat")
        # Start and decoding take two seconds of processor time.
        until(lambda: int(clock.read_text().split()[13]) > 400, "it has computed for four seconds")
        assert running.stop(signal.SIGINT) == 130
        assert "Traceback" not in running.stderr
        assert running.stderr.endswith("interrupted\n")
    assert not out.exists() or {path.name for path in out.iterdir()} <= {".tandemscan"}
