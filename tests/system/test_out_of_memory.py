"""Memory that runs out ends a command in one line, with 4, and keeps what is done: real programs whose address space is limited."""

import json
import resource
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest

from common.program.out_of_memory import is_out_of_memory
from phone_host.output.rig_yaml import write_rig
from phone_host.stereo.rectify import rectify_rig
from tests.support.programs import PATIENCE_S, board
from tests.support.rigs import small_rig

_LIMITS_MB = tuple(range(350, 2000, 150))
"""Libraries alone take some 450 MB of addresses; the pair below takes more than 1000."""


_STARVED = """
import resource, sys, threading
from common.program.commandline import ExamplesFirstParser, run_command
parser = ExamplesFirstParser("sample")
for name in sys.argv[1:]:
    parser.add_argument(name)
def command(options):
    used = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used, used))
    threading.Thread(target=print).start()
raise SystemExit(run_command(parser, [], command))
"""
"""A command with these options that has no memory for one thread more."""


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


def _out_of_memory(
    run: Callable[[int], "subprocess.CompletedProcess[str]"], words: str = ""
) -> "subprocess.CompletedProcess[str]":
    """Run with more and more memory until the program says that it ran out for something with these words in its name.

    Below that, it ran out before, a library cannot even be loaded, or it ends the process.
    """
    for limit_mb in _LIMITS_MB[1:]:
        done = run(limit_mb)
        assert "Traceback" not in done.stderr
        if "memory ran out" in done.stderr:
            assert done.returncode == 4
            culprit = done.stderr.partition("memory ran out for ")[2]
            if culprit and words in culprit:
                return done
    pytest.fail("memory never ran out during the work")


def test_a_scan_keeps_the_model_of_the_pairs_before(tmp_path: Path) -> None:
    """The fifth pair is too large: the model holds the four before it, the line names the pair's files and what helps."""
    tile = np.random.default_rng(1).integers(0, 256, (722, 1083), dtype=np.uint8)
    tile = np.asarray(cv2.GaussianBlur(tile, (5, 5), 1.2), np.uint8)
    for side, shift in (("left", 0), ("right", -24)):
        (tmp_path / side).mkdir()
        for number in range(4):
            cv2.imwrite(str(tmp_path / side / f"{number}.jpg"), np.roll(tile, shift, 1)[:480, :640])
        cv2.imwrite(str(tmp_path / side / "4.jpg"), np.roll(np.tile(tile, (4, 4)), shift, 1))
    arguments = ["scan", "left", "right", "--rectified", "--focal", "1000", "--baseline", "60mm", "--scale", "1"]
    arguments += ["--disparities", "64", "--out"]
    done = _out_of_memory(lambda limit_mb: _limited([*arguments, f"out-{limit_mb}"], limit_mb, tmp_path), "/4.jpg")
    line = done.stderr.splitlines()[-1]
    assert "(--scale 0.5) or fewer --disparities" in line
    out = tmp_path / done.args[-1]
    report = json.loads((out / "report.json").read_text())
    assert (report["in_model"], report["interrupted_of"]) == (4, 5)
    assert (out / "model.ply").exists()


def test_a_calibration_ends_in_one_line_and_keeps_the_earlier_rig(tmp_path: Path) -> None:
    """The line names the picture and its size, and no option that the verb does not have."""
    write_rig(tmp_path / "rig.yaml", small_rig(), rectify_rig(small_rig()))
    before = (tmp_path / "rig.yaml").read_bytes()
    for side in ("left", "right"):
        (tmp_path / side).mkdir()
        cv2.imwrite(str(tmp_path / side / "0.png"), np.zeros((6600, 9600, 3), np.uint8))
    arguments = ["calibrate", "left", "right", "--board", "9x6", "--square", "25mm", "--out", "rig.yaml"]
    done = _out_of_memory(lambda limit_mb: _limited(arguments, limit_mb, tmp_path))
    line = done.stderr.splitlines()[-1]
    assert "memory ran out for left/0.png of 9600x6600 px" in line or "for right/0.png of 9600x6600 px" in line
    assert "give smaller images, or use a machine with more memory" in line
    assert "--scale" not in line
    assert (tmp_path / "rig.yaml").read_bytes() == before


def test_a_run_ends_in_one_line_and_with_its_report(pictures: Path, tmp_path: Path) -> None:
    """Where a thread of the run has no memory, the run's root says so once; the report is written."""
    for side in ("left", "right"):
        (tmp_path / side).mkdir()
        (tmp_path / side / "0.jpg").symlink_to(pictures / side / "1.jpg")
    arguments = ["run", "--rectified", "--disparities", "64", "--scale", "1", "--pairs", "2"]
    arguments += ["--camera", f"replay:{tmp_path}/right?fps=2&loop=1", "--out"]

    def run(limit_mb: int) -> "subprocess.CompletedProcess[str]":
        link = f"ipc://{tmp_path}/{limit_mb}"
        with board(["run", "--camera", f"replay:{tmp_path}/left?fps=2&loop=1", "--link", link], tmp_path):
            return _limited([*arguments, f"out-{limit_mb}", "--link", link], limit_mb, tmp_path)

    done = _out_of_memory(run)
    assert len([line for line in done.stderr.splitlines() if "error" in line]) == 1
    assert sorted(tmp_path.glob("out-*/report.json"))


@pytest.mark.parametrize(
    ("options", "remedy"),
    [
        (["--scale", "--disparities"], "give smaller images (--scale 0.5) or fewer --disparities, or use a machine"),
        (["--max-megapixels", "--disparities"], "give smaller images or fewer --disparities, or use a machine"),
        (["--camera"], "give smaller images, or use a machine"),
        ([], "memory ran out (can't start new thread): close other programs, or use a machine"),
    ],
)
def test_a_thread_without_memory_is_told_with_a_remedy_that_the_command_has(options: list[str], remedy: str) -> None:
    """Python says `can't start new thread`; the line names only options that there are."""
    command = [sys.executable, "-P", "-c", _STARVED, *options]
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S, check=False)
    assert (done.returncode, len(done.stderr.splitlines())) == (4, 1), done.stderr
    assert remedy in done.stderr


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
