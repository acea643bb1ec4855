"""`phone-host calibrate` as a user starts it, on rendered boards and on real rigs."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from phone_host.calibration.target.corners import Board, find_corners
from phone_host.output.rig_yaml import read_rig
from phone_host.stereo.images import decode_file, open_image
from phone_host.stereo.rectifier import Rectifier
from phone_host.stereo.reproject import project
from tests.support.boards import poses, render_pair
from tests.support.html import Page
from tests.support.point_files import read_ply
from tests.support.rigs import unlike_rig


def _phone_host(*arguments: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "phone_host.cli", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=110)


def _report(done: subprocess.CompletedProcess[str]) -> dict[str, Any]:
    report: dict[str, Any] = json.loads(done.stdout)
    return report


@pytest.fixture(scope="module")
def boards(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Eight rendered pairs of two unlike cameras, and five kinds of spoiled pair."""
    folder = tmp_path_factory.mktemp("boards")
    left, right = folder / "left", folder / "right"
    left.mkdir()
    right.mkdir()
    pairs = [render_pair(unlike_rig(), pose) for pose in poses(9, seed=11)]
    for index, pair in enumerate(pairs):
        cv2.imwrite(str(left / f"left{index}.png"), pair[0])
        cv2.imwrite(str(right / f"right{index:02d}.png"), pair[1])
    images = pairs[-1]
    (left / "left8.png").write_bytes((left / "left8.png").read_bytes()[:2000])  # truncated
    cv2.imwrite(str(left / "left9.png"), np.full((480, 640), 128, np.uint8))  # no board
    cv2.imwrite(str(right / "right09.png"), images[1])
    cv2.imwrite(str(left / "left10.png"), cv2.resize(images[0], (320, 240)))  # different size
    cv2.imwrite(str(right / "right10.png"), images[1])
    cv2.imwrite(str(right / "right11.png"), images[1])  # no partner
    return folder


@pytest.fixture(scope="module")
def few(boards: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Four of those pairs, one truncated and one without a partner: enough for a calibration whose figures are not checked."""
    folder = tmp_path_factory.mktemp("few")
    for side, names in (("left", ("left{}.png", "012389")), ("right", ("right{:02d}.png", "01238"))):
        (folder / side).mkdir()
        for number in (int(digit) for digit in names[1]):
            source = boards / side / names[0].format(number)
            (folder / side / source.name).write_bytes(source.read_bytes())
    return folder


@pytest.fixture(scope="module")
def small(few: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same at a quarter of the size: enough to search for a missing calibration board."""
    folder = tmp_path_factory.mktemp("small")
    for side in ("left", "right"):
        (folder / side).mkdir()
        for path in (few / side).iterdir():
            image = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE) if path.stat().st_size > 2000 else None
            if image is None:
                (folder / side / path.name).write_bytes(path.read_bytes())
            else:
                cv2.imwrite(str(folder / side / path.name), cv2.resize(image, None, fx=0.25, fy=0.25))
    return folder


