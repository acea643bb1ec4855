"""Series that tell little or nothing: too few views, views that are no boards, and deviations too small or too rare to name."""

import math
import re
from dataclasses import replace

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from common.errors import DataError
from phone_host.calibration.failure_modes.deviating import deviation
from phone_host.calibration.failure_modes.lone import both_alone
from phone_host.calibration.failure_modes.mistakes import Course, Mistake
from phone_host.calibration.failure_modes.name import BoardSeries, name_mistake
from phone_host.calibration.failure_modes.partners import wrong_partners
from phone_host.calibration.solve.board_pose import find_board_plane, rough_pose
from phone_host.calibration.solve.bundle_problem import GLOBALS, Bend, BundleState, RigProblem
from phone_host.calibration.solve.calibrate import solve_pose
from phone_host.calibration.solve.verdict import Calibration, Squares
from phone_host.calibration.target.board_names import named_board
from phone_host.calibration.target.corners import Board, find_corners
from phone_host.calibration.target.marked import MarkFamily
from phone_host.calibration.target.pairs import BoardPair
from phone_host.calibration.target.sharpness import look_at
from phone_host.geometry.lens import project
from phone_host.geometry.se3 import SE3
from phone_host.model import CameraModel, Lens, RectifiedPair, Rig, StereoGeometry, Verdict
from tests.support.boards import BOARD, exact_pairs, poses, render_board
from tests.support.rigs import fisheye_rig, small_rig, unlike_rig

_SIZES = ((640, 480), (1280, 720))
_NOWHERE = np.full((54, 2), 100.0)
"""All corners of a board in one point: OpenCV finds no lens for that."""


def _views(
    count: int, *, zoom: dict[int, float] | None = None, turn: dict[int, float] | None = None, noise_px: float = 0.05
) -> list[BoardPair]:
    """Views by two cameras of which the right one zooms by a factor, or is turned about its y axis by some rad, in some of them."""
    made = []
    for index, pose in enumerate(poses(count, seed=3)):
        rig = unlike_rig()
        matrix = rig.right.matrix.copy()
        matrix[[0, 1], [0, 1]] *= (zoom or {}).get(index, 1.0)
        turned = np.asarray(cv2.Rodrigues(np.array([0.0, (turn or {}).get(index, 0.0), 0.0]))[0], np.float64)
        rig = replace(
            rig,
            right=replace(rig.right, matrix=matrix),
            R_right_left=turned @ rig.R_right_left,
            t_right_left_m=turned @ rig.t_right_left_m,
        )
        (pair,) = exact_pairs(rig, pose[np.newaxis], noise_px, seed=index)
        made.append(BoardPair(str(index), pair.left_px, pair.right_px))
    return made


def _with_board_moved(pairs: list[BoardPair], down_m: dict[int, float]) -> tuple[BoardPair, ...]:
    """The views of `_views`, with the board shifted before the right exposure of some of them."""
    made = list(pairs)
    for index, pose in enumerate(poses(len(pairs), seed=3)):
        if index in down_m:
            moved = pose + np.array([0, 0, 0, 0, down_m[index], 0])
            (after,) = exact_pairs(unlike_rig(), moved[np.newaxis], 0.05, seed=100 + index)
            made[index] = BoardPair(pairs[index].name, pairs[index].left_px, after.right_px)
    return tuple(made)


def _calibration(rig: Rig, obstacle: DataError | None = None) -> Calibration:
    """A calibration whose pairs all fit."""
    return Calibration(
        rig=replace(rig, rms_stereo_px=0.2),
        rectification=None,
        obstacle=obstacle,
        used=(),
        rejected=(),
        vertical_px=np.zeros(1),
        baseline_sigma_m=0.0,
        tilts_deg=np.zeros(1),
        spread=1.0,
        bends=(Bend.USUAL, Bend.USUAL),
        squares=Squares(true_m=0.025, mean_m=math.nan, sigma_m=math.nan, count=0),
    )


def _series(pairs: tuple[BoardPair, ...] = (), board: Board = BOARD, baseline_m: float = math.nan) -> BoardSeries:
    return BoardSeries(pairs=pairs, board=board, sizes_px=_SIZES, baseline_m=baseline_m)


