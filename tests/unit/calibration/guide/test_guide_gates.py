"""The gates of the live guide, the placement of a board, and the views that are wanted."""

import math
from dataclasses import replace

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from phone_host.calibration.guide.coverage import (
    COLUMNS,
    ROWS,
    Coverage,
    Depth,
    Placement,
    Tilt,
    depth_of,
    placement,
    tilt_of,
    usual_camera,
)
from phone_host.calibration.guide.gates import (
    Gate,
    Glance,
    found,
    is_alike,
    is_far,
    is_paired_well,
    is_still,
    sharp,
    speed_widths_s,
)
from phone_host.calibration.guide.wants import ORDER, Placed, Want, back, is_there, missing, spot_of
from phone_host.calibration.target.corners import Board
from phone_host.calibration.target.sharpness import BoardLook

BOARD = Board(9, 6, 0.025)
SIZES = ((640, 480), (1280, 720))
NONE = np.empty((0, 2))
FRAME_NS = 100_000_000


def corners(
    x: float = 0.5, y: float = 0.5, square: float = 0.05, size: tuple[int, int] = SIZES[0]
) -> NDArray[np.float64]:
    """A frontal board whose middle lies at shares of the image; its squares are a share of the width."""
    rows, columns = np.mgrid[0:6, 0:9]
    grid = np.column_stack([columns.ravel() - 4, rows.ravel() - 2.5]) * square * size[0]
    return np.asarray(grid + np.array([x * size[0], y * size[1]]), np.float64)


def tilted(across_deg: float, down_deg: float) -> NDArray[np.float64]:
    """A tilted board in the middle: its left edge is away for positive degrees across, its top edge for positive ones down."""
    model = usual_camera(SIZES[0])
    turn = np.radians([-down_deg, across_deg, 0.0])
    points = (BOARD.points_m() - BOARD.points_m().mean(axis=0)) @ cv2.Rodrigues(turn)[0].T + [0, 0, 0.45]
    pixels = points @ model.matrix.T
    return np.asarray(pixels[:, :2] / pixels[:, 2:], np.float64)


def glance(left: NDArray[np.float64], right: NDArray[np.float64] | None = None, at_ns: int = 0) -> Glance:
    """Both cameras see the same, each at its own size."""
    scale = np.array([SIZES[1][0] / SIZES[0][0], SIZES[1][1] / SIZES[0][1]])
    other = left * scale if right is None else right
    return Glance(at_ns=at_ns, skew_ns=0, left_px=left, right_px=other, sizes_px=SIZES)


def placed(left: NDArray[np.float64], right: NDArray[np.float64] | None = None) -> Placed:
    """The same board in two images of 640x480."""
    model = usual_camera(SIZES[0])
    return Placed(placement(left, BOARD, model), placement(left if right is None else right, BOARD, model))


@pytest.mark.parametrize(
    ("left", "right", "gate"),
    [
        (NONE, NONE, Gate.NOT_FOUND),
        (NONE, corners(), Gate.NOT_FOUND_LEFT),
        (corners(), NONE, Gate.NOT_FOUND_RIGHT),
        (corners(), corners(), Gate.READY),
    ],
)
def test_the_board_must_be_in_both_images(left: NDArray[np.float64], right: NDArray[np.float64], gate: Gate) -> None:
    """The gate names the image in which it is missing."""
    assert found(glance(left, right)) is gate


def test_two_cameras_never_show_the_same_picture() -> None:
    """The same corners to a fraction of a pixel at the same size are one camera's; a board 1 px aside is another's."""
    same = Glance(at_ns=0, skew_ns=0, left_px=corners(), right_px=corners() + 0.1, sizes_px=(SIZES[0], SIZES[0]))
    assert found(same) is Gate.SAME
    assert found(replace(same, right_px=corners() + np.array([1.0, 0.0]))) is Gate.READY


def test_of_a_board_with_marks_enough_corners_must_be_common() -> None:
    """Twenty corners that both see are enough; ten are not, whatever each sees alone."""
    few, enough = corners(), corners()
    few[10:], enough[20:] = math.nan, math.nan
    assert found(glance(corners(), few)) is Gate.PART
    assert found(glance(corners(), enough)) is Gate.READY


@given(speed=st.floats(0, 0.2), noise=st.integers(0, 2**31))
def test_the_speed_is_that_of_the_faster_image(speed: float, noise: int) -> None:
    """The board moves across the right image only; noise of 0.1 px adds little."""
    random = np.random.default_rng(noise)
    before = glance(corners() + random.normal(0, 0.1, (54, 2)))
    moved = corners(size=SIZES[1]) + np.array([speed * SIZES[1][0] * FRAME_NS / 1e9, 0])
    start = replace(before, right_px=corners(size=SIZES[1]))
    now = glance(corners() + random.normal(0, 0.1, (54, 2)), moved, FRAME_NS)
    assert speed_widths_s(start, now) == pytest.approx(speed, abs=0.006)


