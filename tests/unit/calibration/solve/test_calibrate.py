"""Calibration against rigs whose every number is known."""

import math
import re
from dataclasses import replace
from functools import cache

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.errors import DataError
from phone_host.calibration.solve.bundle_problem import Bend
from phone_host.calibration.solve.calibrate import calibrate
from phone_host.calibration.solve.calibrate_alone import off_words
from phone_host.calibration.solve.verdict import Assessment, Calibration, judge, size_factor, vertical_p95_px
from phone_host.calibration.target.pairs import BoardPair, Reason, Rejected
from phone_host.model import CameraModel, Rig, Verdict
from tests.support.boards import BOARD, exact_pairs, poses
from tests.support.rigs import project_points, unlike_rig

_SIZES = ((640, 480), (1280, 720))


def _rig() -> Rig:
    """The unlike rig without k3, because the boards do not reach far enough out to determine it."""
    rig = unlike_rig()
    for camera in (rig.left, rig.right):
        camera.distortion[4] = 0
    return rig


def _baseline_mm(calibration: Calibration) -> float:
    return float(np.linalg.norm(calibration.rig.t_right_left_m)) * 1e3


_TRUE_BASELINE_MM = float(np.linalg.norm([100, 4, -6]))


def test_exact_corners_give_back_the_rig() -> None:
    """Two sizes, two lenses: all parameters come back, all pairs are used, rows meet, the verdict is good."""
    rig = _rig()
    found = calibrate(exact_pairs(rig, poses(15, seed=1)), BOARD, _SIZES)
    for camera, truth in ((found.rig.left, rig.left), (found.rig.right, rig.right)):
        assert (camera.width_px, camera.height_px) == (truth.width_px, truth.height_px)
        np.testing.assert_allclose(camera.matrix, truth.matrix, atol=0.05)
        np.testing.assert_allclose(camera.distortion[:4], truth.distortion[:4], atol=2e-3)
    np.testing.assert_allclose(found.rig.R_right_left, rig.R_right_left, atol=1e-5)
    np.testing.assert_allclose(found.rig.t_right_left_m, rig.t_right_left_m, atol=1e-5)
    assert len(found.used) == 15
    assert found.rejected == ()
    assert vertical_p95_px(found) < 1e-3
    assert judge(found, ()).verdict is Verdict.GOOD


@given(st.integers(0, 1000))
@settings(deadline=None, max_examples=4)
def test_the_baseline_is_off_by_no_more_than_the_report_says(seed: int) -> None:
    """With 0.2 px of noise the error stays within four of the reported standard deviations, which are small."""
    pairs = exact_pairs(_rig(), poses(12, seed=seed), noise_px=0.2, seed=seed)
    found = calibrate(pairs, BOARD, _SIZES)
    assert found.baseline_sigma_m * 1e3 < 1.0
    assert abs(_baseline_mm(found) - _TRUE_BASELINE_MM) < 4 * found.baseline_sigma_m * 1e3 + 0.01
    # 0.2 px in each coordinate is a distance of 0.28 px
    assert found.rig.rms_stereo_px == pytest.approx(0.2 * np.sqrt(2), rel=0.15)


def _changed(pairs: list[BoardPair], index: int, right_px: np.ndarray) -> list[BoardPair]:
    changed = BoardPair(pairs[index].name, pairs[index].left_px, right_px)
    return [changed if place == index else pair for place, pair in enumerate(pairs)]


@pytest.mark.parametrize("jump_px", [2.0, 13.0])
def test_a_view_whose_corners_jump_is_rejected_and_does_no_harm(jump_px: float) -> None:
    """Of 10 pairs, the one with a third of its right corners off is named; the rig comes from the other 9."""
    pairs = exact_pairs(_rig(), poses(10, seed=1), noise_px=0.1, seed=5)
    jumped = pairs[6].right_px.copy()
    jumped[::3] += np.array([jump_px, -jump_px / 2])
    found = calibrate(_changed(pairs, 6, jumped), BOARD, _SIZES)
    assert [(each.name, each.reason) for each in found.rejected] == [("6", Reason.CORNERS_RIGHT)]
    others = calibrate([pair for pair in pairs if pair.name != "6"], BOARD, _SIZES)
    assert _baseline_mm(found) == pytest.approx(_baseline_mm(others), abs=0.02)