def _stretched(model: CameraModel, factor: float) -> CameraModel:
    matrix = model.matrix.copy()
    matrix[0, 0] = factor * matrix[1, 1]
    return replace(model, matrix=matrix)


def test_a_board_longer_than_a_room_is_a_wrong_unit() -> None:
    """Nine columns of 500 mm are 4.5 m, and of 1 mm they are 9 mm: neither is a board, whether a rig was found or not."""
    for square_m, said in (
        (0.5, "squares of 500 mm the board would be 4.5 m"),
        (0.001, "squares of 1 mm the board would be 0.009 m"),
    ):
        found = name_mistake(_series(board=Board(9, 6, square_m)), DataError("nothing", "nothing"))
        assert found is not None
        assert found.code is Mistake.SQUARE
        assert said in found.message
        assert found.evidence.most is Verdict.REJECT
    assert name_mistake(_series(), DataError("nothing", "nothing")) is None


def test_a_measured_baseline_tells_the_square() -> None:
    """Cameras 100 mm apart by the board and 90 mm by the ruler: squares of 22.5 mm would fit, not 25 mm; a ruler off by 2 % accuses nobody."""
    rig = unlike_rig(right_centre_m=(0.1, 0.0, 0.0))
    found = name_mistake(_series(baseline_m=0.09), _calibration(rig))
    assert found is not None
    assert found.code is Mistake.SQUARE
    assert (
        "100.0 mm apart, and you measured 90.0 mm: squares of 22.50 mm would fit, --square says 25 mm" in found.message
    )
    assert found.evidence.most is Verdict.REJECT
    assert name_mistake(_series(baseline_m=0.098), _calibration(rig)) is None


def test_lenses_that_are_stretched_alike_tell_a_stretched_print() -> None:
    """Both cameras' pixels 3 % too wide: the print is; one camera's alone are its own."""
    rig = unlike_rig()
    both = replace(rig, left=_stretched(rig.left, 1.03), right=_stretched(rig.right, 1.03))
    found = name_mistake(_series(), _calibration(both))
    assert found is not None
    assert found.code is Mistake.SQUARE
    assert "3.0% wider" in found.message
    one = replace(rig, left=_stretched(rig.left, 1.03), right=_stretched(rig.right, 1.0))
    assert name_mistake(_series(), _calibration(one)) is None


@pytest.mark.parametrize(
    ("size_px", "stretch", "said"),
    [
        (
            (270, 180),
            270 / 180 / (16 / 9),
            "270x180 px show the squares 15.6% narrower than they are, as pictures of 16:9",
        ),
        ((640, 360), 640 / 360 / (4 / 3), "640x360 px show the squares 33.3% wider than they are, as pictures of 4:3"),
        ((640, 480), 0.95, "the squares look stretched: they are 5.0% narrower than they are high"),
        ((640, 480), 1.03, "the squares look stretched: they are 3.0% wider than they are high"),
    ],
)
def test_a_pictures_shape_tells_whether_it_was_resized(size_px: tuple[int, int], stretch: float, said: str) -> None:
    """Where the pictures have a camera's shape without the stretch, they were resized; else the print is to blame."""
    rig = unlike_rig()
    both = replace(rig, left=_stretched(rig.left, stretch), right=_stretched(rig.right, stretch))
    found = name_mistake(replace(_series(), sizes_px=(size_px, size_px)), _calibration(both))
    assert found is not None
    assert said in found.message
    assert found.code is (Mistake.RESIZED if "resized" in found.message else Mistake.SQUARE)


@pytest.mark.parametrize(
    ("centre", "named"), [((-0.1, 0, 0), Mistake.SWAPPED), ((0.02, 0, 0.1), None), ((-0.02, 0.1, 0), None)]
)
def test_only_cameras_beside_each_other_are_swapped(centre: tuple[float, float, float], named: Mistake | None) -> None:
    """A rig that cannot be rectified is swapped if the right camera stands on the left, not if it stands ahead or below."""
    found = name_mistake(_series(), _calibration(unlike_rig(centre), DataError("it cannot be", "exchange them")))
    assert (found.code if found else None) is named
    assert found is None or found.remedy == "exchange them"


