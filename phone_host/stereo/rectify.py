"""Rectification of two unlike cameras, with different resolution, focal length and distortion.

`cv2.stereoRectify` takes one image size for both cameras and uses it for both fields of view, both focal lengths and
both principal points, so it is wrong for two sizes. Here each camera's field of view is computed with its own model:

- rotation: Bouguet's. Each camera turns by half of the rotation between them, then both together so that the baseline
  becomes the x axis; neither image is distorted more than the other.
- focal length: that of the coarser camera. The finer camera's extra pixels have no partner, and work grows with the
  square.
- window: the largest rectangle that both cameras fill with measured pixels, over the same slopes in both. So both
  images share the principal point (doffs = 0, infinity has disparity 0) and have no black border that a matcher would
  take for texture.

Cameras that stand one above the other are rectified in the same way, with the baseline as the y axis: their epipolar
lines are columns, as with `cv2.stereoRectify`. Only the matcher turns such images, by a quarter (`stacked`).

Source: J.-Y. Bouguet, Camera Calibration Toolbox, 2000; A. Fusiello et al., "A compact algorithm for rectification of stereo
pairs", 2000; OpenCV's calib3d documentation for P1, P2 and Q.
"""

import math
from copy import copy

import cv2
import numpy as np
from numpy.typing import NDArray

from common.errors import DataError
from common.imagesize.head import size_text
from phone_host.geometry.lens import project, rays_through
from phone_host.model import (
    AS_CALIBRATED,
    CameraModel,
    Departure,
    Epipolar,
    Image,
    Lens,
    Rectification,
    RectifiedPair,
    Rig,
    Side,
    StereoGeometry,
)
from phone_host.stereo.departure import corrected_rectification, corrected_rig
from phone_host.stereo.images import size_px
from phone_host.stereo.remap import Maps, remap
from phone_host.stereo.two_threads import in_two_threads

Matrix = NDArray[np.float64]

_LEAST_BASELINE_M = 5e-4
"""No two cameras stand nearer to each other."""

_RECALIBRATE = "calibrate the rig again"
_ROUND_TRIP_LIMIT_PX = 0.01
_SAMPLES_PER_EDGE = 65  # the outline bends slowly: between two of 65 samples it moves by less than 0.01 px
# A polynomial fitted to points in the middle may fold back near the corners; the usable field of view then ends before
# that.
_FIELD_SHARES = (1.0, 0.97, 0.94, 0.9, 0.85, 0.8, 0.7, 0.6, 0.5)
# Real lenses pull corners outwards by a tenth or so. A model that makes 10 px of 7 was fitted to nothing.
_LEAST_SQUEEZE = 0.7
# Beyond it a pixel at the edge would become a line of pixels. 170 degrees of a usual fisheye lens reach two diagonals.
_MOST_DIAGONALS = 3.0
# A rectified image is flat: it grows with the tangent, and a fisheye lens may see beyond 90 degrees. At 65 degrees a pixel covers a
# sixth of the solid angle of one in the middle.
_MOST_SLOPE = math.tan(math.radians(65.0))
_LEAST_SIZE_PX = 32
_WHOLE_PX = 1e-6  # rounding of ideal cameras' windows, which are whole pixels wide, must not cost a row
_MOST_KEPT_PIXELS = 4_000_000  # twice 1920 x 1080: what a live camera sends. The maps take 6 bytes per pixel and side.
_STRIP_ROWS = 256
_TO_RIGHT = {
    Epipolar.LEFT: np.array([1.0, 0.0, 0.0]),
    Epipolar.UP: np.array([0.0, 1.0, 0.0]),
    Epipolar.DOWN: np.array([0.0, -1.0, 0.0]),
}
"""From the left camera to the right one in the rectified axes (x right, y down)."""


