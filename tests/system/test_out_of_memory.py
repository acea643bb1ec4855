"""Memory that runs out ends a command in one line, with 4, and keeps what is done: real programs whose address space is limited."""

import resource
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

from common.program.out_of_memory import is_out_of_memory
from tests.support.programs import PATIENCE_S

_LIMITS_MB = tuple(range(350, 2000, 150))
"""Libraries alone take some 450 MB of addresses; the pair below takes more than 1000."""


def _limited(arguments: list[str], limit_mb: int, folder: Path) -> "subprocess.CompletedProcess[str]":
    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_AS, (limit_mb << 20, limit_mb << 20))

    return subprocess.run(
        [sys.executable, "-P", "-m", "phone_host.cli", *arguments],
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
        preexec_fn=limit,
        cwd=folder,
    )


@pytest.fixture(scope="module")
def pictures(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A pair of small pictures, 0, and one of 12 megapixels, 1."""
    folder = tmp_path_factory.mktemp("pictures")
    tile = np.random.default_rng(1).integers(0, 256, (722, 1083), dtype=np.uint8)
    for side in ("left", "right"):
        (folder / side).mkdir()
        cv2.imwrite(str(folder / side / "0.jpg"), tile[:120, :160])
        cv2.imwrite(str(folder / side / "1.jpg"), np.tile(tile, (4, 4)))
    return folder


@pytest.mark.parametrize("matcher", ["tandem", "sgbm"])
def test_a_pair_too_large_for_the_memory_ends_in_one_line(matcher: str, pictures: Path, tmp_path: Path) -> None:
    """However little there is: the line says that memory ran out, and what helps; the pair before it is whole."""
    arguments = ["stereo", str(pictures / "left"), str(pictures / "right"), "--rectified", "--disparities", "64"]
    arguments += ["--scale", "1", "--matcher", matcher]
    lines = []
    for limit_mb in _LIMITS_MB:
        out = tmp_path / f"{limit_mb}"
        done = _limited([*arguments, "--out", str(out)], limit_mb, tmp_path)
        if "memory ran out" in done.stderr and (out / "pair-000000" / "disparity.pfm").exists():
            assert done.returncode == 4
            lines.append([line for line in done.stderr.splitlines() if "error" in line])
            assert "Traceback" not in done.stderr
            assert not (out / "pair-000001").exists() or not list((out / "pair-000001").glob("disparity.pfm"))
            break
    [[line]] = lines
    assert "give smaller images (--scale 0.5) or fewer --disparities" in line


def test_whoever_says_that_memory_ran_out_is_understood() -> None:
    """numpy, OpenCV and the system say so in different ways; other errors of theirs are none."""
    with pytest.raises(MemoryError) as numpys:
        np.empty(1 << 60, np.uint8)
    assert is_out_of_memory(numpys.value)
    with pytest.raises(cv2.error) as opencvs:
        cv2.resize(np.zeros((1, 1), np.uint8), (1 << 30, 1 << 30))
    assert is_out_of_memory(opencvs.value) is (opencvs.value.code == -4)
    with pytest.raises(cv2.error) as other:
        cv2.cvtColor(np.zeros((2, 2), np.uint8), cv2.COLOR_BGR2GRAY)
    assert not is_out_of_memory(other.value)
    assert is_out_of_memory(OSError(12, "Cannot allocate memory"))
    assert not is_out_of_memory(OSError(2, "No such file"))