def test_unlike_cameras_are_calibrated_and_every_pair_is_accounted_for(boards: Path, tmp_path: Path) -> None:
    """Baseline and sizes are reported, spoiled pairs are named with their reason, rig.yaml and report.json are written."""
    out = tmp_path / "new" / "rig.yaml"
    done = _phone_host(
        "calibrate", boards / "left", boards / "right", "--board", "9x6", "--square", "2.5cm", "--out", out, "--json",
        "--board-side", "right",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    report = _report(done)
    assert report == json.loads((out.parent / "report.json").read_text())
    reasons = {each["pair"]: each["reason"] for each in report["pairs"]["rejected"]}
    assert reasons == {
        "8": "unreadable", "9": "board not found left", "10": "other image size", "right11.png": "no partner",
    }  # fmt: skip
    assert report["pairs"]["found"] == 11
    assert report["pairs"]["used"] == 8
    assert report["baseline_mm"] == pytest.approx(np.linalg.norm([100, 4, -6]), abs=1.0)
    assert report["verdict"] in {"good", "usable"}
    assert (
        report["vertical_error_px"]["mean"] <= report["vertical_error_px"]["p95"] <= report["vertical_error_px"]["max"]
    )
    assert report["page"] == str(out.parent / "index.html")
    page = Page(Path(report["page"]).read_text())
    assert page.open == []
    assert "board not found left" in page.words
    assert page.every("script") == []
    assert not [each for each in page.every("link") + page.every("image") if "http" in str(each.get("href"))]
    assert len(page.every("image")) == 2 * 10 + 2  # of all pairs that could be read, and the rectified one
    assert Path(report["page"]).stat().st_size < 1_000_000
    rig = read_rig(out)
    assert (rig.left.width_px, rig.right.width_px) == (640, 1280)
    assert rig.board_side.value == "right"


def test_the_table_names_every_pair(few: Path, tmp_path: Path) -> None:
    """Without --json the table shows the board found, used and rejected pairs, the verdict and where the files are."""
    done = _phone_host("calibrate", few / "left", few / "right", "--square", 25, "--out", tmp_path / "rig.yaml")
    assert done.returncode == 0, done.stderr
    for word in (
        "9x6 inner corners, as found in the images",
        "4 pairs used, 2 rejected",
        "unreadable",
        "no partner",
        "baseline",
        "verdict",
        str(tmp_path / "rig.yaml"),
        f"look at {tmp_path / 'index.html'}",
    ):
        assert word in done.stdout


def test_swapped_sides_are_exit_4_with_the_remedy_and_a_report(few: Path, tmp_path: Path) -> None:
    """LEFT and RIGHT swapped: verdict reject, the remedy says so, and no new rig.yaml is written; the old one, which has no part in it, stays."""
    (tmp_path / "rig.yaml").write_text("%YAML:1.0\n# of an earlier run")
    done = _phone_host(
        "calibrate", few / "right", few / "left", "--board", "9x6", "--square", "25mm",
        "--out", tmp_path / "rig.yaml", "--json",
    )  # fmt: skip
    assert done.returncode == 4, done.stderr
    report = _report(done)
    assert report["verdict"] == "reject"
    assert "swap LEFT and RIGHT" in report["remedy"]
    assert (tmp_path / "report.json").exists()
    assert report["earlier_rig"] == "rig.yaml"
    assert "of an earlier run" in (tmp_path / "rig.yaml").read_text()


def test_too_few_pairs_are_exit_4_with_a_report(small: Path, tmp_path: Path) -> None:
    """No pair shows a board: one line on stderr, the reasons as JSON on stdout and in report.json, and an old rig stays where it is."""
    for side, name in (("left", "left{}.png"), ("right", "right{:02d}.png")):
        (tmp_path / side).mkdir()
        for number in range(4):
            seen = cv2.imread(str(small / side / name.format(number)), cv2.IMREAD_GRAYSCALE)
            assert seen is not None
            cv2.imwrite(str(tmp_path / side / f"{number}.png"), np.full_like(seen, 99))
    (tmp_path / "rig.yaml").write_text("%YAML:1.0\n# of an earlier run")
    done = _phone_host(
        "calibrate", tmp_path / "left", tmp_path / "right", "--board", "9x6", "--square", "25mm",
        "--out", tmp_path / "rig.yaml", "--json",
    )  # fmt: skip
    assert done.returncode == 4
    assert done.stderr.count("\n") == 1
    assert done.stderr.startswith("phone-host: error: only 0 of at least 3 pairs")
    report = _report(done)
    assert report["verdict"] == "reject"
    assert "inner corners" in report["remedy"]
    assert len(report["pairs"]["rejected"]) == 4
    assert report == json.loads((tmp_path / "report.json").read_text())
    assert report["earlier_rig"] == "rig.yaml"
    assert "of an earlier run" in (tmp_path / "rig.yaml").read_text()


@pytest.mark.parametrize("board", ["10x7", "5x4"])
def test_a_wrong_board_is_told_before_anything_is_searched(few: Path, tmp_path: Path, board: str) -> None:
    """The images show 9x6 inner corners: a larger or smaller --board is exit 2 in one line, and an earlier rig stays."""
    (tmp_path / "rig.yaml").write_text("%YAML:1.0\n# of an earlier run")
    done = _phone_host(
        "calibrate", few / "left", few / "right", "--board", board, "--square", "25mm", "--out", tmp_path / "rig.yaml"
    )
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert f"these boards have 9x6 inner corners, --board says {board}: give --board 9x6" in done.stderr
    assert (tmp_path / "rig.yaml").exists()


def test_usage_errors_are_exit_2(boards: Path, tmp_path: Path) -> None:
    """An invalid board or length, and one folder for both sides."""
    sides = boards / "left", boards / "right"
    for arguments, word in (
        ((*sides, "--board", "9by6", "--square", "25mm"), "--board"),
        ((*sides, "--board", "9x6", "--square", "1in"), "--square"),
        ((boards / "left", boards / "left", "--board", "9x6", "--square", "25mm"), "glob"),
    ):
        done = _phone_host("calibrate", *arguments, "--out", tmp_path / "rig.yaml")
        assert done.returncode == 2, done.stderr
        assert word in done.stderr
        assert "Traceback" not in done.stderr


def test_a_photograph_is_not_replaced(boards: Path, tmp_path: Path) -> None:
    """If --out names a file that is no calibration, such as a picture, exit 3 follows at once; the file stays."""
    picture = tmp_path / "left0.png"
    picture.write_bytes((boards / "left" / "left0.png").read_bytes())
    done = _phone_host(
        "calibrate", boards / "left", boards / "right", "--board", "9x6", "--square", "25mm", "--out", picture
    )
    assert done.returncode == 3
    assert "left0.png is not a calibration" in done.stderr
    assert picture.read_bytes() == (boards / "left" / "left0.png").read_bytes()


def test_what_is_no_file_is_not_replaced(boards: Path, tmp_path: Path) -> None:
    """If --out is a folder or a pipe, or lies in a file, exit 3 follows at once; it stays unchanged."""
    (tmp_path / "file").write_text("no folder")
    os.mkfifo(tmp_path / "pipe")
    cases = (
        ("", "is a folder, not a file"),
        ("pipe", "is a pipe, not a file"),
        ("file/rig.yaml", "is a file, not a folder"),
    )
    for out, said in cases:
        done = _phone_host(
            "calibrate", boards / "left", boards / "right", "--board", "9x6", "--square", 25, "--out", tmp_path / out
        )
        assert done.returncode == 3, done.stderr
        assert done.stderr.count("\n") == 1
        assert said in done.stderr
    assert (tmp_path / "pipe").is_fifo()


def _scan_data() -> Path:
    folder = os.environ.get("SCAN_DATA")
    if not folder:
        pytest.skip("SCAN_DATA is not set: no real images")
    return Path(folder)


def _calibrate_real(left: str, right: str, board: str, square: str, out: Path) -> dict[str, Any]:
    data = _scan_data()
    done = _phone_host(
        "calibrate", data / left, data / right, "--board", board, "--square", square, "--out", out, "--json"
    )
    assert done.returncode == 0, done.stderr
    return _report(done)


@pytest.mark.data
def test_simplestereo_rig_as_published(tmp_path: Path) -> None:
    """Stereo RMS is at most 0.20 px; baseline is 80.17 mm as published in rig.json, within 0.4 mm; its scene becomes a cloud."""
    rig = tmp_path / "rig.yaml"
    report = _calibrate_real("simplestereo_rig1/calib/*_L.png", "simplestereo_rig1/calib/*_R.png", "7x6", "60.5mm", rig)
    assert report["rms_px"]["stereo"] <= 0.20
    assert report["baseline_mm"] == pytest.approx(80.17, abs=0.4)
    assert report["pairs"]["used"] == 15
    scene = _scan_data() / "simplestereo_rig1"
    done = _phone_host(
        "stereo",
        scene / "left.png",
        scene / "right.png",
        "--calibration",
        rig,
        "--near",
        700,
        "--out",
        tmp_path,
        "--json",
    )
    assert done.returncode == 0, done.stderr
    # The instrument and the table: most of the image is a bare wall, which has no depth but for streaks.
    assert _report(done)["points"] > 120_000
    # The instrument stands where the calibration boards stood: at 1.2 m to 1.4 m.
    depth_m = read_ply(tmp_path / "cloud.ply").points_m[:, 2]
    assert 1.1 < np.median(depth_m[(depth_m > 0.8) & (depth_m < 2)]) < 1.5


@pytest.mark.data
def test_opencv_sample_rig(tmp_path: Path) -> None:
    """Stereo RMS is at most 0.30 px on OpenCV's own pairs, all 13 used."""
    report = _calibrate_real(
        "opencv_stereo_calib/left*", "opencv_stereo_calib/right*", "9x6", "25mm", tmp_path / "rig.yaml"
    )
    assert report["rms_px"]["stereo"] <= 0.30
    assert report["pairs"]["used"] == 13


@pytest.mark.data
def test_pairs_that_were_not_exposed_together_are_rejected(tmp_path: Path) -> None:
    """Of 29 hand-held pairs the few whose rows do not align are rejected, and RMS is below the published 0.249 px."""
    report = _calibrate_real(
        "sourishg_rig/calib_imgs/1/left*", "sourishg_rig/calib_imgs/1/right*", "9x6", "25mm", tmp_path / "rig.yaml"
    )
    assert report["rms_px"]["stereo"] <= 0.249
    assert 25 <= report["pairs"]["used"] < 29
    assert {each["reason"] for each in report["pairs"]["rejected"]} == {"not the same moment"}


@pytest.mark.data
def test_squares_measured_in_the_cloud_have_their_size(tmp_path: Path) -> None:
    """From calibration to cloud: 25 mm squares of a board, in a scene that was not used for calibration, measure 25 mm to 2 %."""
    rig_file = tmp_path / "rig.yaml"
    report = _calibrate_real("stereopi_rig/pairs/left*", "stereopi_rig/pairs/right*", "9x6", "25mm", rig_file)
    assert report["rms_px"]["stereo"] <= 0.25
    assert report["pairs"]["used"] >= 27
    both = decode_file(open_image(_scan_data() / "stereopi_rig" / "scenes" / "scene_640x240_1.png"))
    cv2.imwrite(str(tmp_path / "l.png"), both[:, :320])
    cv2.imwrite(str(tmp_path / "r.png"), both[:, 320:])
    done = _phone_host(
        "stereo", tmp_path / "l.png", tmp_path / "r.png", "--calibration", rig_file, "--out", tmp_path / "o", "--json"
    )
    assert done.returncode == 0, done.stderr
    rectifier = Rectifier(read_rig(rig_file))
    left = rectifier.rectify(both[:, :320].copy(), both[:, 320:].copy()).left
    corners = find_corners(left, Board(9, 6, 0.025))
    points_m = read_ply(tmp_path / "o" / "cloud.ply").points_m.astype(np.float64)
    pixels = project(points_m, rectifier.geometry)[:, :2]
    # Each corner's point lies on its ray, at the depth of the nearest pixel that has one.
    nearest = np.array([np.linalg.norm(pixels - corner, axis=1).argmin() for corner in corners])
    rays = np.column_stack([corners - [rectifier.geometry.cx_px, rectifier.geometry.cy_px], np.zeros(54)])
    rays = rays / rectifier.geometry.focal_px + [0, 0, 1]
    grid = (rays * points_m[nearest, 2:]).reshape(6, 9, 3)
    # Measure across several squares: single corners carry the disparity's noise.
    width_m = np.linalg.norm(grid[:, -1] - grid[:, 0], axis=1) / 8
    assert np.median(width_m) == pytest.approx(0.025, rel=0.02)
