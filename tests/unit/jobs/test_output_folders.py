"""A results folder is used again: a verb replaces its own report, and keeps that of another verb."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from phone_host.cli import main
from phone_host.jobs.output_folders import announce_other_report, stale_page, unwritable
from phone_host.model import CameraModel, Rig
from phone_host.output.result_files import claim
from phone_host.output.rig_yaml import write_rig
from phone_host.stereo.rectify import rectify_rig
from tests.support.planes import noise

CALIB = (
    "cam0=[200 0 60; 0 200 40; 0 0 1]\ncam1=[200 0 60; 0 200 40; 0 0 1]\nbaseline=100\nwidth=320\nheight=96\nndisp=32\n"
)
VERBS = ("stereo", "calibrate", "calibrate-time", "run", "demo")


@pytest.fixture
def sides(tmp_path: Path) -> list[str]:
    """Two folders of two images each, 8 px apart."""
    for number in range(2):
        wide = noise(328, 96)
        for side, shift_px in (("left", 0), ("right", 8)):
            (tmp_path / side).mkdir(exist_ok=True)
            cv2.imwrite(str(tmp_path / side / f"{number}.png"), wide[:, shift_px : shift_px + 320])
    return [str(tmp_path / "left"), str(tmp_path / "right")]


def names(folder: Path) -> set[str]:
    """What lies in a folder."""
    return {path.name for path in folder.iterdir()}


def test_each_verb_recognises_its_own_report(
    tmp_path: Path, sides: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    """`stereo` of one pair, of several pairs, and `calibrate`, each twice into its folder: nothing is renamed, nothing is said of it."""
    geometry = ["--rectified", "--focal", "200", "--baseline", "100", "--disparities", "32"]
    size = ["--board", "9x6", "--square", "25mm"]
    pair = [f"{side}/0.png" for side in sides]
    for name, words, code in (
        ("one", ["stereo", *pair, *geometry, "--out", str(tmp_path / "one")], 0),
        ("set", ["stereo", *sides, *geometry, "--out", str(tmp_path / "set")], 0),
        ("rig", ["calibrate", *sides, *size, "--out", str(tmp_path / "rig" / "rig.yaml")], 4),  # there is no chessboard
    ):
        assert main(words) == code
        once = names(tmp_path / name)
        assert main(words) == code
        assert names(tmp_path / name) == once
        assert json.loads((tmp_path / name / "report.json").read_text())["command"] == words[0]
    assert "stays there as" not in capsys.readouterr().err


def test_another_verbs_report_is_kept(tmp_path: Path, sides: list[str]) -> None:
    """`stereo` into the folder of a calibration leaves that report as report-calibrate.json, and only the first time."""
    out = tmp_path / "out"
    assert main(["calibrate", *sides, "--board", "9x6", "--square", "25mm", "--out", str(out / "rig.yaml")]) == 4
    for _ in range(2):
        assert main(["stereo", *sides, "--rectified", "--disparities", "32", "--out", str(out)]) == 0
        assert json.loads((out / "report-calibrate.json").read_text())["command"] == "calibrate"
        assert json.loads((out / "report.json").read_text())["command"] == "stereo"
        assert not (out / "report-stereo.json").exists()


@pytest.mark.parametrize("verb", VERBS)
def test_the_key_command_decides(tmp_path: Path, verb: str) -> None:
    """Whatever else stands in it, a report is that of the verb it names; no other verb takes it for its own."""
    everything = {"command": verb, "truth": {}, "ended": "", "verdict": "", "time_offset_ns": 0, "matcher": "sgbm"}
    (tmp_path / "report.json").write_text(json.dumps(everything))
    announce_other_report(tmp_path, verb, print)
    assert names(tmp_path) == {"report.json"}


@pytest.mark.parametrize(
    ("keys", "verb"),
    [
        (("format_version", "ended", "truth"), "demo"),
        (("format_version", "ended"), "run"),
        (("format_version", "verdict", "pairs", "remedy"), "calibrate"),
        (("format_version", "time_offset_ns"), "calibrate-time"),
        (("format_version", "verdict", "matcher"), "stereo"),
        (("format_version", "verdict", "pairs", "left_alone"), "stereo"),
        (("matcher",), "stereo"),
    ],
)
def test_reports_of_older_versions_are_recognised_by_their_keys(
    tmp_path: Path, keys: tuple[str, ...], verb: str
) -> None:
    """They do not name their verb; a stereo report has a verdict, too."""
    (tmp_path / "report.json").write_text(json.dumps(dict.fromkeys(keys, 1)))
    announce_other_report(tmp_path, verb, print)
    assert names(tmp_path) == {"report.json"}


@pytest.mark.parametrize(
    ("listed", "verb", "stays"), [(True, "calibrate", False), (False, "calibrate", True), (True, "stereo", True)]
)
def test_a_page_of_before_goes_where_its_report_is_replaced(
    tmp_path: Path, verb: str, *, listed: bool, stays: bool
) -> None:
    """Ours goes; the user's own and another verb's stay, and so does an empty folder."""
    assert stale_page(tmp_path, "calibrate") == ()
    assert names(tmp_path) == set()
    (tmp_path / "report.json").write_text(json.dumps({"command": verb}))
    if listed:
        claim(tmp_path, "index.html")
    (tmp_path / "index.html").write_text("a page")
    assert (stale_page(tmp_path, "calibrate") == ()) == stays
    assert (tmp_path / "index.html").read_text() == "a page"  # until a report is written


def test_a_strangers_report_names_no_file(tmp_path: Path) -> None:
    """A name that is no verb of ours moves nothing, wherever it would lead."""
    (tmp_path / "report.json").write_text(json.dumps({"command": "../../x"}))
    announce_other_report(tmp_path, "stereo", print)
    assert names(tmp_path) == {"report.json"}


def test_pages_offer_the_same_rig_live_only_for_a_rig(tmp_path: Path, sides: list[str]) -> None:
    """A calib.txt is of images that were rectified already, which no live camera gives; a rig.yaml is of two cameras."""
    (tmp_path / "calib.txt").write_text(CALIB)
    # Two equal cameras side by side: their images are rectified as they are.
    model = CameraModel(
        width_px=320,
        height_px=96,
        matrix=np.array([[200.0, 0, 159.5], [0, 200, 47.5], [0, 0, 1]]),
        distortion=np.zeros(5),
    )
    rig = Rig(left=model, right=model, R_right_left=np.eye(3), t_right_left_m=np.array([-0.1, 0, 0]))
    write_rig(tmp_path / "rig.yaml", rig, rectify_rig(rig))
    for name, calibration in (("a", "calib.txt"), ("b", "rig.yaml")):
        assert (
            main(["stereo", *sides, "--calibration", str(tmp_path / calibration), "--out", str(tmp_path / name)]) == 0
        )
    pages = [(tmp_path / name / "index.html").read_text() for name in "ab"]
    assert [" run --link" in page for page in pages] == [False, True]


def test_a_rig_is_not_named_like_what_lies_beside_it(sides: list[str], tmp_path: Path) -> None:
    """The report or the page would take its place: exit 2, and nothing is written."""
    for name in ("report.json", "index.html", "Report.JSON"):
        out = tmp_path / "new" / name
        assert main(["calibrate", *sides, "--square", "25mm", "--out", str(out)]) == 2
        assert main(["calibrate", "--import", str(tmp_path / "rig.yaml"), "--out", str(out)]) == 2
    assert not (tmp_path / "new").exists()


def test_a_full_disk_names_the_file(tmp_path: Path) -> None:
    """The file that had no room is named if it lies in the folder that the user gave, else that folder."""
    for name, said in ((str(tmp_path / "report.json"), tmp_path / "report.json"), ("/proc/x", tmp_path)):
        error = OSError(28, "No space left on device", name)
        assert str(unwritable(tmp_path, error)).startswith(f"{said} cannot be written (No space left on device): ")
