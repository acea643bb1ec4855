"""`phone-host scan --resume` after a real SIGKILL: it goes on from the last submap, and ends with the whole model."""

import json
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from tests.support.still_life import photographed, still_life

WAIT_S = 60


@pytest.fixture(scope="module")
def walk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Thirty pairs: three views of a still life, back and forth."""
    turns = [0.0, 3.0, 6.0]
    folder = photographed(tmp_path_factory.mktemp("walk"), turns, [still_life()] * len(turns))
    for side in ("left", "right"):
        for number in range(len(turns), 30):
            shutil.copy(folder / side / f"{(0, 1, 2, 1)[number % 4]:03d}.jpg", folder / side / f"{number:03d}.jpg")
    return folder


def command(walk: Path, out: Path, *words: str) -> list[str]:
    """The program as a user starts it."""
    given = ["scan", walk / "left", walk / "right", "--calibration", walk / "rig.yaml", "--out", out, "--json", *words]
    return [sys.executable, "-m", "phone_host.cli", *map(str, given)]


def until_killed(walk: Path, out: Path) -> None:
    """Scan until the first submap is there, then kill."""
    with subprocess.Popen(command(walk, out), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as scan:
        end = time.monotonic() + WAIT_S
        while not list(out.glob("submap-*.bin")) and time.monotonic() < end and scan.poll() is None:
            time.sleep(0.005)
        scan.send_signal(signal.SIGKILL)
    assert scan.returncode == -signal.SIGKILL


def test_a_killed_scan_is_resumed(walk: Path, tmp_path: Path) -> None:
    """All 30 pairs are in the model, those of the submap are not computed again, what is lost is told, and no submap stays."""
    out = tmp_path / "out"
    until_killed(walk, out)
    assert not (out / "model.ply").exists()
    again = subprocess.run(
        command(walk, out, "--resume", str(out)), capture_output=True, text=True, check=False, timeout=WAIT_S
    )
    assert again.returncode == 0, again.stderr
    assert "going on after pair 19, with 20 pairs" in again.stderr
    report = json.loads(again.stdout)
    assert (report["in_model"], len(report["pairs"])) == (30, 30)
    stations = np.loadtxt(out / "trajectory.txt")
    assert stations[:, 0].tolist() == list(range(30))
    # The camera was at the same place at pairs 0, 4, 8 ... 28.
    assert np.ptp(stations[::4, 1:4], axis=0).max() < 0.003
    assert not list(out.glob("submap-*.bin"))


def test_a_damaged_submap_is_one_line(walk: Path, tmp_path: Path) -> None:
    """A file that was cut is named, with what to do; exit code 4."""
    out = tmp_path / "out"
    out.mkdir()
    (out / "submap-0000.bin").write_bytes(b"tandemscan submap 2\nx")
    done = subprocess.run(
        command(walk, tmp_path / "other", "--resume", str(out)), capture_output=True, text=True, check=False
    )
    assert done.returncode == 4
    assert len(done.stderr.strip().splitlines()) == 1
    assert f"{out / 'submap-0000.bin'} is damaged" in done.stderr