def rectify_rig(rig: Rig) -> Rectification:
    """Find the common rotation, focal length and window of a rig.

    Args:
        rig: two calibrated cameras.

    Returns:
        The rectification.

    Raises:
        DataError: left and right are swapped, one camera stands in front of the other, their fields of view do not
            overlap, or a distortion model cannot be inverted.
    """
    left_rotation, right_rotation, baseline_m, epipolar = _rotations(rig)
    focal_px = min(_mean_focal_px(rig.left), _mean_focal_px(rig.right))
    windows = (
        _filled_window(rig.left, left_rotation, Side.LEFT),
        _filled_window(rig.right, right_rotation, Side.RIGHT),
    )
    x0, y0 = np.max([window[:2] for window in windows], axis=0)
    x1, y1 = np.min([window[2:] for window in windows], axis=0)
    width_px = math.floor(focal_px * (x1 - x0) + _WHOLE_PX) + 1
    height_px = math.floor(focal_px * (y1 - y0) + _WHOLE_PX) + 1
    if width_px < _LEAST_SIZE_PX or height_px < _LEAST_SIZE_PX:
        raise DataError(
            f"the two cameras' fields of view overlap by {max(width_px, 0)}x{max(height_px, 0)} px only",
            f"turn the cameras towards the same scene and {_RECALIBRATE}",
        )
    geometry = StereoGeometry(
        focal_px=focal_px, baseline_m=baseline_m, cx_px=float(-focal_px * x0), cy_px=float(-focal_px * y0)
    )
    projection = np.array([[focal_px, 0, geometry.cx_px, 0], [0, focal_px, geometry.cy_px, 0], [0, 0, 1, 0]])
    shift = np.zeros((3, 4))
    shift[:2, 3] = -focal_px * baseline_m * _TO_RIGHT[epipolar][:2]
    to_metres = np.array(
        [
            [1, 0, 0, -geometry.cx_px],
            [0, 1, 0, -geometry.cy_px],
            [0, 0, 0, focal_px],
            [0, 0, 1 / baseline_m, geometry.doffs_px / baseline_m],
        ]
    )
    return Rectification(
        geometry,
        width_px,
        height_px,
        R_left=left_rotation,
        R_right=right_rotation,
        P_left=projection,
        P_right=projection + shift,
        Q=to_metres,
        epipolar=epipolar,
    )


def across_lines_px(
    left_px: NDArray[np.floating], right_px: NDArray[np.floating], epipolar: Epipolar
) -> NDArray[np.float64]:
    """Measure how far rectified points lie beside each other's epipolar line: the vertical error of cameras side by side.

    Args:
        left_px: (N, 2), px, as `rectify_points` gives them.
        right_px: (N, 2), the same points in the right image.
        epipolar: which way the lines run.

    Returns:
        (N,) left minus right across the lines, px.
    """
    axis = 0 if epipolar.is_vertical else 1
    return np.asarray(left_px[:, axis] - right_px[:, axis], dtype=np.float64)


def rectify_points(
    points_px: NDArray[np.floating], model: CameraModel, rotation: Matrix, geometry: StereoGeometry
) -> NDArray[np.float64]:
    """Map measured points of one camera to its rectified image.

    Args:
        points_px: (N, 2), px, in the camera's own image.
        model: of the camera.
        rotation: (3, 3) from the camera's axes to the rectified ones (`R_left` or `R_right`).
        geometry: of the rectified pair.

    Returns:
        (N, 2) float64, px.
    """
    slopes = _rectified_slopes(points_px, model, rotation)
    points: NDArray[np.float64] = slopes * geometry.focal_px + np.array([geometry.cx_px, geometry.cy_px])
    return points


