"""A board's plane from its corners in one image, against poses that are known."""

import cv2
import numpy as np
import pytest

from common.errors import DataError
from phone_host.calibration.solve.board_pose import board_plane_of, corners_bias_share, find_board_plane
from phone_host.calibration.target.corners import Board
from phone_host.model import Epipolar, RectifiedPair, StereoGeometry
from phone_host.stereo.plane_fit import normal_over_distance, plane_in_disparity
from tests.support.boards import BOARD, poses, render_board
from tests.support.rigs import small_rig

GEOMETRY = StereoGeometry(focal_px=800.0, baseline_m=0.1, cx_px=640.0, cy_px=360.0)


def test_the_plane_is_that_of_the_pose() -> None:
    """Corners projected from 20 poses give the pose's normal and distance, and its middle, whatever the tilt."""
    for pose in poses(20, seed=2):
        rotation = np.asarray(cv2.Rodrigues(pose[:3])[0])
        points = BOARD.points_m() @ rotation.T + pose[3:]
        corners = points[:, :2] / points[:, 2:] * GEOMETRY.focal_px + [GEOMETRY.cx_px, GEOMETRY.cy_px]
        found = board_plane_of(corners, BOARD, GEOMETRY)
        normal = rotation[:, 2]
        assert normal_over_distance(found.plane, GEOMETRY) == pytest.approx(normal / (normal @ pose[3:]), abs=1e-6)
        middle = points.mean(axis=0)
        expected = middle[:2] / middle[2] * GEOMETRY.focal_px + [GEOMETRY.cx_px, GEOMETRY.cy_px]
        assert found.middle_px == pytest.approx(expected, abs=1e-3)
        assert found.misfit_px < 1e-3
        assert found.outline_px == pytest.approx(corners.reshape(6, 9, 2)[[0, 0, -1, -1], [0, -1, -1, 0]])


def test_the_outline_covers_the_inner_squares() -> None:
    """Of a board that faces the camera at 1 m, 8 x 5 squares of 25 mm lie inside the outline: 160 x 100 px."""
    corners = BOARD.points_m()[:, :2] * GEOMETRY.focal_px + [500, 300]
    covered = board_plane_of(corners, BOARD, GEOMETRY).covers(1280, 720)
    assert covered.sum() == 161 * 101
    assert covered[300:401, 500:661].all()


@pytest.mark.parametrize(
    ("epipolar", "way"), [(Epipolar.LEFT, (1, 0)), (Epipolar.UP, (0, 1)), (Epipolar.DOWN, (0, -1))]
)
def test_corners_that_are_nearer_than_the_board_have_a_bias(epipolar: Epipolar, way: tuple[int, int]) -> None:
    """Corners on a plane at 1 m whose disparities of 80 px are 0.8 px too large lie at 80 / 80.8 of it, whichever way the cameras stand."""
    plane = plane_in_disparity(np.array([0.0, 0.0, 1.0]), GEOMETRY)
    left = BOARD.points_m()[:, :2] * GEOMETRY.focal_px + [500, 300]
    assert corners_bias_share(left, left - np.array(way) * 80.8, plane, GEOMETRY, epipolar) == pytest.approx(
        80 / 80.8 - 1
    )


def test_what_is_no_such_board_is_refused() -> None:
    """A picture without a board, and one whose corners do not lie as on a flat board, are named with a remedy."""
    model = small_rig().left
    geometry = StereoGeometry(focal_px=float(model.matrix[0, 0]), baseline_m=0.1, cx_px=160.0, cy_px=120.0)
    empty = np.full((model.height_px, model.width_px), 128, np.uint8)
    with pytest.raises(DataError, match=r"no board with 9x6 inner corners .* in l\.png"):
        find_board_plane(RectifiedPair(empty, empty), BOARD, geometry, "l.png")
    board = Board(5, 4, 0.05)
    middle = board.points_m().mean(axis=0)
    seen = render_board(model, np.eye(3), np.array([0, 0, 0.5]) - middle, board)
    assert find_board_plane(RectifiedPair(seen, seen), board, geometry, "l.png").misfit_px < 2
    y, x = np.mgrid[: seen.shape[0], : seen.shape[1]].astype(np.float32)
    bent = cv2.remap(seen, x, (y + 8 * np.sin(x / 40)).astype(np.float32), cv2.INTER_LINEAR)  # rows sag by up to 8 px
    with pytest.raises(DataError, match=r"the corners in l\.png lie .* px off those of a flat 5x4 board"):
        find_board_plane(RectifiedPair(np.asarray(bent, np.uint8), seen), board, geometry, "l.png")