@pytest.mark.parametrize("shift_m", [0.0015, 0.05])
def test_a_pair_of_two_moments_is_rejected(shift_m: float) -> None:
    """A board that moved between the two exposures, by much or by a little over a millimetre, is reported as such."""
    rig, where = _rig(), poses(10, seed=2)
    pairs = exact_pairs(rig, where, noise_px=0.1, seed=6)
    later = where[4].copy()
    later[4] += shift_m
    found = calibrate(_changed(pairs, 4, exact_pairs(rig, later[np.newaxis])[0].right_px), BOARD, _SIZES)
    assert [(each.name, each.reason) for each in found.rejected] == [("4", Reason.MOVED)]


def test_a_pair_without_a_corner_in_common_switches_no_check_off() -> None:
    """Rows of one pair are 0.9 px off: its rays tell, also beside a pair of which each camera saw another half of the board."""
    pairs = exact_pairs(_rig(), poses(10, seed=2), noise_px=0.1, seed=6)
    pairs = _changed(pairs, 3, pairs[3].right_px + np.array([0.0, 0.9]))
    half = len(pairs[5].left_px) // 2
    pairs[5].left_px[half:], pairs[5].right_px[:half] = np.nan, np.nan
    (rejected,) = calibrate(pairs, BOARD, _SIZES).rejected
    assert (rejected.name, rejected.reason) == ("3", Reason.MOVED)
    assert "rays of left and right miss each other" in rejected.detail
    assert "others by nan" not in rejected.detail


@pytest.mark.parametrize("seed", range(4))
def test_exchanged_pairs_are_told_with_numbers_that_mean_something(seed: int) -> None:
    """Five pairs whose right images went to their neighbours: no error above 1000 px is printed, and an error says to check the pairs."""
    pairs = exact_pairs(_rig(), poses(5, seed=seed), noise_px=0.1, seed=seed)
    shuffled = [BoardPair(a.name, a.left_px, b.right_px) for a, b in zip(pairs, [*pairs[1:], pairs[0]], strict=True)]
    try:
        text = " ".join(each.detail for each in calibrate(shuffled, BOARD, _SIZES).rejected)
    except DataError as error:
        text = str(error)
    assert not re.search(r"[0-9]{4,}\.", text)
    assert "only " not in text or "check that the two images of each pair belong together" in text


def test_how_far_corners_are_off_is_told_up_to_a_thousand_pixels() -> None:
    """A fit that has diverged gives errors of millions of pixels; they are told as more than 1000."""
    assert off_words(3.214, 0.3) == "by 3.21 px, others by 0.30 px"
    assert off_words(114029453.03, 59.94) == "by more than 1000 px, others by 59.94 px"
    assert off_words(float("nan"), 0.3) == "by more than 1000 px, others by 0.30 px"


def test_swapped_sides_are_told_with_the_remedy() -> None:
    """Swapped left and right images calibrate well, but the verdict is reject: swap LEFT and RIGHT."""
    pairs = [BoardPair(p.name, p.right_px, p.left_px) for p in exact_pairs(_rig(), poses(12, seed=3))]
    found = calibrate(pairs, BOARD, (_SIZES[1], _SIZES[0]))
    judgement = judge(found, ())
    assert found.rectification is None
    assert judgement.verdict is Verdict.REJECT
    assert "swap LEFT and RIGHT" in judgement.remedy


def test_boards_that_are_all_parallel_are_told() -> None:
    """Boards that face the camera leave the focal length open: a remedy names the tilt."""
    pairs = exact_pairs(_rig(), poses(8, seed=4, tilt_deg=1.0), noise_px=0.2, seed=7)
    judgement = judge(calibrate(pairs, BOARD, _SIZES), ())
    assert "tilted" in judgement.remedy