class Rectifier:
    """Remaps the images of a rig to a rectified pair; the maps are computed once.

    Attributes:
        rig: the rig it was made for, as it stands now.
        rectification: rotations, projections and size.
        geometry: of the rectified pair.
        overlay: how the right camera departs from the rig that was calibrated.

    Args:
        rig: two calibrated cameras.

    Raises:
        DataError: see `rectify_rig`.
    """

    def __init__(self, rig: Rig) -> None:
        self.rig = rig
        self.rectification = rectify_rig(rig)
        self.geometry = self.rectification.geometry
        self.overlay = AS_CALIBRATED
        self._left = _Remap(rig.left, self.rectification.R_left, self.rectification)
        self._right = _Remap(rig.right, self.rectification.R_right, self.rectification)

    def corrected(self, departure: Departure) -> "Rectifier":
        """Return a rectifier for the same rig whose right camera has turned since; the left image's maps are shared.

        Args:
            departure: how the right camera departs from the rig that was calibrated.
        """
        if departure == self.overlay:
            return self
        made = copy(self)
        made.rig = corrected_rig(self.rig, departure)
        made.rectification = corrected_rectification(self.rectification, departure)
        made.overlay = departure
        made._right = _Remap(made.rig.right, made.rectification.R_right, made.rectification, self._right.shrink)  # noqa: SLF001  # its own
        return made

    @property
    def reductions(self) -> tuple[int, int]:
        """By how much the left and the right image may be smaller, 1, 2, 4 or 8: a finer camera's image is averaged down first, which a decoder of JPEG does for less."""
        return self._left.reduction, self._right.reduction

    def require_sizes(self, left_px: tuple[int, int], right_px: tuple[int, int]) -> None:
        """Check that the images have their cameras' sizes.

        Args:
            left_px: width and height of the left image, px.
            right_px: width and height of the right image, px.

        Raises:
            DataError: an image's size differs from that of its camera in the rig.
        """
        for found_px, model, side in ((left_px, self.rig.left, Side.LEFT), (right_px, self.rig.right, Side.RIGHT)):
            if found_px != (model.width_px, model.height_px):
                raise DataError(
                    f"the {side.value} image is {size_text(found_px)} px, rig.yaml was calibrated for"
                    f" {model.width_px}x{model.height_px}",
                    "use the size of the calibration; StereoCore takes others, too",
                )

    def rectify(self, left: Image, right: Image) -> RectifiedPair:
        """Rectify a pair of images as the cameras sent them.

        Args:
            left: (H, W) grey or (H, W, 3) BGR, uint8, the left camera's size, or that divided by its reduction.
            right: the same of the right camera.

        Returns:
            The pair, both of the rectification's size, every pixel filled.

        Raises:
            DataError: an image's size differs from that of its camera in the rig.
        """
        self.require_sizes(self._left.whole_px(size_px(left)), self._right.whole_px(size_px(right)))
        first, second = in_two_threads(lambda: self._left.apply(left), lambda: self._right.apply(right))
        return RectifiedPair(first, second, self.rectification.epipolar)


