"""Mistakes of a series of board views are told apart by what two cameras see; good series accuse nobody."""

import math
import os
from dataclasses import replace
from functools import cache

import cv2
import numpy as np
import pytest

from common.diagnostic import Diagnostic
from common.errors import DataError
from phone_host.calibration.failure_modes.deviating import deviation
from phone_host.calibration.failure_modes.mistakes import Course, Mistake, mistaken, unturned
from phone_host.calibration.failure_modes.name import BoardSeries, name_mistake
from phone_host.calibration.failure_modes.partners import wrong_partners
from phone_host.calibration.failure_modes.remedies import assessed, with_cause
from phone_host.calibration.solve.calibrate import calibrate
from phone_host.calibration.solve.verdict import Assessment
from phone_host.calibration.target.corners import find_corners
from phone_host.calibration.target.pairs import BoardPair
from phone_host.calibration.target.sharpness import look_at
from phone_host.model import Verdict
from tests.support.boards import BOARD, exact_pairs, poses, render_pair
from tests.support.cause_judge import finding_of
from tests.support.cause_real import real_pairs, variants
from tests.support.cause_series import MAKERS, Made, good, good_pictures, partners, unstiff
from tests.support.rigs import small_rig

_FEW = 11
"""A series of that many views is solved in half the time of most; of those of images, three pairs are looked at."""


def _random(seed: int) -> np.random.Generator:
    return np.random.default_rng([7, seed])


@cache
def _unstiff(course: Course) -> tuple[Made, Diagnostic]:
    """The first small series whose cameras turn in a way, and what is named."""
    word = {Course.DRIFT: "drift", Course.KNOCK: "knock", Course.LOOSE: "loose"}[course]
    series = (unstiff(_random(seed)) for seed in range(99))
    made = next(made for made in series if made.truth.startswith(word) and len(made.pairs) <= _FEW)
    found = deviation(tuple(made.pairs), made.board, made.sizes_px)
    assert found is not None
    return made, found


@pytest.mark.parametrize("mistake", list(Mistake))
def test_each_mistake_is_named(mistake: Mistake) -> None:
    """A series of random cameras and boards with one mistake: its name, a sentence with figures and a remedy are given."""
    made = next(made for made in (MAKERS[mistake](_random(seed)) for seed in range(30)) if len(made.pairs) <= _FEW)
    found = finding_of(replace(made, images=made.images[:3]))
    assert found is not None
    assert found.code is mistake
    assert found.message
    assert found.remedy


@pytest.mark.parametrize("seed", [0, 3])
def test_a_good_series_accuses_nobody(seed: int) -> None:
    """Noise, a board that is not flat, and one pair in which it moved are no mistake of the series."""
    assert finding_of(good(_random(seed))) is None


def test_good_pictures_are_neither_blurred_nor_glaring() -> None:
    """Rendered images with the softness and noise of a webcam."""
    assert finding_of(good_pictures(_random(2))) is None


@pytest.mark.parametrize("course", [Course.DRIFT, Course.KNOCK])
def test_a_turn_is_measured_and_undone(course: Course) -> None:
    """The angle is that of the truth within three standard deviations and a tenth; without it the rig is that of the last view."""
    made, found = _unstiff(course)
    degrees = float(made.truth.split()[1])
    assert found.code is Mistake.UNSTIFF
    assert found.evidence.turned is not None
    assert found.evidence.turned.course is course
    angle = math.degrees(float(np.linalg.norm(found.evidence.turned.turn_rad)))
    sigma = math.degrees(float(np.linalg.norm(found.evidence.turned.sigma_rad)))
    assert angle == pytest.approx(degrees, abs=3 * sigma + 0.1 * degrees)
    stiff = calibrate(unturned(made.pairs, found.evidence.turned), made.board, made.sizes_px)
    loose = calibrate(made.pairs, made.board, made.sizes_px)
    assert len(stiff.used) == len(made.pairs)
    off = [
        math.degrees(math.acos(min(1.0, (np.trace(each.rig.R_right_left.T @ made.rig.R_right_left) - 1) / 2)))
        for each in (stiff, loose)
    ]
    assert off[0] < 0.5 * off[1] or off[0] < 0.02


