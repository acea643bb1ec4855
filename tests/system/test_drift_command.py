"""A real run whose right camera is turned halfway: told, corrected, saved beside the report, and used by the next commands."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from phone_host.model import CameraModel, Departure, Rig
from phone_host.output.overlay_yaml import read_overlay
from phone_host.output.rig_yaml import read_rig, write_rig
from phone_host.scene.scene import demo_scene
from phone_host.scene.scene_model import rig_poses
from phone_host.scene.scene_render import render
from phone_host.stereo.rectifier import corrected_rig
from phone_host.stereo.rectify import rectify_rig
from tests.support.programs import board, host, program

TURNED = Departure(turn_rad=(0.007, 0.0, -0.006))
"""0.4 degrees of pitch, 0.34 of roll: 2.9 px at 320x240."""

BEFORE, IMAGES = 20, 60


@pytest.fixture(scope="module")
def film(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with rig.yaml and two folders of stills; from the 20th on the right camera is turned."""
    matrix = np.array([[260.0, 0, 159.5], [0, 260.0, 119.5], [0, 0, 1]])
    model = CameraModel(width_px=320, height_px=240, matrix=matrix, distortion=np.zeros(5))
    rig = Rig(left=model, right=model, R_right_left=np.eye(3), t_right_left_m=np.array([-0.1, 0, 0]))
    folder, stands = tmp_path_factory.mktemp("film"), corrected_rig(rig, TURNED)
    write_rig(folder / "rig.yaml", rig, rectify_rig(rig))
    left, right = (render(demo_scene(), model, pose) for pose in rig_poses(rig))
    turned = render(demo_scene(), model, rig_poses(stands)[1])
    for name, images in (("left", [left] * IMAGES), ("right", [right] * BEFORE + [turned] * (IMAGES - BEFORE))):
        (folder / name).mkdir()
        for number, image in enumerate(images):
            cv2.imwrite(str(folder / name / f"{number:02d}.png"), image, [cv2.IMWRITE_PNG_COMPRESSION, 1])
    return folder


def test_a_rig_that_turns_is_told_corrected_and_remembered(film: Path, tmp_path: Path) -> None:
    """The log, the summary and report.json name the knock; overlay.yaml holds the turn; `stereo --overlay` finds level rows with it."""
    link, out, rig = f"ipc://{tmp_path}/link", tmp_path / "out", film / "rig.yaml"
    run = ["run", "--link", link, "--camera", f"replay:{film}/right", "--calibration", str(rig), "--save-every", "0"]
    with (
        board(["run", "--camera", f"replay:{film}/left", "--link", link], tmp_path),
        host([*run, "--out", str(out)], tmp_path) as running,
    ):
        assert running.wait() == 0, running.stderr
    drift = json.loads((out / "report.json").read_text())["drift"]
    assert drift["state"] == "corrected"
    assert [change["what"] for change in drift["changes"]][:2] == ["knocked", "corrected"]
    assert drift["vertical_error_px"] > 1.5
    assert drift["vertical_error_left_px"] < 0.3
    assert "rig_knocked" in running.stderr
    assert "drift_corrected" in running.stderr
    assert "the cameras turned by 0.5" in running.out.read_text()
    used = read_overlay(out / "overlay.yaml", read_rig(rig))
    assert used.turn_rad == pytest.approx(TURNED.turn_rad, abs=1e-3)
    files = [str(film / "left" / "59.png"), str(film / "right" / "59.png"), "--calibration", str(rig)]
    given = [*files, "--overlay", str(out / "overlay.yaml"), "--out", str(tmp_path / "mended")]
    with program("phone_host.cli", ["stereo", *given], tmp_path, "stereo") as done:
        assert done.wait() == 0, done.stderr
    trust = json.loads((tmp_path / "mended" / "report.json").read_text())["trust"]
    assert trust["vertical_error_px"] < 0.3