def test_boards_that_are_all_far_away_are_told() -> None:
    """Boards far away cover only the middle and leave the lens open: the one remedy says what to show."""
    pairs = exact_pairs(_rig(), poses(8, seed=4, depth_m=(1.2, 1.3)), noise_px=0.1, seed=7)
    judgement = judge(calibrate(pairs, BOARD, _SIZES), ())
    assert judgement.verdict is Verdict.USABLE
    remedy = judgement.remedy
    assert "leave depth open" in remedy
    assert ": take pairs with the board" in remedy


def test_wild_corners_everywhere_are_no_calibration() -> None:
    """With 1 px of noise the views contradict each other, with half of that rows do not meet to half a pixel: reject, with one remedy."""
    for noise_px, said in ((1.0, "contradict each other"), (0.5, "take new pairs")):
        pairs = exact_pairs(_rig(), poses(8, seed=8), noise_px=noise_px, seed=8)
        judgement = judge(calibrate(pairs, BOARD, _SIZES), ())
        assert judgement.verdict is Verdict.REJECT
        remedy = judgement.remedy
        assert said in remedy


def test_few_pairs_are_never_good() -> None:
    """Four perfect pairs are usable at most."""
    found = calibrate(exact_pairs(_rig(), poses(4, seed=9)), BOARD, _SIZES)
    assert judge(found, ()).verdict is not Verdict.GOOD


def test_of_three_pairs_the_uncertainty_is_honest() -> None:
    """Of eight series of three pairs, the baseline lies within 2.5 stated deviations in all; with k1 alone it is off by up to twenty."""
    true_m = float(np.linalg.norm(_rig().t_right_left_m))
    for seed in range(8):
        found = calibrate(exact_pairs(_rig(), poses(3, seed=seed), noise_px=0.02, seed=seed), BOARD, _SIZES)
        off_m = float(np.linalg.norm(found.rig.t_right_left_m)) - true_m
        assert abs(off_m) < 2.5 * found.baseline_sigma_m, seed


@pytest.mark.parametrize("count", [0, 2])
def test_fewer_than_three_pairs_are_refused(count: int) -> None:
    """Nothing is invented from two views."""
    with pytest.raises(DataError, match=f"only {count} of at least 3 pairs"):
        calibrate(exact_pairs(_rig(), poses(count, seed=1)), BOARD, _SIZES)


@cache
def _fine() -> Calibration:
    return calibrate(exact_pairs(_rig(), poses(10, seed=1)), BOARD, _SIZES)


def test_the_one_remedy_is_that_of_the_worst_measure() -> None:
    """Good carries none; each measure beyond its limit limits the verdict; of several the one that is farthest beyond gives the remedy."""
    found = _fine()
    assert judge(found, ()) == Assessment(Verdict.GOOD, "")
    rows = replace(found, vertical_px=np.full(100, 0.3))
    assert judge(rows, ()).verdict is Verdict.USABLE
    assert "rows of the two views differ by 0.30 px" in judge(rows, ()).remedy
    baseline = replace(rows, baseline_sigma_m=0.002)
    remedy = judge(baseline, ()).remedy
    assert "open by 2.00 of 100.3 mm: take pairs with the board" in remedy
    squares = replace(baseline, squares=replace(found.squares, mean_m=0.026))
    remedy = judge(squares, ()).remedy
    assert "measure 26.00 instead of 25.00 mm" in remedy
    depth = replace(squares, depths=((0.5, 0.001), (1.0, 0.06)))
    assert judge(depth, ()).verdict is Verdict.REJECT
    remedy = judge(depth, ()).remedy
    assert "leave depth open by 60 mm at 1 m" in remedy
    assert judge(replace(found, baseline_sigma_m=0.006), ()).verdict is Verdict.REJECT


def test_an_unknown_uncertainty_is_not_good() -> None:
    """After --pose-only with an imported rig nothing is known of baseline and depth: usable at most, and that is said; what is known to be worse is said first."""
    found = _fine()
    unknown = replace(
        found, baseline_sigma_m=math.nan, depths=tuple((depth_m, math.nan) for depth_m, _ in found.depths)
    )
    judgement = judge(unknown, ())
    assert judgement.verdict is Verdict.USABLE
    assert "how exactly baseline and depth are known cannot be told" in judgement.remedy
    remedy = judge(replace(unknown, vertical_px=np.full(100, 0.3)), ()).remedy
    assert "rows of the two views differ by 0.30 px" in remedy
    assert judge(replace(unknown, vertical_px=np.full(100, 3.0)), ()).verdict is Verdict.REJECT


