"""rig.yaml: a calibrated rig as OpenCV FileStorage YAML, readable by `cv2.FileStorage` anywhere.

Keys: format_version (absent: 1); left_image_width, left_image_height, right_image_width, right_image_height (px); M1 D1
M2 D2 (camera matrices and distortion, left and right); lens1, lens2 (what the distortion means: pinhole, rational or fisheye;
absent: pinhole with 4 or 5 coefficients, rational with more); R T (right from left, T in metres); R1 R2 P1 P2 Q
(rectification); rectified_image_width, rectified_image_height (the size for which P1 and P2 hold); board_side; rms_left
rms_right rms_stereo (px, .Nan = unknown); zero_sigma (standard uncertainty of the disparity of infinitely far points, px;
absent or .Nan: not measured); verdict (good, usable, reject; absent: not stated); left_camera, right_camera (see
`rig_cameras`); time_offset_ns, time_offset_uncertainty_ns (host's stamp minus board's;
absent: not measured); how well all of it is known (see `rig_sigmas`); views (see `rig_views`). This program reads only the rig and computes the rectification from it. R1 to Q are there for
other programs; a rig that they contradict is refused. Of a file from format 2 on nothing may be missing but verdict, cameras,
uncertainties and views: one that was cut off would lose its verdict without a word.
"""

import math
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from common.camera_identity import RememberedCamera
from common.errors import DataError
from common.files import read_whole
from common.versions import RIG_FORMAT
from phone_host.model import CameraModel, Rectification, Rig, Side, TimeOffset, Verdict
from phone_host.output.atomic import write_text
from phone_host.output.rig_agreement import KeptRectification, require_agreement, require_own_focal
from phone_host.output.rig_cameras import read_camera, write_camera
from phone_host.output.rig_lenses import known_lens, lens_of, require_count, usual_lens
from phone_host.output.rig_sigmas import read_covariance, write_sigmas
from phone_host.output.rig_views import RigViews, read_views, write_views
from phone_host.output.yaml_depth import is_too_deep

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


def write_rig(path: Path, rig: Rig, rectification: Rectification, views: RigViews | None = None) -> None:
    """Write a rig and its rectification.

    Args:
        path: the file; it appears whole or not at all.
        rig: the two cameras.
        rectification: computed from the same rig.
        views: what it was computed from; None: not known.

    Raises:
        OSError: the file cannot be written.
    """
    storage = cv2.FileStorage(".yaml", cv2.FILE_STORAGE_WRITE | cv2.FILE_STORAGE_MEMORY)
    storage.write("format_version", RIG_FORMAT)
    storage.write("left_image_width", rig.left.width_px)
    storage.write("left_image_height", rig.left.height_px)
    storage.write("right_image_width", rig.right.width_px)
    storage.write("right_image_height", rig.right.height_px)
    storage.write("board_side", rig.board_side.value)
    storage.write("lens1", lens_of(rig.left).value)
    storage.write("lens2", lens_of(rig.right).value)
    storage.write("M1", rig.left.matrix)
    storage.write("D1", rig.left.distortion.reshape(1, -1))
    storage.write("M2", rig.right.matrix)
    storage.write("D2", rig.right.distortion.reshape(1, -1))
    storage.writeComment("a point of the left camera's axes is R p + T in the right camera's; T in metres")
    storage.write("R", rig.R_right_left)
    storage.write("T", rig.t_right_left_m.reshape(3, 1))
    storage.writeComment("rectification: rotations, projections (metres), disparity to metres, size of both images")
    storage.write("R1", rectification.R_left)
    storage.write("R2", rectification.R_right)
    storage.write("P1", rectification.P_left)
    storage.write("P2", rectification.P_right)
    storage.write("Q", rectification.Q)
    storage.write("rectified_image_width", rectification.width_px)
    storage.write("rectified_image_height", rectification.height_px)
    storage.writeComment("reprojection errors of the calibration, px")
    storage.write("rms_left", rig.rms_left_px)
    storage.write("rms_right", rig.rms_right_px)
    storage.write("rms_stereo", rig.rms_stereo_px)
    storage.writeComment("standard uncertainty of the disparity of infinitely far points, px; what the rig is good for")
    storage.write("zero_sigma", rig.zero_sigma_px)
    if rig.verdict is not None:
        storage.write("verdict", rig.verdict.value)
    for key, camera in (("left_camera", rig.left_camera), ("right_camera", rig.right_camera)):
        if camera is not None:
            write_camera(storage, key, camera)
    storage.writeComment(
        "the host camera's stamp minus the board camera's for one moment, ns, and what contains it in 99.9 %"
    )
    # Written as reals: FileStorage's integers have 32 bits, which is 2 s.
    storage.write("time_offset_ns", float(rig.time_offset.offset_ns))
    storage.write("time_offset_uncertainty_ns", float(rig.time_offset.uncertainty_ns))
    write_sigmas(storage, rig)
    if views is not None:
        storage.writeComment("what the rig was computed from: calibrate --from adds to it")
        write_views(storage, views)
    write_text(path, storage.releaseAndGetString())


