"""Two camera_info files of ROS: what they mean, said by the documentation of CameraInfo."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from common.errors import DataError
from phone_host.output.rig_files.imported import RigKind, import_rig
from phone_host.stereo.rectify import rectify_rig
from tests.support.rig_files import (
    assert_refused,
    assert_same_rig,
    assert_side_by_side,
    exported,
    four_rig,
    two_texts,
)
from tests.support.rigs import points_seen_by_both

ROS = """width: 640
height: 480
distortion_model: plumb_bob
d: [-0.1, 0.01, 0.0, 0.0, 0.0]
k: [400.0, 0.0, 320.0, 0.0, 401.0, 240.0, 0.0, 0.0, 1.0]
r: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
p: [400.0, 0.0, 320.0, {t}, 0.0, 400.0, 240.0, 0.0, 0.0, 0.0, 1.0, 0.0]
"""


def test_ros_files_hold_a_rectification_that_ros_understands(tmp_path: Path) -> None:
    """CameraInfo's own words: a point of the rectified axes projects by P, the right P[0, 3] is -f b, and rows agree."""
    rig = four_rig()
    exported(tmp_path, rig, RigKind.ROS)
    seen = points_seen_by_both(rig, 40, seed=2)
    pixels = []
    for name, at, points in (("left", 0, seen.points_m), ("right", 1, seen.points_m)):
        lines = (tmp_path / f"{name}.yaml").read_text().splitlines()
        data = [_numbers(line) for line in lines if line.strip().startswith("data:")]
        matrix, distortion, turn, projection = (
            data[0].reshape(3, 3),
            data[1],
            data[2].reshape(3, 3),
            data[3].reshape(3, 4),
        )
        raw = (seen.left_px, seen.right_px)[at].reshape(-1, 1, 2)
        flat = cv2.undistortPointsIter(raw, matrix, distortion, turn, projection[:, :3], (3, 100, 1e-12))
        pixels.append(np.asarray(flat).reshape(-1, 2))
        rectified = points @ rectify_rig(rig).R_left.T
        homogeneous = np.column_stack([rectified, np.ones(len(points))]) @ projection.T
        np.testing.assert_allclose(homogeneous[:, :2] / homogeneous[:, 2:], pixels[-1], atol=1e-4)
        assert projection[0, 3] == pytest.approx(-projection[0, 0] * np.linalg.norm(rig.t_right_left_m) * at)
    np.testing.assert_allclose(pixels[0][:, 1], pixels[1][:, 1], atol=1e-4)


def _numbers(line: str) -> NDArray[np.float64]:
    return np.array([float(word) for word in line.partition(":")[2].strip(" []").split(",")])


def test_ros_topics_are_read_under_their_own_names(tmp_path: Path) -> None:
    """What `ros2 topic echo` prints: width, height, k, d, r, p."""
    exported(tmp_path, four_rig(), RigKind.ROS)
    names = {"image_width": "width", "image_height": "height", "camera_matrix": "k", "distortion_coefficients": "d"}
    names |= {"rectification_matrix": "r", "projection_matrix": "p"}
    for side in ("left", "right"):
        text = (tmp_path / f"{side}.yaml").read_text()
        for key, topic in names.items():
            text = text.replace(f"{key}:", f"{topic}:")
        (tmp_path / f"{side}.yaml").write_text(text)
    assert_same_rig(import_rig((tmp_path,)).rig, four_rig())


def test_the_text_is_sound_until_one_thing_is_wrong(tmp_path: Path) -> None:
    """The right camera stands 0.12 m right of the left one: P[0, 3] is -f b."""
    assert_side_by_side(tmp_path, two_texts(ROS, t="-48.0"))


def test_ros_halves_of_two_calibrations_are_refused(tmp_path: Path) -> None:
    """Rectified cameras share focal length and rows; a camera calibrated alone has no baseline."""
    folder = exported(tmp_path, four_rig(), RigKind.ROS)
    right = (folder / "right.yaml").read_text()
    with pytest.raises(DataError, match="has no baseline"):
        import_rig((folder / "left.yaml", folder / "left.yaml"))
    coarse = replace(four_rig().left, matrix=np.array([[500.0, 0, 320], [0, 500, 240], [0, 0, 1]]))
    other = exported(tmp_path / "other", replace(four_rig(), left=coarse), RigKind.ROS)
    with pytest.raises(DataError, match=r"right.yaml: projection_matrix has another fx"):
        import_rig((other / "left.yaml", folder / "right.yaml"))
    (folder / "right.yaml").write_text(right.replace("plumb_bob", "thin_prism"))
    with pytest.raises(DataError, match=r"distortion_model is 'thin_prism': read are plumb_bob, rational_polynomial"):
        import_rig((folder,))


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("k: [400.0, 0.0,", "k: [400.0, 0.5,", "k is no camera matrix"),
        ("p: [400.0, 0.0,", "p: [400.0, 0.5,", "p is no projection"),
        ("p: [400.0,", "p: [0.0,", "p is no projection"),
        ("0.0, 0.0, 1.0, 0.0]\n", "0.0, 0.0, 1.0, 0.5]\n", "p is no projection"),
    ],
)
def test_a_bad_camera_info_is_refused(old: str, new: str, said: str, tmp_path: Path) -> None:
    """Skew, no focal length and another last row than 0 0 1 0 are no matrices of a camera."""
    assert ROS.count(old) == 1
    assert_refused(tmp_path, two_texts(ROS.replace(old, new), t="-48.0"), f"a.yaml: {said}", "it must be fx 0 cx")
