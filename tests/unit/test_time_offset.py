"""The offset of two recordings by what they saw: found to a part of a period, honest about how well, refused where nothing tells it."""

from dataclasses import replace

import numpy as np
import pytest

from common.recording.recorded import Shown
from phone_host.recording.offset_fit import fit_offset, student_95
from phone_host.recording.offset_search import Found, Unclear, search_offset
from phone_host.recording.sight import Sight, rates_at
from phone_host.recording.watching import watch
from tests.support.handheld import RATE_HZ, ZERO_NS, Eye, Floats, hand, panned, simulated_sight


def _two(chance: np.random.Generator, positions: Floats, first: Eye, second: Eye) -> tuple[Sight, Sight]:
    turned = np.array([[0.0, 1.3, 0.0], [-1.3, 0.0, 0.0], [0.0, 0.0, 1.0]])
    return simulated_sight(chance, positions, first), simulated_sight(chance, positions, second, turned)


def _spoiled(shown: Shown) -> Shown:
    return replace(shown, image=replace(shown.image, content=b"\xff\xd8"))


def test_offset_and_drift_are_found_within_what_is_stated() -> None:
    """A minute in which one camera's clock runs 80 ppm fast, at other rates and turned: 95 % hold, so all of six do within two such widths."""
    for seed in range(6):
        chance = np.random.default_rng(seed)
        first = Eye(begin_s=0, end_s=70, offset_s=123.4567, drift=80e-6)
        sights = _two(chance, hand(chance, 80), first, Eye(begin_s=8, end_s=80, rate_hz=25))
        found = search_offset(*sights)
        assert isinstance(found, Found)
        fitted = fit_offset(*sights, found.offset_s)
        assert abs(fitted.offset_s - 123.4567 - 80e-6 * fitted.at_s) < 2 * fitted.uncertainty_s < 0.01
        assert abs(fitted.drift - 80e-6) < 2 * fitted.drift_uncertainty
        assert fitted.likeness > 0.8


def test_without_noise_the_offset_is_exact() -> None:
    """Cameras that see the same without error, at 30 and 15 frames a second: the interpolation shifts nothing."""
    chance = np.random.default_rng(1)
    eyes = Eye(begin_s=0, end_s=25, offset_s=3.0, noise_px=0), Eye(begin_s=5, end_s=30, rate_hz=15, noise_px=0)
    assert abs(fit_offset(*_two(chance, hand(chance, 30), *eyes), 3.02).offset_s - 3.0) < 0.0003


def test_a_gap_is_not_taken_for_rest() -> None:
    """Two seconds without images: nothing is known there, and the rest tells the same offset."""
    chance = np.random.default_rng(2)
    first, second = _two(chance, hand(chance, 40), Eye(begin_s=0, end_s=35, offset_s=2), Eye(begin_s=5, end_s=40))
    there = (second.at_s < 18) | (second.at_s > 20)
    holed = Sight(second.at_s[there], second.totals[there])
    moments = np.arange(10.0, 30.0, 0.01)
    assert not rates_at(holed, moments, 0.033).known[(moments > 18) & (moments < 20)].any()
    fitted = fit_offset(first, holed, 2.01)
    assert abs(fitted.offset_s - 2) < 2 * fitted.uncertainty_s


@pytest.mark.parametrize("seed", range(4))
def test_recordings_of_other_things_are_refused(seed: int) -> None:
    """Two hands that move independently have no offset."""
    chance = np.random.default_rng(seed)
    one, other = (simulated_sight(chance, hand(chance, 30), Eye(begin_s=0, end_s=30)) for _ in range(2))
    assert search_offset(one, other) is Unclear.STRANGE


def test_what_repeats_itself_is_refused() -> None:
    """A movement that comes again every 4 s fits at several offsets, unless a stored clock excludes all but one."""
    chance = np.random.default_rng(3)
    lap = np.diff(hand(chance, 4), axis=0, prepend=0)
    positions = np.cumsum(np.tile(lap, (11, 1)), axis=0)
    assert len(positions) == 44 * RATE_HZ
    sights = _two(chance, positions, Eye(begin_s=0, end_s=40, offset_s=7), Eye(begin_s=3, end_s=43))
    assert search_offset(*sights) is Unclear.REPEATED
    found = search_offset(*sights, (5.5, 8.5))
    assert isinstance(found, Found)
    assert abs(found.offset_s - 7) < 0.05