def write_time_offset(path: Path, offset: TimeOffset) -> None:
    """Put a time offset into a rig.yaml; everything else in it stays as it is.

    Args:
        path: a file that `read_rig` accepts.
        offset: the measured offset.

    Raises:
        OSError: the file cannot be written.
    """
    lines = path.read_text(encoding="utf-8").splitlines()
    kept = [line for line in lines if not line.startswith(("time_offset_ns:", "time_offset_uncertainty_ns:"))]
    values = [f"time_offset_ns: {offset.offset_ns}.", f"time_offset_uncertainty_ns: {offset.uncertainty_ns}."]
    write_text(path, "\n".join([*kept, *values]) + "\n")


def read_rig(path: Path) -> Rig:
    """Read a rig and check it.

    Args:
        path: a rig.yaml of this program, or any FileStorage file with the same keys.

    Returns:
        The rig.

    Raises:
        DataError: the file is missing or not FileStorage YAML, or a key is missing or not valid; names file and key.
    """
    reader = _Reader(path)
    reader.require_known_format()
    reader.require_all_keys()
    baseline_m = reader.baseline("T")
    left = reader.camera_model("left", "1")
    right = reader.camera_model("right", "2")
    side = reader.text("board_side", Side.LEFT.value)
    if side not in {choice.value for choice in Side}:
        raise reader.problem("board_side", f"is {side!r}", "write left or right")
    rotation = reader.rotation("R")
    kept = reader.rectification()
    require_agreement(kept, rotation, baseline_m, reader.problem)
    if reader.version >= _WHOLE_FROM:
        require_own_focal(kept, left, right, reader.problem)
    return Rig(
        left=left,
        right=right,
        R_right_left=rotation,
        t_right_left_m=baseline_m,
        board_side=Side(side),
        rms_left_px=reader.error_px("rms_left"),
        rms_right_px=reader.error_px("rms_right"),
        rms_stereo_px=reader.error_px("rms_stereo"),
        time_offset=reader.time_offset(),
        zero_sigma_px=reader.error_px("zero_sigma"),
        verdict=reader.verdict(),
        left_camera=reader.camera("left_camera", left),
        right_camera=reader.camera("right_camera", right),
        covariance=reader.covariance(),
    )


def read_rig_views(path: Path) -> RigViews | None:
    """Read what a rig was computed from.

    Args:
        path: a rig.yaml that `read_rig` accepts.

    Returns:
        The views; None if the file has none.

    Raises:
        DataError: the views are not valid; names file and key.
    """
    return _Reader(path).views()


def is_rig(path: Path) -> bool:
    """Return whether a file begins like FileStorage YAML, or like a rig.yaml that lost its first line. False also for a file that cannot be read."""
    try:
        with path.open("rb") as file:
            return file.read(16).removeprefix(b"\xef\xbb\xbf").startswith((b"%YAML", b"format_version:"))
    except OSError:
        return False


_MOST_BYTES = 16 << 20
"""Limit for a rig.yaml: some pages, and 5 kB for each pair of views."""

_WHOLE_FROM = 2
_ALWAYS = (
    *("board_side", "lens1", "lens2", "R1", "R2", "P1", "P2", "Q", "rectified_image_width", "rectified_image_height"),
    *("rms_left", "rms_right", "rms_stereo", "zero_sigma", "time_offset_ns", "time_offset_uncertainty_ns"),
)
"""What each file from format 2 on holds beside the rig itself."""


class _Reader:
    """A FileStorage whose values are checked one by one; every error names file and key."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self.version = 1
        try:
            text = read_whole(path, _MOST_BYTES).decode("utf-8")
        except OSError as error:
            raise DataError(
                f"{path} cannot be read ({error.strerror})", "give the rig.yaml of `phone-host calibrate`"
            ) from error
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

    def require_all_keys(self) -> None:
        """Check that a file of ours was not cut off."""
        if self.version < _WHOLE_FROM:
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
        return read_views(self._storage, self.problem)

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
            raise self.problem(key, f"has {matrix.size} values", "it must have 3")
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
