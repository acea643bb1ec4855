"""calib.txt: the calibration of rectified images as the data sets Middlebury, ETH3D and KITTI write it. Read here; `rig_files.rectified` writes it.

Middlebury (2014, version 3, 2021) and ETH3D: lines `key=value`; cam0 and cam1 are camera matrices `[f 0 cx; 0 f cy; 0 0
1]` in px, doffs is the x of cam1's principal point minus that of cam0's, baseline is in mm, and width, height and ndisp
may follow (https://vision.middlebury.edu/stereo/data/scenes2014/).

KITTI: lines `P0:` to `P3:` (odometry, object) or `P_rect_00:` to `P_rect_03:` (raw data), twelve numbers each: a
projection matrix by rows, whose P[0, 3] is -f times the camera's x in metres. Cameras 0 and 1 are grey, 2 and 3 colour
(Geiger et al., "Vision meets Robotics: The KITTI Dataset", 2013). Some copies leave the names out: then the lines are
P0, P1 and so on.
"""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Final

from common.byte_order_mark import without_mark
from common.errors import DataError
from common.files import read_input, read_whole
from phone_host.model import StereoGeometry

_MOST_BYTES: Final = 64 << 10
"""Limit for a file. The longest kind (KITTI's raw data) has about 4 KB."""

_LINE: Final = re.compile(r"\s*([A-Za-z]\w{0,31})\s*[=:]\s*(\S.*?)\s*")
_NUMBER: Final = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,3})?", re.ASCII)
_DECIMAL_COMMA: Final = re.compile(r"[+-]?\d{1,9},\d{1,9}", re.ASCII)
_KITTI_KEY: Final = re.compile(r"P(?:_rect_0)?([0-3])")
_BARE_KITTI_LINES: Final = (2, 4)
_PROJECTION_NUMBERS: Final = 12

_FOCAL_PX: Final = (1.0, 1e6)
_POINT_PX: Final = 1e6
"""Cropped images may have their principal point outside, but not farther than any sensor is wide."""

_BASELINE_M: Final = (1e-3, 100.0)
"""The widest published stereo rigs for ranges of kilometres are some metres wide; below a millimetre a unit is wrong."""

_SIZE_PX: Final = (1.0, 100_000.0)
_SAME_PX: Final = 0.01
"""By how much numbers may differ that rectified cameras have in common: files hold two digits or more after the point."""

_DOFFS_PX: Final = 1.0
"""By how much doffs may differ from the two principal points: smaller copies of a scene have them rounded."""

_MIDDLEBURY_KEYS: Final = frozenset({"cam0", "cam1", "doffs", "baseline", "ndisp"})

_REMEDY: Final = "give calib.txt as Middlebury, ETH3D or KITTI publish it, or --focal and --baseline"


class KittiCameras(Enum):
    """Which two of KITTI's four cameras the images come from: the number of the left one."""

    GREY = 0
    COLOUR = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class CalibTxt:
    """What a calib.txt says.

    Attributes:
        geometry: converts the disparity of the rectified images to metres.
        disparities: the number of disparities to search; None: not stated, or no less than the image's width.
        size_px: width and height of the images, px; None: not stated.
        cameras: the cameras it was read for, in words, such as "cam0 and cam1" or "P2 and P3 (colour)".
    """

    geometry: StereoGeometry
    disparities: int | None
    size_px: tuple[int, int] | None
    cameras: str


def is_calib_txt(path: Path) -> bool:
    """Return whether a file holds lines like a calib.txt's. False also for a file that cannot be read."""
    try:
        text = without_mark(read_whole(path, _MOST_BYTES)).decode()
    except (OSError, UnicodeDecodeError, DataError):
        return False
    if text.lstrip().startswith("%YAML"):
        return False
    bare = [line for line in text.splitlines() if line.strip()]
    keys = {found[1] for line in bare if (found := _LINE.fullmatch(line))}
    has_names = not _MIDDLEBURY_KEYS.isdisjoint(keys) or any(_KITTI_KEY.fullmatch(key) for key in keys)
    return has_names or _is_bare_kitti(bare)


