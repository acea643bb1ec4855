"""The plots of calibrate's page, and what they show: coverage, enlarged arrows, courses, tilts, space, turns, rectified pairs."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from phone_host.calibration.solve.series_snapshot import series_views, view_turns
from phone_host.calibration.target.board_views import fullest, rectified_view
from phone_host.calibration.target.pairs import Reason, Rejected
from phone_host.calibration.target.small_picture import small_jpeg, small_size
from phone_host.report.calibration_space import Shape, in_space, seen_from
from phone_host.svg.plot_arrows import enlarged
from phone_host.svg.plot_maps import TiltedBoard, coverage_map, tile_views, tilt_disc
from phone_host.svg.plot_marks import Course, over_views
from tests.support.boards import BOARD
from tests.support.calibration_series import calibration, pairs, taken, turned
from tests.support.html import Page


def test_tiles_count_views_and_not_corners() -> None:
    """Two corners in one tile are one view; a corner that was not seen or lies outside counts nowhere."""
    views = [np.array([[10.0, 10], [20, 20], [np.nan, np.nan]]), np.array([[15.0, 15], [639, 479], [700, 10]])]
    counts = tile_views(views, (640, 480))
    assert counts.shape == (9, 12)
    assert (counts[0, 0], counts[8, 11], counts.sum()) == (2, 1, 3)
    drawn = Page(coverage_map(views, (640, 480), counts, "corners", 360))
    titles = drawn.words
    assert titles.count("no view") == 9 * 12 - 2
    assert "views: 2" in titles


def test_a_coverage_without_views_is_empty() -> None:
    """Every tile is crossed out."""
    counts = tile_views([], (64, 64))
    assert Page(coverage_map([], (64, 64), counts, "corners", 120)).words.count("no view") == counts.size


@pytest.mark.parametrize(("error_px", "bar_px"), [(0.01, 0.02), (0.2, 0.5), (3.0, 5.0)])
def test_the_scale_of_arrows_is_a_round_number_near_what_they_show(error_px: float, bar_px: float) -> None:
    """An arrow of the usual error is as long as was asked, and the bar a round error, at most a sixth of the width."""
    scale = enlarged(np.array([[error_px, 0.0]] * 20 + [[np.nan, np.nan]]), 0.06)
    assert error_px * scale.by == pytest.approx(0.06)
    assert scale.bar_px == bar_px
    assert scale.words(1000) == f"enlarged {60 / error_px:.0f} times"
    assert enlarged(np.empty((0, 2)), 0.06).by > 0


def test_large_errors_are_not_enlarged_0_times() -> None:
    """Residuals of a rig that is none are longer than their arrows."""
    assert enlarged(np.array([[400.0, 0.0]] * 20), 0.06).words(1000) == "drawn at 0.15 of their length"


def test_courses_show_their_limits_and_as_many_names_as_fit() -> None:
    """Of fifty long names a few; a value that is NaN has no mark."""
    values = np.linspace(0, 1, 50)
    values[3] = np.nan
    names = [f"view-{index:04d}" for index in range(50)]
    course = Course("turn", 4, values, np.full(50, 0.1))
    still = Course("still", 5, np.zeros(50), np.zeros(50))
    drawn = Page(over_views(names, [course, still], "px", "turns", 340))
    assert "view-0004: turn +0.0816 ± 0.1 px" in drawn.words
    assert "view-0003: turn" not in drawn.words
    ticks = [name for name in names if name in drawn.words.replace(f"{name}: turn", "").replace(f"{name}: still", "")]
    assert 2 <= len(ticks) <= 5
    assert Page(over_views(["one"], [Course("a", 1, np.ones(1), np.ones(1))], "px", "one", 340)).open == []


def test_a_disc_of_tilts_holds_the_steepest() -> None:
    """A board that faces the camera lies in the middle, one tilted to the right beside it."""
    drawn = Page(tilt_disc([TiltedBoard(0.0, 0.0, 0.0, "flat"), TiltedBoard(70.0, 1.0, 0.0, "steep")], "tilts", 300))
    dots = [each for each in drawn.every("circle") if "fill-opacity" in each]
    assert [float(each["cx"] or 0) for each in dots] == pytest.approx([150, 150 + 130 - 18])
    assert "steep" in drawn.words


@pytest.mark.parametrize(("size_m", "bar"), [(0.1, "20 mm"), (9.0, "2 m")])
def test_a_picture_of_space_has_a_round_scale(size_m: float, bar: str) -> None:
    """From above, what is farther away stands higher; a closed line is filled."""
    near = Shape(lines=(np.array([[0, 0, 0], [size_m, 0, 0]]),), colour=1, title="near")
    far = Shape(lines=(np.array([[0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 0, 1]]) * size_m,), colour=2, title="far")
    drawn = Page(in_space([near, far], seen_from(0, 90), "space", 400))
    assert bar in drawn.words
    assert drawn.words.index("far") < drawn.words.index("near") or "near" in drawn.words
    paths = [str(each["d"]) for each in drawn.every("path")]
    assert sum(path.endswith("z") for path in paths) == 1
    tops = {path[1:].split("L")[0].split()[1] for path in paths[:2]}
    assert len(tops) == 2


def test_a_view_in_which_a_camera_was_turned_is_found_with_its_angle() -> None:
    """0.05 degrees about x in one of eight views: found there within three standard deviations, and nowhere else."""
    found = calibration()
    result = view_turns(turned(0.05, 3), found.poses, BOARD.points_m(), found.rig)
    assert result is not None
    off = np.degrees(result.turns_rad) - np.array([[0.05 * (index == 3), 0, 0] for index in range(8)])
    assert np.all(np.abs(off) < 4 * np.degrees(result.sigmas_rad) + 0.01)
    assert np.degrees(result.sigmas_rad[3, 0]) < 0.01
    assert result.names[3] == "3"


def test_turns_are_not_told_where_corners_do_not_tell_them() -> None:
    """No view, or one of which a single corner was seen."""
    found = calibration()
    assert view_turns([], found.poses[:0], BOARD.points_m(), found.rig) is None
    blind = replace(pairs()[0], left_px=np.full((54, 2), np.nan), right_px=np.full((54, 2), np.nan))
    assert view_turns([blind], found.poses[:1], BOARD.points_m(), found.rig) is None


def test_views_of_an_earlier_calibration_come_first_and_have_no_picture() -> None:
    """Their corners are known, their images are not; a new pair whose name was taken keeps its own picture."""
    renamed = [replace(pair, name=f"{pair.name} (2)") for pair in pairs()[4:]]
    earlier = [replace(pair, left_px=pair.left_px.copy()) for pair in pairs()[:4]]
    views = series_views(taken([*renamed, *earlier], [*renamed, *earlier]), None, ())
    assert [view.name for view in views] == ["0", "1", "2", "3", "4 (2)", "5 (2)", "6 (2)", "7 (2)"]
    assert [bool(view.left.picture) for view in views] == [False] * 4 + [True] * 4
    assert not any(view.is_used for view in views)
    found = calibration()
    namesake = Rejected("3", Reason.NOT_FOUND_LEFT, "it is new")
    views = series_views(taken([replace(pair, left_px=pair.left_px.copy()) for pair in pairs()]), found, (namesake,))
    assert [(view.is_used, view.detail) for view in views if view.name == "3"] == [(True, ""), (False, "it is new")]


def test_a_rectified_pair_is_small_and_its_corners_lie_on_its_lines(tmp_path: Path) -> None:
    """Two images of the rig's sizes give pictures of at most 640 px, whose corners meet in rows to a third of a pixel; a file that is gone gives none."""
    files = (tmp_path / "l.png", tmp_path / "r.png")
    for path, (width, height) in zip(files, ((640, 480), (1280, 720)), strict=True):
        cv2.imwrite(str(path), np.full((height, width, 3), 80, np.uint8))
    rig = calibration().rig
    shown = rectified_view(files, pairs()[2], rig)
    assert shown is not None
    assert not shown.is_vertical
    assert len(shown.left_px) == 53
    assert np.abs(shown.left_px[:, 1] - shown.right_px[:, 1]).max() < 0.6
    assert np.all(shown.left_px[:, 0] > shown.right_px[:, 0])
    image = cv2.imdecode(np.frombuffer(shown.left, np.uint8), cv2.IMREAD_COLOR)
    assert image is not None
    assert max(image.shape[:2]) <= 640
    files[1].unlink()
    assert rectified_view(files, pairs()[2], rig) is None


def test_the_pair_that_is_shown_has_a_whole_and_large_board() -> None:
    """Of a board that is whole, the same half as large, and one larger whose corners lie outside, the first."""
    found = calibration()
    assert found.rectification is not None
    whole = pairs()[0]
    both = (whole.left_px, whole.right_px)
    small = replace(whole, name="small", left_px=both[0].mean(axis=0) + (both[0] - both[0].mean(axis=0)) / 2)
    cut = replace(whole, name="cut", left_px=both[0] - (600, 0), right_px=both[1] * 1.5)
    assert fullest([small, whole, cut], found.rig, found.rectification) is whole


def test_small_pictures_keep_their_shape_and_are_never_enlarged() -> None:
    """The longer side is limited; a line stays at least a pixel wide."""
    assert small_size((4000, 3000), 320) == (320, 240)
    assert small_size((100, 50), 320) == (100, 50)
    assert small_size((5000, 2), 320) == (320, 1)
    assert small_jpeg(np.zeros((30, 20), np.uint8), 320).startswith(b"\xff\xd8")
