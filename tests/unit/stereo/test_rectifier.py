"""Remapped images of two unlike cameras: filled, alike where they show the same, and refused where their size is another."""

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.errors import DataError
from phone_host.model import CameraModel, Image, Rectification, Rig, Side
from phone_host.stereo.rectifier import Rectifier
from phone_host.stereo.scaled_rig import scaled_rig
from tests.support.rigs import unlike_rig


@given(
    st.tuples(st.floats(0.03, 0.3), st.floats(-0.01, 0.01), st.floats(-0.01, 0.01)),
    st.floats(-2, 2),
)
@settings(deadline=None, max_examples=25)
def test_every_pixel_of_the_window_comes_from_inside_both_images(
    centre_m: tuple[float, float, float], turn: float
) -> None:
    """White images stay white to the last corner: there is no black border that a matcher would take for texture."""
    rig = unlike_rig(centre_m, turn)
    rectifier = Rectifier(rig)
    pair = rectifier.rectify(np.full((480, 640), 255, np.uint8), np.full((720, 1280), 255, np.uint8))
    assert pair.left.shape == pair.right.shape
    assert pair.left.min() == 255
    assert pair.right.min() == 255
    for model, rotation in ((rig.left, rectifier.rectification.R_left), (rig.right, rectifier.rectification.R_right)):
        assert _source_margin_px(model, rotation, rectifier.rectification) >= -0.01


def _source_margin_px(model: CameraModel, rotation: np.ndarray, r: Rectification) -> float:
    """How far inside the camera's image the window's outermost source pixel lies: it is on the border, as the map does not fold."""
    columns, rows = np.meshgrid(np.arange(r.width_px), np.arange(r.height_px))
    border = np.ones(columns.shape, dtype=bool)
    border[1:-1, 1:-1] = False
    pixels = np.column_stack([columns[border], rows[border], np.ones(border.sum())])
    rays = pixels @ np.linalg.inv(r.P_left[:, :3]).T @ rotation
    source = np.asarray(cv2.projectPoints(rays, np.zeros(3), np.zeros(3), model.matrix, model.distortion)[0])
    source = source.reshape(-1, 2)
    beyond = source - np.array([model.width_px - 1, model.height_px - 1])
    return float(min(source.min(), -beyond.max()))


def test_images_of_a_textured_plane_agree() -> None:
    """The remapped images of a fronto-parallel plane are one image shifted by its disparity, within a few grey levels."""
    rig = unlike_rig()
    rectifier = Rectifier(rig)
    depth_m = 1.0
    left = _render_plane(rig, Side.LEFT, rectifier, depth_m)
    right = _render_plane(rig, Side.RIGHT, rectifier, depth_m)
    pair = rectifier.rectify(left, right)
    shift_px = rectifier.geometry.focal_px * rectifier.geometry.baseline_m / depth_m
    height, width = pair.left.shape
    columns, rows = np.meshgrid(np.arange(width, dtype=np.float32), np.arange(height, dtype=np.float32))
    moved = cv2.remap(pair.right, columns - np.float32(shift_px), rows, cv2.INTER_LINEAR)
    inner = np.s_[8:-8, int(shift_px) + 8 : -8]
    difference = np.abs(moved[inner].astype(int) - pair.left[inner])
    assert np.median(difference) <= 2
    assert np.percentile(difference, 99) <= 12


def _render_plane(rig: Rig, side: Side, rectifier: Rectifier, depth_m: float) -> Image:
    """The camera's view of a smooth texture on a plane at z = depth in the rectified left axes, computed ray by ray."""
    model = rig.left if side is Side.LEFT else rig.right
    r = rectifier.rectification
    rotation = r.R_left if side is Side.LEFT else r.R_right
    origin_x = 0.0 if side is Side.LEFT else r.geometry.baseline_m
    columns, rows = np.meshgrid(np.arange(model.width_px), np.arange(model.height_px))
    pixels = np.column_stack([columns.ravel(), rows.ravel()]).astype(np.float64)[:, np.newaxis]
    criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 50, 1e-12)
    slopes = np.asarray(
        cv2.undistortPointsIter(pixels, model.matrix, model.distortion, rotation, np.eye(3), criteria)
    ).reshape(-1, 2)
    x, y = slopes[:, 0] * depth_m + origin_x, slopes[:, 1] * depth_m
    value = 128 + 50 * np.sin(x * 60) * np.cos(y * 45) + 50 * np.sin(x * 23 + y * 37)
    image: Image = np.rint(value).reshape(model.height_px, model.width_px).astype(np.uint8)
    return image


def test_colour_passes_and_a_finer_camera_is_averaged_down() -> None:
    """A 1-px checkerboard from the camera with twice the resolution becomes grey, not a moire pattern."""
    rig = unlike_rig(turn=0)
    board = (np.indices((720, 1280)).sum(axis=0) % 2 * 255).astype(np.uint8)
    pair = Rectifier(rig).rectify(np.zeros((480, 640, 3), np.uint8), np.dstack([board] * 3))
    assert pair.right.shape == (*pair.left.shape[:2], 3)
    assert pair.right.min() >= 120
    assert pair.right.max() <= 135


def test_large_maps_made_in_strips_are_those_made_at_once() -> None:
    """The image of a rig with more pixels than maps are kept for agrees with OpenCV's own maps over the whole image."""
    small = unlike_rig()
    rig = scaled_rig(small, (3840, 2880), (3840, 2160))
    rectifier = Rectifier(rig)
    r = rectifier.rectification
    assert r.width_px * r.height_px > 4_000_000
    image = cv2.resize(_noise_image(), (3840, 2880), interpolation=cv2.INTER_CUBIC)
    found = rectifier.rectify(np.asarray(image, np.uint8), np.zeros((2160, 3840), np.uint8)).left
    maps = cv2.initUndistortRectifyMap(
        rig.left.matrix, rig.left.distortion, r.R_left, r.P_left[:, :3], (r.width_px, r.height_px), cv2.CV_32FC1
    )
    whole = cv2.remap(image, *maps, cv2.INTER_LINEAR)
    assert np.abs(found.astype(int) - whole).max() <= 4  # 1/32 px of the steepest texture


def _noise_image() -> Image:
    return np.random.default_rng(4).integers(0, 256, (120, 160), np.uint8)


def test_an_image_of_another_size_is_told() -> None:
    """A frame of another resolution than the calibration's is refused; the error names the side and both sizes."""
    rectifier = Rectifier(unlike_rig())
    with pytest.raises(DataError, match=r"right image is 640x480 px, .*1280x720"):
        rectifier.rectify(np.zeros((480, 640), np.uint8), np.zeros((480, 640), np.uint8))
