"""`phone-host calibrate-time` as a user starts it: a board process, a film of known time offset, rig.yaml, and its use by `run`."""

import json
import shutil
import subprocess
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from phone_host.calibration.time_offset.screen import COUNT, PatternReader
from phone_host.model import UNMEASURED_NS, TimeOffset
from phone_host.output.rig_yaml import read_rig, write_rig
from phone_host.scene.film import Film, render_film
from phone_host.scene.scene import PHONE_LOOK, WEBCAM_LOOK, demo_scene
from phone_host.scene.scene_model import Path as Motion
from phone_host.scene.scene_model import Scene
from phone_host.stereo.rectify import rectify_rig
from tests.support.programs import board, free_port, host
from tests.support.rigs import small_rig

OFFSET_MS = 13.0
"""The host camera's stamps are late by this: its replay shows image k this long after k / fps, and says so."""

FPS, SECONDS = 10, 2.0
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")


@pytest.fixture(scope="module")
def film(tmp_path_factory: pytest.TempPathFactory) -> Film:
    """A cube and a ball swing up and down, seen by a small copy of the demo's rig; the film repeats."""
    swing = Motion(amplitude_m=(0.04, 0.09, 0.0), phase_rad=(0.5, 0.0, 0.0), period_s=SECONDS)
    base = demo_scene()
    names = {"wall", "table", "poster", "cube", "ball"}
    bodies = [replace(body, path=swing) if body.path.moves else body for body in base.bodies if body.name in names]
    folder = tmp_path_factory.mktemp("film")
    scene = Scene(tuple(bodies), base.light)
    rig, looks = small_rig(), (WEBCAM_LOOK, PHONE_LOOK)
    return render_film(scene, rig, looks, folder, fps=FPS, seconds=SECONDS, advance=lambda: None)


@pytest.fixture
def rig_file(tmp_path: Path) -> Path:
    """That rig, with its time offset not yet measured."""
    path = tmp_path / "rig.yaml"
    rig = small_rig()
    write_rig(path, rig, rectify_rig(rig))
    assert read_rig(path).time_offset == TimeOffset(0, UNMEASURED_NS)
    return path


@pytest.fixture
def address(film: Film, tmp_path: Path) -> Iterator[str]:
    """A board that shows the left film."""
    address = f"tcp://127.0.0.1:{free_port()}"
    with board(["run", "--camera", film.replay_uri(film.left), "--link", address], tmp_path):
        yield address


def test_a_moving_scene_sets_the_clocks_of_a_run(film: Film, rig_file: Path, address: str, tmp_path: Path) -> None:
    """The offset of two streams is found within its uncertainty, stored, found again from the kept frames, and used by `run` for pairing."""
    own = f"{film.replay_uri(film.right)}&phase_ms={OFFSET_MS:g}"
    out = tmp_path / "timing"
    measure = ["calibrate-time", "--by", "scene", "--calibration", str(rig_file), "--out", str(out), "--json"]
    with host([*measure, "--link", address, "--camera", own, "--seconds", "5", "--keep"], tmp_path, "live") as running:
        assert running.wait() == 0, running.stderr
        report = running.json()
    assert abs(report["time_offset_ns"] / 1e6 - OFFSET_MS) <= report["uncertainty_ns"] / 1e6 < 6
    stored = read_rig(rig_file).time_offset
    assert (stored.offset_ns, stored.uncertainty_ns) == (report["time_offset_ns"], report["uncertainty_ns"])
    plain = cv2.FileStorage(str(rig_file), cv2.FILE_STORAGE_READ)
    assert plain.getNode("time_offset_ns").real() == report["time_offset_ns"]
    assert "<polyline" in (out / "time-offset.svg").read_text()
    assert json.loads((out / "report.json").read_text()) == report

    with host([*measure, "--frames", str(out)], tmp_path, "again") as running:
        assert running.wait() == 0, running.stderr
        again = running.json()
    assert abs(again["time_offset_ns"] - report["time_offset_ns"]) < 100_000

    scan = ["run", "--link", address, "--camera", own, "--calibration", str(rig_file), "--pairs", "12", "--json"]
    with host(scan, tmp_path, "scan") as running:
        assert running.wait() == 0, running.stderr
        scanned = running.json()
    assert scanned["time_offset_ms"]["measured"]
    # Both films are exposed at the same moments: the rest of the 13 ms is the error of the measurement and of the clock.
    assert scanned["time_skew_ms"]["p50"] <= report["uncertainty_ns"] / 1e6 + 1


def test_what_cannot_be_measured_is_said_in_one_line(film: Film, address: str, tmp_path: Path) -> None:
    """A film without the pattern is bad data: exit 4 and one line with its remedy; nothing is stored."""
    arguments = ["calibrate-time", "--by", "screen", "--link", address, "--camera", film.replay_uri(film.right)]
    with host([*arguments, "--seconds", "4"], tmp_path) as running:
        assert running.wait() == 4
        assert "saw the pattern in 0 of" in running.stderr
        assert running.stderr.count("\n") == 1


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ([], "--camera or --frames"),
        (["--camera", "replay:x", "--by", "scene"], "without --calibration"),
        (["--camera", "replay:x", "--seconds", "0"], "--seconds"),
        (["--camera", "replay:x", "--keep"], "--keep"),
    ],
)
def test_options_of_no_use_are_refused(arguments: list[str], words: str, tmp_path: Path) -> None:
    """Wrong usage is exit 2 and names the option."""
    with host(["calibrate-time", *arguments], tmp_path) as running:
        assert running.wait() == 2
        assert words in running.stderr


def test_a_page_that_cannot_be_written_names_its_own_option(tmp_path: Path) -> None:
    """If the pattern cannot be written, the exit code is 3 and the remedy is another --pattern."""
    with host(["calibrate-time", "--pattern", "/dev/null/pattern.html"], tmp_path) as running:
        assert running.wait() == 3
        assert "another --pattern" in running.stderr


@pytest.mark.skipif(CHROMIUM is None, reason="needs chromium")
def test_a_browser_shows_the_pattern(tmp_path: Path) -> None:
    """In a real browser, the written page shows a readable pattern that has begun to count."""
    page, path = tmp_path / "pattern.html", tmp_path / "screen.png"
    with host(["calibrate-time", "--pattern", str(page)], tmp_path) as running:
        assert running.wait() == 0
    assert CHROMIUM is not None
    command = [CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--window-size=800,600"]
    command += [f"--user-data-dir={tmp_path / 'profile'}", "--virtual-time-budget=1000", f"--screenshot={path}"]
    subprocess.run([*command, page.as_uri()], check=True, capture_output=True, timeout=100)
    image = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    assert image is not None
    reading = PatternReader().read(np.asarray(image, dtype=np.uint8))
    assert reading is not None
    assert 0 < reading.number < COUNT // 2
