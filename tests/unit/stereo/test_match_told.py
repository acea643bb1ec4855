"""Large areas whose disparities the images do not tell lose them: bare walls do, weak texture and plain parts of a told surface do not."""

import numpy as np
import pytest
from numpy.typing import NDArray

from phone_host.model import Confidence, Disparity, Image, RectifiedPair
from phone_host.stereo.match import MatchSettings, create_matcher
from phone_host.stereo.match_tandem import untold, without_untold
from phone_host.stereo.matcher_names import MatcherName
from phone_host.stereo.matcher_protocol import matched_by
from phone_host.stereo.working import reduced
from tests.support.layers import Layer, layers

_HEIGHT, _WIDTH, _SHIFT = 180, 240, 12
_UNSURE = 20
_UPPER = slice(None, 100)


def pair(upper_levels: float, noise_levels: float = 0.0, seed: int = 5) -> tuple[Image, Image]:
    """A rich texture at 12 px below; above it a wall of the same disparity whose texture has this standard deviation."""
    rng = np.random.default_rng(seed)
    scene = rng.normal(0, 40, (_HEIGHT, _WIDTH + _SHIFT))
    scene[_UPPER] *= upper_levels / 40
    scene = scene + 128

    def seen(part: NDArray[np.float64]) -> Image:
        return np.asarray(np.clip(np.rint(part + rng.normal(0, noise_levels, part.shape)), 0, 255), np.uint8)

    # The column x of the left image is x - 12 of the right one.
    return seen(scene[:, :_WIDTH]), seen(scene[:, _SHIFT:])


def disparity(upper_px: float = _SHIFT) -> tuple[Disparity, Confidence]:
    """12 px below, this above, everywhere unsure."""
    found = np.full((_HEIGHT, _WIDTH), _SHIFT, np.float32)
    found[_UPPER] = upper_px
    found[:, :_SHIFT] = np.nan  # the right camera does not see it
    return found, np.full(found.shape, _UNSURE, np.uint8)


@pytest.mark.parametrize("noise_levels", [0.0, 1.5])
def test_a_bare_wall_loses_its_disparities_and_texture_keeps_its_own(noise_levels: float) -> None:
    """All of the wall goes but for a rim of 5 px, whether the cameras have noise or not; nothing of the textured half does."""
    left, right = pair(0.0, noise_levels)
    gone = untold(left, right, *disparity(upper_px=9))
    assert gone is not None
    assert gone[:95, 20:].all()
    assert not gone[105:, 20:].any()


def test_weak_texture_below_the_noise_is_evidence_enough() -> None:
    """A texture of 1.5 levels under noise of 2: at its true disparity it stays, at a wrong one it goes."""
    left, right = pair(1.5, 2.0)
    assert untold(left, right, *disparity()) is None
    gone = untold(left, right, *disparity(upper_px=9))
    assert gone is not None
    assert gone[:85, 30:].mean() > 0.9


def test_light_that_falls_off_along_a_bare_wall_is_no_texture() -> None:
    """A wall that is 24 levels darker at its right end has slopes that agree at any disparity: it goes all the same."""
    left, right = pair(0.0, 1.0)
    ramp = np.rint(np.linspace(12, -12, _WIDTH))
    left[_UPPER] = (left[_UPPER] + ramp).astype(np.uint8)
    right[_UPPER] = (right[_UPPER] + ramp).astype(np.uint8)
    gone = untold(left, right, *disparity(upper_px=9))
    assert gone is not None
    assert gone[:90, 20:].mean() > 0.9


def test_a_plain_part_of_a_surface_that_is_told_around_it_stays() -> None:
    """A white square of a board, 60 px wide: from each of its pixels all four ways lead to texture of the same surface."""
    left, right = pair(40.0)
    left[40:100, 100:160] = 200
    right[40:100, 100 - _SHIFT : 160 - _SHIFT] = 200
    assert untold(left, right, *disparity()) is None


def test_what_the_matcher_is_sure_of_stays() -> None:
    """The same bare wall with a confidence of 200."""
    found, confidence = disparity(upper_px=9)
    confidence[:] = 200
    assert untold(*pair(0.0), found, confidence) is None


def test_a_small_plain_area_stays() -> None:
    """A strip of 8 px beside a hole is narrower than a twentieth of the image."""
    left, right = pair(40.0)
    left[:, 100:108], right[:, 100 - _SHIFT : 108 - _SHIFT] = 128, 128
    assert untold(left, right, *disparity()) is None


def test_larger_images_are_judged_the_same() -> None:
    """Beyond 160 000 pixels half the size is looked at: the wall goes, the texture stays, and only what has a value goes."""
    left, right = (np.kron(image, np.ones((3, 3), np.uint8)) for image in pair(0.0))
    found, confidence = disparity(upper_px=9)
    found, confidence = np.kron(found * 3, np.ones((3, 3), np.float32)), np.kron(confidence, np.ones((3, 3), np.uint8))
    found[:20] = np.nan
    gone = untold(left, right, found, confidence)
    assert gone is not None
    assert gone[20:280, 60:].all()
    assert not gone[:20].any()
    assert not gone[320:].any()


@pytest.mark.parametrize("scale", [0.3, 0.5])
def test_the_matcher_puts_hardly_any_wrong_depth_on_a_bare_wall(scale: float) -> None:
    """Of a bare wall behind a textured box and floor less than 3 % get a wrong disparity at reduced sizes, and the textures keep 95 %."""
    scene = layers(
        (Layer(disparity=40, x=250, y=150, width=150, height=330, seed=2), Layer(disparity=24, seed=3)),
        width_px=640,
        height_px=480,
    )
    wall = np.zeros(scene.disparity.shape, np.bool_)
    wall[:300] = scene.disparity[:300] == 24
    rng = np.random.default_rng(6)
    images = []
    for image, bare in ((scene.pair.left, wall), (scene.pair.right, _right_wall(wall.shape))):
        seen = image.copy()
        seen[bare] = np.clip(np.rint(150 + rng.normal(0, 1, int(bare.sum()))), 0, 255)
        images.append(reduced(seen, scale))
    matcher = create_matcher(MatchSettings(MatcherName.TANDEM, round(64 * scale)))
    small = RectifiedPair(images[0], images[1])
    found = without_untold(small, matched_by(matcher, small)).disparity / np.float32(scale)
    height, width = found.shape
    y, x = np.linspace(0, 479, height).round().astype(int), np.linspace(0, 639, width).round().astype(int)
    truth, is_wall, seen_by_both = (values[np.ix_(y, x)] for values in (scene.disparity, wall, scene.visible))
    error = np.abs(found - truth)
    assert (error[is_wall & seen_by_both] > 2 / scale).mean() < 0.03
    assert (error[~is_wall & seen_by_both] <= 2 / scale).mean() > 0.95


def _right_wall(shape: tuple[int, ...]) -> NDArray[np.bool_]:
    """Where the right image shows the wall: the box lies 40 px farther left there."""
    bare = np.zeros(shape, np.bool_)
    bare[:300] = True
    bare[150:300, 210:360] = False
    return bare
