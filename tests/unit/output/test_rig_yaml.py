"""rig.yaml: round trip, other readers, and every kind of invalid file."""

import re
from pathlib import Path

import cv2
import numpy as np
import pytest

from common.camera_identity import CameraIdentity, RememberedCamera
from common.errors import DataError
from common.orientation import Flip, Orientation
from common.versions import RIG_FORMAT
from phone_host.model import UNMEASURED_NS, Rig, Side, TimeOffset, Verdict
from phone_host.output.rig_yaml import is_rig, read_rig, write_rig, write_time_offset
from phone_host.stereo.rectify import rectify_rig
from tests.support.rigs import unlike_rig

_MATRICES = ("M1", "D1", "M2", "D2", "R", "T", "R1", "R2", "P1", "P2", "Q")


def _written(tmp_path: Path, **changes: object) -> Path:
    rig = unlike_rig()
    fields = {name: getattr(rig, name) for name in Rig.__slots__} | changes
    path = tmp_path / "rig.yaml"
    write_rig(path, Rig(**fields), rectify_rig(rig))
    return path


def _foreign(text: str) -> str:
    """Return the file as one of before, or as other programs may write it: not all keys need be there."""
    return text.replace(f"format_version: {RIG_FORMAT}\n", "")


def test_round_trip(tmp_path: Path) -> None:
    """Every number of the rig comes back bit for bit."""
    rig = unlike_rig()
    back = read_rig(_written(tmp_path, board_side=Side.RIGHT, rms_left_px=0.125, rms_stereo_px=0.25))
    for camera, expected in ((back.left, rig.left), (back.right, rig.right)):
        assert (camera.width_px, camera.height_px) == (expected.width_px, expected.height_px)
        np.testing.assert_array_equal(camera.matrix, expected.matrix)
        np.testing.assert_array_equal(camera.distortion, expected.distortion)
    np.testing.assert_array_equal(back.R_right_left, rig.R_right_left)
    np.testing.assert_array_equal(back.t_right_left_m, rig.t_right_left_m)
    assert back.board_side is Side.RIGHT
    assert (back.rms_left_px, back.rms_stereo_px) == (0.125, 0.25)
    assert np.isnan(back.rms_right_px)


def test_opencv_reads_the_keys_of_the_contract(tmp_path: Path) -> None:
    """A plain cv2.FileStorage finds every key, and its own projection with P2 agrees with the rig's."""
    storage = cv2.FileStorage(str(_written(tmp_path)), cv2.FILE_STORAGE_READ)
    sizes = {key: int(storage.getNode(key).real()) for key in ("left_image_width", "right_image_height")}
    assert sizes == {"left_image_width": 640, "right_image_height": 720}
    shapes = {key: storage.getNode(key).mat().shape for key in _MATRICES}
    assert shapes == {
        "M1": (3, 3), "D1": (1, 5), "M2": (3, 3), "D2": (1, 5), "R": (3, 3), "T": (3, 1),
        "R1": (3, 3), "R2": (3, 3), "P1": (3, 4), "P2": (3, 4), "Q": (4, 4),
    }  # fmt: skip
    P2 = storage.getNode("P2").mat()  # noqa: N806
    assert -P2[0, 3] / P2[0, 0] == pytest.approx(np.linalg.norm([0.1, 0.004, -0.006]))


@pytest.mark.parametrize("key", ["M1", "D2", "R", "T", "left_image_width", "right_image_height"])
def test_a_missing_key_is_named(tmp_path: Path, key: str) -> None:
    """A file that lacks a key is refused; the message names the key and the file."""
    path = _written(tmp_path)
    path.write_text(re.sub(rf"^{key}:", f"no_{key}:", path.read_text(), flags=re.MULTILINE))
    with pytest.raises(DataError, match=rf"rig\.yaml: {key} is missing"):
        read_rig(path)


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("R_right_left", np.eye(3) * 1.1, "R is no rotation"),
        ("R_right_left", np.diag([1.0, 1.0, -1.0]), "R is no rotation"),
        ("R_right_left", np.eye(2), "R is 2x2"),
        ("R_right_left", np.full((3, 3), np.nan), "R holds values that are not finite"),
        ("t_right_left_m", np.array([-80.0, 0, 0]), "T is 80 m long: T is in metres"),
        ("t_right_left_m", np.zeros(3), "T is 0"),
    ],
)
def test_a_value_that_makes_no_sense_is_named(tmp_path: Path, field: str, value: np.ndarray, message: str) -> None:
    """A matrix of the wrong shape or type, or with NaN, is refused by key."""
    with pytest.raises(DataError, match=message):
        read_rig(_written(tmp_path, **{field: value}))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("left_image_width: 640", "left_image_width: 0", "left_image_width is no image size"),
        ("left_image_width: 640", "left_image_width: wide", "left_image_width is no image size"),
        ("board_side: left", "board_side: top", "board_side is 'top'"),
        ("525., 0., 315.", "-525., 0., 315.", "M1 is no camera matrix"),
        ("525., 0., 315.,", "", "M1 is no matrix"),
    ],
)
def test_an_edited_file_is_checked(tmp_path: Path, old: str, new: str, message: str) -> None:
    """Whatever a text editor can break is named by key."""
    path = _written(tmp_path)
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    with pytest.raises(DataError, match=message):
        read_rig(path)