def test_views_in_one_point_tell_nothing() -> None:
    """OpenCV refuses corners that all lie in one point; no mistake is named for it, and no partner."""
    pairs = tuple(BoardPair(str(index), _NOWHERE, _NOWHERE) for index in range(6))
    with pytest.raises(cv2.error):
        both_alone(list(pairs), BOARD.points_m(), _SIZES)
    assert deviation(pairs, BOARD, _SIZES) is None
    assert wrong_partners(list(pairs), BOARD, _SIZES) == []
    assert name_mistake(_series(pairs), _calibration(unlike_rig())) is None


def test_two_views_give_no_lens_and_no_partners() -> None:
    """Three views are the least; of three, one whose corners lie anywhere is dropped, and two are left."""
    views = _views(3)
    found = both_alone(views, BOARD.points_m(), _SIZES)
    assert found is not None
    assert [pair.name for pair in found[0]] == ["0", "1", "2"]
    assert found[1].lens[5] == 0  # so few views say nothing about k2
    wild = np.random.default_rng(1).uniform(0, 480, (54, 2))
    assert both_alone([*views[:2], BoardPair("wild", wild, wild)], BOARD.points_m(), _SIZES) is None
    exchanged = [
        BoardPair("0", views[0].left_px, views[1].right_px),
        BoardPair("1", views[1].left_px, views[0].right_px),
    ]
    assert wrong_partners(exchanged, BOARD, _SIZES) == []


def test_six_pairs_are_the_least_for_a_deviation() -> None:
    """Six views of which one lies anywhere are five: nothing is said about a knock that seven views show."""
    knocked = _views(7, turn=dict.fromkeys(range(4, 7), 0.01))
    assert deviation(tuple(knocked), BOARD, _SIZES) is not None
    wild = np.random.default_rng(1).uniform(0, 480, (54, 2))
    assert deviation((*knocked[1:6], BoardPair("wild", wild, wild)), BOARD, _SIZES) is None


def test_another_focus_in_each_view_is_told_as_that() -> None:
    """A focal length that scatters by 2 % from view to view has not changed at some view, nor did the board move between the exposures."""
    zoom = dict(enumerate(1 + 0.02 * np.random.default_rng(1).normal(size=8)))
    found = deviation(tuple(_views(8, zoom=zoom)), BOARD, _SIZES)
    assert found is not None
    assert found.code is Mistake.FOCUS
    assert re.search(r"the right camera's focal length changes by [12]\.\d% from view to view", found.message)


def test_a_focus_that_breathes_accuses_nobody() -> None:
    """0.06 % over eight views, which corners of 0.01 px show, costs nothing."""
    zoom = dict(enumerate(1 + np.linspace(0, 6e-4, 8)))
    assert deviation(tuple(_views(8, zoom=zoom, noise_px=0.01)), BOARD, _SIZES) is None


@pytest.mark.parametrize("moved", [{3: 0.001}, {1: 0.02, 3: -0.02, 6: 0.03}])
def test_a_few_pairs_in_which_the_board_moved_are_not_the_series(moved: dict[int, float]) -> None:
    """One of eight by 1 mm, and three of eight by centimetres: the others fit, so the series has no mistake in common."""
    assert deviation(_with_board_moved(_views(8), moved), BOARD, _SIZES) is None


def test_of_many_pairs_the_first_and_the_last_are_kept() -> None:
    """61 pairs, eight with a board, the first and last among them: the knock before the sixth of these is named by them."""
    views = iter(_views(8, turn=dict.fromkeys(range(5, 8), 0.01)))
    unseen = np.full((54, 2), np.nan)
    seen_at = {0, 8, 16, 24, 32, 40, 48, 60}
    pairs = []
    for index in range(61):
        view = next(views) if index in seen_at else BoardPair("", unseen, unseen)
        pairs.append(BoardPair(str(index), view.left_px, view.right_px))
    found = deviation(tuple(pairs), BOARD, _SIZES)
    assert found is not None
    assert found.evidence.turned is not None
    assert found.evidence.turned.course is Course.KNOCK
    assert found.evidence.turned.names == tuple(str(index) for index in sorted(seen_at))
    assert "at once before pair 40" in found.message
    assert math.degrees(float(np.linalg.norm(found.evidence.turned.turn_rad))) == pytest.approx(
        math.degrees(0.01), rel=0.1
    )


