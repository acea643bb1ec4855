"""Which camera it is and how it is set: what a rig remembers of its two cameras. Values only."""

import re
from enum import Enum
from typing import Final

from common.orientation import UPRIGHT, Orientation
from common.value import value


class Lock(Enum):
    """A control that a rig's camera is held at, by its name in files. The order is the wire's: new ones go to the end.

    Gain is none of them: it changes neither where points lie nor when they were seen, and in other light than that of
    the calibration it must make up for the held exposure.

    Attributes:
        EXPOSURE: exposure time, us. Not ns: the integers of a rig.yaml have 32 bits.
        WHITE_BALANCE: colour temperature, K.
        FOCUS: in the camera's own unit.
        ZOOM: in the camera's own unit.
    """

    EXPOSURE = "exposure_us"
    WHITE_BALANCE = "white_balance"
    FOCUS = "focus"
    ZOOM = "zoom"


_LOCK_NAME: Final = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,47}", re.ASCII)
"""All that any version of this program may call a control, and that OpenCV's files accept as a key."""


def is_lock_name(text: str) -> bool:
    """Return whether a text can be the name of a held control, of this version or another."""
    return _LOCK_NAME.fullmatch(text) is not None


LARGEST_LOCK: Final = 2**31 - 1
"""A control's value has 32 bits with its sign, on V4L2 as in a rig.yaml."""


@value()
class CameraIdentity:
    """Tells one camera from another. Empty texts are unknown and differ from nothing.

    Attributes:
        driver: kernel driver, such as uvcvideo; empty for images that come from no device.
        name: the camera's own name.
        serial: its serial number, if it has one.
    """

    driver: str = ""
    name: str = ""
    serial: str = ""

    @property
    def is_known(self) -> bool:
        """Whether it says anything."""
        return bool(self.driver or self.name or self.serial)

    def differs_from(self, other: "CameraIdentity") -> bool:
        """Whether the two cannot be the same camera: something that both know is not the same."""
        pairs = ((self.driver, other.driver), (self.name, other.name), (self.serial, other.serial))
        return any(own and theirs and own != theirs for own, theirs in pairs)

    def __str__(self) -> str:
        text = self.name or self.driver or "a camera without a name"
        return f"{text}, serial {self.serial}" if self.serial else text


UNKNOWN_CAMERA: Final = CameraIdentity()

MOST_LETTERS: Final = 48
"""Texts of an identity are cut here, the same on a board and off it: a driver's name has 15 letters at most, a card's 31 (videodev2.h)."""


def identity_of(driver: str, name: str, serial: str) -> CameraIdentity:
    """Make an identity of what a driver says, which may be any text."""
    return CameraIdentity(*(text.encode("utf-8", "replace").decode()[:MOST_LETTERS] for text in (driver, name, serial)))


@value()
class RememberedCamera:
    """A camera as it was when its images were taken.

    Attributes:
        identity: which camera.
        width_px: width of its images as the camera gives them, before they are turned, px.
        height_px: height of the same, px.
        orientation: how its images become upright.
        locks: name and value of each control that was held; the names are those of `Lock`.
    """

    identity: CameraIdentity
    width_px: int
    height_px: int
    orientation: Orientation = UPRIGHT
    locks: tuple[tuple[str, int], ...] = ()

    @property
    def upright_px(self) -> tuple[int, int]:
        """Width and height of its upright images, px."""
        return self.orientation.turned_size((self.width_px, self.height_px))
