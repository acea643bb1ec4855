"""A printed mat in view of a scan that does not use it: found in a pair, told before anything is fused, and nowhere else seen."""

import json
import math
from functools import cache
from pathlib import Path

import cv2
import numpy as np
import pytest

from phone_host import api
from phone_host.calibration.target.marked import MarkFamily
from phone_host.cli import main
from phone_host.model import Image
from phone_host.output.rig_yaml import write_rig
from phone_host.scan.mat import MatDetector, MatInView, mat_in_view, parse_mat
from phone_host.stereo.rectify import rectify_rig
from tests.scan.test_scan_mat import RIG, pictures, walked
from tests.support.mat_rigs import rig_of
from tests.support.mats import MatPainter, looking_at
from tests.support.table_things import small_scene

AT_M = np.array([0.0, 0.0, 0.035])


@cache
def with_mat(name: str, degrees: float) -> Image:
    """A mat with a ball on it, from a side, 640x480 px."""
    painter = MatPainter(rig_of("vga").left, parse_mat(name), fine=2)
    return painter.image(looking_at(math.radians(degrees), math.radians(35), 0.42, AT_M), seed=3)


@pytest.mark.parametrize("degrees", [0, 130, 250])
def test_the_usual_mat_is_found_from_all_sides(degrees: float) -> None:
    """With an object on it, and the option that uses it."""
    found = mat_in_view(with_mat("10x8:25mm:18mm:5x5", degrees))
    assert found == MatInView(10, 8, MarkFamily.ARUCO_5X5)
    assert found.option == "--mat"


def test_another_mat_is_named_as_far_as_a_picture_tells() -> None:
    """Its columns and its family; rows and sides are the user's to say."""
    found = mat_in_view(with_mat("8x6:28mm:20mm:4x4", 20))
    assert found is not None
    assert found.option == "--mat 8xROWS:SQUARE:MARK:4x4"


def test_no_mat_is_seen_where_none_lies() -> None:
    """A chessboard, a speckled figure on a wooden table, noise, and a page of text are no mats."""
    board = np.kron(np.indices((9, 12)).sum(axis=0) % 2, np.ones((40, 40))) * 200 + 20
    text = np.full((480, 640), 255, np.uint8)
    for row in range(30, 480, 30):
        cv2.putText(text, "the quick brown fox 0123456789", (10, row), cv2.FONT_HERSHEY_SIMPLEX, 0.8, 0, 2)
    noise = np.random.default_rng(1).integers(0, 256, (480, 640))
    figure = cv2.cvtColor(small_scene().view(0).left, cv2.COLOR_BGR2GRAY)
    blocks = np.kron(np.random.default_rng(2).integers(0, 2, (40, 60)), np.ones((12, 12))) * 200
    for grey in (board, text, noise, figure, blocks):
        assert mat_in_view(np.asarray(grey, np.uint8)) is None


def test_few_pairs_are_searched() -> None:
    """The first five, then the 9th, 17th, 33rd ..., in grey or colour; others are not even converted to grey. A mat that lies there is reported once."""
    blank, grey = np.full((480, 640), 90, np.uint8), with_mat("10x8:25mm:18mm:5x5", 0)
    mat, no_image = np.repeat(grey[..., np.newaxis], 3, axis=2), np.zeros((480, 640, 2), np.uint8)
    detector = MatDetector()
    assert not any(detector.take(blank) for _ in range(5))
    assert not any(detector.take(no_image) for _ in range(3))
    assert detector.take(mat)
    assert detector.result == MatInView(10, 8, MarkFamily.ARUCO_5X5)
    assert not any(detector.take(no_image) for _ in range(9))


@pytest.fixture(scope="module")
def on_mat(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Pictures of a ball on the usual mat from four sides."""
    folder = tmp_path_factory.mktemp("on_mat")
    write_rig(folder / "rig.yaml", RIG, rectify_rig(RIG))
    for side in ("left", "right"):
        (folder / side).mkdir()
    for number, degrees in enumerate((0, 10, 20, 30)):
        for side, image in zip(("left", "right"), pictures(degrees), strict=True):
            cv2.imwrite(str(folder / side / f"{number}.png"), image)
    return folder


@pytest.mark.parametrize(("way", "code"), [("--turntable", 4), ("--object", 0), ("", 0)])
def test_a_scan_without_mat_says_so_first(
    on_mat: Path, way: str, code: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """One warning on stderr as the first pair comes, and one in the report, or in the error where --turntable makes no model; advice to move the cameras takes its place nowhere."""
    given = [str(on_mat / each) for each in ("left", "right")]
    options = ["--calibration", str(on_mat / "rig.yaml"), "--near", "280mm", "--voxel", "4mm", *([way] if way else [])]
    assert main(["scan", *given, *options, "--out", str(tmp_path / "out")]) == code
    told = capsys.readouterr()
    words = f"a printed mat is in view, but the scan does not use it: use --mat{f' in place of {way}' if way else ''} "
    assert told.err.count(f"phone-host: warning: {words}") == 1
    assert "move the cameras back" not in told.err + told.out
    if code == 0:
        report = json.loads((tmp_path / "out" / "report.json").read_text())
        assert report["verdict"] != "good"
        assert report["warnings"][0].startswith(words)
        assert words in (tmp_path / "out" / "index.html").read_text()
        assert f"warning: {words}" in told.out
    else:
        assert told.err.count(words) == 2
        assert not (tmp_path / "out").exists()


def test_a_scan_of_the_python_api_says_so(tmp_path: Path) -> None:
    """The listener is told once, before the pair is taken, and the saved report begins with it."""
    told = list[MatInView]()
    scan = api.scan_for(api.ScanWanted(voxel_m=0.004), told.append)
    for number in range(2):
        scan.take(str(number), float(number), walked(0))
    assert told == [scan.unused_mat] == [MatInView(10, 8, MarkFamily.ARUCO_5X5)]
    api.save_scan(tmp_path / "out", scan)
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    assert report["warnings"][0].startswith("a printed mat is in view, but the scan does not use it: use --mat ")