def test_a_speed_needs_two_looks_close_in_time_at_the_same_corners() -> None:
    """Otherwise it is infinite, which is not still."""
    unseen = corners()
    unseen[3:] = math.nan
    for before in (None, glance(corners(), at_ns=-FRAME_NS * 20), glance(NONE, NONE), glance(unseen)):
        assert speed_widths_s(before, glance(corners(), at_ns=FRAME_NS)) == math.inf
    assert not is_still(math.inf)
    assert is_still(speed_widths_s(glance(corners()), glance(corners(), at_ns=FRAME_NS)))


def test_a_pair_is_paired_well_if_the_board_hardly_moves_between_its_exposures() -> None:
    """0.02 widths per second are 13 px/s at 640 px and 26 px/s at 1280: in 5 ms the board moves by 0.13 px, in 16 ms by 0.4 px."""
    late = replace(glance(corners()), skew_ns=-16_000_000)
    assert is_paired_well(replace(late, skew_ns=5_000_000), 0.02)
    assert not is_paired_well(late, 0.02)
    assert is_paired_well(late, 0.0)


@pytest.mark.parametrize(
    ("edge_px", "washed", "sharpest_px", "gate"),
    [
        (2.5, 0.0, math.nan, Gate.READY),
        (4.5, 0.0, math.nan, Gate.BLURRED),
        (4.5, 0.0, 3.5, Gate.READY),
        (6.5, 0.0, 5.0, Gate.BLURRED),
        (2.5, 0.2, 2.0, Gate.GLARE),
    ],
)
def test_a_view_must_be_sharp_by_the_cameras_own_measure(
    edge_px: float, washed: float, sharpest_px: float, gate: Gate
) -> None:
    """Edges of 4.5 px are blurred unless this camera's best are hardly better; above 6 px they always are. Lost contrast is glare."""
    good = BoardLook(2.0, 0.0, 0.0)
    assert sharp((good, BoardLook(edge_px, washed, 0.0)), SIZES, (2.0, sharpest_px)) is gate


def test_views_are_alike_if_the_board_is_at_nearly_the_same_place_in_both() -> None:
    """A fiftieth of the width apart is alike, a tenth is not; a move that one camera alone sees counts."""
    here, there = glance(corners()), glance(corners(0.6))
    assert is_alike(here, glance(corners(0.52)))
    assert not is_alike(here, there)
    assert not is_alike(here, replace(here, right_px=there.right_px))
    assert not is_alike(glance(tilted(0, 0)), glance(tilted(25, 0)))
    assert not is_alike(here, glance(np.full((54, 2), math.nan)))


def test_views_are_far_from_each_other_by_place_or_shape() -> None:
    """A fifth of the width apart is far, a tenth is not; nearer by half is far; what has no corner in common is, too."""
    here = glance(corners())
    assert is_far(here, glance(corners(0.7)))
    assert not is_far(here, glance(corners(0.6)))
    assert is_far(here, glance(corners(square=0.075)))
    assert is_far(here, glance(np.full((54, 2), math.nan)))


@given(across=st.floats(-45, 45), down=st.floats(-45, 45))
def test_a_tilt_is_measured_with_its_way(across: float, down: float) -> None:
    """Of a board tilted about both axes, each tilt has the right sign, and an only one its size."""
    model = usual_camera(SIZES[0])
    assert placement(tilted(across, 0.0), BOARD, model).tilt_deg == pytest.approx((across, 0.0), abs=0.1)
    assert placement(tilted(0.0, down), BOARD, model).tilt_deg == pytest.approx((0.0, down), abs=0.1)


def test_a_placement_says_where_and_how_large_a_board_is() -> None:
    """Squares of a twentieth of the width: eight of them fill 0.4 of it. A part that has no pose counts as flat."""
    where = placement(corners(0.4, 0.6), BOARD, usual_camera(SIZES[0]))
    assert where.fills == pytest.approx(0.4)
    assert where.low == pytest.approx((0.2, 0.6 - 2.5 * 0.05 * 4 / 3))
    assert where.square == pytest.approx((0.05, 0.05 * 4 / 3))
    assert len(where.outline) == 4
    row = corners()
    row[3:] = math.nan
    assert placement(row, BOARD, usual_camera(SIZES[0])).tilt_deg == (0.0, 0.0)
    assert len(placement(row, BOARD, usual_camera(SIZES[0])).outline) == 1


@pytest.mark.parametrize(
    ("want", "there"),
    [
        (Want.ANY, corners()),
        (Want.LEFT_AWAY, tilted(25, 0)),
        (Want.RIGHT_AWAY, tilted(-25, 0)),
        (Want.TOP_AWAY, tilted(0, 25)),
        (Want.BOTTOM_AWAY, tilted(0, -25)),
        (Want.TOP_LEFT, corners(0.34, 0.36)),
        (Want.TOP_RIGHT, corners(0.66, 0.36)),
        (Want.BOTTOM_LEFT, corners(0.34, 0.64)),
        (Want.BOTTOM_RIGHT, corners(0.66, 0.64)),
        (Want.NEAR, corners(square=0.065)),
        (Want.FAR, corners(square=0.03)),
    ],
)
def test_each_wanted_view_is_known_when_it_is_there(want: Want, there: NDArray[np.float64]) -> None:
    """It is, and a frontal board in the middle is none of those that are asked for."""
    assert is_there(want, placed(there))
    assert is_there(want, placed(corners())) == (want is Want.ANY)


