"""A search that is too short, a repeated pattern, uneven rows and unrectified images are told on rendered pairs."""

import math
from dataclasses import replace
from typing import Final

import cv2
import numpy as np
import pytest

from common import now
from common.diagnostic import Diagnostic
from phone_host.diagnostics.codes import BLOCKING, Code, diagnose
from phone_host.diagnostics.headline import Grade, answer
from phone_host.diagnostics.image_rules import image_doubts, median_figures
from phone_host.diagnostics.run_rules import no_depth
from phone_host.model import CameraModel, Crop, Evidence, Image, Rig, StereoGeometry
from phone_host.scene.scene import demo_scene
from phone_host.scene.scene_model import Look, rig_poses
from phone_host.scene.scene_render import render
from phone_host.stereo.core import StereoCore
from phone_host.stereo.depth_limits import DepthWanted
from phone_host.stereo.evidence import look_at, maps_of
from phone_host.stereo.evidence_search import beyond_search, row_skew_px
from phone_host.stereo.match import MatchSettings
from phone_host.stereo.matcher_names import MatcherName
from phone_host.stereo.rectifier import Rectifier

Pair = tuple[Image, Image]

GEOMETRY: Final = StereoGeometry(focal_px=260.0, baseline_m=0.1, cx_px=159.5, cy_px=119.5)
"""f b = 26 m px: the demo's scene, 0.7 to 2.5 m away, has disparities of 10 to 37 px."""


def _model() -> CameraModel:
    matrix = np.array([[260.0, 0, 159.5], [0, 260.0, 119.5], [0, 0, 1]])
    return CameraModel(width_px=320, height_px=240, matrix=matrix, distortion=np.zeros(5))


