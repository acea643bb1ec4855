"""Where a lamp may be reflected in a thing, unsure depths do not count."""

from dataclasses import replace

import numpy as np

from phone_host.model import StereoGeometry
from phone_host.scan.mat_tracker import without_reflections
from phone_host.scan.view import View

SHAPE = (60, 80)


def seen() -> View:
    """A dark thing with a bright spot; its left half is unsure."""
    colours = np.full((*SHAPE, 3), (40, 90, 60), np.uint8)
    colours[20:30, 30:50] = (200, 250, 220)
    confidence = np.full(SHAPE, 200, np.uint8)
    confidence[:, :40] = 60
    return View(
        grey=colours[..., 1],
        colours=colours,
        depth_m=np.full(SHAPE, 0.4, np.float32),
        geometry=StereoGeometry(focal_px=600.0, baseline_m=0.06, cx_px=40.0, cy_px=30.0),
        noise_px=0.5,
        confidence=confidence,
    )


def test_bright_and_unsure_depths_are_left_out() -> None:
    """What is bright and sure stays, and so does what is unsure and dark."""
    view = seen()
    left_out = np.isnan(without_reflections(view, view.depth_m).depth_m)
    expected = np.zeros(SHAPE, np.bool_)
    expected[18:32, 28:40] = True
    assert np.array_equal(left_out, expected)


def test_without_confidence_or_a_thing_every_depth_stays() -> None:
    view = seen()
    blind = replace(view, confidence=None)
    assert without_reflections(blind, view.depth_m) is blind
    assert without_reflections(view, np.full(SHAPE, np.nan, np.float32)) is view


def test_only_the_things_depths_are_left_out() -> None:
    view = seen()
    thing = view.depth_m.copy()
    thing[:, :35] = np.nan
    left_out = np.isnan(without_reflections(view, thing).depth_m)
    assert left_out[:, 35:40].any()
    assert not left_out[:, :35].any()
