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


def until_killed(walk: Path, out: Path, number: signal.Signals = signal.SIGKILL) -> tuple[int, str]:
    """Scan until the first submap is there, then send a signal; return the exit code, and what was told."""
    with subprocess.Popen(command(walk, out), stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as scan:
        end = time.monotonic() + WAIT_S
        while not list(out.glob("submap-*.bin")) and time.monotonic() < end and scan.poll() is None:
            time.sleep(0.005)
        scan.send_signal(number)
        told = scan.communicate(timeout=WAIT_S)[1]
    return scan.returncode, told


def test_a_killed_scan_is_resumed(walk: Path, tmp_path: Path) -> None:
    """All 30 pairs are in the model, those of the submap are not computed again, what is lost is told, and no submap stays."""
    out = tmp_path / "out"
    assert until_killed(walk, out)[0] == -signal.SIGKILL
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


@pytest.mark.parametrize(("number", "code"), [(signal.SIGTERM, 143), (signal.SIGINT, 130)])
def test_a_scan_that_is_stopped_keeps_its_model_and_is_resumed(
    walk: Path, tmp_path: Path, number: signal.Signals, code: int
) -> None:
    """The model of the pairs so far is there, and it is said how to go on: from the last pair, to the whole model."""
    out = tmp_path / "out"
    ended, told = until_killed(walk, out, number)
    assert ended == code
    assert f"--resume {out} goes on with it" in told
    assert told.splitlines()[-1].endswith("terminated" if number is signal.SIGTERM else "interrupted")
    report = json.loads((out / "report.json").read_text())
    assert report["interrupted_of"] == 30
    assert 20 <= report["in_model"] < 30
    assert (out / "model.ply").exists()
    again = subprocess.run(
        command(walk, out, "--resume", str(out)), capture_output=True, text=True, check=False, timeout=WAIT_S
    )
    assert again.returncode == 0, again.stderr
    assert f"with {report['in_model']} pairs" in again.stderr
    assert json.loads(again.stdout)["in_model"] == 30
    assert not list(out.glob("submap-*.bin"))


def test_a_damaged_submap_is_one_line(walk: Path, tmp_path: Path) -> None:
    """A file that was cut is named, with what to do; exit code 4."""
    out = tmp_path / "out"
    out.mkdir()
    (out / "submap-0000.bin").write_bytes(b"tandemscan submap 5\nx")
    done = subprocess.run(
        command(walk, tmp_path / "other", "--resume", str(out)), capture_output=True, text=True, check=False
    )
    assert done.returncode == 4
    assert len(done.stderr.strip().splitlines()) == 1
    assert f"{out / 'submap-0000.bin'} is damaged" in done.stderr


def test_the_same_command_does_not_drop_a_killed_scan(walk: Path, tmp_path: Path) -> None:
    """After SIGKILL the same command changes nothing and names --resume and --restart; with --restart all pairs are scanned anew and no submap stays."""
    out = tmp_path / "out"
    assert until_killed(walk, out)[0] == -signal.SIGKILL
    kept = {path.name: path.read_bytes() for path in out.glob("submap-*.bin")}
    assert kept
    again = subprocess.run(command(walk, out), capture_output=True, text=True, check=False, timeout=WAIT_S)
    assert again.returncode == 2
    (line,) = again.stderr.strip().splitlines()
    assert f"go on with it with --resume {out}, or start again with --restart" in line
    assert {path.name: path.read_bytes() for path in out.glob("submap-*.bin")} == kept
    anew = subprocess.run(command(walk, out, "--restart"), capture_output=True, text=True, check=False, timeout=WAIT_S)
    assert anew.returncode == 0, anew.stderr
    assert "going on" not in anew.stderr
    assert json.loads(anew.stdout)["in_model"] == 30
    assert not [path.name for path in out.iterdir() if path.name.startswith((".tandemscan.", "submap"))]


def test_resume_and_restart_contradict_each_other(walk: Path, tmp_path: Path) -> None:
    """Exit code 2, and one line."""
    words = command(walk, tmp_path / "out", "--resume", str(tmp_path), "--restart")
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert (done.returncode, len(done.stderr.strip().splitlines())) == (2, 1)


def test_a_second_scan_into_the_same_folder_is_refused(walk: Path, tmp_path: Path) -> None:
    """While a scan works, another one into its folder ends with exit code 3 and the number of the first one's process; the first one ends well."""
    out = tmp_path / "out"
    with subprocess.Popen(command(walk, out), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as first:
        end = time.monotonic() + WAIT_S
        while not (out / ".tandemscan.lock").exists() and time.monotonic() < end and first.poll() is None:
            time.sleep(0.005)
        first.send_signal(signal.SIGSTOP)  # it does not end before the second one has begun
        second = subprocess.run(command(walk, out), capture_output=True, text=True, check=False, timeout=WAIT_S)
        first.send_signal(signal.SIGCONT)
        told = first.communicate(timeout=WAIT_S)[0]
    assert second.returncode == 3
    (line,) = second.stderr.strip().splitlines()
    assert f"{out} is being written by process {first.pid}: wait for its end, or give another --out" in line
    assert first.returncode == 0
    assert json.loads(told)["in_model"] == 30
    assert not (out / ".tandemscan.lock").exists()
