"""Rectification of two unlike cameras, against projections through their full models."""

import math
from dataclasses import replace

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.errors import DataError
from phone_host.model import CameraModel, Epipolar, Image, Rectification, Rig, Side
from phone_host.stereo.rectify import Rectifier, across_lines_px, rectify_points, rectify_rig
from phone_host.stereo.scaled_rig import scaled_rig
from tests.support.rigs import points_seen_by_both, unlike_rig


def test_points_lie_on_one_row_and_their_disparity_gives_their_depth() -> None:
    """With full distortion: |y left - y right| < 0.01 px and z = f b / d, for every point that both cameras see."""
    rig = unlike_rig()
    rectification = rectify_rig(rig)
    geometry = rectification.geometry
    seen = points_seen_by_both(rig, 5000, seed=1)
    assert len(seen.points_m) > 1000
    left = rectify_points(seen.left_px, rig.left, rectification.R_left, geometry)
    right = rectify_points(seen.right_px, rig.right, rectification.R_right, geometry)
    assert np.abs(left[:, 1] - right[:, 1]).max() < 0.01
    depth_m = geometry.focal_px * geometry.baseline_m / (left[:, 0] - right[:, 0] + geometry.doffs_px)
    np.testing.assert_allclose(depth_m, (seen.points_m @ rectification.R_left.T)[:, 2], rtol=1e-6)


def test_published_matrices_agree_with_each_other() -> None:
    """P1 and P2 project as the rectified points do, and Q maps a pixel with its disparity back to the point."""
    rig = unlike_rig()
    r = rectify_rig(rig)
    seen = points_seen_by_both(rig, 200, seed=2)
    rectified_m = np.column_stack([seen.points_m @ r.R_left.T, np.ones(len(seen.points_m))])
    left, right = rectified_m @ r.P_left.T, rectified_m @ r.P_right.T
    left, right = left[:, :2] / left[:, 2:], right[:, :2] / right[:, 2:]
    np.testing.assert_allclose(left, rectify_points(seen.left_px, rig.left, r.R_left, r.geometry), atol=1e-6)
    np.testing.assert_allclose(right, rectify_points(seen.right_px, rig.right, r.R_right, r.geometry), atol=1e-6)
    back = np.column_stack([left, left[:, 0] - right[:, 0], np.ones(len(left))]) @ r.Q.T
    np.testing.assert_allclose(back[:, :3] / back[:, 3:], rectified_m[:, :3], rtol=1e-6, atol=1e-9)


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


def test_window_keeps_most_of_the_common_view() -> None:
    """The window is not too small: it spans at least 85 % of the narrower view in both directions."""
    rectification = rectify_rig(unlike_rig(turn=0.2))
    # Left: 640 / 525 = 1.22 wide. Right: 720 / 1128 = 0.638 high; at the common f = 526 that is 641 x 336 px.
    assert rectification.width_px > 0.85 * 640 * 0.9  # the left lens bends its sides inwards by a tenth
    assert rectification.height_px > 0.85 * 336


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


def test_swapped_sides_are_told() -> None:
    """A right camera that is on the left is refused with the remedy."""
    with pytest.raises(DataError, match="swap LEFT and RIGHT"):
        rectify_rig(unlike_rig((-0.1, 0.0, 0.0)))


def test_a_camera_in_front_of_the_other_is_told() -> None:
    """A tandem rig is refused with an explanation."""
    with pytest.raises(DataError, match="in front of or behind"):
        rectify_rig(unlike_rig((0.01, 0.0, 0.1)))


