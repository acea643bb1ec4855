"""OpenCV's YAML and XML files, with OpenCV as the oracle."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from common.errors import DataError
from phone_host.output.rig_files.imported import RigKind, export_texts, import_rig
from phone_host.output.rig_files.opencv import merged
from phone_host.output.rig_files.tree import Node
from phone_host.stereo.rectify import rectify_rig
from tests.support.rig_files import (
    assert_refused,
    assert_same_rig,
    assert_side_by_side,
    exported,
    fisheye_rig,
    four_rig,
    rational_rig,
    written,
)

OPENCV = """%YAML:1.0
---
imageSize: [640, 480]
M1: [400., 0., 320., 0., 401., 240., 0., 0., 1.]
D1: [-0.1, 0.01, 0., 0.]
M2: [[500., 0., 330.], [0., 502., 250.], [0., 0., 1.]]
D2: [0.2, -0.3, 0.001, 0.002]
R: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [1., 0., 0., 0., 1., 0., 0., 0., 1.]
T: [-0.12, 0., 0.]
"""


@pytest.mark.parametrize("name", ["stereo.yml", "stereo.xml"])
def test_opencv_reads_what_is_exported_for_it(name: str, tmp_path: Path) -> None:
    """cv2.FileStorage gives the matrices, and its rectification maps built from them lead to the same pixels as ours."""
    rig, kind = rational_rig(), RigKind.OPENCV if name.endswith("yml") else RigKind.OPENCV_XML
    made = rectify_rig(rig)
    storage = cv2.FileStorage(str(exported(tmp_path, rig, kind) / name), cv2.FILE_STORAGE_READ)
    keys = {key: storage.getNode(key).mat() for key in ("M1", "D1", "M2", "D2", "R", "T", "R1", "R2", "P1", "P2", "Q")}
    np.testing.assert_array_equal(keys["R"], rig.R_right_left)
    assert storage.getNode("right_image_width").real() == rig.right.width_px
    for n, model, turn in (("1", rig.left, made.R_left), ("2", rig.right, made.R_right)):
        size = (made.width_px, made.height_px)
        theirs = cv2.initUndistortRectifyMap(
            keys[f"M{n}"], keys[f"D{n}"], keys[f"R{n}"], keys[f"P{n}"], size, cv2.CV_32FC1
        )
        ours = cv2.initUndistortRectifyMap(model.matrix, model.distortion, turn, made.P_left, size, cv2.CV_32FC1)
        np.testing.assert_allclose(theirs[0], ours[0], atol=1e-3)
        np.testing.assert_allclose(theirs[1], ours[1], atol=1e-3)


@pytest.mark.parametrize("name", ["a.yml", "a.xml"])
def test_what_opencv_writes_is_read(name: str, tmp_path: Path) -> None:
    """A file written by cv2.FileStorage with the keys of OpenCV's sample, which states no size and counts T in squares."""
    rig = four_rig()
    storage = cv2.FileStorage(str(tmp_path / name), cv2.FILE_STORAGE_WRITE)
    for key, matrix in {
        "M1": rig.left.matrix, "D1": rig.left.distortion.reshape(1, -1), "M2": rig.right.matrix,
        "D2": rig.right.distortion.reshape(-1, 1), "R": rig.R_right_left, "T": rig.t_right_left_m.reshape(3, 1) / 0.025,
    }.items():  # fmt: skip
        storage.write(key, matrix)
    storage.release()
    path = (tmp_path / name,)
    with pytest.raises(DataError, match=r"M1 does not state the images' size: add --size"):
        import_rig(path, 0.025)
    assert_same_rig(import_rig(path, 0.025, ((640, 480), (1280, 720))).rig, rig, atol=1e-9)


def test_two_files_of_opencvs_sample_are_one_calibration(tmp_path: Path) -> None:
    """intrinsics.yml and extrinsics.yml, in any order; a file with another M1 is refused."""
    whole = (exported(tmp_path, four_rig(), RigKind.OPENCV) / "stereo.yml").read_text()
    head, _, pose = whole.partition("R: ")
    (tmp_path / "intrinsics.yml").write_text(head)
    (tmp_path / "extrinsics.yml").write_text(f"%YAML:1.0\n---\nR: {pose}")
    paths = tmp_path / "extrinsics.yml", tmp_path / "intrinsics.yml"
    assert_same_rig(import_rig(paths).rig, four_rig())
    (tmp_path / "stereo.yml").write_text(whole.replace("525.0", "526.0"))
    with pytest.raises(DataError, match="has another M1 than"):
        import_rig((paths[1], tmp_path / "stereo.yml"))


def test_one_fisheye_lens_of_two_is_refused_where_one_word_stands_for_both() -> None:
    """OpenCV's file says fisheye_model for the whole rig."""
    rig = replace(fisheye_rig(), right=four_rig().right)
    with pytest.raises(DataError, match="opencv cannot hold a rig with one fisheye lens"):
        export_texts(rig, rectify_rig(rig), RigKind.OPENCV, 64)


def test_the_text_is_sound_until_one_thing_is_wrong(tmp_path: Path) -> None:
    """The right camera stands 0.12 m right of the left one, whether matrices are maps, lists of rows or plain lists."""
    assert_side_by_side(tmp_path, {"stereo.yml": OPENCV})


def test_one_size_for_both_cameras_is_read_from_opencvs_list(tmp_path: Path) -> None:
    """`imageSize: [640, 480]` is the width and height of both images, and M1 in one list is read row by row."""
    rig = import_rig(written(tmp_path, {"stereo.yml": OPENCV})).rig
    assert [(each.width_px, each.height_px) for each in (rig.left, rig.right)] == [(640, 480)] * 2
    assert rig.left.matrix.tolist() == [[400, 0, 320], [0, 401, 240], [0, 0, 1]]


@pytest.mark.parametrize(
    ("old", "new", "said", "remedy"),
    [
        ("[400., 0., 320.", "[400., 2., 320.", "M1 is no camera matrix", "fx 0 cx 0 fy cy 0 0 1"),
        ("[0., 0., 1.]]", "[0., 0., 2.]]", "M2 is no camera matrix", "fx 0 cx 0 fy cy 0 0 1"),
        ("[-0.1, 0.01, 0., 0.]", "[-0.1, 0.01]", "D1 has 2 values", "4, 5, 8, 12, 14"),
        ("rows: 3", "rows: 4", "R is 4x3", "it must be 3x3"),
        ("[-0.1, 0.01, 0., 0.]", "[-0.1, [0.01], 0., 0.]", "D1 is no list of numbers", "[1.0, 2.0]"),
    ],
)
def test_a_bad_opencv_file_is_refused(old: str, new: str, said: str, remedy: str, tmp_path: Path) -> None:
    """A skewed matrix, too few coefficients, another shape and a list in a list are told with the key and what it must be."""
    assert_refused(tmp_path, {"stereo.yml": OPENCV.replace(old, new, 1)}, f"stereo.yml: {said}", remedy)


def test_a_file_without_keys_adds_none_to_the_other() -> None:
    """A file that is a list has no key of a calibration: the keys of both are those of the other."""
    whole = merged((Node("a.yml", "", ["1"]), Node("b.yml", "", {"M1": "2"})))
    assert whole == Node("a.yml and b.yml", "", {"M1": "2"})
