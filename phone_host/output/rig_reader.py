"""Reads the keys of a rig.yaml one by one, and checks each; `rig_yaml` says what they mean."""

import math
import re
from pathlib import Path
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from common.camera_identity import RememberedCamera
from common.errors import DataError
from common.files import read_input
from common.versions import RIG_FORMAT
from common.words import counted
from phone_host.model import CameraModel, TimeOffset, Verdict
from phone_host.output.rig_agreement import KeptRectification
from phone_host.output.rig_cameras import known_lens, read_camera, require_count, usual_lens
from phone_host.output.rig_views import KEY as VIEWS
from phone_host.output.rig_views import RigViews, read_covariance, read_views

MOST_LEVELS: Final = 64
"""A rig.yaml has three levels. OpenCV's parser survives 20000 on a stack of 8 MB."""

_BLOCK: Final = re.compile(r":|-(?![\d.])")
"""Begins a value that may itself be a map or a list; a sign before a number does not."""


def is_too_deep(text: str) -> bool:
    """Return whether a YAML text may nest more than `MOST_LEVELS` levels deep: OpenCV's parser calls itself for each, and a deep file overflows its stack.

    The depth is never less than the parser's, whatever the text is, and as a rule the same. So:
    - an opening bracket always counts, even in quotes or in a key;
    - a closing one counts only where it cannot be part of a text: on a line without quotes and comments, behind the last colon;
    - what a line leaves open ends at the next line that begins in the first column, because there the parser allows no inner value.
    """
    brackets = 0
    columns: list[int] = []  # of the maps and lists without brackets that are open
    for line in re.split(r"[\r\n]", text):
        words = line.lstrip(" ")
        if not words or words.startswith("#"):
            continue
        column = len(line) - len(words)
        if column == 0:
            brackets = 0
        while columns and columns[-1] >= column:
            columns.pop()
        columns.append(column)
        if words != "---":
            columns.extend(column + mark.end() for mark in _BLOCK.finditer(words))
        brackets += words.count("[") + words.count("{")
        if brackets + len(columns) > MOST_LEVELS:
            return True
        if not re.search(r"[\"'#]", words):
            after = words.rpartition(":")[2]
            brackets = max(0, brackets - after.count("]") - after.count("}"))
    return False


_LARGEST_IMAGE_PX = 100_000
_ROTATION_TOLERANCE = 1e-6  # files hold 16 digits; a matrix typed with 6 digits has this error
# The two cameras of a scanner never stand farther apart; a larger number is a T in millimetres.
_LARGEST_BASELINE_M = 10.0
_LEAST_BASELINE_M = 1e-3  # as for --baseline and calib.txt
_LARGEST_OFFSET_NS = 2e9  # no camera with its driver is seconds behind another one
_LARGEST_NUMBER = 1e9  # ten thousand times the width of the largest image; beyond it sums of squares may overflow
_FOCAL_WIDTHS = (0.05, 50.0)  # focal length / image width: views of 169 degrees and of 1 degree
_MOST_ASIDE = 1.5  # image sizes from the middle to the principal point: even that of a crop is not so far away
_LARGEST_ERROR_PX = 1e6  # of rms and zero_sigma: calibrations that failed have some thousands

_MOST_BYTES = 16 << 20
"""Limit for a rig.yaml: some pages, and 5 kB for each pair of views."""

_WHOLE_FROM = 2
_ALWAYS = (
    *("board_side", "lens1", "lens2", "R1", "R2", "P1", "P2", "Q", "rectified_image_width", "rectified_image_height"),
    *("rms_left", "rms_right", "rms_stereo", "zero_sigma", "time_offset_ns", "time_offset_uncertainty_ns"),
)
"""What each file from format 2 on holds beside the rig itself."""

_BOARD_FROM = 3
"""From this format on views name their board."""