def test_a_roll_costs_rows_at_the_edges() -> None:
    """A right camera that rolls by 0.395 degrees moves no row in the middle, but those at the edges by angle times half the width: that is what is told."""
    rig, pairs = small_rig(), list[BoardPair]()
    roll = math.radians(0.395)
    for index, pose in enumerate(poses(12, seed=3)):
        turn = np.asarray(cv2.Rodrigues(np.array([0, 0, roll * index / 11]))[0], np.float64)
        turned = replace(rig, R_right_left=turn @ rig.R_right_left, t_right_left_m=turn @ rig.t_right_left_m)
        pairs += exact_pairs(turned, pose[np.newaxis], noise_px=0.03, seed=index)
    found = deviation(tuple(pairs), BOARD, ((320, 240), (400, 300)))
    assert found is not None
    assert found.evidence.turned is not None
    assert found.evidence.turned.rows_px == pytest.approx(roll * 200, rel=0.1)
    assert "rows differ by up to 1." in found.message


def test_a_loose_rig_is_told_from_a_board_that_moved() -> None:
    """Cameras that wobble about the middle of their bar: the scatter is that of the truth."""
    made, found = _unstiff(Course.LOOSE)
    assert found.evidence.turned is not None
    assert found.evidence.turned.course is Course.LOOSE
    truth = math.radians(float(made.truth.split()[1]))
    assert float(np.linalg.norm(found.evidence.turned.turn_rad)) == pytest.approx(truth * math.sqrt(3), rel=0.4)


def test_a_stretched_print_is_told_though_it_makes_a_view_look_wrong() -> None:
    """The lens of a view is judged with the wrong squares first: views rejected for it must not hide the stretch."""
    made = MAKERS[Mistake.SQUARE](np.random.default_rng([10, 1 + list(Mistake).index(Mistake.SQUARE)]))
    found = finding_of(made)
    assert found is not None
    assert found.code is Mistake.SQUARE, found.message
    assert "wider" in found.message


def test_few_views_with_much_motion_do_not_hide_a_rolling_shutter() -> None:
    """Of 15 views two have most of the motion: the others, far above the noise, tell it is all of them."""
    made = MAKERS[Mistake.ROWS](np.random.default_rng([12, 1 + list(Mistake).index(Mistake.ROWS)]))
    found = deviation(tuple(made.pairs), made.board, made.sizes_px)
    assert found is not None
    assert found.code is Mistake.ROWS, found.message


def test_the_true_partners_are_named() -> None:
    """Two right pictures are exchanged: each left one is told its own."""
    made = next(made for made in (partners(_random(seed)) for seed in range(30)) if made.truth == "two exchanged")
    found = wrong_partners(made.pairs, made.board, made.sizes_px)
    assert len(found) == 2
    assert found[0] == found[1][::-1]


def test_wrong_partners_are_told_also_where_no_rig_can_be_rectified() -> None:
    """What such pairs make of the cameras has no meaning: not its obstacle is told, but its cause."""
    pairs = exact_pairs(small_rig(), poses(6, seed=8))
    found = calibrate(pairs, BOARD, ((640, 480), (640, 480)))
    broken = replace(found, rectification=None, obstacle=DataError("the cameras stand nowhere", "take other pictures"))
    finding = mistaken(Mistake.PARTNERS, "the numbers are shifted", "rename them", most=Verdict.REJECT)
    assert assessed(broken, (), finding, "") == Assessment(Verdict.REJECT, "the numbers are shifted: rename them")
    other = replace(finding, code=Mistake.SQUARE)
    assert "shifted" not in assessed(broken, (), other, "").remedy


