"""The measures by which matchers are judged: what they say about maps whose errors are known."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from phone_host.model import Disparity, RectifiedPair
from phone_host.scene.cast import pixel_rays
from phone_host.scene.scene import rectified_cameras, truth
from phone_host.scene.scene_model import Body, Plane, Scene
from tests.bench.depth_accuracy import Case, Row, by_three_way, score
from tests.bench.depth_boards import View, view_scores
from tests.bench.depth_choice import choices
from tests.bench.depth_confidence import curve, relative_area
from tests.bench.depth_parts import evaluate_parts
from tests.bench.depth_rooms import PARTS, Room, furnished, parts_of, view_of
from tests.bench.depth_scenes import Image
from tests.bench.match_limit import OPERATIONS, Peak
from tests.bench.room_painter import Paint, Painted, paint_view

TRUTH_PX = 10.0


def _case(height_px: int = 10, width_px: int = 100) -> Case:
    nothing: Image = np.zeros((height_px, width_px, 3), np.uint8)
    return Case("scene", "clean", nothing, nothing, np.full((height_px, width_px), TRUTH_PX, np.float32), 16)


def _map(case: Case, wrong: int, none: int = 0, off_px: float = 5.0) -> Disparity:
    """A map whose first pixels are wrong and whose next have no value."""
    found = case.truth.copy().reshape(-1)
    found[:wrong] += off_px
    found[wrong : wrong + none] = np.nan
    return found.reshape(case.truth.shape)


def test_scores_count_pixels() -> None:
    """Of 1000 pixels, 100 are 1.5 px off and 100 have no value: density 90 %, bad1 1 of 9, bad2 none, mean error 1/9 of 1.5 px."""
    case = _case()
    row = score(case, _map(case, 100, 100, off_px=1.5))
    assert row.density == pytest.approx(90)
    assert (row.bad1, row.bad2) == pytest.approx((100 / 9, 0))
    assert row.avg == pytest.approx(1.5 / 9)
    # The second row of the map has no value at all and stays so: all its pixels count as wrong after filling.
    assert (row.fill1, row.fill2) == pytest.approx((20, 10))
    assert (row.right2, row.wrong2) == pytest.approx((90, 0))


def test_a_map_without_values_is_all_wrong() -> None:
    """Giving no value at all must never look good."""
    case = _case()
    row = score(case, np.full(case.truth.shape, np.nan, np.float32))
    assert (row.density, row.bad2, row.fill2) == (0, 100, 100)


def _confidence(case: Case, values: NDArray[np.generic]) -> NDArray[np.uint8]:
    return np.asarray(values, np.uint8).reshape(case.truth.shape)


def test_an_oracle_has_no_area_and_dice_have_all_of_it() -> None:
    """Confidence that knows the errors has the relative area 0; one level for all pixels, which is no order, has 1; the reverse more."""
    case = _case()
    found = _map(case, 200)
    right = (np.arange(1000) >= 200).astype(np.uint8)
    oracle, level, reverse = (
        curve(case, found, _confidence(case, values)) for values in (right, np.full(1000, 7), 1 - right)
    )
    assert oracle.area == pytest.approx(0, abs=1e-9)
    assert level.area == pytest.approx(1, abs=1e-9)
    assert reverse.area > 1.5
    assert [oracle.at(share) for share in (0.5, 0.8, 1.0)] == pytest.approx([0, 0, 20])
    assert level.at(0.5) == pytest.approx(20)
    assert (oracle.falls, level.falls, reverse.falls) == (True, True, False)
    assert relative_area([oracle, level]) == pytest.approx(0.5, abs=1e-9)


def test_confidence_of_another_shape_is_refused() -> None:
    """A confidence map that does not fit its disparity is a mistake of the matcher."""
    case = _case()
    with pytest.raises(ValueError, match="confidence is"):
        curve(case, case.truth, np.zeros((3, 3), np.uint8))


def test_a_scene_is_judged_by_what_the_others_choose() -> None:
    """Where one variant is best on every scene but one, that scene still gets the others' choice, and says what it lost."""

    def row(scene: str, percent: float) -> Row:
        return Row(scene, "clean", 100, percent, percent, percent, percent, 1)

    scenes = ("a", "b", "c")
    anchor = [row(scene, 10) for scene in scenes]
    table = choices(
        {"x": [row("a", 5), row("b", 5), row("c", 9)], "y": [row("a", 8), row("b", 8), row("c", 2)]}, anchor
    )
    held = {each.scene: each for each in table.held_out}
    assert table.chosen == "y"  # 18 in all, beside 19
    assert (held["c"].chosen, held["c"].best) == ("x", "y")
    assert held["c"].score > held["c"].best_score
    assert held["a"].chosen == "y"
    assert "held out" in str(table)