def test_a_baseline_that_contradicts_the_projection_is_refused(tmp_path: Path) -> None:
    """T edited by hand, P2 not: the line names both lengths. Where others have written no P2, T counts."""
    path = _written(tmp_path, t_right_left_m=2 * unlike_rig().t_right_left_m)
    with pytest.raises(DataError, match=r"P2 has a baseline of 100\.26 mm, but T one of 200\.52 mm"):
        read_rig(path)
    path.write_text(_foreign(re.sub(r"^P2:", "no_P2:", path.read_text(), flags=re.MULTILINE)))
    assert read_rig(path).t_right_left_m[0] == 2 * unlike_rig().t_right_left_m[0]


def test_a_rig_that_lost_its_first_line_is_no_calib_txt(tmp_path: Path) -> None:
    """It is taken for what it was, so that the error does not speak of another kind of file."""
    path = _written(tmp_path)
    path.write_text("format_version: 1\n" + path.read_text().partition("---\n")[2])
    assert is_rig(path)
    with pytest.raises(DataError, match=r"rig\.yaml is not a calibration file"):
        read_rig(path)


@pytest.mark.parametrize(
    "content", [b"", b"hello", b'{"M1": 1}', b"%YAML:1.0\nM1: [", b"%YAML:1.0\n---\n- 1\n", b"\xff\xfe\x00"]
)
def test_other_files_are_refused(tmp_path: Path, content: bytes) -> None:
    """A file that is no FileStorage YAML is refused in one line, by name."""
    path = tmp_path / "rig.yaml"
    path.write_bytes(content)
    with pytest.raises(DataError, match=r"rig\.yaml is not a calibration file"):
        read_rig(path)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    """A missing file is a DataError with the command that makes one."""
    with pytest.raises(DataError, match="phone-host calibrate"):
        read_rig(tmp_path / "rig.yaml")