def test_what_rests_or_is_short_or_apart_is_refused() -> None:
    """Each with its reason: nothing moves in one of them, less than 5 s, no overlap that is allowed."""
    chance = np.random.default_rng(4)
    positions = hand(chance, 30)
    eye = Eye(begin_s=0, end_s=30, noise_px=0.001)
    moving, still = simulated_sight(chance, positions, eye), simulated_sight(chance, positions * 0, eye)
    assert search_offset(still, moving) is Unclear.STILL_FIRST
    assert search_offset(moving, still) is Unclear.STILL_SECOND
    assert search_offset(simulated_sight(chance, positions, Eye(begin_s=0, end_s=4)), moving) is Unclear.SHORT
    assert search_offset(moving, moving, (100.0, 101.0)) is Unclear.STRANGE


def test_of_a_long_recording_the_busiest_piece_is_looked_for() -> None:
    """Seven minutes, of which the first two rest: what moves later is found in the other recording."""
    chance = np.random.default_rng(5)
    positions = hand(chance, 430)
    positions[: 120 * RATE_HZ] = positions[120 * RATE_HZ]
    sights = _two(
        chance, positions, Eye(begin_s=100, end_s=425, rate_hz=10, offset_s=-4), Eye(begin_s=0, end_s=430, rate_hz=10)
    )
    found = search_offset(*sights)
    assert isinstance(found, Found)
    assert abs(found.offset_s + 4) < 0.1


def test_over_five_minutes_a_drift_is_followed_from_the_middle_outward() -> None:
    """At 150 ppm the offset moves by 45 ms: more than a frame's period lies between both ends."""
    chance = np.random.default_rng(7)
    eyes = Eye(begin_s=0, end_s=300, rate_hz=20, offset_s=5, drift=150e-6), Eye(begin_s=0, end_s=300, rate_hz=20)
    fitted = fit_offset(*_two(chance, hand(chance, 300), *eyes), 5 + 150 * 150e-6)
    assert abs(fitted.offset_s - 5 - 150e-6 * fitted.at_s) < 2 * fitted.uncertainty_s < 0.005
    assert abs(fitted.drift - 150e-6) < 2 * fitted.drift_uncertainty < 40e-6
    assert fitted.uncertainty_s < fitted.worst_s < 0.01


def test_images_tell_their_shift_and_light() -> None:
    """A camera that pans by 20 px/s over a wall: rates as they were; a spoiled image and one of the same moment are left out."""
    chance = np.random.default_rng(6)
    positions = hand(chance, 6)
    shown = panned(chance, positions, Eye(begin_s=0, end_s=6, rate_hz=15, missing=0))
    spoiled = [*shown[:9], shown[8], _spoiled(shown[9]), *shown[10:]]
    shares: list[float] = []
    sight = watch(spoiled, ZERO_NS, shares.append)
    assert len(sight.at_s) == len(shown) - 1
    assert shares[0] == 0.0
    assert shares == sorted(shares)
    true = 20 * np.column_stack(
        [np.interp(sight.at_s, np.arange(len(positions)) / RATE_HZ, one) for one in positions.T]
    )
    for axis in (0, 1):
        moved = np.diff(sight.totals[:, axis])
        assert np.corrcoef(moved, np.diff(true[:, axis]))[0, 1] > 0.98
        assert 0.8 < np.polyfit(np.diff(true[:, axis]), moved, 1)[0] < 1.1


def test_few_blocks_are_weighed_by_student() -> None:
    """Half-widths of 95 % as tables of Student's distribution have them."""
    for freedom, expected in ((5, 2.571), (10, 2.228), (30, 2.042), (1e9, 1.960)):
        assert student_95(freedom) == pytest.approx(expected, abs=0.005)
    assert student_95(0.5) == student_95(2)