def test_a_look_needs_corners_beside_each_other() -> None:
    """Every second row of corners gives edges in one direction, every second corner of these none: then nothing is known."""
    board = Board(5, 4, 0.05)
    middle = board.points_m().mean(axis=0)
    image = render_board(small_rig().left, np.eye(3), np.array([0, 0, 0.5]) - middle, board)
    corners = find_corners(image, board)
    grid = corners.reshape(4, 5, 2).copy()
    grid[1::2] = np.nan
    rows = look_at(image, grid.reshape(-1, 2), board)
    assert 0 < rows.edge_px < 3
    assert rows.washed == 0
    grid[:, 1::2] = np.nan
    lonely = look_at(image, grid.reshape(-1, 2), board)
    assert math.isnan(lonely.edge_px)
    assert math.isnan(lonely.washed)
    assert lonely.bright == rows.bright


def test_a_pose_needs_four_rays() -> None:
    """Three corners leave a pose open, before a fisheye lens too."""
    model = fisheye_rig().left
    corners = np.full((54, 2), np.nan)
    corners[:3] = [[300, 200], [320, 200], [300, 220]]
    with pytest.raises(cv2.error, match="no rays"):
        rough_pose(BOARD.points_m(), corners, model)


def test_lenses_that_are_kept_keep_their_formula() -> None:
    """A fisheye lens and a rational one are told as such, and four exact views give the rig's pose back."""
    truth = replace(fisheye_rig(), covariance=np.zeros((GLOBALS, GLOBALS)))
    found = solve_pose(exact_pairs(truth, poses(4, seed=9), noise_px=0.05), BOARD, truth)
    assert found.bends == (Bend.FISHEYE, Bend.RATIONAL)
    assert found.rig.t_right_left_m == pytest.approx(truth.t_right_left_m, abs=0.001)


def test_a_state_without_projections_costs_infinitely_much() -> None:
    """Of a board whose place is not a number no corner is seen anywhere; at the true place exact corners cost nothing."""
    rig, pose = unlike_rig(), poses(1, seed=4)
    (pair,) = exact_pairs(rig, pose)
    problem = RigProblem([pair], BOARD.points_m(), (np.zeros(GLOBALS), np.zeros(GLOBALS)), (0.1, 0.1))
    turn = np.ravel(cv2.Rodrigues(rig.R_right_left)[0]).astype(np.float64)
    state = BundleState(left=rig.left, right=rig.right, rotation=turn, translation_m=rig.t_right_left_m, poses=pose)
    assert problem.cost(state) == pytest.approx(0, abs=1e-6)
    assert problem.cost(replace(state, poses=np.full((1, 6), np.nan))) == math.inf


def test_a_board_that_one_camera_does_not_see_has_a_plane_and_no_bias() -> None:
    """The left image gives the plane; without the right one nothing is known of the rig's bias."""
    model, board = small_rig().left, Board(5, 4, 0.05)
    middle = board.points_m().mean(axis=0)
    seen = render_board(model, np.eye(3), np.array([0, 0, 0.5]) - middle, board)
    geometry = StereoGeometry(focal_px=float(model.matrix[0, 0]), baseline_m=0.1, cx_px=160.0, cy_px=120.0)
    empty = np.full_like(seen, 128)
    assert math.isnan(find_board_plane(RectifiedPair(seen, empty), board, geometry, "l.png").corners_bias_share)
    # The same place in both images is no disparity: endlessly far, which is no share.
    both = find_board_plane(RectifiedPair(seen, seen), board, geometry, "l.png")
    assert math.isnan(both.corners_bias_share)


def test_two_tags_are_just_enough() -> None:
    """Two tags of an AprilGrid have eight corners, the least: all are found where they are; one tag is too few."""
    board = named_board("aprilgrid:5x4:30mm:9mm", None)
    one, two = _tags(1), _tags(2)
    assert find_corners(one[0], board).shape == (0, 2)
    found = find_corners(two[0], board)
    seen = np.isfinite(found).all(axis=1)
    assert seen.sum() == 8
    assert np.linalg.norm(found[seen] - two[1], axis=1).max() < 0.5


