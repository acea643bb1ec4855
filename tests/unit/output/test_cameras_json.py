"""cameras.json: what is written is read back; anything else is refused by file and key."""

import json
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.camera_identity import LARGEST_LOCK, CameraIdentity, Lock, RememberedCamera
from common.errors import DataError
from common.orientation import Flip, Orientation
from common.versions import CAMERAS_FORMAT
from phone_host.output.cameras_json import cameras_text, read_cameras

LEFT = RememberedCamera(
    CameraIdentity("uvcvideo", "HD Pro Webcam C920", "A1B2"), 640, 480, Orientation(180), (("focus", 20), ("zoom", 100))
)
RIGHT = RememberedCamera(CameraIdentity(), 1280, 720)
TEXTS = st.text(st.characters(exclude_categories=["Cs"]), max_size=48)
CAMERAS = st.builds(
    RememberedCamera,
    st.builds(CameraIdentity, TEXTS, TEXTS, TEXTS),
    st.integers(1, 16384),
    st.integers(1, 16384),
    st.builds(Orientation, st.sampled_from([0, 90, 180, 270]), st.sampled_from(Flip)),
    st.lists(
        st.tuples(st.sampled_from([lock.value for lock in Lock]), st.integers(-LARGEST_LOCK - 1, LARGEST_LOCK)),
        unique_by=lambda lock: lock[0],
    ).map(tuple),
)


@given(CAMERAS, CAMERAS)
def test_both_cameras_come_back_as_they_were(
    tmp_path_factory: pytest.TempPathFactory, left: RememberedCamera, right: RememberedCamera
) -> None:
    path = tmp_path_factory.getbasetemp() / "cameras.json"
    path.write_text(cameras_text(left, right))
    assert read_cameras(path) == (left, right)


def test_the_file_is_what_the_documentation_says() -> None:
    """Keys, units and the version are fixed: other programs read them."""
    assert json.loads(cameras_text(LEFT, RIGHT)) == {
        "format_version": 1,
        "left": {
            "driver": "uvcvideo",
            "name": "HD Pro Webcam C920",
            "serial": "A1B2",
            "width_px": 640,
            "height_px": 480,
            "rotate_deg": 180,
            "flip": "none",
            "locks": {"focus": 20, "zoom": 100},
        },
        "right": {
            "driver": "",
            "name": "",
            "serial": "",
            "width_px": 1280,
            "height_px": 720,
            "rotate_deg": 0,
            "flip": "none",
            "locks": {},
        },
    }


def changed(key: str, value: Any) -> str:
    """The file with another value in the left camera."""
    values = json.loads(cameras_text(LEFT, RIGHT))
    values["left"][key] = value
    return json.dumps(values)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "is no cameras.json"),
        ("[" * 50_000, "is no cameras.json"),
        ("[]", "the file is no object"),
        ("{}", "format_version is no whole number"),
        (
            f'{{"format_version": {CAMERAS_FORMAT + 1}}}',
            f"this program reads up to {CAMERAS_FORMAT}: update tandemscan",
        ),
        ('{"format_version": true}', "format_version is no whole number"),
        ('{"format_version": 1, "left": 3}', "left is no object"),
        (changed("driver", 3), "left.driver is no short text"),
        (changed("name", "x" * 201), "left.name is no short text"),
        (changed("width_px", 0), "left.width_px is no whole number"),
        (changed("height_px", 480.5), "left.height_px is no whole number"),
        (changed("rotate_deg", 45), "left.rotate_deg is none of"),
        (changed("flip", "hv"), "left.flip is none of"),
        (changed("locks", {"focus": 2**31}), "left.locks.focus is no whole number"),
        (changed("locks", dict.fromkeys(map(str, range(33)), 1)), "left.locks holds too much"),
        (changed("name", "\ud800"), "left.name is no text"),
        (changed("locks", {"": 1}), "left.locks holds '', which is no name of a control"),
        (changed("locks", {"1a": 1}), "left.locks holds '1a'"),
        (changed("locks", {"a b:\n": 1}), "left.locks holds 'a b:"),
        (changed("locks", {"x" * 49: 1}), "which is no name of a control"),
        ("x" * 70_000, "bytes"),
    ],
)
def test_a_bad_file_is_refused_by_its_key(text: str, said: str, tmp_path: Path) -> None:
    path = tmp_path / "cameras.json"
    path.write_text(text)
    with pytest.raises(DataError) as caught:
        read_cameras(path)
    assert str(path) in str(caught.value)
    assert said in str(caught.value)


def test_a_missing_file_is_bad_data(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="cannot be read"):
        read_cameras(tmp_path / "cameras.json")
