"""Checks remove values and never invent them; repairs touch only what they are for."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from phone_host.model import Disparity
from phone_host.stereo.filters import (
    NO_STEPS,
    STEPS_PER_PX,
    bridged,
    confirmed,
    smoothed,
    to_px,
    unlocked,
    without_speckles,
)

maps = arrays(
    np.float32,
    st.tuples(st.integers(1, 12), st.integers(1, 12)),
    elements=st.one_of(st.just(np.nan), st.floats(0, 60, width=32)),
)


def test_left_right_check_by_hand() -> None:
    """At x = 3, d = 2 is confirmed by 2.5 at right x = 1; at x = 4, d = 2 is not confirmed by 4 at right x = 2, nor is d = 0 by 4."""
    left = np.array([[32, -16, 0, 32, 32]], np.int16)
    right = np.array([[0, 40, 64, 0, 0]], np.int16)
    assert confirmed(left, right, 1.0)[0].tolist() == [False, False, False, True, False]


@settings(deadline=None, max_examples=50)
@given(width=st.integers(1, 20), d=st.integers(0, 25))
def test_exactly_what_the_right_image_shows_is_confirmed(width: int, d: int) -> None:
    """With one disparity everywhere, exactly the left pixels from x = d on are confirmed."""
    steps = np.full((3, width), d * STEPS_PER_PX, np.int16)
    assert (confirmed(steps, steps, 0.0) == (np.arange(width) >= d)).all()


def test_islands_go_and_surfaces_stay() -> None:
    """A 3 x 3 island 5 px off its surroundings is dropped whole; the surface around it stays."""
    steps = np.full((30, 30), 160, np.int16)
    steps[10:13, 10:13] = 240
    kept = without_speckles(steps, 20, 1.0)
    assert (kept[10:13, 10:13] == NO_STEPS).all()
    assert (kept == 160).sum() == 900 - 9
    assert (steps == NO_STEPS).sum() == 0


def test_steps_become_px() -> None:
    """Sixteenths become px exactly, and every negative becomes NaN."""
    assert to_px(np.array([[24, 0, -16, -1]], np.int16)).tolist()[0][:2] == [1.5, 0.0]
    assert np.isnan(to_px(np.array([[-16, -1]], np.int16))).all()


@settings(deadline=None, max_examples=100)
@given(disparity=maps, gap=st.integers(1, 8), step=st.floats(0, 5))
def test_bridging_keeps_every_value_and_stays_between_its_ends(disparity: Disparity, gap: int, step: float) -> None:
    """Known values stay as they are; new ones lie within the range of the known ones."""
    before = disparity.copy()
    after = bridged(disparity, gap, step)
    known = np.isfinite(before)
    assert (after[known] == before[known]).all()
    assert disparity.tobytes() == before.tobytes()
    new = after[~known & np.isfinite(after)]
    if new.size:
        # Float32 rounding of the interpolation between two values below 64 px.
        assert before[known].min() - 1e-5 <= new.min() <= new.max() <= before[known].max() + 1e-5


@pytest.mark.parametrize("axis", [0, 1])
def test_a_gap_in_a_plane_is_closed_exactly(axis: int) -> None:
    """In d = 10 + 0.05 x + 0.02 y a gap of 6 px, in a row or a column, is filled with the plane's own values."""
    y, x = np.mgrid[:30, :40]
    truth = (10 + 0.05 * x + 0.02 * y).astype(np.float32)
    holed = truth.copy()
    if axis:
        holed[:, 12:18] = np.nan
    else:
        holed[12:18] = np.nan
    assert bridged(holed, 6, 1.0) == pytest.approx(truth, abs=1e-4)
    assert np.isnan(bridged(holed, 5, 1.0)).sum() == np.isnan(holed).sum()


def test_a_gap_between_two_surfaces_stays_open() -> None:
    """Gaps whose ends differ by more than the step, and gaps at the border, are not bridged."""
    row = np.array([[np.nan, 5, np.nan, 9, np.nan]], np.float32)
    assert np.isnan(bridged(row, 4, 1.0)).tolist() == [[True, False, True, False, True]]


@settings(deadline=None, max_examples=50)
@given(amplitude=st.floats(0, 0.15))
def test_unlocking_keeps_order_and_fixed_points(amplitude: float) -> None:
    """Whole and half pixels stay, the order of values stays, and nothing moves by more than the amplitude."""
    d = np.arange(0, 64, 1 / 16, dtype=np.float32)[None]
    after = unlocked(d, amplitude)
    assert (np.diff(after) > 0).all()
    # float32's sin of 2 pi d for d up to 64 is off by 400 * 2^-24.
    assert after[:, ::8] == pytest.approx(d[:, ::8], abs=1e-4)
    assert np.abs(after - d).max() <= amplitude + 1e-4


def test_unlocking_takes_the_sine_back() -> None:
    """Values pulled to whole pixels by 0.1 sin(2 pi d) return to within 0.04 px (the first-order remainder)."""
    truth = np.arange(0, 8, 1 / 64, dtype=np.float32)[None]
    locked = truth - np.float32(0.1) * np.sin(2 * np.pi * truth).astype(np.float32)
    assert np.abs(locked - truth).max() > 0.09
    assert np.abs(unlocked(locked, 0.1) - truth).max() < 0.04


@settings(deadline=None, max_examples=50)
@given(disparity=maps)
def test_smoothing_keeps_the_holes_and_the_range(disparity: Disparity) -> None:
    """NaN stays NaN, values stay values, and none leaves the range of the original values."""
    after = smoothed(disparity, 9, 1.0, 4.0)
    known = np.isfinite(disparity)
    assert (np.isfinite(after) == known).all()
    if known.any():
        # OpenCV interpolates its table of weights; a weighted mean of float32 is good to about 1e-5 of the value.
        assert disparity[known].min() - 1e-3 <= after[known].min()
        assert after[known].max() <= disparity[known].max() + 1e-3
        assert after[known].min() >= 0


def test_smoothing_calms_a_surface_and_keeps_an_edge() -> None:
    """Noise of 0.2 px falls by half or more; an edge of 10 px stays within 0.1 px of where it was."""
    rng = np.random.default_rng(0)
    truth = np.where(np.arange(60) < 30, 10, 20).astype(np.float32)[None].repeat(40, 0)
    after = smoothed((truth + rng.normal(0, 0.2, truth.shape)).astype(np.float32), 9, 1.0, 4.0)
    assert np.std(after - truth) < 0.1
    assert np.abs((after - truth)[:, 28:32].mean(axis=0)).max() < 0.1