def test_a_board_view_without_values_is_all_wrong_and_none_of_it_right() -> None:
    """Half of the outline right, a quarter 3 px off, a quarter without a value: density 75, bad2 33, wrong2 25, right2 50 %."""
    truth = np.full((4, 8), np.nan, np.float32)
    truth[:, :4] = TRUTH_PX
    found = truth.copy()
    found[2] += 3
    found[3] = 0
    nothing: Image = np.zeros((4, 8, 3), np.uint8)
    view = View("rig", 1, nothing, nothing, truth, 16)
    assert view_scores(view, found) == pytest.approx([75, 100 / 3, 100 / 3, 25, 50])
    assert view_scores(view, np.full_like(truth, np.nan)) == pytest.approx([0, 100, 100, 0, 0])


def test_the_padded_anchor_gives_the_left_columns_values() -> None:
    """A noise image shifted by 8 px has disparity 8 also in the columns whose whole search range is not in the image."""
    noise = np.random.default_rng(1).integers(0, 256, (60, 128, 3), dtype=np.uint8)
    found = by_three_way(noise[:, :120], noise[:, 8:], 32)
    assert (np.abs(found[5:-5, 12:32] - 8) < 1).mean() > 0.8


def test_the_arithmetic_limit_is_operations_over_peak() -> None:
    """One pixel and disparity needs the stated operations; twice the cores take half the time; an unknown peak gives no limit."""
    peak = Peak("X", 1e9)
    assert peak.limit_ms(1000, 10, 1) == pytest.approx(OPERATIONS * 1e4 / 1e9 * 1e3)
    assert peak.limit_ms(1000, 10, 2) == pytest.approx(peak.limit_ms(1000, 10, 1) / 2)
    assert Peak("X", why="no compiler").limit_ms(1000, 10, 2) == 0


def test_a_wall_has_the_grey_levels_it_was_given_and_a_highlight_lies_at_infinity() -> None:
    """A wall painted with 4 levels spans about as many.

    A flat face mirrors a far lamp as if it were at infinity: both eyes see the highlight in the same pixel, so it has
    disparity 0 on a face that is 30 px and more nearer, and wanders over that face from one eye to the other.
    """
    painted = furnished(np.random.default_rng([1, 41]), 1)
    (camera, pose), (_, other) = rectified_cameras(view_of(640))
    small = replace(camera, width_px=160, height_px=120)
    wall = Painted(Scene((Body("wall", Plane(), (0.0, 0.0, 2.0)),)), (Paint(texture_levels=4.0),))
    levels = paint_view(wall, small, pose)[..., 0]
    low, high = np.percentile(levels, [1, 99])
    assert 1.5 < high - low < 4.1
    names = [body.name for body in painted.scene.bodies]
    shine = replace(painted.paints[names.index("glossy")], texture_levels=0.0)
    box = Painted(Scene((painted.scene.bodies[names.index("glossy")],)), (shine,))
    dull = Painted(box.scene, (replace(shine, gloss_levels=0.0),))
    peaks = []
    for eye in (pose, other):
        extra = (paint_view(box, camera, eye) - paint_view(dull, camera, eye))[..., 0]
        row, column = np.unravel_index(int(extra.argmax()), extra.shape)
        peaks.append((float(extra.max()), int(row), int(column)))
    assert peaks[0][0] > 30
    assert peaks[0] == pytest.approx(peaks[1], abs=1)
    assert float(truth(box.scene, view_of(640)).disparity_px[peaks[0][1], peaks[0][2]]) > 30


def test_what_a_rooms_pixels_show_is_known() -> None:
    """The bare half of a wall is told from the other, and a pixel that sees nothing from both."""
    wall = Body("wall", Plane(2.0, 2.0), (0.0, 0.0, 2.0))
    painted = Painted(Scene((wall,)), (Paint(plain_beyond_m=0.25),))
    view = view_of(640)
    exact = truth(painted.scene, view)
    parts = parts_of(painted, exact.body, exact.depth_m, pixel_rays(rectified_cameras(view)[0][0]))
    # f = 525 px at 2 m: the wall ends 262.5 px from the middle, at column 319.5, and is bare from 65.6 px right of it.
    row = [PARTS[part] for part in parts[240]]
    assert row == ["nothing"] * 57 + ["wall"] * (386 - 57) + ["plain"] * (583 - 386) + ["nothing"] * (640 - 583)


def test_errors_are_counted_by_what_the_pixel_shows() -> None:
    """All pixels of one surface wrong, all of another right, a third without a value."""

    class Fixed:
        def match(self, pair: RectifiedPair) -> Disparity:
            found = np.full(pair.left.shape[:2], TRUTH_PX, np.float32)
            found[:2] += 5
            found[4:] = np.nan
            return found

    parts = np.repeat(np.array([1, 1, 4, 4, 5, 5], np.uint8)[:, None], 8, axis=1)
    nothing: Image = np.zeros((6, 8, 3), np.uint8)
    room = Room("room", nothing, nothing, np.full((6, 8), TRUTH_PX, np.float32), parts, 16)
    rows = {row.part: row for row in evaluate_parts(lambda _: Fixed(), [room])}
    assert set(rows) == {"wall", "floor", "pole"}
    assert (rows["wall"].wrong2, rows["floor"].right2, rows["pole"].density) == (100, 100, 0)
    assert rows["pole"].bad2 == 100
    assert sum(row.share for row in rows.values()) == pytest.approx(100)
