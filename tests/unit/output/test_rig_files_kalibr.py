"""Kalibr's camchain: what it means, said by its wiki."""

from pathlib import Path

import numpy as np
import pytest

from common.errors import DataError
from phone_host.output.rig_files.imported import Imported, import_rig
from tests.support.rig_files import assert_refused, assert_side_by_side

# As the Kalibr wiki shows it, with numbers of our own: the right camera 0.12 m at +x of cam0, turned by 90 degrees about z.
KALIBR = """cam0:
  cam_overlaps: [1]
  camera_model: pinhole
  distortion_coeffs: [-0.1, 0.01, 0.0, 0.0]
  distortion_model: radtan
  intrinsics: [400.0, 401.0, 320.0, 240.0]
  resolution: [640, 480]
  rostopic: /cam0/image_raw
cam1:
  T_cn_cnm1:
  - [0.0, -1.0, 0.0, 0.0]
  - [1.0, 0.0, 0.0, -0.12]
  - [0.0, 0.0, 1.0, 0.0]
  - [0.0, 0.0, 0.0, 1.0]
  cam_overlaps: [0]
  camera_model: pinhole
  distortion_coeffs: [0.2, -0.3, 0.001, 0.002]
  distortion_model: radtan
  intrinsics: [500.0, 502.0, 330.0, 250.0]
  resolution: [640, 480]
  rostopic: /cam1/image_raw
"""
SHORT = """cam0:
  camera_model: pinhole
  distortion_coeffs: [0.0]
  distortion_model: none
  intrinsics: [400.0, 401.0, 320.0, 240.0]
  resolution: [640, 480]
cam1:
  T_cn_cnm1: [[1.0, 0.0, 0.0, -0.12], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]]
  camera_model: pinhole
  distortion_model: radtan
  distortion_coeffs: [0.2, -0.3, 0.001, 0.002]
  intrinsics: [500.0, 502.0, 330.0, 250.0]
  resolution: [640, 480]
"""


def _kalibr(tmp_path: Path, text: str = KALIBR) -> Imported:
    path = tmp_path / "camchain.yaml"
    path.write_text(text)
    return import_rig((path,))


def test_kalibrs_pose_takes_points_of_cam0_to_cam1(tmp_path: Path) -> None:
    """T_cn_cnm1 of the wiki: p1 = T p0, so (0.12, 0, 1) of cam0 is (0, 0, 1) of cam1."""
    rig = _kalibr(tmp_path).rig
    point = rig.R_right_left @ np.array([0.12, 0.0, 1.0]) + rig.t_right_left_m
    np.testing.assert_allclose(point, [0, 0, 1], atol=1e-12)
    assert rig.left.matrix.tolist() == [[400, 0, 320], [0, 401, 240], [0, 0, 1]]
    assert rig.right.distortion.tolist() == [0.2, -0.3, 0.001, 0.002]


def test_cameras_without_sides_are_exchanged_and_it_is_said(tmp_path: Path) -> None:
    """cam1 at -x of cam0 becomes the left camera; with a third camera a note says which two are taken."""
    pose = KALIBR.replace("- [0.0, -1.0, 0.0, 0.0]", "- [1, 0, 0, 0.12]").replace(
        "- [1.0, 0.0, 0.0, -0.12]", "- [0, 1, 0, 0]"
    )
    found = _kalibr(tmp_path, pose + "cam2:\n  camera_model: omni\n")
    assert found.rig.left.matrix[0, 0] == 500
    np.testing.assert_allclose(found.rig.t_right_left_m, [-0.12, 0, 0])
    assert len(found.notes) == 2
    assert "cam1 is the left one" in found.notes[1]


def test_millimetres_are_told_by_the_unit(tmp_path: Path) -> None:
    """The same chain in mm is 0.12 m with --unit 1mm."""
    path = tmp_path / "camchain.yaml"
    path.write_text(KALIBR.replace("-0.12", "-120"))
    assert np.linalg.norm(import_rig((path,), 0.001).rig.t_right_left_m) == pytest.approx(0.12)


