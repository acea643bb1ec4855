"""Rectification of two unlike cameras, against projections through their full models."""

import math
from dataclasses import replace

import cv2
import numpy as np
import pytest

from common.errors import DataError
from phone_host.model import Epipolar
from phone_host.stereo.rectify import across_lines_px, rectify_points, rectify_rig
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


def test_window_keeps_most_of_the_common_view() -> None:
    """The window is not too small: it spans at least 85 % of the narrower view in both directions."""
    rectification = rectify_rig(unlike_rig(turn=0.2))
    # Left: 640 / 525 = 1.22 wide. Right: 720 / 1128 = 0.638 high; at the common f = 526 that is 641 x 336 px.
    assert rectification.width_px > 0.85 * 640 * 0.9  # the left lens bends its sides inwards by a tenth
    assert rectification.height_px > 0.85 * 336


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


def test_cameras_that_look_apart_are_told() -> None:
    """Two views that hardly overlap are refused with an explanation."""
    with pytest.raises(DataError, match="overlap"):
        rectify_rig(unlike_rig(turn=18))


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
