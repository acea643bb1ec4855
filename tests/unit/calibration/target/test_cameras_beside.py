"""cameras.json beside the images of a calibration: it is found, checked against the images, and goes into the rig."""

from dataclasses import replace
from pathlib import Path

import pytest

from common.camera_identity import CameraIdentity, RememberedCamera
from common.errors import DataError, SettingsError
from common.orientation import UPRIGHT, Orientation
from phone_host.calibration.target.cameras_beside import cameras_beside, with_cameras
from phone_host.output.cameras_json import cameras_text
from phone_host.stereo.view_files import pair_files
from tests.support.pictures import encoded, picture
from tests.support.rigs import unlike_rig

_LEFT = RememberedCamera(CameraIdentity("uvcvideo", "Left", "1"), 24, 32, Orientation(90), (("focus", 20),))
_RIGHT = RememberedCamera(CameraIdentity("uvcvideo", "Right", "2"), 32, 24)
_AS_GIVEN = (UPRIGHT, UPRIGHT)


def _images(folder: Path, names: tuple[str, ...]) -> None:
    for name in names:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(encoded(".png", picture(32, 24)))


@pytest.mark.parametrize(
    ("names", "left", "right", "where"),
    [
        (("left/1.png", "right/1.png"), "left", "right", "."),
        (("left/1.png", "right/1.png"), "left", "right", "right"),
        (("pair-0/left.png", "pair-0/right.png", "pair-1/left.png", "pair-1/right.png"), "pair-*/left.png", "pair-*/right.png", "."),
        (("left1.png", "right1.png"), "left*.png", "right*.png", "."),
    ],
)  # fmt: skip
def test_it_is_found_beside_the_images(
    tmp_path: Path, names: tuple[str, ...], left: str, right: str, where: str
) -> None:
    """In the folder of one side, or in the one that holds both, as a run leaves it above its pairs."""
    _images(tmp_path, names)
    (tmp_path / where / "cameras.json").write_text(cameras_text(_LEFT, _RIGHT))
    found = cameras_beside(pair_files(str(tmp_path / left), str(tmp_path / right)), _AS_GIVEN)
    assert found is not None
    assert found[1] == (_LEFT, _RIGHT)
    rig = with_cameras(unlike_rig(), found[1], _AS_GIVEN)
    assert (rig.left_camera, rig.right_camera) == (_LEFT, _RIGHT)


def test_without_one_a_rig_states_how_the_user_says_its_cameras_are_mounted(tmp_path: Path) -> None:
    """A camera on its side has images of 480x640 px; nothing is said about the other one."""
    _images(tmp_path, ("left/1.png", "right/1.png"))
    mounted = Orientation(90), UPRIGHT
    assert cameras_beside(pair_files(str(tmp_path / "left"), str(tmp_path / "right")), mounted) is None
    rig = with_cameras(unlike_rig(), None, mounted)
    assert rig.left_camera == RememberedCamera(CameraIdentity(), 480, 640, Orientation(90))
    assert rig.right_camera is None


def test_images_of_another_size_are_refused(tmp_path: Path) -> None:
    """The file, the side and both sizes are named."""
    _images(tmp_path, ("left/1.png", "right/1.png"))
    (tmp_path / "cameras.json").write_text(cameras_text(_LEFT, replace(_RIGHT, width_px=640, height_px=480)))
    files = pair_files(str(tmp_path / "left"), str(tmp_path / "right"))
    with pytest.raises(
        DataError, match=r"cameras.json: the right camera gives images of 640x480 px, these are 32x24 px"
    ):
        cameras_beside(files, _AS_GIVEN)


def test_images_that_are_upright_already_are_not_turned_again(tmp_path: Path) -> None:
    """A run saves images upright, so --rotate-left would turn them a second time: refused with the remedy."""
    _images(tmp_path, ("left/1.png", "right/1.png"))
    (tmp_path / "cameras.json").write_text(cameras_text(_LEFT, _RIGHT))
    files = pair_files(str(tmp_path / "left"), str(tmp_path / "right"))
    with pytest.raises(SettingsError, match=r"saved upright.*leave out --rotate-left"):
        cameras_beside(files, (Orientation(90), UPRIGHT))


def test_two_files_that_differ_are_refused(tmp_path: Path) -> None:
    """Nobody can tell which of them belongs to these images."""
    _images(tmp_path, ("left/1.png", "right/1.png"))
    (tmp_path / "left" / "cameras.json").write_text(cameras_text(_LEFT, _RIGHT))
    (tmp_path / "right" / "cameras.json").write_text(
        cameras_text(_LEFT, replace(_RIGHT, identity=CameraIdentity(serial="3")))
    )
    with pytest.raises(DataError, match="name different cameras"):
        cameras_beside(pair_files(str(tmp_path / "left"), str(tmp_path / "right")), _AS_GIVEN)