def test_the_text_is_sound_until_one_thing_is_wrong(tmp_path: Path) -> None:
    """The right camera stands 0.12 m right of the left one, with a lens that bends nothing and a pose in one line."""
    assert_side_by_side(tmp_path, {"camchain.yaml": SHORT})


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("camera_model: pinhole", "camera_model: omni", "cam0.camera_model is 'omni'"),
        ("distortion_model: radtan", "distortion_model: fov", "cam0.distortion_model is 'fov'"),
        ("[-0.1, 0.01, 0.0, 0.0]", "[-0.1, 0.01]", "cam0.distortion_coeffs has 2 values"),
        ("[400.0, 401.0, 320.0, 240.0]", "[nan, 401.0, 320.0, 240.0]", "cam0.intrinsics holds 'nan'"),
        ("[400.0, 401.0, 320.0, 240.0]", "[400.0, 401.0, 320.0]", "cam0.intrinsics has 3 values"),
        ("[400.0, 401.0, 320.0, 240.0]", "[0.4, 401.0, 320.0, 240.0]", "cam0 has a focal length of 0.4 px"),
        ("[400.0, 401.0, 320.0, 240.0]", "[400.0, 401.0, 3200.0, 240.0]", "cam0 has its principal point at 3200"),
        ("[640, 480]", "[640.5, 480]", "cam0.resolution holds 640.5"),
        ("  resolution: [640, 480]\n", "", "cam0.resolution is missing"),
        ("- [1.0, 0.0, 0.0, -0.12]", "- [0.9, 0.0, 0.0, -0.12]", "cam1.T_cn_cnm1 holds no rotation"),
        ("- [1.0, 0.0, 0.0, -0.12]", "- [-1.0, 0.0, 0.0, -0.12]", "cam1.T_cn_cnm1 holds no rotation"),
        ("- [1.0, 0.0, 0.0, -0.12]", "- [1.0, 0.0, 0.0, -120]", "cam1.T_cn_cnm1 puts the cameras 120 m apart"),
        ("- [1.0, 0.0, 0.0, -0.12]", "- [1.0, 0.0, 0.0, 0]", "cam1.T_cn_cnm1 puts the cameras 0 m apart"),
        ("  - [0.0, 0.0, 0.0, 1.0]\n", "", "cam1.T_cn_cnm1 has 3 rows"),
        ("- [0.0, 0.0, 0.0, 1.0]", "- [0.0, 0.0, 0.0, 2.0]", "cam1.T_cn_cnm1 has another last row"),
        ("cam1:", "camera1:", "cam1 is missing"),
        ("cam0:", "camera0:", "is no calibration"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused_with_file_and_key(old: str, new: str, said: str, tmp_path: Path) -> None:
    """Each value is checked: one line that names camchain.yaml and the key."""
    with pytest.raises(DataError) as caught:
        _kalibr(tmp_path, KALIBR.replace(old, new, 1))
    assert said in caught.value.problem
    assert "camchain.yaml" in caught.value.problem
    assert caught.value.remedy


@pytest.mark.parametrize(
    ("old", "new", "said", "remedy"),
    [
        ("[0.0]", "[0.1]", "cam0.distortion_coeffs bends rays", "but cam0.distortion_model is none"),
        ("camera_model: pinhole", "camera_model: [pinhole]", "cam0.camera_model is no word", "write one word"),
    ],
)
def test_a_bad_camchain_is_refused(old: str, new: str, said: str, remedy: str, tmp_path: Path) -> None:
    """Coefficients of a lens that is said to have none, and a list where a word belongs."""
    assert_refused(tmp_path, {"camchain.yaml": SHORT.replace(old, new, 1)}, f"camchain.yaml: {said}", remedy)
