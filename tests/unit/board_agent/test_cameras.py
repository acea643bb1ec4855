"""The list of cameras, for people and for programs."""

import json
from fractions import Fraction
from pathlib import Path

from board_agent.cameras import Listed, table, values
from common.camera import v4l2_abi as abi
from common.camera.v4l2_device import Identity
from common.camera.v4l2_formats import FormatOffer, Rates
from tests.support.samples import control

_RATES = Rates((Fraction(10_000_000, 333_333), Fraction(15)))
_CAMERA = Listed(
    path=Path("/dev/v4l/by-id/usb-Some_Cam-video-index0"),
    node=Path("/dev/video2"),
    identity=Identity(
        driver="uvcvideo", card="Some Cam", bus="usb-1.1", capabilities=abi.CAP_VIDEO_CAPTURE | abi.CAP_STREAMING
    ),
    formats=(
        (FormatOffer(letters="MJPG", text="Motion-JPEG", sizes_px=((640, 480),)), (((640, 480), _RATES),)),
        (FormatOffer(letters="H264", text="H.264", sizes_px=((1920, 1080),)), (((1920, 1080), _RATES),)),
    ),
    controls=(
        (control(1, "Gain", abi.CTRL_TYPE_INTEGER, (0, 100, 5, 20)), 25),
        (
            control(2, "Auto Exposure", abi.CTRL_TYPE_MENU, (0, 3, 1, 3), menu=((1, "Manual"), (3, "Aperture"))),
            None,
        ),
    ),
)


def test_the_table_names_all_that_can_be_asked_for() -> None:
    """The table has path, size, rates and each control with its value and range; formats that are not passed on are marked as such."""
    text = table([_CAMERA])
    for part in ("usb-Some_Cam-video-index0", "/dev/video2", "uvcvideo", "640x480  30, 15", "not used: H264"):
        assert part in text
    rows = [" ".join(line.split()) for line in text.splitlines()]
    assert "Gain 25 20 0 to 100 by 5" in rows
    assert "Auto Exposure - 3 1 Manual, 3 Aperture" in rows


def test_the_json_holds_the_same_and_more() -> None:
    """The values survive JSON, which holds every format, used or not, with its rates as numbers."""
    (camera,) = json.loads(json.dumps(values([_CAMERA])))["cameras"]
    assert [item["format"] for item in camera["formats"]] == ["mjpeg", None]
    assert camera["formats"][0]["sizes"] == [{"size": "640x480", "fps": [30.0, 15.0], "fps_range": []}]
    assert camera["controls"][0]["value"] == 25
    assert camera["controls"][1]["menu"] == {"1": "Manual", "3": "Aperture"}


def test_no_camera_is_said_with_a_remedy() -> None:
    """An empty list gives a sentence that says what to do, not an empty table."""
    assert "plug one in" in table([])
    assert values([]) == {"cameras": []}