def test_a_time_offset_comes_back_and_leaves_all_else(tmp_path: Path) -> None:
    """A measured offset is read as it was written, other lines are unchanged, and without the keys nothing counts as measured."""
    path = _written(tmp_path, time_offset=TimeOffset(-12_345_678_901 // 10, 250_001))
    assert read_rig(path).time_offset == TimeOffset(-1_234_567_891, 250_001)
    with path.open("a") as file:
        file.write("foreign: 7\n")
    before = [line for line in path.read_text().splitlines() if not line.startswith("time_offset")]
    write_time_offset(path, TimeOffset(5_000_000, 1_000_000))
    assert read_rig(path).time_offset == TimeOffset(5_000_000, 1_000_000)
    after = path.read_text().splitlines()
    assert [line for line in after if not line.startswith("time_offset")] == before
    path.write_text(_foreign("\n".join(before) + "\n"))
    assert read_rig(path).time_offset == TimeOffset(0, UNMEASURED_NS)


@pytest.mark.parametrize(
    ("key", "value"),
    [("time_offset_ns", "9.e9"), ("time_offset_uncertainty_ns", "0."), ("time_offset_uncertainty_ns", "-3.")],
)
def test_a_time_offset_of_no_use_is_named(tmp_path: Path, key: str, value: str) -> None:
    """An offset of seconds or an uncertainty of zero is refused by key."""
    path = _written(tmp_path, time_offset=TimeOffset(1, 1))
    path.write_text(re.sub(rf"^{key}:.*$", f"{key}: {value}", path.read_text(), flags=re.MULTILINE))
    with pytest.raises(DataError, match=key):
        read_rig(path)


def test_noise_of_zero_and_verdict_come_back(tmp_path: Path) -> None:
    """They are read as they were written; files of before, without them, say nothing."""
    back = read_rig(_written(tmp_path, zero_sigma_px=0.375, verdict=Verdict.USABLE))
    assert (back.zero_sigma_px, back.verdict) == (0.375, Verdict.USABLE)
    path = _written(tmp_path)
    path.write_text(_foreign(re.sub(r"^zero_sigma:.*\n", "", path.read_text(), flags=re.MULTILINE)))
    back = read_rig(path)
    assert np.isnan(back.zero_sigma_px)
    assert back.verdict is None
    assert (back.left_camera, back.right_camera) == (None, None)


_CAMERA = RememberedCamera(
    identity=CameraIdentity("uvcvideo", 'HD "Pro": C920 ü', "0123"),
    width_px=480,
    height_px=640,
    orientation=Orientation(270, Flip.V),
    locks=(("exposure_us", 10_000), ("focus", 0), ("gain", -3)),
)
"""A camera mounted turned, so that its 480x640 images become the rig's 640x480."""


@pytest.mark.parametrize(
    "camera",
    [
        _CAMERA,
        RememberedCamera(CameraIdentity(), 640, 480),
        RememberedCamera(CameraIdentity(name="phone"), 640, 480, Orientation(180)),
    ],
)
def test_cameras_come_back(tmp_path: Path, camera: RememberedCamera) -> None:
    """What is known of a camera is read as it was written; what is not known stays away; a time offset put in later changes nothing."""
    path = _written(tmp_path, left_camera=camera)
    write_time_offset(path, TimeOffset(1, 2))
    back = read_rig(path)
    assert back.left_camera == camera
    assert back.right_camera is None


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("verdict: splendid", "verdict is 'splendid': write good, usable or reject"),
        ("verdict: 7", "verdict is no word"),
        ("zero_sigma: -1.", "zero_sigma is -1"),
        ("zero_sigma: .Inf", "zero_sigma is inf"),
        ("zero_sigma: 1e308", "zero_sigma is 1e+308"),
        ("zero_sigma: x", "zero_sigma is no number"),
        ("verdict: [good]", "verdict is no word"),
        ('left_camera: { locks: { "1a": 1 } }', "left_camera"),
        ("left_camera: usb", "left_camera is no map"),
        ("left_camera: { rotate: 45 }", "left_camera.rotate is none of"),
        ("left_camera: { rotate: a }", "left_camera.rotate is none of"),
        ("left_camera: { flip: d }", "left_camera.flip is 'd'"),
        ("left_camera: { name: 5 }", "left_camera.name is no short text"),
        (f"right_camera: {{ serial: {'x' * 300} }}", "right_camera.serial is no short text"),
        ("right_camera: { locks: 7 }", "right_camera.locks is no map"),
        ("right_camera: { locks: { focus: 1.5 } }", "right_camera.locks.focus is no whole number"),
    ],
)
def test_what_a_rig_says_of_itself_is_checked_by_key(tmp_path: Path, line: str, said: str) -> None:
    """A verdict that does not exist, a negative or endless noise, and cameras that make no sense are refused by key, in one line."""
    path = _written(tmp_path)
    text = re.sub(rf"^{line.partition(':')[0]}:.*\n", "", path.read_text(), flags=re.MULTILINE)
    path.write_text(f"{text}{line}\n")
    with pytest.raises(DataError) as failure:
        read_rig(path)
    assert said in str(failure.value)
    assert "\n" not in str(failure.value)


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("board_side", "[1,2]", "board_side is no word"),
        ("board_side", ".Nan", "board_side is no word"),
        ("board_side", "{a: 1}", "board_side is no word"),
        ("rms_left", "x", "rms_left is no number"),
        ("rms_right", "-1.", "rms_right is -1 px"),
        ("rms_stereo", "1e308", "rms_stereo is 1e+308 px"),
    ],
)
def test_a_key_of_the_wrong_kind_is_not_taken_for_a_missing_one(
    tmp_path: Path, key: str, value: str, said: str
) -> None:
    """It is named; the default holds only where the key is missing."""
    path = _written(tmp_path)
    path.write_text(re.sub(rf"^{key}:.*$", f"{key}: {value}", path.read_text(), flags=re.MULTILINE))
    with pytest.raises(DataError) as failure:
        read_rig(path)
    assert said in str(failure.value)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("525., 0., 315.", "1e308, 0., 315.", "M1 holds 1e+308"),
        ("525., 0., 315.", "3.5, 0., 315.", "M1 has a focal length of 3.5 px for images 640 px wide"),
        ("525., 0., 315.", "525e2, 0., 315.", "M1 has a focal length of 52500 px"),
        ("525., 0., 315.", "525., 0., 1e8", "M1 has its principal point at 1e+08,243 px"),
    ],
)
def test_a_camera_that_cannot_be_is_refused(tmp_path: Path, old: str, new: str, said: str) -> None:
    """A number that is finite but absurd is named with its key, and no library warns of an overflow."""
    path = _written(tmp_path)
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(DataError) as failure:
        read_rig(path)
    assert said in str(failure.value)


@pytest.mark.parametrize(("t_m", "said"), [([-1e308, 0, 0], "T holds 1e+308"), ([-1e-8, 0, 0], "T is 1e-08 m long")])
def test_a_baseline_that_cannot_be_is_refused(tmp_path: Path, t_m: list[float], said: str) -> None:
    """Neither the width of a galaxy nor that of an atom."""
    with pytest.raises(DataError) as failure:
        read_rig(_written(tmp_path, t_right_left_m=np.array(t_m)))
    assert said in str(failure.value)