class _Remap:
    """The remapping of one camera's image to the rectified one.

    The maps of large images are not kept but computed strip by strip: those of 50 megapixels would take 300 MB a side.
    """

    def __init__(
        self, model: CameraModel, rotation: Matrix, rectification: Rectification, shrink: int | None = None
    ) -> None:
        self._model, self._rotation = model, rotation
        self._projection = rectification.P_left[:, :3]  # P_right's first three columns are the same
        self._width, self._height = rectification.width_px, rectification.height_px
        # Bilinear interpolation reads 2 x 2 pixels. A camera twice as fine as the result would alias, so average it
        # down first.
        finer = max(1, int(_mean_focal_px(model) / rectification.geometry.focal_px + 1e-6))
        self.shrink = finer if shrink is None else shrink  # a corrected focal length decodes as the calibrated one
        self._kept = self._maps(0, self._height) if self._width * self._height <= _MOST_KEPT_PIXELS else None

    @property
    def reduction(self) -> int:
        """The largest power of 2, up to 8, that divides the factor by which images are averaged down."""
        return min(self.shrink & -self.shrink, 8)

    def whole_px(self, size_px: tuple[int, int]) -> tuple[int, int]:
        """Return the size of the image that was decoded to this size, px; the size itself if it was not reduced."""
        width, height = (length * self.reduction for length in size_px)
        return (width, height) if (width, height) == (self._model.width_px, self._model.height_px) else size_px

    def apply(self, image: Image) -> Image:
        shrink = self.shrink if image.shape[1] == self._model.width_px else self.shrink // self.reduction
        if shrink > 1:
            height, width = (length // shrink for length in image.shape[:2])
            whole_blocks = image[: height * shrink, : width * shrink]
            image = np.asarray(cv2.resize(whole_blocks, (width, height), interpolation=cv2.INTER_AREA), dtype=np.uint8)
        # The maps stay inside the image, but the last half block of a reduced one may lie 0.5 px outside.
        if self._kept is not None:
            return remap(image, self._kept)
        result = np.empty((self._height, self._width, *image.shape[2:]), np.uint8)
        for top in range(0, self._height, _STRIP_ROWS):
            bottom = min(top + _STRIP_ROWS, self._height)
            result[top:bottom] = remap(image, self._maps(top, bottom))
        return result

    def _maps(self, top: int, bottom: int) -> Maps:
        """Return where the rows from `top` to `bottom` of the result lie in the image."""
        up = np.array([[1, 0, 0], [0, 1, -top], [0, 0, 1]], np.float64)
        size, new = (self._width, bottom - top), up @ self._projection
        k, distortion = self._model.matrix, self._model.distortion
        if self._model.lens is Lens.FISHEYE:
            x, y = cv2.fisheye.initUndistortRectifyMap(k, distortion, self._rotation, new, size, cv2.CV_32FC1)
        else:
            x, y = cv2.initUndistortRectifyMap(k, distortion, self._rotation, new, size, cv2.CV_32FC1)
        if self.shrink > 1:
            x, y = ((axis + 0.5) / self.shrink - 0.5 for axis in (x, y))
        return cv2.convertMaps(x, y, cv2.CV_16SC2)  # half the time of float maps, the same 1/32 px


def _rotations(rig: Rig) -> tuple[Matrix, Matrix, float, Epipolar]:
    """Return R_left, R_right, the baseline in metres and the epipolar lines; refuse rigs that have no such lines."""
    half = np.asarray(cv2.Rodrigues(rig.R_right_left)[0], dtype=np.float64) / 2
    left_to_middle = np.asarray(cv2.Rodrigues(half)[0], dtype=np.float64)
    right_to_middle = left_to_middle.T
    # The right camera's centre relative to the left one, in the middle's axes.
    to_right_m = -right_to_middle @ rig.t_right_left_m.reshape(3)
    baseline_m = float(np.linalg.norm(to_right_m))
    if not baseline_m > _LEAST_BASELINE_M:
        raise DataError(
            f"both cameras stand at one place (baseline {baseline_m * 1e3:.1f} mm)",
            "give the pictures of two cameras: perhaps both sides have the same ones; then calibrate again",
        )
    x, y, z = to_right_m / baseline_m
    if abs(z) > max(abs(x), abs(y)):
        raise DataError(
            "the right camera stands in front of or behind the left one",
            "mount the two cameras side by side or one above the other, looking the same way",
        )
    if abs(y) > abs(x):
        epipolar = Epipolar.UP if y > 0 else Epipolar.DOWN
    elif x > 0:
        epipolar = Epipolar.LEFT
    else:
        raise DataError(
            f"the right camera stands to the left of the left one (by {-x * baseline_m * 1e3:.1f} mm)",
            "swap LEFT and RIGHT; if each is where it should be, both mirror their images (--flip-left h --flip-right h) or both"
            " stand on their heads (--rotate-left 180 --rotate-right 180)",
        )
    turn = _shortest_turn(np.array([x, y, z]), _TO_RIGHT[epipolar])
    return turn @ left_to_middle, turn @ right_to_middle, baseline_m, epipolar


def _shortest_turn(source: Matrix, target: Matrix) -> Matrix:
    """Return the rotation by the smallest angle that takes unit vector `source` to `target`."""
    axis = np.cross(source, target)
    sine = float(np.linalg.norm(axis))
    angle = math.atan2(sine, float(source @ target))
    vector = axis * (angle / sine) if sine > 0 else np.zeros(3)
    return np.asarray(cv2.Rodrigues(vector)[0], dtype=np.float64)


def _mean_focal_px(model: CameraModel) -> float:
    return float(model.matrix[0, 0] + model.matrix[1, 1]) / 2


def _rectified_slopes(points_px: NDArray[np.floating], model: CameraModel, rotation: Matrix) -> NDArray[np.float64]:
    """Return (N, 2) slopes x / z and y / z in the rectified axes; NaN for what lies behind them or comes from nowhere."""
    rays = rays_through(points_px, model) @ rotation.T
    ahead = rays[:, 2] > 0 if model.lens is Lens.FISHEYE else np.ones(len(rays), np.bool_)
    slopes = np.full((len(rays), 2), np.nan)
    np.divide(rays[:, :2], rays[:, 2:], out=slopes, where=ahead[:, np.newaxis])
    return slopes


def _filled_window(model: CameraModel, rotation: Matrix, side: Side) -> tuple[float, float, float, float]:
    """Return x0, y0, x1, y1 in slopes: a rectangle in the rectified view that the camera's image fills completely.

    The four edges of the image, mapped through the model, bound the view; the rectangle takes the innermost point of
    each.
    """
    for share in _FIELD_SHARES:
        edges = _edges_px(model, share)
        slopes = _rectified_slopes(edges.reshape(-1, 2), model, rotation)
        if _round_trip_error_px(slopes, edges.reshape(-1, 2), model, rotation) > _ROUND_TRIP_LIMIT_PX:
            continue
        if model.lens is Lens.FISHEYE and not (np.abs(slopes) <= _MOST_SLOPE).all():
            continue
        if not _is_lens(edges.reshape(-1, 2), model):
            raise DataError(
                f"the {side.value} camera's distortion is no lens's: it moves the image's edge too far",
                f"{_RECALIBRATE}, with views that also cover the corners",
            )
        top, right, bottom, left = slopes.reshape(4, -1, 2)
        return (
            float(left[:, 0].max()), float(top[:, 1].max()), float(right[:, 0].min()), float(bottom[:, 1].min())
        )  # fmt: skip
    if rotation[2, 2] < math.hypot(rotation[0, 2], rotation[1, 2]):  # its axis points more sideways than forward
        raise DataError(
            f"the {side.value} camera looks too far aside of what both cameras could see",
            f"turn the cameras towards the same scene and {_RECALIBRATE}",
        )
    raise DataError(
        f"the {side.value} camera's distortion folds back inside its image",
        f"{_RECALIBRATE}, with views that also cover the corners",
    )


def _is_lens(points_px: NDArray[np.float64], model: CameraModel) -> bool:
    """Return whether the distortion leaves points at the image's edge about where such a lens sees them."""
    if model.lens is Lens.FISHEYE:
        return True  # `rays_through` has found them, and the slopes are limited
    straight = np.linalg.norm((points_px - model.matrix[:2, 2]) / np.diag(model.matrix)[:2], axis=1)
    seen = np.linalg.norm(_rectified_slopes(points_px, model, np.eye(3)), axis=1)
    farthest = _MOST_DIAGONALS * math.hypot(model.width_px, model.height_px) / _mean_focal_px(model)
    return bool((seen >= _LEAST_SQUEEZE * straight).all() and seen.max() <= farthest)


def _edges_px(model: CameraModel, share: float) -> NDArray[np.float64]:
    """Return (4, N, 2): points along the top, right, bottom and left edge of the image, shrunk to `share` of it about the centre."""
    ends = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], dtype=np.float64) - 0.5
    along = np.linspace(0, 1, _SAMPLES_PER_EDGE)[:, np.newaxis]
    extent = np.array([model.width_px - 1, model.height_px - 1], dtype=np.float64)
    edges = [a * (1 - along) + b * along for a, b in zip(ends, np.roll(ends, -1, axis=0), strict=True)]
    return (np.array(edges) * share + 0.5) * extent


def _round_trip_error_px(
    slopes: NDArray[np.float64], points_px: NDArray[np.float64], model: CameraModel, rotation: Matrix
) -> float:
    """Return the largest distance between points and their slopes projected back; NaN-safe (NaN gives infinity)."""
    rays = np.column_stack([slopes, np.ones(len(slopes))]) @ rotation  # rows: rotation.T @ ray
    if not np.all(rays[:, 2] > 0):
        return math.inf
    error = np.abs(project(rays, model) - points_px).max()
    return float(error) if math.isfinite(error) else math.inf
