"""The rectification of two unlike cameras, with different resolution, focal length and distortion.

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
lines are columns, as with `cv2.stereoRectify`. Only the matcher turns such images, by a quarter (`working.lying`).

Source: J.-Y. Bouguet, Camera Calibration Toolbox, 2000; A. Fusiello et al., "A compact algorithm for rectification of stereo
pairs", 2000; OpenCV's calib3d documentation for P1, P2 and Q.
"""

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from common.errors import DataError
from phone_host.geometry.lens import project, rays_through
from phone_host.model import CameraModel, Epipolar, Lens, Rectification, Rig, Side, StereoGeometry

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
_TO_RIGHT = {
    Epipolar.LEFT: np.array([1.0, 0.0, 0.0]),
    Epipolar.UP: np.array([0.0, 1.0, 0.0]),
    Epipolar.DOWN: np.array([0.0, -1.0, 0.0]),
}
"""From the left camera to the right one in the rectified axes (x right, y down)."""


def rectify_rig(rig: Rig) -> Rectification:
    """Find the common rotation, focal length and window of a rig.

    Raises:
        DataError: left and right are swapped, one camera stands in front of the other, their fields of view do not
            overlap, or a distortion model cannot be inverted.
    """
    left_rotation, right_rotation, baseline_m, epipolar = _rotations(rig)
    focal_px = min(rig.left.mean_focal_px, rig.right.mean_focal_px)
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
            " are upside down (--rotate-left 180 --rotate-right 180)",
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
    farthest = _MOST_DIAGONALS * math.hypot(model.width_px, model.height_px) / model.mean_focal_px
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
