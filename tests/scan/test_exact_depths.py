"""Depths near a thing are moved until both images agree: what a matcher gets wrong in the same way everywhere is undone."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from phone_host.model import Epipolar, Image, StereoGeometry
from phone_host.scan.mat_tracker import with_exact_depths
from phone_host.scan.view import View

GEOMETRY = StereoGeometry(focal_px=600.0, baseline_m=0.06, cx_px=100.0, cy_px=80.0, doffs_px=3.0)
SCALE = GEOMETRY.focal_px * GEOMETRY.baseline_m
SHAPE = (160, 200)
ROWS, COLUMNS = np.indices(SHAPE).astype(np.float32)
SLOPED = (20 + 0.18 * (ROWS - 80) + 0.05 * (COLUMNS - 100)).astype(np.float32)
"""Disparity of a table that is seen at a slant, px."""

INSIDE = np.s_[20:-20, 45:-45]


def texture(seed: int) -> NDArray[np.float32]:
    random = np.random.default_rng(seed)
    rough = random.normal(0, 1, SHAPE).astype(np.float32)
    return np.asarray(128 + 120 * cv2.GaussianBlur(rough, (0, 0), 1.5), np.float32)


def seen(wrong_px: float, epipolar: Epipolar = Epipolar.LEFT) -> View:
    """The table from sensors of unlike contrast; its disparities are wrong by so much, and there is noise on both."""
    right, random = texture(1), np.random.default_rng(2)
    along, across = epipolar.way
    left = cv2.remap(right, COLUMNS + along * SLOPED, ROWS + across * SLOPED, cv2.INTER_CUBIC)
    disparity = SLOPED + np.float32(wrong_px) + random.normal(0, 0.1, SHAPE).astype(np.float32)
    grey: Image = np.clip(0.8 * left + 15 + random.normal(0, 1, SHAPE), 0, 255).astype(np.uint8)
    return View(
        grey=grey,
        colours=np.repeat(grey[..., np.newaxis], 3, axis=2),
        depth_m=(SCALE / (disparity + GEOMETRY.doffs_px)).astype(np.float32),
        geometry=GEOMETRY,
        noise_px=0.5,
        right=np.clip(right, 0, 255).astype(np.uint8),
        epipolar=epipolar,
    )


def off_px(view: View) -> NDArray[np.float32]:
    return np.asarray(SCALE / view.depth_m - GEOMETRY.doffs_px - SLOPED, np.float32)[INSIDE]


@pytest.mark.parametrize("epipolar", list(Epipolar))
@pytest.mark.parametrize("wrong_px", [-0.15, 0.15])
def test_what_is_wrong_everywhere_is_undone(wrong_px: float, epipolar: Epipolar) -> None:
    """A slant makes no difference, nor do the sensors' unlike levels, nor the way in which the lines run."""
    view = seen(wrong_px, epipolar)
    assert np.median(off_px(view)) == pytest.approx(wrong_px, abs=0.01)
    exact = off_px(with_exact_depths(view, view.depth_m))
    assert np.median(exact) == pytest.approx(0, abs=0.02)
    assert exact.std() < 0.1


def test_only_what_is_wanted_is_moved_and_what_is_not_known_stays_so() -> None:
    view = seen(0.15)
    view.depth_m[100:110] = np.nan
    wanted = view.depth_m.copy()
    wanted[:, 120:] = np.nan
    exact = with_exact_depths(view, wanted).depth_m
    assert np.array_equal(np.isnan(exact), np.isnan(view.depth_m))
    assert np.array_equal(exact[:, 140:], view.depth_m[:, 140:], equal_nan=True)
    assert (exact[30:90, 60:100] != view.depth_m[30:90, 60:100]).mean() > 0.9


def test_what_cannot_be_made_more_exact_stays_as_it_is() -> None:
    """Without a right image, without anything wanted, or where the images tell nothing."""
    view = seen(0.15)
    assert with_exact_depths(replace(view, right=None), view.depth_m).depth_m is view.depth_m
    assert with_exact_depths(view, np.full(SHAPE, np.nan, np.float32)) is view
    plain: Image = np.full(SHAPE, 90, np.uint8)
    bare = replace(view, grey=plain, right=plain)
    assert np.median(off_px(with_exact_depths(bare, bare.depth_m))) == pytest.approx(0.15, abs=0.01)
