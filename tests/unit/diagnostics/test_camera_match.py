"""Which cameras a rig takes, which it refuses, and which controls are doubted."""

from dataclasses import replace

import pytest

from common.camera_identity import UNKNOWN_CAMERA, CameraIdentity, Lock, RememberedCamera, identity_of
from common.errors import DataError
from common.orientation import UPRIGHT, Orientation
from common.protocol.message import CameraDescription
from phone_host.diagnostics.codes import Code
from phone_host.diagnostics.run_rules import misses, require_camera, settings_concerns, state_of
from phone_host.model import Side
from tests.support.samples import CAMERA

C920 = CameraIdentity("uvcvideo", "HD Pro Webcam C920", "A1")
OTHER_C920 = CameraIdentity("uvcvideo", "HD Pro Webcam C920", "B2")
NO_SERIAL = CameraIdentity("uvcvideo", "HD Pro Webcam C920", "")
CHEAP = CameraIdentity("uvcvideo", "USB Camera", "")


def described(identity: CameraIdentity, orientation: Orientation = UPRIGHT) -> CameraDescription:
    """A camera of 640x480."""
    return replace(CAMERA, identity=identity, orientation=orientation)


def check(rig: RememberedCamera, present: CameraDescription, other: CameraIdentity = UNKNOWN_CAMERA) -> None:
    """Compare the left camera."""
    require_camera(Side.LEFT, "the board's camera", rig, present, other)


@pytest.mark.parametrize(
    ("rig", "present"),
    [
        (C920, C920),
        (C920, NO_SERIAL),
        (NO_SERIAL, C920),
        (UNKNOWN_CAMERA, C920),
        (C920, UNKNOWN_CAMERA),
        (CameraIdentity(name="USB Camera"), CHEAP),
    ],
)
def test_what_either_side_does_not_state_is_not_compared(rig: CameraIdentity, present: CameraIdentity) -> None:
    """A missing serial number is no difference, nor is a replay, which is no device."""
    assert not rig.differs_from(present)
    check(RememberedCamera(rig, 640, 480), described(present))


@pytest.mark.parametrize("present", [OTHER_C920, CHEAP, CameraIdentity("vivid", "HD Pro Webcam C920", "A1")])
def test_another_camera_is_refused_by_both_names(present: CameraIdentity) -> None:
    """Driver, name and serial number each tell a camera from another; exit code 4."""
    with pytest.raises(DataError) as caught:
        check(RememberedCamera(C920, 640, 480), described(present))
    assert f"the board's camera is {present}, but the rig's left camera was {C920}" in str(caught.value)
    assert "plug that one in" in str(caught.value)
    assert caught.value.exit_code == 4


def test_exchanged_cameras_are_called_so() -> None:
    """If the camera that is there is the rig's other one, the remedy is to exchange them."""
    with pytest.raises(DataError, match="exchange the two cameras"):
        check(RememberedCamera(C920, 640, 480), described(CHEAP), other=CHEAP)


def test_another_orientation_is_refused_with_both() -> None:
    """The same camera on its head has another geometry. Where the camera is unknown, its images may have been turned already."""
    rig = RememberedCamera(C920, 640, 480, Orientation(180))
    check(rig, described(C920, Orientation(180)))
    with pytest.raises(DataError, match="neither rotate= nor flip=, but the rig was calibrated with rotate=180"):
        check(rig, described(C920))
    check(rig, described(UNKNOWN_CAMERA))


def test_only_controls_that_differ_are_doubted() -> None:
    """One concern names each control with both values, in the rig's order; a control of a later version is not held."""
    rig = RememberedCamera(C920, 640, 480, locks=(("focus", 20), ("zoom", 100), ("exposure_us", 10_000), ("tilt", 3)))
    held = ((Lock.FOCUS, 20), (Lock.EXPOSURE, 9_900))
    missed = misses(Side.RIGHT, rig, held)
    assert [(miss.control, miss.wanted, miss.present) for miss in missed] == [
        ("zoom", 100, None),
        ("exposure_us", 10_000, 9_900),
        ("tilt", 3, None),
    ]
    (concern,) = settings_concerns(missed)
    assert concern.code == Code.CAMERA_SETTINGS
    assert "the right camera's zoom is not held instead of 100" in concern.message
    assert "exposure_us is 9900 instead of 10000" in concern.message
    assert not [*settings_concerns(misses(Side.LEFT, RememberedCamera(C920, 640, 480, locks=(("focus", 20),)), held))]


def test_a_state_remembers_what_the_camera_says() -> None:
    """Size and orientation are the camera's own; a driver's text is cut to what a hello carries, and repaired."""
    identity = identity_of("uvcvideo", "x" * 100, "caf\udce9")
    state = state_of(described(identity, Orientation(90)), ((Lock.FOCUS, 3),))
    assert state == RememberedCamera(
        CameraIdentity("uvcvideo", "x" * 48, "caf?"), 640, 480, Orientation(90), (("focus", 3),)
    )
    assert state.upright_px == (480, 640)
