"""A run with a time budget: one that leaves all the room there is changes no bit, one that nothing can hold says so."""

import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from phone_host.model import CameraModel, Rig
from phone_host.scene.scene import demo_scene
from phone_host.scene.scene_model import rig_poses
from phone_host.scene.scene_render import render
from tests.support.point_files import read_pfm
from tests.support.programs import board, host, program

GIVEN = ["--rectified", "--focal", "260", "--baseline", "100mm"]


@pytest.fixture(scope="module")
def film(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folders left and right with one rendered image each, a rectified pair of 320x240; f b = 26 px m."""
    matrix = np.array([[260.0, 0, 159.5], [0, 260.0, 119.5], [0, 0, 1]])
    model = CameraModel(width_px=320, height_px=240, matrix=matrix, distortion=np.zeros(5))
    rig = Rig(left=model, right=model, R_right_left=np.eye(3), t_right_left_m=np.array([-0.1, 0, 0]))
    root = tmp_path_factory.mktemp("film")
    for name, pose in zip(("left", "right"), rig_poses(rig), strict=True):
        (root / name).mkdir()
        cv2.imwrite(str(root / name / "0.png"), render(demo_scene(), model, pose))
    return root


def _run(film: Path, folder: Path, budget: str) -> tuple[dict[str, Any], str]:
    """Run 20 pairs; return the report and what was printed."""
    link, out = f"ipc://{folder}/link", folder / "live"
    words = ["run", "--link", link, "--camera", f"replay:{film}/right?fps=20&loop=1", *GIVEN, "--budget", budget]
    with (
        board(["run", "--camera", f"replay:{film}/left?fps=20&loop=1", "--link", link], folder),
        host([*words, "--pairs", "20", "--save-every", "19", "--out", str(out)], folder) as live,
    ):
        assert live.wait() == 0
    return json.loads((out / "report.json").read_text()), live.out.read_text()


def test_a_budget_with_room_changes_no_bit(film: Path, tmp_path: Path) -> None:
    """A minute for each pair: the whole size is matched from the first pair to the last, and both have the bits of `stereo`."""
    report, said = _run(film, tmp_path, "60s")
    images = [str(film / side / "0.png") for side in ("left", "right")]
    same = [
        "--matcher",
        report["budget"]["chosen"]["matcher"],
    ]  # a budget takes the best one, which need not be the default
    with program(
        "phone_host.cli", ["stereo", *images, *GIVEN, *same, "--out", str(tmp_path / "files")], tmp_path, "stereo"
    ) as files:
        assert files.wait() == 0
    budget = report["budget"]
    assert (budget["budget_ms"], budget["pairs"], budget["held_pairs"], budget["changed"]) == (60_000, 20, 20, 0)
    assert budget["chosen"] == budget["best"]
    # 26 px m / 0.3 m = 87 px, in steps of 16: 96 px reach 0.271 m.
    assert (budget["best"]["scale"], budget["best"]["disparities"]) == (1.0, 96)
    assert budget["best"]["nearest_m"] == pytest.approx(26 / 96, abs=1e-6)
    expected = read_pfm(tmp_path / "files" / "disparity.pfm")
    for number in (0, 19):
        found = read_pfm(tmp_path / "live" / f"pair-{number:06d}" / "disparity.pfm")
        assert np.array_equal(found, expected, equal_nan=True)
    assert "budget: 60000 ms for each pair: " in said
    assert "--budget" not in report["trust"]["headline"]


def test_a_budget_that_nothing_holds_is_told(film: Path, tmp_path: Path) -> None:
    """To decode two images takes longer than 1 ms: pairs are matched small, none holds the budget, and the account balances."""
    report, said = _run(film, tmp_path, "1ms")
    budget = report["budget"]
    assert (budget["pairs"], budget["held_pairs"]) == (20, 0)
    assert budget["chosen"]["scale"] < 1
    assert report["depth"]["scale"] == budget["chosen"]["scale"] or budget["changes"][-1]["pair"] == 20
    assert "0% of 20 pairs held it" in said
    narrowed = budget["chosen"]["disparities"] < budget["best"]["disparities"]
    assert ("Nearest depth is now" in report["trust"]["headline"]) == narrowed
    assert sum(report["depth"]["cut"].values()) == 20 * 320 * 240