def read_calib_txt(path: Path, prefer: KittiCameras = KittiCameras.GREY) -> CalibTxt:
    """Read a calib.txt of Middlebury, ETH3D or KITTI.

    Args:
        path: the file.
        prefer: which of KITTI's camera pairs is taken, if the file has both; without meaning for the other kinds.

    Raises:
        DataError: the file cannot be read, or a key is missing or not valid; names file and key.
    """
    try:
        text = without_mark(read_input(path, _MOST_BYTES, _REMEDY)).decode()
    except UnicodeDecodeError as error:
        raise DataError(f"{path} is no text", _REMEDY) from error
    values = _values(text, path)
    projections = {int(found[1]): key for key in values if (found := _KITTI_KEY.fullmatch(key))}
    if projections:
        return _kitti(path, values, projections, prefer)
    if not _MIDDLEBURY_KEYS.isdisjoint(values):
        return _middlebury(path, values)
    raise DataError(f"{path} has neither cam0= nor P0: or P_rect_00:", _REMEDY)


def _values(text: str, path: Path) -> dict[str, str]:
    """Return the text behind each key; bare lines of twelve numbers get KITTI's names."""
    values: dict[str, str] = {}
    bare = [line for line in text.splitlines() if line.strip()]
    if _is_bare_kitti(bare):
        return {f"P{index}": line for index, line in enumerate(bare)}
    for line in bare:
        found = _LINE.fullmatch(line)
        if found is None:
            continue  # comments, and what other programs add
        if found[1] in values:
            raise DataError(f"{path}: {found[1]} is there twice", _REMEDY)
        values[found[1]] = found[2]
    return values


def _is_bare_kitti(lines: list[str]) -> bool:
    return len(lines) in _BARE_KITTI_LINES and all(_are_numbers(line, _PROJECTION_NUMBERS) for line in lines)


def _are_numbers(text: str, count: int) -> bool:
    words = text.split()
    return len(words) == count and all(_NUMBER.fullmatch(word) for word in words)


def _middlebury(path: Path, values: Mapping[str, str]) -> CalibTxt:
    left, right = (_matrix(path, values, key) for key in ("cam0", "cam1"))
    for what, a, b in (("focal length", left[0], right[0]), ("y of the principal point", left[2], right[2])):
        _require_same(path, "cam0 and cam1", what, (a, b))
    doffs_px = right[1] - left[1]
    if "doffs" in values:
        stated_px = _number(path, values, "doffs", (-_POINT_PX, _POINT_PX), "px")
        if abs(stated_px - doffs_px) > _DOFFS_PX:
            raise DataError(f"{path}: doffs is {stated_px:g}, cam0 and cam1 say {doffs_px:g}", _REMEDY)
        doffs_px = stated_px
    baseline_mm = _number(path, values, "baseline", (_BASELINE_M[0] * 1e3, _BASELINE_M[1] * 1e3), "mm")
    size_px = None
    if "width" in values or "height" in values:
        size_px = _whole(path, values, "width"), _whole(path, values, "height")
    disparities = _whole(path, values, "ndisp") if "ndisp" in values else None
    # ETH3D states the image's width, which bounds nothing.
    if disparities is not None and size_px is not None and disparities >= size_px[0]:
        disparities = None
    return CalibTxt(
        geometry=StereoGeometry(
            focal_px=left[0], baseline_m=baseline_mm / 1e3, cx_px=left[1], cy_px=left[2], doffs_px=doffs_px
        ),
        disparities=disparities,
        size_px=size_px,
        cameras="cam0 and cam1",
    )


def _kitti(path: Path, values: Mapping[str, str], keys: Mapping[int, str], prefer: KittiCameras) -> CalibTxt:
    order = (prefer, *(each for each in KittiCameras if each is not prefer))
    chosen = next((each for each in order if each.value in keys and each.value + 1 in keys), None)
    if chosen is None:
        raise DataError(f"{path} has only {', '.join(sorted(keys.values()))}", "it needs P0 and P1, or P2 and P3")
    names = keys[chosen.value], keys[chosen.value + 1]
    left, right = (_projection(path, values, name) for name in names)
    both = f"{names[0]} and {names[1]}"
    for what, at in (("focal length", 0), ("y of the principal point", 6)):
        _require_same(path, both, what, (left[at], right[at]))
    baseline_m = (left[3] - right[3]) / left[0]
    if not _BASELINE_M[0] <= baseline_m <= _BASELINE_M[1]:
        raise DataError(f"{path}: {both} are {baseline_m:g} m apart", _REMEDY)
    size_key = f"S_rect_0{chosen.value}"
    size_px = None
    if size_key in values:
        words = values[size_key].split()
        if len(words) != 2:
            raise DataError(f"{path}: {size_key} is {_short(values[size_key])}", "it must be width and height in px")
        width_px, height_px = (_as_whole(path, size_key, word) for word in words)
        size_px = width_px, height_px
    return CalibTxt(
        geometry=StereoGeometry(
            focal_px=left[0], baseline_m=baseline_m, cx_px=left[2], cy_px=left[6], doffs_px=right[2] - left[2]
        ),
        disparities=None,
        size_px=size_px,
        cameras=f"{both} ({'grey' if chosen is KittiCameras.GREY else 'colour'})",
    )


