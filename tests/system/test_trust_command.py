"""Swapped images are told by `stereo` and by a run over a link: exit 4, the doubt's name, the remedy. Good ones end with 0."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from phone_host.model import CameraModel, Rig
from phone_host.scene.scene import demo_scene
from phone_host.scene.scene_model import rig_poses
from phone_host.scene.scene_render import render
from tests.support.programs import board, host, program


@pytest.fixture(scope="module")
def pair(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Two folders with one rendered image each, a rectified pair of 320x240."""
    matrix = np.array([[260.0, 0, 159.5], [0, 260.0, 119.5], [0, 0, 1]])
    model = CameraModel(width_px=320, height_px=240, matrix=matrix, distortion=np.zeros(5))
    rig = Rig(left=model, right=model, R_right_left=np.eye(3), t_right_left_m=np.array([-0.1, 0, 0]))
    root = tmp_path_factory.mktemp("pair")
    for name, pose in zip(("left", "right"), rig_poses(rig), strict=True):
        (root / name).mkdir()
        cv2.imwrite(str(root / name / "0.png"), render(demo_scene(), model, pose))
    return root / "left", root / "right"


@pytest.mark.parametrize(("is_swapped", "code"), [(False, 0), (True, 4)])
def test_a_run_and_stereo_tell_swapped_images(
    pair: tuple[Path, Path], tmp_path: Path, *, is_swapped: bool, code: int
) -> None:
    """Both end with 4 if left and right are exchanged, and name it in headline and report.json; with 0 if not."""
    left, right = reversed(pair) if is_swapped else pair
    link, given = f"ipc://{tmp_path}/link", ["--rectified", "--disparities", "48"]
    stereo = ["stereo", str(left / "0.png"), str(right / "0.png"), *given, "--out", str(tmp_path / "files")]
    run = ["run", "--link", link, "--camera", f"replay:{right}?fps=10&loop=1", *given, "--pairs", "12"]
    with (
        program("phone_host.cli", stereo, tmp_path, "stereo") as from_files,
        board(["run", "--camera", f"replay:{left}?fps=10&loop=1", "--link", link], tmp_path),
        host([*run, "--out", str(tmp_path / "live")], tmp_path) as live,
    ):
        assert (live.wait(), from_files.wait()) == (code, code)
    named = ["swapped"] if is_swapped else []
    for folder, done in (("live", live), ("files", from_files)):
        report = json.loads((tmp_path / folder / "report.json").read_text())
        trust, said = report["trust"], done.out.read_text()
        assert [doubt["doubt"] for doubt in trust["doubts"] if doubt["blocking"]] == named
        assert said.startswith(trust["headline"])
        assert said.startswith("Depth is wrong" if is_swapped else "Depth looks right")
        assert ("left and right are exchanged" in said) == is_swapped
    assert (tmp_path / "files" / "disparity.pfm").exists()
    assert ("depth_doubtful doubt=swapped" in live.stderr) == is_swapped
