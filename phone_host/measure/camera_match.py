"""Compares the cameras of a run with those that its rig was calibrated with. Pure.

A rig holds for two cameras as they were: another camera, or the same one mounted otherwise, has another geometry, so
the run is refused. A control that is not as it was (focus and zoom move the image) is a concern. What either side does
not state is not compared: a rig without cameras, a camera without a serial number, images that come from no device.
"""

from dataclasses import dataclass

from common.camera_identity import CameraIdentity, RememberedCamera
from common.errors import DataError
from common.protocol.message import CameraDescription, Locks
from phone_host.measure.trust import Concern, Doubt
from phone_host.model import Side


@dataclass(frozen=True, slots=True, kw_only=True)
class LockMiss:
    """A control that could not be restored.

    Attributes:
        side: whose it is.
        control: its name.
        wanted: its value in the rig.
        present: its value now; None: the camera does not hold it.
    """

    side: Side
    control: str
    wanted: int
    present: int | None


def state_of(camera: CameraDescription, held: Locks) -> RememberedCamera:
    """Return what is to be remembered of a camera.

    Args:
        camera: what it says of itself.
        held: the controls that it is held at.
    """
    locks = tuple((lock.value, value) for lock, value in held)
    return RememberedCamera(camera.identity, camera.width_px, camera.height_px, camera.orientation, locks)


def require_camera(
    side: Side, whose: str, rig: RememberedCamera, present: CameraDescription, other: CameraIdentity
) -> None:
    """Check that a camera is the rig's and is mounted as it was.

    Args:
        side: which of the rig's two cameras it is.
        whose: whose camera it is, for example `the board's camera`.
        rig: the camera as the rig states it.
        present: the camera that is there.
        other: the rig's camera on the other side; unknown if the rig does not state it.

    Raises:
        DataError: it is another camera, or has another orientation; names both and what to do.
    """
    if not present.identity.is_known:
        return
    there = f"{whose} is {present.identity}"
    if rig.identity.differs_from(present.identity):
        exchanged = other.is_known and not other.differs_from(present.identity)
        remedy = "exchange the two cameras" if exchanged else "plug that one in"
        raise DataError(
            f"{there}, but the rig's {side.value} camera was {rig.identity}",
            f"{remedy}, calibrate again with these, or remove {side.value}_camera from the rig's file",
        )
    if rig.identity.is_known and rig.orientation != present.orientation:
        now, then = (str(turn) or "neither rotate= nor flip=" for turn in (present.orientation, rig.orientation))
        raise DataError(
            f"{there}, with {now}, but the rig was calibrated with {then}",
            f"mount it and give its address as before, calibrate again, or remove {side.value}_camera from the rig's file",
        )


def misses(side: Side, rig: RememberedCamera, held: Locks) -> tuple[LockMiss, ...]:
    """Return the rig's locks that a camera does not have.

    Args:
        side: which of the rig's two cameras it is.
        rig: the camera as the rig states it.
        held: the controls that the camera is held at now.
    """
    now = {lock.value: value for lock, value in held}
    return tuple(
        LockMiss(side=side, control=name, wanted=wanted, present=now.get(name))
        for name, wanted in rig.locks
        if now.get(name) != wanted
    )


def settings_concerns(missed: tuple[LockMiss, ...]) -> tuple[Concern, ...]:
    """Say which controls could not be restored; empty if all were."""
    if not missed:
        return ()
    said = ", ".join(
        f"the {miss.side.value} camera's {miss.control} is "
        f"{'not held' if miss.present is None else miss.present} instead of {miss.wanted}"
        for miss in missed
    )
    return (
        Concern(
            Doubt.CAMERA_SETTINGS,
            f"{said}, so depth may be wrong",
            "see which controls the camera has: board-agent cameras; or calibrate again as it is now",
        ),
    )