def _tags(count: int) -> tuple[NDArray[np.uint8], NDArray[np.float64]]:
    """The first tags of an AprilGrid with 3 px to a mm, black squares in the gaps' crossings, and the tags' corners by rows."""
    dictionary = cv2.aruco.getPredefinedDictionary(MarkFamily.APRILTAG_36H11.value)
    side, gap = 90, 27
    image = np.full((side + 6 * gap, count * (side + gap) + 5 * gap), 255, np.uint8)
    top, bottom = 3 * gap, 3 * gap + side
    rows: tuple[list[list[float]], list[list[float]]] = ([], [])
    for number in range(count + 1):
        x = 2 * gap + number * (side + gap)
        for y in (top - gap, bottom):
            image[y : y + gap, x : x + gap] = 0
        if number == count:
            break
        tag = np.asarray(cv2.aruco.generateImageMarker(dictionary, number, 10, borderBits=2), np.uint8)
        image[top:bottom, x + gap : x + gap + side] = cv2.resize(tag, (side, side), interpolation=cv2.INTER_NEAREST)
        for row, y in zip(rows, (top, bottom), strict=True):
            row += [[x + gap - 0.5, y - 0.5], [x + gap + side - 0.5, y - 0.5]]
    return image, np.array([*rows[0], *rows[1]])


_FISHEYE = CameraModel(
    width_px=1280,
    height_px=960,
    matrix=np.array([[440.0, 0, 640], [0, 440, 480], [0, 0, 1]]),
    distortion=np.array([0.02, -0.004, 0.001, -0.0002]),
    lens=Lens.FISHEYE,
)


def _fisheye_views(turn_deg: float) -> tuple[BoardPair, ...]:
    """Two fisheye cameras, 150 degrees wide, and twelve boards up to 60 degrees from the axis; half way the right one turns."""
    random = np.random.default_rng(3)
    points, pairs = BOARD.points_m() - BOARD.points_m().mean(axis=0), []
    for index in range(12):
        away, around = np.radians(random.uniform(0, 60)), random.uniform(0, 2 * np.pi)
        face = SE3.of(np.array([-away * np.sin(around), away * np.cos(around), 0, 0, 0, 0])).R
        tilt = SE3.of(np.array([*np.radians(random.uniform(-30, 30, 3)), 0, 0, 0])).R
        seen = points @ (face @ tilt).T + face @ [0, 0, random.uniform(0.25, 0.45)]
        rig = SE3.of(np.array([np.radians(turn_deg) * (index >= 6), 0, 0, -0.1, 0, 0]))
        left, right = (
            project(each, _FISHEYE) + random.normal(0, 0.1, (len(points), 2)) for each in (seen, rig.apply(seen))
        )
        pairs.append(BoardPair(str(index), left, right))
    return tuple(pairs)


@pytest.mark.parametrize(("turn_deg", "named"), [(0.0, None), (0.3, Mistake.UNSTIFF)])
def test_a_fisheye_is_no_mistake_and_hides_none(turn_deg: float, named: Mistake | None) -> None:
    """The search knows no fisheye: good views must not look like those of a rolling shutter, and a knock is told in the true lens's words."""
    rig = Rig(left=_FISHEYE, right=_FISHEYE, R_right_left=np.eye(3), t_right_left_m=np.array([-0.1, 0, 0]))
    series = BoardSeries(pairs=_fisheye_views(turn_deg), board=BOARD, sizes_px=((1280, 960), (1280, 960)))
    assert deviation(series.pairs, BOARD, series.sizes_px) is not None
    finding = name_mistake(series, _calibration(rig))
    assert (None if finding is None else finding.code) is named
    if finding is not None and finding.evidence.turned is not None:
        assert np.degrees(np.linalg.norm(finding.evidence.turned.turn_rad)) == pytest.approx(turn_deg, rel=0.1)
        assert finding.evidence.turned.lens is _FISHEYE