def _rig(turn: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Rig:
    """Two cameras of 320x240, f = 260 px, 100 mm apart, the right one turned by a rotation vector, rad."""
    rotation = np.asarray(cv2.Rodrigues(np.array(turn))[0], np.float64)
    moved = -rotation @ np.array([0.1, 0.0, 0.0])
    return Rig(left=_model(), right=_model(), R_right_left=rotation, t_right_left_m=moved)


def _render(rig: Rig) -> Pair:
    left, right = (
        render(demo_scene(), model, pose, Look(noise_sigma=1.0, seed=seed))
        for seed, (model, pose) in enumerate(zip((rig.left, rig.right), rig_poses(rig), strict=True))
    )
    return left, right


@pytest.fixture(scope="module")
def good() -> Pair:
    """A rectified pair of the demo's scene."""
    return _render(_rig())


def _core(
    disparities: int,
    geometry: StereoGeometry | None = None,
    wanted: DepthWanted = DepthWanted(),  # noqa: B008  # frozen
    rig: Rig | None = None,
) -> StereoCore:
    rectifier = None if rig is None else Rectifier(rig)
    return StereoCore(MatchSettings(MatcherName.SGBM, disparities), rectifier, geometry, wanted)


def _evidence(core: StereoCore, left: Image, right: Image) -> Evidence:
    processed = core.compute(left, right, now.monotonic_ns)
    return look_at(processed, maps_of(core, processed)).evidence


def _found(core: StereoCore, left: Image, right: Image) -> tuple[Diagnostic, ...]:
    return image_doubts(_evidence(core, left, right))


def test_a_search_that_leaves_out_most_of_the_scene_is_called_wrong_with_a_number_that_helps(good: Pair) -> None:
    """With N = 8 all is nearer; the remedy's N, given in its place, leaves no doubt."""
    evidence = _evidence(_core(8), *good)
    found = image_doubts(evidence)
    assert [concern.code for concern in found] == [Code.SEARCH_TOO_SHORT]
    assert evidence.beyond_share > 0.9
    said = answer(median_figures((evidence,)), found, None)
    assert said.grade is Grade.BAD
    assert said.sentence.startswith("Depth is wrong")
    assert f"--disparities {evidence.enough_disparities}" in found[0].remedy
    assert _found(_core(evidence.enough_disparities), *good) == ()


def test_a_near_limit_that_is_too_far_is_told_in_metres(good: Pair) -> None:
    """The nearest things are 26 m px / 37 px = 0.7 m away: a search from 1.6 m, N = 16, is told to begin there."""
    evidence = _evidence(_core(64, GEOMETRY, DepthWanted(search_from_m=1.7)), *good)
    [concern] = image_doubts(evidence)
    assert concern.code == Code.SEARCH_TOO_SHORT
    assert 0.4 <= evidence.enough_from_m <= 0.75
    assert concern.remedy.startswith(f"give --near {math.floor(evidence.enough_from_m * 100) / 100:g}m")


def test_a_crop_is_only_asked_for_what_lies_in_it(good: Pair) -> None:
    """Behind the crop's window nothing is nearer than the search, though other parts of the scene are."""
    core = _core(64)
    disparity = core.compute(*good, now.monotonic_ns).disparity
    assert disparity is not None
    spans = [(float(np.nanpercentile(disparity[y : y + 80, 60:310], 97)), y) for y in range(0, 161, 20)]
    least, y = min(spans)
    searched = math.ceil(least) + 3
    assert _evidence(_core(searched), *good).beyond_share > 0.05
    crop = DepthWanted(crop=Crop(x_px=60, y_px=y, width_px=250, height_px=80))
    assert not _evidence(_core(searched, wanted=crop), *good).beyond_share > 0.05


def test_single_features_beyond_the_search_do_not_count() -> None:
    """Of 100 features all over the image, one beyond is a wrong match, and a wider search is not asked for it."""
    places = np.column_stack([np.tile(np.arange(10), 10), np.repeat(np.arange(10), 10)]) * [32.0, 24.0]
    shifts = np.where(np.arange(100) == 5, 200.0, 10.0)
    assert beyond_search(places, shifts, 32, (320, 240)) == (0.0, 16)


def test_chance_matches_on_a_bare_wall_are_nothing_near() -> None:
    """Things fill two tiles; on the wall three features, each alone in its tile, are beyond the search, each elsewhere or farther: not told.

    Two that agree, side by side, are a thing that is near: one tile of four.
    """
    things = np.random.default_rng(2).uniform((0, 200), (60, 238), (40, 2))
    chance = np.array([[150.0, 30.0], [170.0, 40.0], [300.0, 100.0]])
    shifts = np.concatenate([np.full(40, 12.0), [90.0, 160.0, 91.0]])
    share, enough = beyond_search(np.vstack([things, chance]), shifts, 32, (320, 240))
    assert share == 0.0
    assert enough == 16
    shifts[41] = 92.0
    share, enough = beyond_search(np.vstack([things, chance]), shifts, 32, (320, 240))
    assert 0.1 < share < 0.4
    assert enough == 96  # 90 and 92 with a twentieth more, in steps of 16


def test_a_textured_board_in_a_plain_room_is_not_most_of_the_scene() -> None:
    """A tile of the image counts once, however many features it holds: 90 of 100 features in one tile of 11 are 9 %."""
    board = np.full((90, 2), 150.0) + np.random.default_rng(1).uniform(0, 8, (90, 2))
    wall = np.array([[x, y] for y in (20.0, 220.0) for x in (20.0, 80.0, 140.0, 220.0, 300.0)])
    shifts = np.concatenate([np.full(90, 50.0), np.full(10, 5.0)])
    share, _ = beyond_search(np.vstack([board, wall]), shifts, 32, (320, 240))
    assert share == pytest.approx(1 / 11)


def test_without_a_known_search_nothing_is_said_about_it() -> None:
    """Another package's matcher has a range of its own."""
    places = np.zeros((100, 2))
    assert math.isnan(beyond_search(places, np.full(100, 90.0), 0, (320, 240))[0])


def test_false_matches_are_no_roll() -> None:
    """Most features agree on their rows; a tenth, all at one edge, is off by 8 px, as repeated squares are. No plane explains that."""
    random = np.random.default_rng(5)
    places = random.uniform(0, (640, 480), (100, 2))
    down = random.normal(0, 0.1, 100)
    at_the_edge = np.argsort(places[:, 0])[-30:]
    down[at_the_edge[::3]] += 8.0
    assert row_skew_px(places, down, (640, 480)) < 0.8


def test_no_depth_because_of_a_short_search_is_told_with_its_remedy() -> None:
    """The remedy of missing depth is that of the search."""
    short = diagnose(Code.SEARCH_TOO_SHORT, "all of the scene is nearer", "give --near 1m")
    assert no_depth(None, None, (short,)).remedy == "give --near 1m"
    assert no_depth(None, None).code == Code.NO_DEPTH
    dark = diagnose(Code.DARK, "the right camera sees almost nothing", "switch on a light")
    assert no_depth(None, None, (dark,)).message == "no pair has depth: the right camera sees almost nothing"


def _pattern(kind: str, shift_px: int) -> Image:
    y, x = np.mgrid[:240, :320]
    bars = (x + shift_px) // 8 + (y // 8 if kind == "checks" else 0)
    noise = np.random.default_rng(shift_px).normal(0, 2, x.shape)
    return np.asarray(np.clip(bars % 2 * 180 + 30 + noise, 0, 255), np.uint8)


@pytest.mark.parametrize("kind", ["stripes", "checks"])
def test_a_repeated_pattern_is_told(kind: str) -> None:
    """A period of 16 px fits four places of a search of 64 px."""
    found = _found(_core(64), _pattern(kind, 0), _pattern(kind, 21))
    assert [concern.code for concern in found] == [Code.AMBIGUOUS]


def test_a_search_that_was_narrowed_to_one_repeat_is_ambiguous_all_the_same() -> None:
    """A search of 8 px holds one repeat of 16 px at most, and finds it: whether it is the right one, nobody knows."""
    evidence = _evidence(_core(8), _pattern("stripes", 0), _pattern("stripes", 5))
    assert evidence.ambiguous_share > 0.75


def test_depth_whose_rows_could_not_be_compared_is_no_plain_success() -> None:
    """Too few features: a warning, though no doubt is named."""
    said = answer(replace(median_figures(()), density=0.9), (), None)
    assert said.grade is Grade.WARNING
    assert "could not be checked" in said.sentence


@pytest.mark.parametrize(
    ("angle_deg", "zoom", "skew_px"),
    # a ramp of 240 px * 2 % or 320 px * sin 1 deg, divided by sqrt 12
    [(0.0, 1.02, 1.39), (1.0, 1.0, 1.61), (0.0, 1.0, 0.0)],
)
def test_uneven_rows_are_measured_and_told(good: Pair, angle_deg: float, zoom: float, skew_px: float) -> None:
    """A rolled or zoomed camera is told with its size; the remedy speaks of a rig only if there is one."""
    move = cv2.getRotationMatrix2D((159.5, 119.5), angle_deg, zoom)
    right = np.asarray(cv2.warpAffine(good[1], move, (320, 240), borderMode=cv2.BORDER_REPLICATE), np.uint8)
    evidence = _evidence(_core(64), good[0], right)
    assert evidence.skew_px == pytest.approx(skew_px, abs=0.25)
    found = [concern for concern in image_doubts(evidence) if concern.code == Code.VERTICAL_ERROR]
    assert bool(found) == (skew_px > 1)
    assert all("not rectified" in concern.remedy for concern in found)
    behind = image_doubts(_evidence(_core(64, rig=_rig()), good[0], right))
    assert all("calibrate the rig again" in c.remedy for c in behind if c.code == Code.VERTICAL_ERROR)


def test_a_common_offset_is_no_skew() -> None:
    """Rows that are all 1.5 px too low have a skew of 0; few features measure none."""
    places = np.random.default_rng(2).uniform(0, 240, (60, 2))
    assert row_skew_px(places, np.full(60, 1.5), (320, 240)) == pytest.approx(0.0, abs=1e-9)
    assert math.isnan(row_skew_px(places[:19], np.full(19, 1.5), (320, 240)))


def test_unrectified_photographs_are_not_called_turned() -> None:
    """Cameras that look 1.5 degrees aside and up: rows differ by 7 px, and the remedy is a calibration."""
    left, right = _render(_rig((0.026, 0.02, 0.02)))
    found = _found(_core(64), left, right)
    assert not [concern for concern in found if concern.code in BLOCKING]
    [rows] = [concern for concern in found if concern.code == Code.VERTICAL_ERROR]
    assert "give --calibration rig.yaml" in rows.remedy