@pytest.mark.parametrize(
    ("want", "seen", "words"),
    [
        (Want.TOP_LEFT, corners(), "top left corner"),
        (Want.TOP_LEFT, corners(0.34), "top edge"),
        (Want.TOP_LEFT, corners(0.5, 0.36), "left edge"),
        (Want.BOTTOM_RIGHT, corners(square=0.015), "bottom right corner, closer"),
        (Want.TOP_LEFT, corners(0.38, 0.48, square=0.07), "top edge, farther away"),
        (Want.LEFT_AWAY, tilted(-20, 0), "tilt the board: left edge away"),
        (Want.FAR, corners(), "farther away"),
        (Want.NEAR, corners(), "closer"),
        (Want.NEAR, corners(0.33), "closer, back from the left edge"),
    ],
)
def test_what_is_missing_is_said(want: Want, seen: NDArray[np.float64], words: str) -> None:
    """Only what is missing is said: an edge that is reached is not asked for again."""
    assert missing(want, placed(seen)) == words


def test_a_corner_is_reached_in_the_picture_in_which_the_board_is_nearer_to_it() -> None:
    """Two cameras see the board at different places: the left edge counts in the right picture."""
    assert is_there(Want.TOP_LEFT, placed(corners(0.45, 0.36), corners(0.3, 0.36)))


@pytest.mark.parametrize(
    ("left", "right", "words"),
    [
        (corners(), corners(), ""),
        (corners(0.3), corners(0.4), "back from the left edge"),
        (corners(0.5, 0.7), corners(), "back from the bottom edge"),
        (corners(0.3, 0.3), corners(0.4), "back from the top left corner"),
        (corners(0.7), corners(0.3), "farther away"),
    ],
)
def test_a_board_that_is_about_to_leave_is_told_the_way_back(
    left: NDArray[np.float64], right: NDArray[np.float64], words: str
) -> None:
    """The way is away from the edges that it has reached in any picture; between opposite edges it is away from the cameras."""
    assert back(placed(left, right)) == words


def test_a_board_that_fills_both_pictures_is_near_enough() -> None:
    """At the right edge of the left picture and the left edge of the right one it cannot come closer, however small it is."""
    assert is_there(Want.NEAR, placed(corners(0.7), corners(0.3)))


def test_each_kind_of_view_has_a_spot_of_its_own() -> None:
    """So what each would teach can be told apart."""
    assert len({spot_of(want) for want in (Want.ANY, *ORDER)}) == len(ORDER) + 1


def test_coverage_counts_every_corner_that_was_seen_and_every_view() -> None:
    """Counts of cells, distances and tilts grow by what a view shows; corners that were not seen do not count."""
    part = corners(0.25, 0.25, square=0.03)
    part[:9] = math.nan
    model = usual_camera(SIZES[0])
    empty = Coverage(SIZES[0])
    once = empty.with_view(part, placement(part, BOARD, model))
    twice = once.with_view(tilted(30, 0), placement(tilted(30, 0), BOARD, model))
    assert np.array(once.cells).shape == (ROWS, COLUMNS)
    assert np.array(once.cells).sum() == 45
    assert np.array(once.cells)[:, COLUMNS // 2 :].sum() == 0
    assert np.array(twice.cells).sum() == 45 + 54
    assert once.depths[list(Depth).index(Depth.FAR)] == 1
    assert twice.tilts[list(Tilt).index(Tilt.LEFT_AWAY)] == 1
    assert (empty.share, sum(twice.depths), sum(twice.tilts)) == (0.0, 2, 2)
    assert once.share == 4 / (COLUMNS * ROWS)


def test_depth_and_tilt_have_names() -> None:
    """A board is near when it fills more than half of the width; its tilt is named by the edge that is farthest away."""
    base = placement(corners(), BOARD, usual_camera(SIZES[0]))
    fills = {0.2: Depth.FAR, 0.4: Depth.MIDDLE, 0.7: Depth.NEAR}
    assert {share: depth_of(replace(base, fills=share)) for share in fills} == fills
    tilts = {
        (0.0, 5.0): Tilt.FLAT,
        (20.0, 5.0): Tilt.LEFT_AWAY,
        (-20.0, 5.0): Tilt.RIGHT_AWAY,
        (5.0, 20.0): Tilt.TOP_AWAY,
        (5.0, -20.0): Tilt.BOTTOM_AWAY,
    }
    assert {tilt: tilt_of(_tilted(base, tilt)) for tilt in tilts} == tilts


def _tilted(base: Placement, tilt_deg: tuple[float, float]) -> Placement:
    return replace(base, tilt_deg=tilt_deg)