@pytest.mark.parametrize("shift", [1, -1])
def test_shifted_numbers_are_told_as_such(shift: int) -> None:
    """All right pictures carry the number of their neighbour: one sentence says by how much, not 13 pairs of names."""
    made = good(_random(3))
    count = len(made.pairs)
    pairs = [
        BoardPair(str(number), pair.left_px, made.pairs[(number + shift) % count].right_px)
        for number, pair in enumerate(made.pairs)
    ]
    series = BoardSeries(pairs=tuple(pairs), board=made.board, sizes_px=made.sizes_px)
    found = name_mistake(series, DataError("no lens explains the views", ""))
    assert found is not None
    assert found.code is Mistake.PARTNERS
    way = "1 lower" if shift > 0 else "1 higher"
    assert found.message.endswith(f"each left picture belongs to the right one whose number is {way}")


def test_a_blurred_edge_is_as_wide_as_its_blur() -> None:
    """A step blurred by a Gaussian rises to its height within sqrt(2 pi) sigmas at its steepest slope; a sharp one within a pixel or two."""
    image = render_pair(small_rig(), poses(1, seed=8, depth_m=(0.3, 0.31))[0])[0]
    corners = find_corners(image, BOARD)
    sharp = look_at(image, corners, BOARD)
    soft = look_at(np.asarray(cv2.GaussianBlur(image, (0, 0), 2.0), np.uint8), corners, BOARD)
    assert sharp.edge_px < 2.5
    assert soft.edge_px == pytest.approx(math.sqrt(2 * math.pi) * 2.0, rel=0.2)
    assert sharp.washed == soft.washed == 0
    assert math.isnan(look_at(image, np.empty((0, 2)), BOARD).edge_px)
    bright = image.copy()
    bright[:, : int(corners[:, 0].mean())] = 255
    assert look_at(bright, corners, BOARD).washed > 0.3


def test_a_mistake_is_the_first_remedy_and_caps_the_verdict() -> None:
    """A rig whose bar is loose is at most usable; what was rejected stays so."""
    finding = mistaken(Mistake.UNSTIFF, "they turned", "tighten it", most=Verdict.USABLE)
    assert with_cause(Assessment(Verdict.GOOD, ""), finding) == Assessment(Verdict.USABLE, "they turned: tighten it")
    assert with_cause(Assessment(Verdict.REJECT, "x"), finding).verdict is Verdict.REJECT


@pytest.mark.slow
@pytest.mark.data
@pytest.mark.skipif(not os.environ.get("SCAN_DATA"), reason="SCAN_DATA is not set: no real images")
def test_a_real_series_and_the_mistakes_made_on_it() -> None:
    """OpenCV's sample pairs tell of no mistake; made on their corners, each is named."""
    for what, mistake, made in variants("opencv_stereo_calib"):
        if not made.images:
            found = finding_of(made)
            assert (what, None if found is None else found.code) == (what, mistake)


@pytest.mark.slow
@pytest.mark.data
@pytest.mark.skipif(not os.environ.get("SCAN_DATA"), reason="SCAN_DATA is not set: no real images")
def test_a_real_rig_that_turned_is_told() -> None:
    """The cameras of simplestereo_rig1 turned about their x axis, 15 standard deviations in 15 views; without it the pairs fit better."""
    pairs, board, sizes_px = real_pairs("simplestereo_rig1")
    found = deviation(pairs, board, sizes_px)
    assert found is not None
    assert found.evidence.turned is not None
    assert found.evidence.turned.course is Course.DRIFT
    assert abs(found.evidence.turned.turn_rad[0]) > 5 * found.evidence.turned.sigma_rad[0]
    before = calibrate(list(pairs), board, sizes_px).rig.rms_stereo_px
    assert calibrate(unturned(list(pairs), found.evidence.turned), board, sizes_px).rig.rms_stereo_px < 0.97 * before
