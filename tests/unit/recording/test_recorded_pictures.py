"""Pictures out of a recording: for calibrate, quality and stereo the stillest ones, for calibrate-time all."""

import math
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.camera_identity import CameraIdentity
from common.errors import DataError, SettingsError, UnavailableError
from common.orientation import Flip, Orientation
from common.protocol.message import CameraDescription
from phone_host.calibration.target.cameras_beside import cameras_beside
from phone_host.jobs.picture_pairs import given_pictures
from phone_host.model import Side
from phone_host.recording.chosen_views import MOST, NS, choose_views, stillest
from phone_host.recording.footage import read_recording
from phone_host.recording.joining import copy_recording
from phone_host.stereo.view_files import pair_files
from tests.support.recorded import LATE_NS, PERIOD_NS, ZERO_NS, payload, recording, recording_file
from tests.support.samples import CAMERA

_ANY_SIZE = 10**6
_STILL = (7, 40)
"""Numbers before and after which the scene of `_moving` stands: in the first and in the second second of 25 images each."""


def _moving(side: str, number: int) -> bytes:
    """A square that stands at two moments, and moves by 5 px from image to image at all others; the right one is darker."""
    at = next((still for still in _STILL if abs(number - still) <= 1), number)
    image = np.full((96, 128), 30, np.uint8)
    x = 5 * (at % 16)
    image[20:60, x : x + 40] = 220 if side == "left" else 150
    image[0:8, 0:8] = 255 if number % 2 else 0  # a corner that tells the images apart, and changes always alike
    return cv2.imencode(".jpg", image)[1].tobytes()


def _camera(turned: Orientation) -> CameraDescription:
    return replace(
        CAMERA,
        width_px=128,
        height_px=96,
        period_ns=PERIOD_NS,
        orientation=turned,
        identity=CameraIdentity("uvcvideo", "Cam", "7"),
    )