def test_what_spoils_pairs_comes_before_what_they_measure() -> None:
    """Where a third of the pairs was rejected, and the verdict is not good, the most frequent reason is cured first; where all is well nothing is said."""
    found = _fine()
    unpaired = tuple(Rejected(str(number), Reason.NO_PARTNER, "no partner") for number in range(6))
    assert judge(found, unpaired) == Assessment(Verdict.GOOD, "")
    remedy = judge(replace(found, vertical_px=np.full(100, 0.3)), unpaired).remedy
    assert remedy == "6 of 16 pairs were rejected: no partner: give both images of a pair the same number"


@pytest.mark.parametrize("reason", Reason)
def test_every_reason_has_its_cure(reason: Reason) -> None:
    """Whatever most pairs were rejected for, and whatever the verdict: the remedy names it and says what to do; a good rig has none."""
    found, rejected = _fine(), tuple(Rejected(str(number), reason, "so it was") for number in range(6))
    for rows_px, verdict in ((0.01, Verdict.GOOD), (0.3, Verdict.USABLE), (3.0, Verdict.REJECT)):
        judgement = judge(replace(found, vertical_px=np.full(100, rows_px)), rejected)
        assert judgement.verdict is verdict
        told, _, cure = judgement.remedy.rpartition(": ")
        assert told == ("" if verdict is Verdict.GOOD else f"6 of 16 pairs were rejected: {reason.value}")
        assert bool(cure) is (verdict is not Verdict.GOOD)


def test_what_would_help_most_can_be_told() -> None:
    """Without advice, as from a rig that cannot be rectified, more pairs are asked for; a calibration says what the next views would bring."""
    found = _fine()
    assert found.advice is not None
    assert found.advice.after_m < found.advice.sigma_m
    remedy = judge(replace(found, advice=None, baseline_sigma_m=0.002), ()).remedy
    assert remedy.endswith("take more pairs like these")


def test_a_lens_that_takes_all_five_terms_gets_them() -> None:
    """Where boards reach far enough out for the third radial term to show, it is estimated and comes back; in all other tests here four terms are enough."""
    rig = _rig()
    rig.left.distortion[:] = (-0.25, 0.08, 0.0, 0.0, 0.4)
    found = calibrate(exact_pairs(rig, poses(10, seed=3, depth_m=(0.3, 0.4)), noise_px=0.02, seed=1), BOARD, _SIZES)
    assert found.bends[0] is Bend.WIDE
    assert found.rig.left.distortion[4] == pytest.approx(0.4, abs=0.05)
    assert found.rejected == ()


def _wide_rig() -> Rig:
    """Two cameras of 100 degrees whose lenses bend as a stereographic projection does: 2 tan(angle / 2) fitted by k1, k2 and k3."""
    slopes = np.linspace(1e-3, 1.6, 300)
    bent = 2 * np.tan(np.arctan(slopes) / 2) - slopes
    k1, k2, k3 = np.linalg.lstsq(np.stack([slopes**3, slopes**5, slopes**7], axis=1), bent, rcond=None)[0]
    models = [
        CameraModel(
            width_px=640,
            height_px=480,
            matrix=np.array([[316.0, 0, cx], [0, 316, cy], [0, 0, 1]]),
            distortion=np.array([k1, k2, 0, 0, k3]),
        )
        for cx, cy in ((322.0, 238.0), (317.0, 243.0))
    ]
    rotation = np.asarray(cv2.Rodrigues(np.array([0.01, -0.02, 0.015]))[0], np.float64)
    centre = np.array([0.06, 0.001, 0.002])
    return Rig(left=models[0], right=models[1], R_right_left=rotation, t_right_left_m=-rotation @ centre)


