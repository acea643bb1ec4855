"""COLMAP's cameras.txt with images.txt, with COLMAP as the oracle."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from common.errors import DataError
from phone_host.model import Rig
from phone_host.output.rig_files.imported import RigKind, export_texts, import_rig
from phone_host.stereo.rectify import rectify_rig
from tests.support.rig_files import (
    assert_refused,
    assert_side_by_side,
    exported,
    four_rig,
    rational_rig,
)
from tests.support.rigs import points_seen_by_both, unlike_rig

CAMERAS = "1 PINHOLE 640 480 400 401 320.5 240.5\n2 PINHOLE 640 480 500 502 330.5 250.5\n"
IMAGES = "1 1 0 0 0 0 0 0 1 left.png\n\n2 1 0 0 0 -0.12 0 0 2 right.png\n\n"


@pytest.fixture
def colmap_folder(tmp_path: Path) -> Path:
    """An ETH3D-like model: two PINHOLE cameras, metres, points behind each image."""
    (tmp_path / "cameras.txt").write_text(
        "# a comment\n3 PINHOLE 940 490 540.5 541.5 470.5 245.5\n7 SIMPLE_RADIAL 940 490 540 470 245 -0.1\n"
    )
    (tmp_path / "images.txt").write_text(
        "# a comment\n2 1 0 0 0 -0.06 0 0 7 im1.png\n\n1 1 0 0 0 0 0 0 3 im0 left.png\n10.5 20.5 -1 3 4 7\n"
    )
    return tmp_path


def test_colmaps_first_pixel_has_its_centre_at_a_half(colmap_folder: Path) -> None:
    """Principal points are half a pixel less than in the file; images come in the order of their ids."""
    rig = import_rig((colmap_folder / "images.txt", colmap_folder / "cameras.txt")).rig
    assert rig.left.matrix.tolist() == [[540.5, 0, 470], [0, 541.5, 245], [0, 0, 1]]
    assert rig.right.matrix.tolist() == [[540, 0, 469.5], [0, 540, 244.5], [0, 0, 1]]
    assert rig.right.distortion.tolist() == [-0.1, 0, 0, 0]
    np.testing.assert_allclose(rig.t_right_left_m, [-0.06, 0, 0])


@pytest.mark.parametrize("rig", [four_rig(), rational_rig()], ids=["four", "rational"])
def test_colmap_sees_the_same_pixels(rig: Rig, tmp_path: Path) -> None:
    """COLMAP reads the exported model and projects points to the pixels of cv2.projectPoints, half a pixel further."""
    pycolmap: Any = pytest.importorskip("pycolmap", reason="pycolmap has no wheel for this machine")
    exported(tmp_path, rig, RigKind.COLMAP)
    model = pycolmap.Reconstruction()
    model.read_text(str(tmp_path))
    seen = points_seen_by_both(rig, 40, seed=3)
    for id_, pixels in ((1, seen.left_px), (2, seen.right_px)):
        image = model.images[id_]
        pose = image.cam_from_world() if callable(image.cam_from_world) else image.cam_from_world
        theirs = model.cameras[image.camera_id].img_from_cam(pose * seen.points_m)
        np.testing.assert_allclose(np.asarray(theirs), pixels + 0.5, atol=1e-6)


def test_the_text_is_sound_until_one_thing_is_wrong(tmp_path: Path) -> None:
    """The right camera stands 0.12 m right of the left one."""
    assert_side_by_side(tmp_path, {"cameras.txt": CAMERAS, "images.txt": IMAGES})


@pytest.mark.parametrize(
    ("file", "old", "new", "said"),
    [
        ("images.txt", "1 1 0 0 0 0 0 0 3", "1 2 0 0 0 0 0 0 3", "image 1 has a quaternion of length 2"),
        ("images.txt", "0 0 3 im0", "0 0 4 im0", "image 1 is of camera 4"),
        ("images.txt", "2 1 0 0 0 -0.06 0 0 7 im1.png\n\n", "", "has 1 image"),
        ("cameras.txt", "PINHOLE 940", "FOV 940", "camera 3 is a FOV"),
        ("cameras.txt", "541.5 ", "", "camera 3 has 3 values"),
        ("cameras.txt", "7 SIMPLE", "3 SIMPLE", "camera 3 is there twice"),
    ],
)
def test_a_bad_colmap_model_is_refused(colmap_folder: Path, file: str, old: str, new: str, said: str) -> None:
    """One line that names the file and the id."""
    path = colmap_folder / file
    path.write_text(path.read_text().replace(old, new, 1))
    with pytest.raises(DataError, match=said):
        import_rig((colmap_folder,))


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
    assert_refused(tmp_path, texts, said, remedy)


def test_colmap_has_no_lens_of_twelve_coefficients() -> None:
    """COLMAP's largest model has eight: thin prism coefficients are refused, and what could hold them is named."""
    rig = unlike_rig()
    rig = replace(rig, right=replace(rig.right, distortion=np.array([0.1] * 8 + [0.001] * 4)))
    with pytest.raises(DataError) as caught:
        export_texts(rig, rectify_rig(rig), RigKind.COLMAP, 64)
    assert caught.value.problem == "colmap cannot hold the right camera of the rig: a rational lens of 12 coefficients"
    assert caught.value.remedy == "export it as opencv or ros"