@pytest.mark.parametrize(("y_m", "epipolar"), [(0.1, Epipolar.UP), (-0.1, Epipolar.DOWN)])
def test_points_of_stacked_cameras_lie_in_one_column(y_m: float, epipolar: Epipolar) -> None:
    """With the right camera below, a point lies d px further up in its image, in the same column; above, further down; z = f b / d."""
    rig = unlike_rig((0.004, y_m, -0.006))
    r = rectify_rig(rig)
    assert r.epipolar is epipolar
    seen = points_seen_by_both(rig, 5000, seed=1)
    assert len(seen.points_m) > 1000
    left = rectify_points(seen.left_px, rig.left, r.R_left, r.geometry)
    right = rectify_points(seen.right_px, rig.right, r.R_right, r.geometry)
    assert np.abs(across_lines_px(left, right, epipolar)).max() < 0.01
    np.testing.assert_array_equal(across_lines_px(left, right, epipolar), left[:, 0] - right[:, 0])
    disparity_px = (left[:, 1] - right[:, 1]) * (1 if epipolar is Epipolar.UP else -1)
    assert disparity_px.min() > 0
    depth_m = r.geometry.focal_px * r.geometry.baseline_m / disparity_px
    np.testing.assert_allclose(depth_m, (seen.points_m @ r.R_left.T)[:, 2], rtol=1e-6)
    # Upright: the rectified axes differ from the left camera's by a few degrees, not by a quarter turn.
    assert r.R_left[0, 0] > 0.99
    rectified_m = np.column_stack([seen.points_m @ r.R_left.T, np.ones(len(seen.points_m))])
    projected = rectified_m @ r.P_right.T
    np.testing.assert_allclose(projected[:, :2] / projected[:, 2:], right, atol=1e-6)
    back = np.column_stack([left, disparity_px, np.ones(len(left))]) @ r.Q.T
    np.testing.assert_allclose(back[:, :3] / back[:, 3:], rectified_m[:, :3], rtol=1e-6, atol=1e-9)


def test_opencv_projects_stacked_cameras_alike() -> None:
    """P2 has its shift where `cv2.stereoRectify` has it for a rig whose second camera is below: f T_y in the second row."""
    rig = unlike_rig((0.0, 0.1, 0.0), turn=0)
    p_right = rectify_rig(rig).P_right
    size = (rig.left.width_px, rig.left.height_px)
    plain = np.zeros(5)
    by_opencv = cv2.stereoRectify(
        rig.left.matrix, plain, rig.left.matrix, plain, size, np.eye(3), np.array([0.0, -0.1, 0.0])
    )[3]
    assert p_right[1, 3] / p_right[0, 0] == pytest.approx(by_opencv[1, 3] / by_opencv[0, 0])
    assert p_right[0, 3] == pytest.approx(0)


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


def test_cameras_that_look_apart_are_told() -> None:
    """Two views that hardly overlap are refused with an explanation."""
    with pytest.raises(DataError, match="overlap"):
        rectify_rig(unlike_rig(turn=18))


def test_an_image_of_another_size_is_told() -> None:
    """A frame of another resolution than the calibration's is refused; the error names the side and both sizes."""
    rectifier = Rectifier(unlike_rig())
    with pytest.raises(DataError, match=r"right image is 640x480 px, .*1280x720"):
        rectifier.rectify(np.zeros((480, 640), np.uint8), np.zeros((480, 640), np.uint8))


def test_cameras_in_one_place_are_told() -> None:
    """Without a baseline there is no depth: the error says so."""
    with pytest.raises(DataError, match="baseline"):
        rectify_rig(unlike_rig((0.0, 0.0, 0.0)))


def test_a_distortion_that_folds_inside_the_image_is_told() -> None:
    """A lens model whose radius decreases before the corner is not a lens: the error names the camera."""
    rig = unlike_rig()
    rig.left.distortion[:] = (-3.0, 0.0, 0.0, 0.0, 0.0)
    with pytest.raises(DataError, match="left"):
        rectify_rig(rig)


@pytest.mark.parametrize(("outwards_deg", "words"), [(70, "overlap by 0x"), (80, "left camera looks too far aside")])
def test_cameras_that_look_to_opposite_sides_are_told(outwards_deg: float, words: str) -> None:
    """Two cameras turned so far outwards that each sees points behind the common view are refused with an explanation that does not blame their lenses."""
    half = np.asarray(cv2.Rodrigues(np.array([0.0, math.radians(outwards_deg), 0.0]))[0], np.float64)
    rig = replace(unlike_rig(), R_right_left=half @ half, t_right_left_m=-half @ np.array([0.1, 0.0, 0.0]))
    with pytest.raises(DataError, match=words) as caught:
        rectify_rig(rig)
    assert "towards the same scene" in caught.value.remedy


@pytest.mark.parametrize("side", ["left", "right"])
def test_a_distortion_that_no_lens_has_is_refused(side: str) -> None:
    """k3 = 99999 can be inverted, but would squeeze the image into its middle third; depth from it would look right."""
    rig = unlike_rig()
    model = getattr(rig, side)
    wrong = replace(model, distortion=np.array([0.0, 0.0, 0.0, 0.0, 99999.0]))
    with pytest.raises(DataError, match=f"the {side} camera's distortion is no lens's"):
        rectify_rig(replace(rig, **{side: wrong}))
