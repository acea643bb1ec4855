"""Images moved in time: what a time skew costs in a rendered moving scene, and what interpolation wins back."""

from dataclasses import replace
from functools import cache

import cv2
import numpy as np
import pytest

from phone_host.model import Image, RectifiedPair
from phone_host.scene.scene import Truth, demo_scene, matched_rig, truth
from phone_host.scene.scene_model import Body, Path, Scene, rig_poses
from phone_host.scene.scene_render import Renderer
from phone_host.stereo.interpolate import Interpolator
from phone_host.stereo.match import MatchSettings, create_matcher
from tests.support.plain_scenes import matched_view

PERIOD_S = 1 / 30
MOMENT_S = 0.4
"""The time of the board's newest image; the scene's bodies then move at about half a metre a second."""

FOCAL_M_PX = 525.0 * 0.1
"""Focal length times baseline of `matched_rig`: depth x disparity."""


def textured(size: tuple[int, int]) -> Image:
    """Smooth random texture."""
    noise = np.random.default_rng(2).normal(0, 1, size)
    smooth = cv2.GaussianBlur(noise, (0, 0), 3)
    return np.asarray(np.clip(128 + 40 * smooth / smooth.std(), 0, 255), dtype=np.uint8)


@pytest.mark.parametrize("part", [-0.5, -0.2, 0.3, 0.5, 1.0])
def test_a_moving_picture_is_moved(part: float) -> None:
    """For a picture that moves by (6, -4) px from one image to the next, interpolation by any fraction, back or on, moves it by that fraction."""
    picture = textured((300, 400))

    def shown(x: float, y: float) -> Image:
        shift = np.array([[1, 0, x - 30], [0, 1, y - 30]], dtype=np.float64)
        return np.asarray(cv2.warpAffine(picture, shift, (320, 240), flags=cv2.INTER_CUBIC), dtype=np.uint8)

    made = Interpolator().back(shown(0, 0), shown(6, -4), part)
    expected = shown(6 * (1 - part), -4 * (1 - part))
    inside = np.s_[20:-20, 20:-20]
    error = np.abs(made[inside].astype(int) - expected[inside])
    assert np.median(error) <= 1
    assert np.percentile(error, 99) <= 8


def test_nothing_is_done_for_no_time() -> None:
    """At the later image's own moment that image comes back unchanged."""
    first, second = textured((100, 120)), textured((100, 120))[::-1].copy()
    assert Interpolator().back(first, second, 0.0) is second


@cache
def scene() -> Scene:
    """The demo's still life with a ball and a cube that cross it fast."""
    sideways = Path(amplitude_m=(0.16, 0.05, 0.0), phase_rad=(2.2, 0.9, 0.0), period_s=2.0)
    bodies = [
        replace(body, path=sideways) if body.name in {"ball", "cube"} else resting(body) for body in demo_scene().bodies
    ]
    return Scene(tuple(bodies), demo_scene().light)


def resting(body: Body) -> Body:
    """The same body without its motion."""
    return replace(body, path=Path())


@cache
def renderers() -> tuple[Renderer, Renderer]:
    """The scene's two cameras."""
    rig = matched_rig()
    left, right = rig_poses(rig)
    return Renderer(scene(), rig.left, left), Renderer(scene(), rig.right, right)


@cache
def judged(moment_s: float, *, still: bool = False) -> Truth:
    """The truth at a moment, with or without the moving bodies."""
    rig = matched_rig()
    left, right = rig_poses(rig)
    bodies = tuple(body for body in scene().bodies if not (still and body.path.moves))
    return truth(Scene(bodies).at(moment_s), matched_view(), ((rig.left, left), (rig.right, right)))


def depth_errors(skew_s: float) -> tuple[float, float, float]:
    """Median |depth error| on the moving bodies, mm: with this time skew, with interpolation, and without any skew."""
    left, right = renderers()
    host_s = MOMENT_S - skew_s
    earlier, later, other = left.frame(MOMENT_S - PERIOD_S), left.frame(MOMENT_S), right.frame(host_s)
    moved = Interpolator().back(earlier, later, skew_s / PERIOD_S)
    matcher = create_matcher(MatchSettings(disparities=96))

    def error_mm(view: Image, moment_s: float) -> float:
        exact = judged(moment_s)
        moving = exact.visible & (np.abs(exact.depth_m - judged(0.0, still=True).depth_m) > 0.05)
        disparity = matcher.match(RectifiedPair(view, other))
        off_mm = np.abs(FOCAL_M_PX / disparity - exact.depth_m)[moving & np.isfinite(disparity) & (disparity > 1)] * 1e3
        assert moving.sum() > 5000
        return float(np.median(off_mm))

    # The image with the skew is judged at its own moment, the others at the host's.
    return error_mm(later, MOMENT_S), error_mm(moved, host_s), error_mm(left.frame(host_s), host_s)


@pytest.mark.long
@pytest.mark.parametrize("part", [0.5, -0.45])
def test_depth_of_what_moves_is_right_again(part: float) -> None:
    """At a skew of half a period the depth of moving things is off by centimetres; interpolation or extrapolation removes most of that."""
    skewed_mm, interpolated_mm, best_mm = depth_errors(part * PERIOD_S)
    print(
        f"part {part}: skewed {skewed_mm:.1f} mm, interpolated {interpolated_mm:.1f} mm, without skew {best_mm:.1f} mm"
    )
    assert skewed_mm > 30
    assert interpolated_mm < skewed_mm / 4
    assert best_mm < 5


def test_the_second_image_of_a_size_is_moved_like_the_first() -> None:
    """The buffers that are kept for one image size change nothing, even after an image of another size."""
    large, small = textured((240, 320)), textured((120, 160))
    keeps = Interpolator()
    for picture in (large, large, small, large):
        later = np.roll(picture, 3, axis=1)
        np.testing.assert_array_equal(keeps.back(picture, later, 0.4), Interpolator().back(picture, later, 0.4))
