"""A rig's cameras in rig.yaml: their lenses (lens1 and lens2 say what D1 and D2 mean) and their identity (the maps `left_camera` and `right_camera`).

Each map may hold driver, name, serial (texts; absent: unknown), rotate (clockwise, degrees; absent: 0), flip (h or v;
absent: not mirrored) and the map locks (control: whole number). A rig without a map says nothing about that camera.
"""

from collections.abc import Callable
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from common.camera_identity import LARGEST_LOCK, CameraIdentity, RememberedCamera, is_lock_name
from common.errors import DataError
from common.orientation import Flip, Orientation
from phone_host.model import CameraModel, Lens

Problem = Callable[[str, str, str], DataError]
"""Makes the error of a key, from what is wrong with it and the remedy."""

_COUNTS: Final = {Lens.PINHOLE: (4, 5), Lens.RATIONAL: (8, 12, 14), Lens.FISHEYE: (4,)}
"""Numbers of coefficients, as OpenCV defines them."""


def lens_of(model: CameraModel) -> Lens:
    """Return a camera's lens; with eight or more coefficients a pinhole is a rational one."""
    return usual_lens(model.distortion.size) if model.lens is Lens.PINHOLE else model.lens


def usual_lens(count: int) -> Lens:
    """Return what so many coefficients mean in a file of format 1, which does not name its lenses."""
    return Lens.RATIONAL if count > max(_COUNTS[Lens.PINHOLE]) else Lens.PINHOLE


def known_lens(name: str, key: str, problem: Problem) -> Lens:
    """Return the lens of a name.

    Raises:
        DataError: it is none of ours; nothing is guessed.
    """
    if name not in {each.value for each in Lens}:
        known = ", ".join(each.value for each in Lens)
        raise problem(key, f"is {name!r}", f"this program knows {known}; update tandemscan, or calibrate again")
    return Lens(name)


def require_count(distortion: NDArray[np.float64], lens: Lens, key: str, problem: Problem) -> None:
    """Check that a lens has as many coefficients as its formula takes.

    Raises:
        DataError: it has others.
    """
    if min(distortion.shape) != 1 or distortion.size not in _COUNTS[lens]:
        counts = " or ".join(map(str, _COUNTS[lens]))
        raise problem(key, f"has {distortion.size} values", f"a {lens.value} lens has {counts} coefficients")


_MOST_TEXT: Final = 200
_MOST_LOCKS: Final = 32
_TURNS: Final = (0, 90, 180, 270)


def write_camera(storage: cv2.FileStorage, key: str, camera: RememberedCamera) -> None:
    """Write what is known of a camera.

    Args:
        storage: a rig.yaml, open for writing.
        key: left_camera or right_camera.
        camera: the camera; its size is that of the rig's images, before they are turned.
    """
    storage.startWriteStruct(key, cv2.FileNode_MAP)
    identity, orientation = camera.identity, camera.orientation
    for name, text in (("driver", identity.driver), ("name", identity.name), ("serial", identity.serial)):
        if text:
            storage.write(name, text)
    if orientation.rotate_deg:
        storage.write("rotate", orientation.rotate_deg)
    if orientation.flip is not Flip.NONE:
        storage.write("flip", orientation.flip.value)
    if camera.locks:
        storage.startWriteStruct("locks", cv2.FileNode_MAP)
        for name, value in camera.locks:
            storage.write(name, value)
        storage.endWriteStruct()
    storage.endWriteStruct()


def read_camera(node: cv2.FileNode, key: str, upright_px: tuple[int, int], problem: Problem) -> RememberedCamera | None:
    """Read what is known of a camera, and check it.

    Args:
        node: what the file holds under the key.
        key: left_camera or right_camera.
        upright_px: width and height of the rig's images of this camera, px.
        problem: makes errors that name file and key.

    Returns:
        The camera; None if the file does not say which it was.

    Raises:
        DataError: a key is not valid.
    """
    if node.empty():
        return None
    if not node.isMap():
        raise problem(key, "is no map", "calibrate again, or remove it")
    reader = _CameraReader(node, key, problem)
    orientation = Orientation(reader.turn(), reader.flip())
    width_px, height_px = orientation.turned_size(upright_px)  # the same turn leads back
    return RememberedCamera(
        identity=CameraIdentity(reader.text("driver"), reader.text("name"), reader.text("serial")),
        width_px=width_px,
        height_px=height_px,
        orientation=orientation,
        locks=reader.locks(),
    )


class _CameraReader:
    """A camera's map, whose values are checked one by one."""

    def __init__(self, node: cv2.FileNode, key: str, problem: Problem) -> None:
        self._node, self._key, self._problem = node, key, problem

    def _wrong(self, key: str, what: str, remedy: str) -> DataError:
        return self._problem(f"{self._key}.{key}", what, remedy)

    def text(self, key: str) -> str:
        node = self._node.getNode(key)
        if node.empty():
            return ""
        value = str(node.string()) if node.isString() else None
        if value is None or len(value) > _MOST_TEXT:
            raise self._wrong(key, "is no short text", "calibrate again, or remove it")
        return value

    def turn(self) -> int:
        node = self._node.getNode("rotate")
        if node.empty():
            return 0
        value = round(node.real()) if node.isInt() else -1
        if value not in _TURNS:
            raise self._wrong("rotate", "is none of 0, 90, 180 and 270", "write the clockwise turn, or remove it")
        return value

    def flip(self) -> Flip:
        text = self.text("flip") or Flip.NONE.value
        if text not in {choice.value for choice in Flip}:
            raise self._wrong("flip", f"is {text!r}", "write h or v, or remove it")
        return Flip(text)

    def locks(self) -> tuple[tuple[str, int], ...]:
        node = self._node.getNode("locks")
        if node.empty():
            return ()
        names = list(node.keys()) if node.isMap() else []
        if not names or len(names) > _MOST_LOCKS or not all(map(is_lock_name, names)):
            raise self._wrong("locks", "is no map of controls", "calibrate again, or remove it")
        found = []
        for name in names:
            value = node.getNode(name)
            if not value.isInt() or not abs(value.real()) <= LARGEST_LOCK + 1:
                raise self._wrong(f"locks.{name}", "is no whole number", "calibrate again, or remove it")
            found.append((name, int(value.real())))
        return tuple(found)