class RigReader:
    """A FileStorage whose values are checked one by one; every error names file and key.

    Args:
        path: the file.
        content: what is in it; None: it is read.

    Raises:
        DataError: it cannot be read, or is no FileStorage YAML. The methods raise it for keys that are missing or not valid.
    """

    def __init__(self, path: Path, content: bytes | None = None) -> None:
        self._path = path
        self.version = 1
        try:
            given = (
                read_input(path, _MOST_BYTES, "give the rig.yaml of `phone-host calibrate`")
                if content is None
                else content
            )
            text = given.decode("utf-8")
        except UnicodeDecodeError as error:
            raise self._no_storage() from error
        # OpenCV would also accept JSON and XML, and abort on other text with a message of its own.
        if not text.lstrip("\ufeff").startswith("%YAML") or is_too_deep(text):
            raise self._no_storage()
        if "\0" in text:  # OpenCV's text would end there, without a word
            raise DataError(f"{path} holds a NUL character", "it is damaged: copy it again, or calibrate again")
        try:
            self._storage = cv2.FileStorage(text, cv2.FILE_STORAGE_READ | cv2.FILE_STORAGE_MEMORY)
        except (cv2.error, SystemError) as error:
            raise self._no_storage() from error
        if not self._storage.root().isMap():  # a list, or nothing: OpenCV aborts when asked for a key
            raise self._no_storage()

    def _no_storage(self) -> DataError:
        return DataError(
            f"{self._path} is not a calibration file",
            "give the rig.yaml of `phone-host calibrate`, or a calib.txt of Middlebury, ETH3D or KITTI",
        )

    def problem(self, key: str, what: str, remedy: str) -> DataError:
        """Return the error of a key."""
        return DataError(f"{self._path}: {key} {what}", remedy)

    def _node(self, key: str) -> cv2.FileNode:
        node = self._storage.getNode(key)
        if node.empty() or node.isNone():
            raise self.problem(key, "is missing", "calibrate again, or add the key")
        return node

    def require_known_format(self) -> None:
        """Check that this program knows the file's format; a newer format may use the same keys with another meaning."""
        node = self._storage.getNode("format_version")
        if node.empty():
            return
        value = node.real() if node.isInt() or node.isReal() else math.nan
        if not (math.isfinite(value) and value >= 1 and value == int(value)):
            raise self.problem("format_version", "is no version", "calibrate again")
        if value > RIG_FORMAT:
            known = f"is {value:.0f}, this program reads up to {RIG_FORMAT}"
            raise self.problem("format_version", known, "update tandemscan, or calibrate again")
        self.version = int(value)

    @property
    def is_whole(self) -> bool:
        """Whether the file's format says that all keys are there."""
        return self.version >= _WHOLE_FROM

    def require_all_keys(self) -> None:
        """Check that a file of ours was not cut off."""
        if not self.is_whole:
            return
        has_sigmas = not self._storage.getNode("sigma_M1").empty()
        for key in (*_ALWAYS, *(("covariance",) if has_sigmas else ())):
            if self._storage.getNode(key).empty():
                raise self.problem(key, "is missing", "the file was cut off: copy it again, or calibrate again")

    def rectification(self) -> KeptRectification:
        """Read the rectification, as far as it is there."""
        shapes = {"R1": (3, 3), "R2": (3, 3), "P1": (3, 4), "P2": (3, 4), "Q": (4, 4)}
        there = {key: not self._storage.getNode(key).empty() for key in shapes}
        return KeptRectification(**{key: self._shaped(key, shapes[key]) if there[key] else None for key in shapes})

    def matrix(self, key: str) -> NDArray[np.float64]:
        """Read any matrix of finite numbers, as float64."""
        node = self._node(key)
        try:
            values = node.mat() if node.isMap() else None
        except cv2.error:
            values = None
        if values is None or values.size == 0:
            raise self.problem(key, "is no matrix", "calibrate again")
        matrix = np.asarray(values, dtype=np.float64)
        if not np.isfinite(matrix).all():
            raise self.problem(key, "holds values that are not finite", "calibrate again")
        if np.abs(matrix).max() > _LARGEST_NUMBER:
            raise self.problem(key, f"holds {np.abs(matrix).max():g}, which no camera has", "calibrate again")
        return matrix

    def _shaped(self, key: str, shape: tuple[int, int]) -> NDArray[np.float64]:
        matrix = self.matrix(key)
        if matrix.shape != shape:
            raise self.problem(key, f"is {'x'.join(map(str, matrix.shape))}", f"it must be {shape[0]}x{shape[1]}")
        return matrix

    def camera_model(self, side: str, number: str) -> CameraModel:
        """Read one camera."""
        width_key, height_key = f"{side}_image_width", f"{side}_image_height"
        matrix_key, distortion_key, lens_key = f"M{number}", f"D{number}", f"lens{number}"
        matrix = self._shaped(matrix_key, (3, 3))
        if not (matrix[0, 0] > 0 and matrix[1, 1] > 0) or not np.array_equal(matrix[2], [0, 0, 1]):
            raise self.problem(
                matrix_key, "is no camera matrix", "its focal lengths are positive, its last row is 0 0 1"
            )
        if matrix[0, 1] != 0 or matrix[1, 0] != 0:  # OpenCV's formulas leave them out, without a word
            raise self.problem(matrix_key, "is skewed", "calibrate again: the pixels of cameras are not")
        width_px = self.size(width_key)
        for focal_px in (matrix[0, 0], matrix[1, 1]):
            if not _FOCAL_WIDTHS[0] <= focal_px / width_px <= _FOCAL_WIDTHS[1]:
                raise self.problem(
                    matrix_key,
                    f"has a focal length of {focal_px:g} px for images {width_px} px wide",
                    "calibrate again, or give it in px",
                )
        size_px = np.array([width_px, self.size(height_key)])
        if not (np.abs(matrix[:2, 2] - size_px / 2) <= _MOST_ASIDE * size_px).all():
            point = ",".join(f"{at:g}" for at in matrix[:2, 2])
            raise self.problem(
                matrix_key, f"has its principal point at {point} px", "calibrate again: it lies near the image's middle"
            )
        distortion = self.matrix(distortion_key)
        lens = known_lens(self.text(lens_key, usual_lens(distortion.size).value), lens_key, self.problem)
        require_count(distortion, lens, distortion_key, self.problem)
        return CameraModel(
            width_px=width_px,
            height_px=self.size(height_key),
            matrix=matrix,
            distortion=distortion.reshape(-1),
            lens=lens,
        )

    def covariance(self) -> NDArray[np.float64]:
        """Read how well the rig is known; NaN if it is missing."""
        return read_covariance(self._storage.getNode("covariance"), self.problem)

    def views(self) -> RigViews | None:
        """Read what the rig was computed from; None if it is missing."""
        views = read_views(self._storage, self.problem)
        if views is not None and not views.board and self.version >= _BOARD_FROM:
            raise self.problem(f"{VIEWS}.board", "is missing", "calibrate again from all pictures")
        return views

    def size(self, key: str) -> int:
        """Read an image's width or height."""
        node = self._node(key)
        value = node.real() if node.isInt() or node.isReal() else math.nan
        if not (1 <= value <= _LARGEST_IMAGE_PX and value == int(value)):
            raise self.problem(key, "is no image size", "give whole pixels")
        return int(value)

    def rotation(self, key: str) -> NDArray[np.float64]:
        """Read a rotation matrix."""
        matrix = self._shaped(key, (3, 3))
        if np.abs(matrix @ matrix.T - np.eye(3)).max() > _ROTATION_TOLERANCE or np.linalg.det(matrix) < 0:
            raise self.problem(key, "is no rotation", "calibrate again")
        return matrix

    def baseline(self, key: str) -> NDArray[np.float64]:
        """Read a translation between two cameras, m."""
        matrix = self.matrix(key)
        if matrix.size != 3:
            raise self.problem(key, f"has {counted(matrix.size, 'value')}", "it must have 3")
        length_m = float(np.linalg.norm(matrix))
        if length_m == 0:
            raise self.problem(key, "is 0: both cameras at one place", "calibrate again")
        if length_m < _LEAST_BASELINE_M:
            raise self.problem(key, f"is {length_m:g} m long", "no two cameras are nearer than 1 mm; calibrate again")
        if length_m > _LARGEST_BASELINE_M:
            raise self.problem(key, f"is {length_m:g} m long", "T is in metres; divide millimetres by 1000")
        return matrix.reshape(3)

    def number(self, key: str) -> float:
        """Read a figure that may be missing (NaN)."""
        node = self._storage.getNode(key)
        if node.empty() or node.isNone():
            return math.nan
        if not (node.isReal() or node.isInt()):
            raise self.problem(key, "is no number", "calibrate again, or remove it")
        return float(node.real())

    def error_px(self, key: str) -> float:
        """Read the size of an error, px, which may be missing or unknown (NaN)."""
        value = self.number(key)
        if value < 0 or value > _LARGEST_ERROR_PX:
            raise self.problem(key, f"is {value:g} px", "calibrate again, or remove it")
        return value

    def time_offset(self) -> TimeOffset:
        """Read the measured time offset, or return the default if none was measured."""
        offset_ns, uncertainty_ns = self.number("time_offset_ns"), self.number("time_offset_uncertainty_ns")
        if math.isnan(offset_ns) and math.isnan(uncertainty_ns):
            return TimeOffset()
        if not abs(offset_ns) <= _LARGEST_OFFSET_NS:
            raise self.problem("time_offset_ns", f"is {offset_ns:g}", "measure it: phone-host calibrate-time")
        if not 0 < uncertainty_ns <= _LARGEST_OFFSET_NS:
            raise self.problem(
                "time_offset_uncertainty_ns", f"is {uncertainty_ns:g}", "measure it: phone-host calibrate-time"
            )
        return TimeOffset(round(offset_ns), round(uncertainty_ns))

    def verdict(self) -> Verdict | None:
        """Read what the calibration is good for; None if it is missing."""
        value = self.text("verdict", "")
        known = [each.value for each in Verdict]
        if value and value not in known:
            raise self.problem("verdict", f"is {value!r}", f"write {', '.join(known[:-1])} or {known[-1]}")
        return Verdict(value) if value else None

    def camera(self, key: str, model: CameraModel) -> RememberedCamera | None:
        """Read which camera one of the two was; None if it is missing."""
        return read_camera(self._storage.getNode(key), key, (model.width_px, model.height_px), self.problem)

    def text(self, key: str, default: str) -> str:
        """Read a word; return the default if it is missing."""
        node = self._storage.getNode(key)
        if node.empty() or node.isNone():
            return default
        if not node.isString():
            raise self.problem(key, "is no word", "calibrate again, or remove it")
        return str(node.string())
