"""Calibrations of other programs with one thing wrong in each, and rarer ways to write a sound one."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from common.errors import DataError
from phone_host.output.rig_files.imported import RigKind, export_texts, import_rig
from phone_host.output.rig_files.opencv import merged
from phone_host.output.rig_files.tree import Node
from phone_host.stereo.rectify import rectify_rig
from tests.support.rigs import unlike_rig

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
KALIBR = """cam0:
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
EUROC = """T_BS: [1, 0, 0, {x}, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]
resolution: [752, 480]
camera_model: pinhole
intrinsics: [450.0, 451.0, 370.0, 250.0]
distortion_model: radtan
distortion_coefficients: [-0.28, 0.07, 0.0002, 1.8e-05]
"""
ROS = """width: 640
height: 480
distortion_model: plumb_bob
d: [-0.1, 0.01, 0.0, 0.0, 0.0]
k: [400.0, 0.0, 320.0, 0.0, 401.0, 240.0, 0.0, 0.0, 1.0]
r: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
p: [400.0, 0.0, 320.0, {t}, 0.0, 400.0, 240.0, 0.0, 0.0, 0.0, 1.0, 0.0]
"""
CAMERAS = "1 PINHOLE 640 480 400 401 320.5 240.5\n2 PINHOLE 640 480 500 502 330.5 250.5\n"
IMAGES = "1 1 0 0 0 0 0 0 1 left.png\n\n2 1 0 0 0 -0.12 0 0 2 right.png\n\n"


def _written(folder: Path, texts: dict[str, str]) -> tuple[Path, ...]:
    paths = tuple(folder / name for name in texts)
    for path, text in zip(paths, texts.values(), strict=True):
        path.write_text(text)
    return paths


def _two(text: str, **of_right: str) -> dict[str, str]:
    """Both cameras' files; the right one has other numbers where the text has a name."""
    left = dict.fromkeys(of_right, "0.0")
    return {"a.yaml": text.format(**left), "b.yaml": text.format(**of_right)}


def _assert_refused(folder: Path, texts: dict[str, str], said: str, remedy: str) -> None:
    with pytest.raises(DataError) as caught:
        import_rig(_written(folder, texts))
    assert caught.value.problem.removeprefix(f"{folder}/") == said
    assert remedy in caught.value.remedy


@pytest.mark.parametrize(
    "texts",
    [
        {"stereo.yml": OPENCV},
        {"camchain.yaml": KALIBR},
        {"cameras.txt": CAMERAS, "images.txt": IMAGES},
        _two(EUROC, x="0.12"),
        _two(ROS, t="-48.0"),
    ],
    ids=["opencv", "kalibr", "colmap", "euroc", "ros"],
)
def test_the_texts_are_sound_until_one_thing_is_wrong(texts: dict[str, str], tmp_path: Path) -> None:
    """The right camera stands 0.12 m right of the left one, whether matrices are maps, lists of rows or plain lists."""
    rig = import_rig(_written(tmp_path, texts)).rig
    np.testing.assert_allclose(rig.t_right_left_m, [-0.12, 0, 0], atol=1e-12)
    np.testing.assert_allclose(rig.R_right_left, np.eye(3), atol=1e-12)


def test_one_size_for_both_cameras_is_read_from_opencvs_list(tmp_path: Path) -> None:
    """`imageSize: [640, 480]` is the width and height of both images, and M1 in one list is read row by row."""
    rig = import_rig(_written(tmp_path, {"stereo.yml": OPENCV})).rig
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
    _assert_refused(tmp_path, {"stereo.yml": OPENCV.replace(old, new, 1)}, f"stereo.yml: {said}", remedy)


def test_a_file_without_keys_adds_none_to_the_other() -> None:
    """A file that is a list has no key of a calibration: the keys of both are those of the other."""
    whole = merged((Node("a.yml", "", ["1"]), Node("b.yml", "", {"M1": "2"})))
    assert whole == Node("a.yml and b.yml", "", {"M1": "2"})


@pytest.mark.parametrize(
    ("old", "new", "said", "remedy"),
    [
        ("[0.0]", "[0.1]", "cam0.distortion_coeffs bends rays", "but cam0.distortion_model is none"),
        ("camera_model: pinhole", "camera_model: [pinhole]", "cam0.camera_model is no word", "write one word"),
    ],
)
def test_a_bad_camchain_is_refused(old: str, new: str, said: str, remedy: str, tmp_path: Path) -> None:
    """Coefficients of a lens that is said to have none, and a list where a word belongs."""
    _assert_refused(tmp_path, {"camchain.yaml": KALIBR.replace(old, new, 1)}, f"camchain.yaml: {said}", remedy)


def test_a_camera_of_euroc_that_is_no_pinhole_is_refused(tmp_path: Path) -> None:
    """The model's word is told, with the one that is read."""
    texts = _two(EUROC.replace("pinhole", "omni"), x="0.12")
    _assert_refused(tmp_path, texts, "a.yaml: camera_model is 'omni'", "read is pinhole")


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
    _assert_refused(tmp_path, _two(ROS.replace(old, new), t="-48.0"), f"a.yaml: {said}", "it must be fx 0 cx")


@pytest.mark.parametrize(
    ("old", "new", "said", "remedy"),
    [
        # The first line alone tells the kind of file, so what is wrong stands further down.
        (" 480 500 502 330.5 250.5", "", "cameras.txt: camera 2 is no camera", "CAMERA_ID MODEL WIDTH HEIGHT PARAMS"),
        (" 2 right.png", "", "images.txt: image 2 is no image", "IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME"),
        ("2 1 0", "two 1 0", "images.txt: image two is no image", "IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME"),
    ],
)
def test_a_bad_line_of_colmaps_is_refused(old: str, new: str, said: str, remedy: str, tmp_path: Path) -> None:
    """A line that ends early or has a word for an id is told with what belongs there."""
    texts = {name: text.replace(old, new) for name, text in (("cameras.txt", CAMERAS), ("images.txt", IMAGES))}
    _assert_refused(tmp_path, texts, said, remedy)


def test_colmap_has_no_lens_of_twelve_coefficients() -> None:
    """COLMAP's largest model has eight: thin prism coefficients are refused, and what could hold them is named."""
    rig = unlike_rig()
    rig = replace(rig, right=replace(rig.right, distortion=np.array([0.1] * 8 + [0.001] * 4)))
    with pytest.raises(DataError) as caught:
        export_texts(rig, rectify_rig(rig), RigKind.COLMAP, 64)
    assert caught.value.problem == "colmap cannot hold the right camera of the rig: a rational lens of 12 coefficients"
    assert caught.value.remedy == "export it as opencv or ros"