def _require_same(path: Path, cameras: str, what: str, values: tuple[float, float]) -> None:
    if abs(values[0] - values[1]) > _SAME_PX:
        raise DataError(
            f"{path}: {cameras} differ in {what} ({values[0]:g}, {values[1]:g} px)",
            "rectified images have one; give rig.yaml for unrectified ones",
        )


def _matrix(path: Path, values: Mapping[str, str], key: str) -> tuple[float, float, float]:
    """Return f, cx and cy of a camera matrix `[f 0 cx; 0 f cy; 0 0 1]`."""
    text = _text(path, values, key)
    words = text.removeprefix("[").removesuffix("]").replace(";", " ").replace(",", " ")
    if not _are_numbers(words, 9):
        raise DataError(f"{path}: {key} is {_short(text)}", "it must be [f 0 cx; 0 f cy; 0 0 1]")
    fx, skew, cx, below, fy, cy, *last = (float(word) for word in words.split())
    square = abs(fx - fy) <= _SAME_PX and skew == 0 and below == 0 and last == [0, 0, 1]
    return _pinhole(path, key, (fx, cx, cy) if square else (math.nan, cx, cy), "[f 0 cx; 0 f cy; 0 0 1]")


def _projection(path: Path, values: Mapping[str, str], key: str) -> tuple[float, ...]:
    """Return the twelve numbers of a projection matrix of rectified images."""
    text = _text(path, values, key)
    if not _are_numbers(text, _PROJECTION_NUMBERS):
        raise DataError(f"{path}: {key} is {_short(text)}", "it must be 12 numbers, a 3x4 matrix by rows")
    numbers = tuple(float(word) for word in text.split())
    fx, fy = numbers[0], numbers[5]
    upright = abs(fx - fy) <= _SAME_PX and (numbers[1], numbers[4], *numbers[8:11]) == (0, 0, 0, 0, 1)
    finite = upright and math.isfinite(numbers[3])
    _pinhole(path, key, (fx if finite else math.nan, numbers[2], numbers[6]), "f 0 cx t 0 f cy 0 0 0 1 0")
    return numbers


def _pinhole(path: Path, key: str, found: tuple[float, float, float], form: str) -> tuple[float, float, float]:
    focal_px, cx_px, cy_px = found
    if not (_FOCAL_PX[0] <= focal_px <= _FOCAL_PX[1] and abs(cx_px) <= _POINT_PX and abs(cy_px) <= _POINT_PX):
        raise DataError(f"{path}: {key} is no camera of rectified images", f"it must be {form} in px")
    return found


def _text(path: Path, values: Mapping[str, str], key: str) -> str:
    if key not in values:
        raise DataError(f"{path}: {key} is missing", _REMEDY)
    return values[key]


def _number(path: Path, values: Mapping[str, str], key: str, limits: tuple[float, float], unit: str) -> float:
    text = _text(path, values, key)
    value = float(text) if _NUMBER.fullmatch(text) else math.nan
    if not limits[0] <= value <= limits[1]:
        remedy = f"it must be a number in {unit}, from {limits[0]:g} to {limits[1]:g}"
        if _DECIMAL_COMMA.fullmatch(text):
            remedy += f", with a decimal point: {text.replace(',', '.')}"
        elif 0 < value < limits[0] and unit == "mm":
            remedy += f"; {value:g} m are {value * 1e3:g} mm"
        raise DataError(f"{path}: {key} is {_short(text)}", remedy)
    return value


def _whole(path: Path, values: Mapping[str, str], key: str) -> int:
    return _as_whole(path, key, _text(path, values, key))


def _as_whole(path: Path, key: str, text: str) -> int:
    value = float(text) if _NUMBER.fullmatch(text) else math.nan
    if not (_SIZE_PX[0] <= value <= _SIZE_PX[1] and value == int(value)):
        raise DataError(f"{path}: {key} is {_short(text)}", "it must be a whole number of px above 0")
    return int(value)


def _short(text: str) -> str:
    """Return a value as messages quote it; files may hold anything."""
    return repr(text if len(text) <= 40 else text[:37] + "...")
