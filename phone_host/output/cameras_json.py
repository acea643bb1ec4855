"""cameras.json: which two cameras took a folder's images, and how they were set.

Keys: format_version; left, right: driver, name, serial (empty: unknown), width_px, height_px (as the camera gives its
images, before they are turned), rotate_deg (clockwise), flip (none, h, v), locks (control: value).
"""

import json
from pathlib import Path
from typing import Any, Final

from common.camera_identity import LARGEST_LOCK, CameraIdentity, RememberedCamera, is_lock_name
from common.errors import DataError
from common.files import read_input
from common.orientation import Flip, Orientation
from common.versions import CAMERAS_FORMAT

CAMERAS_NAME: Final = "cameras.json"
"""Its name beside a run's results, and beside the images of a calibration."""

_MOST_BYTES: Final = 1 << 16
"""Limit for a file of one page."""

_MOST_TEXT: Final = 200
_MOST_LOCKS: Final = 32
_LARGEST_IMAGE_PX: Final = 100_000
_REMEDY: Final = "delete the file, or save it again with `phone-host run --out`"


def cameras_text(left: RememberedCamera, right: RememberedCamera) -> str:
    """Return the content of cameras.json."""
    cameras = {"format_version": CAMERAS_FORMAT, "left": _values(left), "right": _values(right)}
    return json.dumps(cameras, indent=1) + "\n"


def read_cameras(path: Path) -> tuple[RememberedCamera, RememberedCamera]:
    """Read cameras.json and check it.

    Raises:
        DataError: the file is missing, of a newer format, or not valid; names file and key.
    """
    try:
        values = json.loads(read_input(path, _MOST_BYTES, _REMEDY).decode("utf-8"))
    except (ValueError, RecursionError) as error:
        raise DataError(f"{path} is no cameras.json", _REMEDY) from error
    reader = _Reader(path, "", values)
    version = reader.whole("format_version", 1, LARGEST_LOCK)
    if version > CAMERAS_FORMAT:
        known = f"{path}: format_version is {version}, this program reads up to {CAMERAS_FORMAT}"
        raise DataError(known, "update tandemscan, or delete the file")
    return _camera(reader.inner("left")), _camera(reader.inner("right"))


def _values(camera: RememberedCamera) -> dict[str, Any]:
    return {
        "driver": camera.identity.driver,
        "name": camera.identity.name,
        "serial": camera.identity.serial,
        "width_px": camera.width_px,
        "height_px": camera.height_px,
        "rotate_deg": camera.orientation.rotate_deg,
        "flip": camera.orientation.flip.value,
        "locks": dict(camera.locks),
    }


def _camera(reader: "_Reader") -> RememberedCamera:
    rotate_deg, flip = reader.whole("rotate_deg", 0, 270), reader.text("flip")
    if rotate_deg % 90:
        raise reader.problem("rotate_deg", "is none of 0, 90, 180 and 270")
    if flip not in {choice.value for choice in Flip}:
        raise reader.problem("flip", "is none of none, h and v")
    return RememberedCamera(
        identity=CameraIdentity(reader.text("driver"), reader.text("name"), reader.text("serial")),
        width_px=reader.whole("width_px", 1, _LARGEST_IMAGE_PX),
        height_px=reader.whole("height_px", 1, _LARGEST_IMAGE_PX),
        orientation=Orientation(rotate_deg, Flip(flip)),
        locks=reader.inner("locks").numbers(),
    )


class _Reader:
    """A JSON object whose values are checked one by one; every error names file and key."""

    def __init__(self, path: Path, where: str, values: Any) -> None:  # noqa: ANN401 - whatever JSON holds
        self._path, self._where = path, where
        if not isinstance(values, dict):
            name = where.rstrip(".") or "the file"
            raise DataError(f"{path}: {name} is no object", _REMEDY)
        self._values: dict[str, Any] = values

    def problem(self, key: str, what: str) -> DataError:
        name = f"{self._where}{key}"
        return DataError(f"{self._path}: {name} {what}", _REMEDY)

    def inner(self, key: str) -> "_Reader":
        """An object inside."""
        return _Reader(self._path, f"{self._where}{key}.", self._values.get(key))

    def whole(self, key: str, low: int, high: int) -> int:
        """A whole number."""
        value = self._values.get(key)
        if type(value) is not int or not low <= value <= high:  # to isinstance, a bool is an int
            raise self.problem(key, f"is no whole number in {low}..{high}")
        return value

    def text(self, key: str) -> str:
        """A short text."""
        value = self._values.get(key)
        if not isinstance(value, str) or len(value) > _MOST_TEXT:
            raise self.problem(key, "is no short text")
        if any(
            "\ud800" <= letter <= "\udfff" for letter in value
        ):  # half of a pair of UTF-16: JSON can write it, no file can hold it
            raise self.problem(key, "is no text")
        return value

    def numbers(self) -> tuple[tuple[str, int], ...]:
        """All of its keys, each with a whole number."""
        name = self._where.rstrip(".")
        if len(self._values) > _MOST_LOCKS:
            raise DataError(f"{self._path}: {name} holds too much", _REMEDY)
        wrong = next((key for key in self._values if not is_lock_name(key)), None)
        if wrong is not None:
            raise DataError(f"{self._path}: {name} holds {_short(wrong)}, which is no name of a control", _REMEDY)
        return tuple((key, self.whole(key, -LARGEST_LOCK - 1, LARGEST_LOCK)) for key in self._values)


def _short(text: str) -> str:
    """Return a key as messages quote it; files may hold anything."""
    return repr(text if len(text) <= 40 else text[:37] + "...")
