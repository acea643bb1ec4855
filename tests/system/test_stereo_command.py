"""`phone-host stereo` as a user starts it, on rendered and on real pairs."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from phone_host.model import Image
from phone_host.output.rig_yaml import write_rig
from phone_host.stereo.rectify import rectify_rig
from tests.support.point_files import read_pfm, read_ply
from tests.support.rigs import unlike_rig

_SHIFT_PX = 12


def _phone_host(*arguments: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "phone_host.cli", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=100)


def _texture(height: int, width: int) -> Image:
    noise = np.random.default_rng(5).normal(size=(height, width))
    smooth = cv2.GaussianBlur(noise, (0, 0), 1.5)
    image: Image = np.clip(128 + smooth / smooth.std() * 50, 0, 255).astype(np.uint8)
    return image


@pytest.fixture
def shifted(tmp_path: Path) -> Path:
    """A folder with left.png and right.png: one texture, 12 px apart (left x - right x = 12)."""
    wide = _texture(120, 200 + _SHIFT_PX)
    cv2.imwrite(str(tmp_path / "left.png"), wide[:, :200])
    cv2.imwrite(str(tmp_path / "right.png"), wide[:, _SHIFT_PX:])
    return tmp_path


@pytest.mark.parametrize("matcher", ["sgbm", "block"])
def test_a_rectified_pair_with_geometry_gives_all_files(shifted: Path, matcher: str) -> None:
    """Disparity is 12 everywhere, depth is f b / (d + doffs) = 500 * 0.1 / (12 + 3) = 3.333 m, and --json prints the report."""
    done = _phone_host(
        "stereo", shifted / "left.png", shifted / "right.png", "--rectified", "--disparities", 32, "--focal", 500,
        "--baseline", 100, "--doffs", 3, "--center", "99.5,59.5", "--matcher", matcher, "--out", shifted / "o", "--json",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    disparity = read_pfm(shifted / "o" / "disparity.pfm")
    assert disparity.shape == (120, 200)
    assert np.nanmedian(disparity) == pytest.approx(12, abs=0.05)
    assert np.nanmedian(read_ply(shifted / "o" / "cloud.ply").points_m[:, 2]) == pytest.approx(50 / 15, rel=0.005)
    report = json.loads(done.stdout)
    assert report == json.loads((shifted / "o" / "report.json").read_text())
    assert report["size"] == "200x120"
    assert report["disparities"] == 32
    assert report["density"] == pytest.approx(np.isfinite(disparity).mean(), abs=1e-4)
    assert report["points"] == np.isfinite(disparity).sum()
    assert set(report["times_ms"]) == {"read", "prepare", "rectify", "match", "reproject", "judge", "write", "total"}
    assert sorted(path.name for path in (shifted / "o").iterdir()) == sorted([".tandemscan", *report["files"]])


def test_folders_give_a_folder_for_each_pair_and_a_bad_pair_is_exit_4(shifted: Path) -> None:
    """Of pairs 3 and 12, the second has a spoiled image: the first is computed, the other named, in the lines and in --json."""
    for side in ("left", "right"):
        (shifted / side).mkdir()
        (shifted / side / "3.png").write_bytes((shifted / f"{side}.png").read_bytes())
        (shifted / side / "12.png").write_bytes((shifted / f"{side}.png").read_bytes())
    (shifted / "left" / "12.png").write_bytes(b"spoiled")
    (shifted / "left" / "7.png").write_bytes((shifted / "left.png").read_bytes())
    arguments = [
        "stereo", shifted / "left", shifted / "right", "--rectified", "--disparities", 32, "--out", shifted / "o",
    ]  # fmt: skip
    done = _phone_host(*arguments, "--json")
    assert done.returncode == 4, done.stderr
    report = json.loads(done.stdout)
    assert report == json.loads((shifted / "o" / "report.json").read_text())
    assert [pair["name"] for pair in report["pairs"]] == ["pair-000003", "pair-000012"]
    assert "12.png" in report["pairs"][1]["problem"]
    assert [Path(path).name for path in report["left_alone"]] == ["7.png"]
    assert np.nanmedian(read_pfm(shifted / "o" / "pair-000003" / "disparity.pfm")) == pytest.approx(12, abs=0.05)
    told = _phone_host(*arguments)
    assert told.returncode == 4
    for words in ("pair-000003", "pair-000012  failed: ", "1 of 2 pairs computed, 1 failed", "no partner: 7.png"):
        assert words in told.stdout


def test_without_focal_length_there_is_no_cloud_and_the_command_says_so(shifted: Path) -> None:
    """No cloud.ply is written, that of an earlier run is removed, and stdout names the missing options; if cloud.ply is the user's own, the run ends with exit 3."""
    arguments = [shifted / "left.png", shifted / "right.png", "--rectified", "--disparities", 32]
    first = _phone_host(
        "stereo", *arguments, "--focal", 500, "--baseline", 100, "--center", "99,59", "--out", shifted / "o"
    )
    assert first.returncode == 0, first.stderr
    assert (shifted / "o" / "cloud.ply").exists()
    done = _phone_host(
        "stereo", shifted / "left.png", shifted / "right.png", "--rectified", "--disparities", 32, "--out", shifted / "o"
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert not (shifted / "o" / "cloud.ply").exists()
    assert "no cloud.ply" in done.stdout
    assert "--focal" in done.stdout
    (shifted / "mine").mkdir()
    (shifted / "mine" / "cloud.ply").write_bytes(b"scanned for days")
    refused = _phone_host("stereo", *arguments, "--out", shifted / "mine")
    assert refused.returncode == 3
    assert refused.stderr.count("\n") == 1
    assert "mine/cloud.ply" in refused.stderr
    assert "--out" in refused.stderr
    assert [path.read_bytes() for path in (shifted / "mine").iterdir()] == [b"scanned for days"]


def test_16_bit_colour_and_grey_give_the_same_disparity_as_8_bit(shifted: Path) -> None:
    """A 16-bit colour left image with an 8-bit grey right one matches like the plain pair."""
    left = cv2.imread(str(shifted / "left.png"), cv2.IMREAD_GRAYSCALE)
    assert left is not None
    cv2.imwrite(str(shifted / "deep.png"), np.dstack([left] * 3).astype(np.uint16) * 257)
    for name in ("left", "deep"):
        done = _phone_host(
            "stereo", shifted / f"{name}.png", shifted / "right.png", "--rectified", "--disparities", 32,
            "--out", shifted / name,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
    assert (shifted / "left" / "disparity.pfm").read_bytes() == (shifted / "deep" / "disparity.pfm").read_bytes()


def test_an_unrectified_pair_of_two_sizes_goes_through_the_rig(tmp_path: Path) -> None:
    """With rig.yaml, images of 640x480 and 1280x720 become one rectified size and a cloud; N follows from --near."""
    rig = unlike_rig()
    rectification = rectify_rig(rig)
    write_rig(tmp_path / "rig.yaml", rig, rectification)
    cv2.imwrite(str(tmp_path / "l.png"), _texture(480, 640))
    cv2.imwrite(str(tmp_path / "r.png"), _texture(720, 1280))
    done = _phone_host(
        "stereo", tmp_path / "l.png", tmp_path / "r.png", "--calibration", tmp_path / "rig.yaml",
        "--near", 600, "--out", tmp_path / "o", "--json",
    )  # fmt: skip
    assert done.returncode == 4, done.stderr  # the two textures have nothing in common
    report = json.loads(done.stdout)
    assert report["trust"]["doubts"][0]["doubt"] == "other_scene"
    assert report["size"] == f"{rectification.width_px}x{rectification.height_px}"
    # f b / near = 526 * 0.10026 / 0.6 = 87.9 -> 96
    assert report["disparities"] == 96
    assert report["geometry"]["baseline_m"] == pytest.approx(0.10026, abs=1e-5)
    assert (tmp_path / "o" / "cloud.ply").exists()


def _bad_cases(folder: Path) -> dict[str, tuple[list[object], int, str]]:
    left, right = folder / "left.png", folder / "right.png"
    rig = unlike_rig()
    write_rig(folder / "rig.yaml", rig, rectify_rig(rig))
    cv2.imwrite(str(folder / "small.png"), np.zeros((60, 100), np.uint8))
    (folder / "text.png").write_text("no image")
    (folder / "cut.png").write_bytes(left.read_bytes()[:500])
    (folder / "file").write_text("no folder")
    rectified: list[object] = ["--rectified", "--disparities", 32]
    out: list[object] = ["--out", folder / "o"]
    return {
        "missing": ([folder / "none.png", right, *rectified, *out], 4, "none.png"),
        "text": ([folder / "text.png", right, *rectified, *out], 4, "text.png"),
        "cut": ([left, folder / "cut.png", *rectified, *out], 4, "cut.png"),
        "two sizes": ([left, folder / "small.png", *rectified, *out], 4, "small.png is 100x60"),
        "size not of the rig": ([left, right, "--calibration", folder / "rig.yaml", *out], 4, "640x480"),
        "no rig": ([left, right, "--calibration", folder / "no.yaml", *out], 4, "no.yaml"),
        "nothing said": ([left, right, *out], 2, "--calibration"),
        "no number": ([left, right, "--rectified", *out], 2, "--disparities"),
        "no disparities": ([left, right, "--rectified", "--disparities", 0, *out], 2, "disparities"),
        "half a geometry": ([left, right, *rectified, "--focal", 500, *out], 2, "--baseline"),
        "no disparities with a rig": (
            [left, right, "--calibration", folder / "rig.yaml", "--disparities", 0, *out],
            2,
            "disparities",
        ),
        "focal not finite": ([left, right, *rectified, "--focal", "nan", "--baseline", 100, *out], 2, "--focal"),
        "baseline not finite": ([left, right, *rectified, "--focal", 500, "--baseline", "inf", *out], 2, "--baseline"),
        "doffs not finite": (
            [left, right, *rectified, "--focal", 500, "--baseline", 100, "--doffs", "nan", *out],
            2,
            "--doffs",
        ),
        "center not finite": (
            [left, right, *rectified, "--focal", 500, "--baseline", 100, "--center", "nan,3", *out],
            2,
            "--center",
        ),
        "geometry and a rig": (
            [left, right, "--calibration", folder / "rig.yaml", "--center", "99,59", *out],
            2,
            "--center contradicts",
        ),
        "center alone": ([left, right, *rectified, "--center", "99,59", *out], 2, "--center without --focal"),
        "doffs alone": ([left, right, *rectified, "--doffs", 0, *out], 2, "--doffs without --focal"),
        "near": ([left, right, "--calibration", folder / "rig.yaml", "--near", 0, *out], 2, "--near"),
        "out is a file": (
            [left, right, *rectified, "--out", folder / "file"],
            3,
            "file is a file, not a folder: name another",
        ),
        "out lies in a file": (
            [left, right, *rectified, "--out", folder / "file" / "a" / "b"],
            3,
            "file is a file, not a folder",
        ),
        "out holds the images": ([left, right, *rectified, "--out", folder], 2, "folder of the images"),
        "one side": ([left, *rectified, *out], 2, "only one side is given"),
        "same image": ([left, left, *rectified, *out], 2, "both name"),
        "folder and file": ([folder, right, *rectified, *out], 2, "is a folder, RIGHT"),
        "out is a device": ([left, right, *rectified, "--out", "/dev/null"], 3, "/dev/null is a device, not a folder"),
    }


def test_bad_input_is_one_line_that_names_it_and_the_exit_code_says_whose_fault_it_is(shifted: Path) -> None:
    """2 for options, 3 for an unusable folder, 4 for bad data; never a traceback."""
    for name, (arguments, code, word) in _bad_cases(shifted).items():
        done = _phone_host("stereo", *arguments)
        lines = [line for line in done.stderr.splitlines() if line.startswith("phone-host: error: ")]
        assert done.returncode == code, (name, done.stderr)
        assert len(lines) == 1, (name, done.stderr)
        assert word in lines[0], (name, lines)
        assert "Traceback" not in done.stderr, name
        assert done.stdout == "", name


def _scan_data() -> Path:
    folder = os.environ.get("SCAN_DATA")
    if not folder:
        pytest.skip("SCAN_DATA is not set: no real images")
    return Path(folder)


@pytest.mark.data
def test_motorcycle_in_metres(tmp_path: Path) -> None:
    """Middlebury's Motorcycle with its published geometry: the median depth agrees with the ground truth to 1 %."""
    scene = _scan_data() / "middlebury_2014_q" / "Motorcycle"
    images = sorted(path for path in scene.iterdir() if path.suffix == ".png")
    done = _phone_host(
        "stereo", *images[:2], "--rectified", "--disparities", 80, "--focal", 994.978, "--baseline", 193.001,
        "--doffs", 31.086, "--center", "311.193,254.877", "--out", tmp_path, "--json",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    report: dict[str, Any] = json.loads(done.stdout)
    assert report["density"] > 0.8
    truth = np.load(scene / "motorcycle_disp.npz")["arr_0"]
    found = read_pfm(tmp_path / "disparity.pfm")
    both = np.isfinite(truth) & np.isfinite(found)
    expected_m = np.median(994.978 * 0.193001 / (truth[both] + 31.086))
    assert np.median(read_ply(tmp_path / "cloud.ply").points_m[:, 2]) == pytest.approx(expected_m, rel=0.01)
