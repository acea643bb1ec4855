"""`phone-host quality` on rendered walls and boards whose distance is known: figures, exit codes, page, refusals."""

import json
import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from phone_host.cli import main
from phone_host.output.rig_yaml import write_rig
from phone_host.run.file_pairs import FilePairs
from phone_host.run.quality_job import QualityJob, run_quality
from phone_host.scene.scene import PHONE_LOOK, WEBCAM_LOOK
from phone_host.scene.scene_model import Body, Box, Scene, Texture, rig_poses, rotation
from phone_host.scene.scene_render import render
from phone_host.stereo.core import StereoCore
from phone_host.stereo.match import MatchSettings
from phone_host.stereo.matcher_names import MatcherName
from phone_host.stereo.rectifier import Rectifier
from phone_host.stereo.rectify import rectify_rig
from phone_host.stereo.view_files import pair_files
from tests.support.boards import BOARD, render_pair
from tests.support.html import Page
from tests.support.overlays import write_turned
from tests.support.plain_scenes import plane_scene
from tests.support.rigs import narrow_rig, project_points

NEAR_M, FAR_M = 0.6, 1.2


@pytest.fixture(scope="module")
def room(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the demo's rig: a wall at 0.6 m, tilted, and at 1.2 m (left/1, left/2), and the edge of a cupboard (edge_l, edge_r)."""
    folder = tmp_path_factory.mktemp("room")
    rig = narrow_rig()
    write_rig(folder / "rig.yaml", rig, rectify_rig(rig))
    turn = rotation((0.0, 1.0, 0.0), math.radians(45))
    cupboard = Scene((Body("cupboard", Box((0.8, 3.0, 0.8)), (0.0, 0.0, 1.3), Texture(seed=4), turn),))
    scenes = {
        "left/1.png right/1.png": plane_scene(NEAR_M, 0.15, seed=1),
        "left/2.png right/2.png": plane_scene(FAR_M, seed=2),
        "edge_l.png edge_r.png": cupboard,
    }
    for names, scene in scenes.items():
        sides = zip(names.split(), (rig.left, rig.right), rig_poses(rig), (WEBCAM_LOOK, PHONE_LOOK), strict=True)
        for name, model, pose, look in sides:
            (folder / name).parent.mkdir(exist_ok=True)
            cv2.imwrite(str(folder / name), render(scene, model, pose, look))
    return folder


def run(room: Path, *words: str) -> int:
    """Call the verb with the room's rig."""
    return main(["quality", *words, "--calibration", str(room / "rig.yaml"), "--matcher", "sgbm"])


def report_of(out: Path) -> dict[str, Any]:
    """What it wrote."""
    report: dict[str, Any] = json.loads((out / "report.json").read_text())
    return report


class _Impatient:
    """Somebody who presses Ctrl-C when these words are shown."""

    def __init__(self, words: str) -> None:
        self._words = words

    def __call__(self, amount: int = 1) -> None:
        """Wait on."""

    def say(self, what: str) -> None:
        """Read what is being done."""
        if what == self._words:
            raise KeyboardInterrupt


def test_what_was_measured_before_ctrl_c_is_written(room: Path, tmp_path: Path) -> None:
    """Ctrl-C during the second pair: report and page are of the first one, and say so. During the first one nothing is written."""
    core = StereoCore(MatchSettings(MatcherName.SGBM, 96), Rectifier(narrow_rig()))
    pairs = FilePairs(
        files=pair_files(str(room / "left"), str(room / "right")),
        out=tmp_path / "o",
        make_core=lambda _: core,
        matcher="sgbm",
    )
    with pytest.raises(KeyboardInterrupt):
        run_quality(QualityJob(pairs=pairs), _Impatient("matching 2.png"))
    report = report_of(tmp_path / "o")
    assert (report["interrupted_of"], len(report["pairs"])) == (2, 1)
    assert report["headline"].startswith("Interrupted after 1 of 2 pairs. At ")
    assert "Interrupted after 1 of 2 pairs" in (tmp_path / "o" / "index.html").read_text()
    with pytest.raises(KeyboardInterrupt):
        run_quality(QualityJob(pairs=replace(pairs, out=tmp_path / "none")), _Impatient("matching 1.png"))
    assert not (tmp_path / "none").exists()


def test_walls_at_known_distances(room: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Two walls, stated at 0.6 m and 1.2 m along the left camera's own axis, show both distances to 0.2 %, and RMS as theory has it."""
    given = [str(room / "left"), str(room / "right"), "--distance", "60cm,1.2m", "--out", str(tmp_path / "o"), "--json"]
    assert run(room, *given) == 0
    report = report_of(tmp_path / "o")
    assert report == json.loads(capsys.readouterr().out)
    assert (report["command"], report["verdict"], report["planes"]) == ("quality", "good", 2)
    for pair, distance_m in zip(report["pairs"], (NEAR_M, FAR_M), strict=True):
        assert (pair["seen"], pair["problem"], pair["true_m"]) == ("plane", None, distance_m)
        assert pair["distance_m"] == pytest.approx(distance_m, rel=0.002)
        assert pair["bias_m"] == pytest.approx(pair["distance_m"] - distance_m)
        assert pair["bias_share"] == pytest.approx(pair["bias_m"] / distance_m)
        assert pair["fill"] > 0.97
        assert pair["subpixel_rms_px"] < 0.2
        theory_m = distance_m**2 * pair["subpixel_rms_px"] / (report["focal_px"] * report["baseline_m"])
        assert pair["plane_rms_m"] == pytest.approx(theory_m, rel=0.1)
        assert np.shape(pair["tiles"]["fill"]) == (9, 12)
    assert report["pairs"][0]["tilt_deg"] > report["pairs"][1]["tilt_deg"]
    page = Page((tmp_path / "o" / "index.html").read_text())
    assert page.open == []
    assert "Over the distance" in page.words
    assert len(page.every("img")) == 2


def test_one_wall_without_a_distance(room: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """RMS and fill rate need no distance; terminal and page say how to learn the bias. A region is taken as given."""
    given = [
        str(room / "left/2.png"),
        str(room / "right/2.png"),
        "--roi",
        "100,50,150,120",
        "--out",
        str(tmp_path / "o"),
    ]
    assert run(room, *given) == 0
    lines = capsys.readouterr().out.splitlines()
    assert re.match(r"At 1\.[12]\d\d m depth scatters by [\d.]+ mm \(0\.\d\d%\)", lines[0])
    assert any("note: give --distance" in line for line in lines)
    [pair] = report_of(tmp_path / "o")["pairs"]
    assert (pair["roi"], pair["pixels"], pair["bias_m"]) == ([100, 50, 150, 120], 18000, None)
    page = Page((tmp_path / "o" / "index.html").read_text())
    assert page.open == []
    assert "give --distance" in page.words
    assert run(room, *given) == 0  # into the same folder


def test_an_overlay_makes_up_for_a_turn(room: Path, tmp_path: Path) -> None:
    """The right camera has turned by 0.4 degrees since the calibration: with the run's overlay.yaml the wall is where it stands to 0.2 %."""
    images = [str(room / side / "2.png") for side in ("left", "right")]
    words = [*write_turned(tmp_path, narrow_rig()), "--matcher", "sgbm", "--distance", "1.2m", "--out"]
    assert main(["quality", *images, *words, str(tmp_path / "o")]) == 0
    [pair] = report_of(tmp_path / "o")["pairs"]
    assert pair["bias_share"] == pytest.approx(0, abs=0.002)


def test_what_is_no_plane_is_exit_4_in_one_line(room: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The edge of a cupboard is no plane: one line says so with a remedy, no figure is told for one, and the exit code is 4."""
    given = [str(room / "edge_l.png"), str(room / "edge_r.png"), "--distance", "0.8m", "--out", str(tmp_path / "o")]
    assert run(room, *given) == 4
    told = capsys.readouterr().out
    assert told.startswith("The region shows no plane: ")
    assert re.search(r"^warning: edge_l.png: the region shows no plane: .*: a\w+ .*wall", told, re.MULTILINE)
    assert "bias +" not in told
    report = report_of(tmp_path / "o")
    assert report["verdict"] == "bad"
    assert report["pairs"][0]["seen"] in {"bent", "off_plane"}


def test_a_pair_that_fails_among_others_is_named(
    room: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Of three pairs one cannot be read and one shows no plane: the third is measured, both are named, exit 4; alone, the unreadable one is an error."""
    for side, short in (("left", "l"), ("right", "r")):
        (tmp_path / side).mkdir()
        (tmp_path / side / "1.png").write_bytes((room / side / "1.png").read_bytes())
        (tmp_path / side / "2.png").write_bytes((room / f"edge_{short}.png").read_bytes())
        (tmp_path / side / "3.png").write_bytes(b"no picture")
    sides = [str(tmp_path / "left"), str(tmp_path / "right")]
    assert run(room, *sides, "--out", str(tmp_path / "o")) == 4
    told = capsys.readouterr().out
    assert told.startswith("1 of 3 pairs show a plane")
    assert "warning: 2.png: the region shows no plane" in told
    assert "3.png failed: " in told
    report = report_of(tmp_path / "o")
    assert [pair.get("seen") for pair in report["pairs"]][::2] == ["plane", None]
    assert report["verdict"] == "warning"
    assert Page((tmp_path / "o" / "index.html").read_text()).open == []
    assert run(room, *(f"{side}/3.png" for side in sides), "--out", str(tmp_path / "none")) == 4
    assert not (tmp_path / "none").exists()


def test_a_board_gives_the_true_distance(room: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A rendered board is where its corners say, to 0.3 %, and its depth is measured inside its outline; squares taken for 1 % larger give 1 % of bias."""
    rig = narrow_rig()
    middle = BOARD.points_m().mean(axis=0)
    turn = np.array([0.1, 0.2, 0.05])
    pose = np.concatenate([turn, np.array([0.05, 0.0, 0.8]) - np.asarray(cv2.Rodrigues(turn)[0]) @ middle])
    rng = np.random.default_rng(5)
    for name, image in zip(("l.png", "r.png"), render_pair(rig, pose), strict=True):
        noisy = cv2.GaussianBlur(image, (0, 0), 0.7) + rng.normal(0, 1.5, image.shape)
        cv2.imwrite(str(tmp_path / name), np.clip(noisy, 0, 255).astype(np.uint8))
    images = [str(tmp_path / name) for name in ("l.png", "r.png")]
    pairs = []
    for square in ("25mm", "25.25mm"):
        assert run(room, *images, "--board", "9x6", "--square", square, "--out", str(tmp_path / square)) == 0
        pairs += report_of(tmp_path / square)["pairs"]
    assert pairs[0]["board_misfit_px"] < 0.3
    assert pairs[0]["corners_bias_share"] == pytest.approx(0, abs=0.001)
    bias = [pair["bias_share"] for pair in pairs]
    assert bias[0] == pytest.approx(0, abs=0.003)
    assert bias[1] - bias[0] == pytest.approx(1 / 1.01 - 1, abs=1e-4)
    corners, _ = project_points(BOARD.points_m() @ np.asarray(cv2.Rodrigues(turn)[0]).T + pose[3:], rig)
    assert pairs[0]["roi"][2] == pytest.approx(np.ptp(corners[:, 0]), rel=0.1)
    assert "bias" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (["--board", "9x6"], "only one of --board and --square"),
        (["--board", "9x6", "--square", "25mm", "--distance", "1m"], "contradict each other"),
        (["--distance", "1m,2m,3m"], "--distance has 3 values, and there are 2 pairs"),
        (["--distance", "1"], "--distance 1 has no unit"),
        (["--roi", "1,2,3"], "--roi is '1,2,3'"),
        (["--board", "charuco:8x6:25mm:18mm:5x5", "--square", "25mm"], "quality knows chessboards only"),
    ],
)
def test_contradictory_options_are_exit_2(
    room: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], words: list[str], named: str
) -> None:
    """One line names the option, and nothing is written."""
    given = [str(room / "left"), str(room / "right"), "--out", str(tmp_path / "o")]
    assert run(room, *given, *words) == 2
    error = capsys.readouterr().err
    assert named in error
    assert len(error.splitlines()) == 1
    assert not (tmp_path / "o").exists()


def test_what_has_no_metres_or_region_is_refused(
    room: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Rectified images without focal length have no distances; neither option is a remedy in itself; a region outside the image is named."""
    images, out = [str(room / "left/1.png"), str(room / "right/1.png")], ["--out", str(tmp_path / "o")]
    same = [images[0], str(tmp_path / "right.png")]
    cv2.imwrite(same[1], np.roll(np.asarray(cv2.imread(images[0])), -20, axis=1))
    assert main(["quality", *same, "--rectified", "--disparities", "64", *out]) == 2
    assert "neither a focal length nor a baseline" in capsys.readouterr().err
    assert main(["quality", *images, *out]) == 2
    assert "neither --calibration nor --rectified" in capsys.readouterr().err
    assert run(room, *images, "--roi", "5000,0,10,10", *out) == 2
    assert "--roi 5000,0,10,10 lies outside" in capsys.readouterr().err