def test_the_moment_at_which_least_moves_is_taken_of_each_second() -> None:
    """An image counts as moving if it differs from the one before or behind it; the first one has none before it."""
    stamps = [number * NS // 4 for number in range(9)]
    changes = [math.nan, 5.0, 1.0, 1.0, 9.0, 2.0, 0.5, 0.6, 3.0]
    assert stillest(stamps, changes) == [2, 6, 8]
    assert stillest([], []) == []
    assert stillest([5], [math.nan]) == [0]


@given(st.lists(st.integers(0, 10**12), max_size=300, unique=True), st.randoms(use_true_random=False))
def test_no_film_gives_too_many_pictures(stamps: list[int], chance: "np.random.Generator") -> None:
    """In order, each once, at most a hundred, and at least one in each second that has any, of a film of up to a hundred."""
    stamps.sort()
    found = stillest(stamps, [chance.random() for _ in stamps])
    assert found == sorted(set(found))
    assert len(found) <= MOST
    if stamps and stamps[-1] - stamps[0] < MOST * NS:
        assert {(stamps[place] - stamps[0]) // NS for place in found} == {(at - stamps[0]) // NS for at in stamps}


def test_still_pictures_of_both_sides_are_paired_by_the_recording(tmp_path: Path) -> None:
    """The pair of a moment whose left image is missing is none; files are named by the second, and hold the images of then."""
    path = tmp_path / "s.mcap"
    path.write_bytes(recording(50, image=_moving, missing=frozenset({_STILL[1]})))
    shares: list[float] = []
    chosen = choose_views(path, tmp_path / "views", _ANY_SIZE, shares.append)
    assert (chosen.board_side, shares[-1]) == (Side.LEFT, 1.0)
    assert shares == sorted(shares)
    files = pair_files(str(chosen.left), str(chosen.right))
    assert [name for name, *_ in files.pairs] == ["0", "1"]
    for side, written in zip(("left", "right"), files.pairs[0][1:], strict=True):
        truth = cv2.imdecode(np.frombuffer(_moving(side, _STILL[0]), np.uint8), cv2.IMREAD_GRAYSCALE)
        shown = cv2.imread(str(written), cv2.IMREAD_GRAYSCALE)
        assert shown is not None
        assert truth is not None
        assert np.array_equal(shown, truth)
    assert cameras_beside(files, (Orientation(), Orientation())) is None  # the recording tells of none


def test_pictures_stand_upright_and_name_their_cameras(tmp_path: Path) -> None:
    """A camera that hangs on its side is turned, as its run would do it; the rig will know both."""
    cameras = {"left": _camera(Orientation(90, Flip.NONE)), "right": _camera(Orientation())}
    path = tmp_path / "s.mcap"
    path.write_bytes(recording(3, image=_moving, cameras=cameras))
    chosen = choose_views(path, tmp_path / "views", _ANY_SIZE)
    left = cv2.imread(str(chosen.left / "000.png"))
    assert left is not None
    assert left.shape[:2] == (128, 96)
    files = pair_files(str(chosen.left), str(chosen.right))
    beside = cameras_beside(files, (Orientation(), Orientation()))
    assert beside is not None
    assert [camera.orientation.rotate_deg for camera in beside[1]] == [90, 0]
    assert beside[1][0].identity.serial == "7"


def test_spoiled_and_reduced_images_give_no_pictures(tmp_path: Path) -> None:
    """Of images that are none, or smaller than their camera's, the partner is not taken either; without any there is one line."""

    def image(side: str, number: int) -> bytes:
        if (side, number) == ("left", 1):
            return b"\xff\xd8 none"
        if (side, number) == ("right", 2):
            return payload(2)  # 32 x 24
        return _moving(side, number)

    path = tmp_path / "s.mcap"
    path.write_bytes(recording(4, image=image))
    chosen = choose_views(path, tmp_path / "views", _ANY_SIZE)
    assert [file.name for file in sorted(chosen.left.glob("*.png"))] == ["000.png"]
    with pytest.raises(DataError, match="no two images"):
        choose_views(path, tmp_path / "none", 10)
    copy_recording(path, tmp_path / "one.mcap", lambda m: m.channel is not None and "left" in m.channel.topic)
    with pytest.raises(DataError, match="one camera only"):
        choose_views(tmp_path / "one.mcap", tmp_path / "none", _ANY_SIZE)


def test_all_frames_are_there_to_measure_the_time_between_the_cameras(tmp_path: Path) -> None:
    """The board's and the host's, with their exposures and the bytes of then; an image that is none is left out."""
    path = recording_file(tmp_path, 4, missing=frozenset({2}))
    footage = read_recording(path)
    assert [shot.exposed_ns for shot in footage.board] == [ZERO_NS + number * PERIOD_NS for number in (0, 1, 3)]
    assert [shot.exposed_ns for shot in footage.host] == [ZERO_NS + LATE_NS + at * PERIOD_NS for at in range(4)]
    assert [bytes(shot.image.payload) for shot in footage.host] == [payload(number) for number in range(4)]
    spoiled = tmp_path / "spoiled.mcap"
    spoiled.write_bytes(recording(3, image=lambda side, at: b"none" if (side, at) == ("right", 1) else payload(at)))
    assert [len(side) for side in (read_recording(spoiled).board, read_recording(spoiled).host)] == [3, 2]


def test_a_command_takes_folders_or_one_recording(tmp_path: Path) -> None:
    """Folders as they are; a recording as the folders of its pictures; both together are refused, and so is a file that is none."""
    assert given_pictures(["a", "b"], tmp_path, _ANY_SIZE).left == ("a",)
    path = recording_file(tmp_path, 3)
    found = given_pictures([str(path)], tmp_path / "out", _ANY_SIZE)
    assert (found.left, found.board_side) == ((str(tmp_path / "out" / "views" / "left"),), Side.LEFT)
    with pytest.raises(SettingsError, match="both sides"):
        given_pictures([str(path), "right"], tmp_path, _ANY_SIZE)
    (tmp_path / "file").write_bytes(b"")
    with pytest.raises(UnavailableError, match="cannot be written"):
        given_pictures([str(path)], tmp_path / "file", _ANY_SIZE)