def _wide_poses(rig: Rig, count: int) -> np.ndarray:
    """Boards near two wide cameras, up to the corners of both images."""
    random, found = np.random.default_rng(3), list[np.ndarray]()
    middle = BOARD.points_m().mean(axis=0)
    while len(found) < count:
        depth_m = random.uniform(0.16, 0.4)
        centre = np.array([random.uniform(-0.9, 0.9), random.uniform(-0.7, 0.7), 1.0]) * depth_m + [0.03, 0, 0]
        turn = np.append(random.uniform(-0.6, 0.6, 2), random.uniform(-0.5, 0.5))
        rotation = np.asarray(cv2.Rodrigues(turn)[0])
        points = (BOARD.points_m() - middle) @ rotation.T + centre
        views = project_points(points, rig)
        if np.hypot(*points.T[:2]).max() < 1.35 * points[:, 2].min() and all(
            ((view > 2) & (view < [638, 478])).all() for view in views
        ):
            found.append(np.concatenate([turn, centre - rotation @ middle]))
    return np.array(found)


def test_a_wide_lens_keeps_its_pairs() -> None:
    """Views in the corners of a wide lens only fit with k3; they are not taken for wrong corners, and the baseline is right."""
    rig = _wide_rig()
    found = calibrate(exact_pairs(rig, _wide_poses(rig, 9), noise_px=0.1), BOARD, ((640, 480), (640, 480)))
    assert len(found.used) == 9
    assert all(bend is not Bend.USUAL for bend in found.bends)
    assert _baseline_mm(found) == pytest.approx(np.linalg.norm([60, 1, 2]), abs=0.3)


def test_a_second_chance_brings_no_wrong_pair_back() -> None:
    """A board that moved between the two exposures of a wide rig stays out; the others are used."""
    rig = _wide_rig()
    pairs = exact_pairs(rig, _wide_poses(rig, 9), noise_px=0.1)
    pairs[4] = replace(pairs[4], right_px=pairs[4].right_px + np.array([0.0, 3.0]))
    found = calibrate(pairs, BOARD, ((640, 480), (640, 480)))
    assert [each.name for each in found.rejected] == ["4"]


def _larger(camera: CameraModel, factor: int) -> CameraModel:
    """The same lens before a sensor with pixels so many times smaller."""
    to_larger = np.array([[factor, 0, (factor - 1) / 2], [0, factor, (factor - 1) / 2], [0, 0, 1]], np.float64)
    width_px, height_px = camera.width_px * factor, camera.height_px * factor
    return replace(camera, width_px=width_px, height_px=height_px, matrix=to_larger @ camera.matrix)


@pytest.mark.parametrize(("noise_px", "verdict"), [(0.08, Verdict.GOOD), (0.17, Verdict.USABLE)])
def test_enlarged_pictures_have_the_verdict_of_the_small_ones(noise_px: float, verdict: Verdict) -> None:
    """Corners of 1280x960 and 1280x720 images, and the same four times as large with four times the error: one verdict. Remedies name the limit that holds."""
    rig = _rig()
    rig = replace(rig, left=_larger(rig.left, 2))
    large = replace(rig, left=_larger(rig.left, 4), right=_larger(rig.right, 4))
    judged = []
    for each, noise, factor in ((rig, noise_px, 1), (large, 4 * noise_px, 4)):
        sizes = tuple((camera.width_px, camera.height_px) for camera in (each.left, each.right))
        found = calibrate(exact_pairs(each, poses(12, seed=8), noise_px=noise, seed=8), BOARD, (sizes[0], sizes[1]))
        assert size_factor(found.rig) == factor
        judged.append(judge(found, ()))
    assert [each.verdict for each in judged] == [verdict, verdict]
    if verdict is Verdict.USABLE:
        assert "1.00 px is good" in judged[1].remedy


def test_small_pictures_have_no_narrower_limits() -> None:
    """Below 1280 px the limits stay; of two cameras the coarser one counts."""
    rig = _rig()
    assert size_factor(rig) == 1.0
    assert size_factor(replace(rig, right=_larger(rig.right, 4))) == 1.0
    assert size_factor(replace(rig, left=_larger(rig.left, 3), right=_larger(rig.right, 4))) == 1.5
