"""Our own matcher: the same bits whatever computes them, what it reports, and what it refuses."""

import numpy as np
import pytest

from common.errors import SettingsError
from phone_host.model import Image, RectifiedPair
from phone_host.native.library import Library, native
from phone_host.stereo.match_tandem import CLASSES, TandemMatcher, confidence_histogram
from phone_host.stereo.matcher_protocol import ReportingMatcher
from tests.support.planes import noise, plane


@pytest.fixture(scope="module")
def library() -> Library:
    """The library of this checkout."""
    found = native()
    assert isinstance(found, Library)
    return found


def real_looking() -> RectifiedPair:
    """A slanted plane 300 rows high (so that it is matched in two strips), seen by two noisy cameras of unlike exposure, with a bare patch."""
    pair = plane(width_px=230, height_px=300, vertical_px=0.6, seed=21).pair
    rng = np.random.default_rng(4)

    def seen(image: Image, gain: float, offset: float) -> Image:
        levels = image * gain + offset + rng.normal(0, 1.5, image.shape)
        return np.asarray(np.clip(np.rint(levels), 0, 255), np.uint8)

    left, right = seen(pair.left, 1.0, 0.0), seen(pair.right, 0.7, 20.0)
    left[200:260, 60:120] = 128
    right[200:260, 50:110] = 128
    return RectifiedPair(left, right)


def test_threads_and_instruction_sets_give_the_same_bits(library: Library) -> None:
    """1, 2, 3 and 8 threads and every instruction set of this processor give one disparity, one confidence and one report."""
    pair = real_looking()
    results = set()
    for simd in library.usable_sets():
        for threads in (1, 2, 3, 8):
            found = TandemMatcher(48, library.using(simd), threads).matched(pair)
            assert found.confidence is not None
            results.add((found.disparity.tobytes(), found.confidence.tobytes(), found.report))
    assert len(results) == 1


def test_differences_of_the_cameras_are_reported_and_undone(library: Library) -> None:
    """0.8 px too low, 0.7 times the levels plus 20: reported within 0.3 px, 6 % and 10 levels; the plane is found below a quarter pixel."""
    scene = plane(vertical_px=0.8, shortest_px=8)
    right = np.rint(scene.pair.right * 0.7 + 20).astype(np.uint8)
    pair = RectifiedPair(scene.pair.left, right)
    matcher = TandemMatcher(64, library)
    assert isinstance(matcher, ReportingMatcher)
    matched = matcher.matched(pair)
    assert matched.report.vertical_px == pytest.approx(0.8, abs=0.3)
    assert matched.report.gain == pytest.approx(1 / 0.7, rel=0.06)
    assert matched.report.offset_levels == pytest.approx(-20 / 0.7, abs=10)
    assert matched.disparity.tobytes() == matcher.match(pair).tobytes()
    assert np.nanmedian(np.abs(matched.disparity - scene.disparity_px)) < 0.25


def test_a_value_has_a_confidence_and_no_value_has_none(library: Library) -> None:
    """Confidence is 0 just where the disparity is NaN; the histogram counts every value once, in classes of 17 levels."""
    matched = TandemMatcher(48, library).matched(real_looking())
    confidence, histogram = matched.confidence, matched.report.confidence_histogram
    assert confidence is not None
    assert histogram is not None
    assert ((confidence == 0) == np.isnan(matched.disparity)).all()
    assert len(histogram) == CLASSES
    expected, _ = np.histogram(confidence[confidence > 0], bins=15, range=(0.5, 255.5))
    assert histogram == tuple(expected)


def test_the_histogram_leaves_out_pixels_without_a_value() -> None:
    """Levels 0, 1, 17, 18 and 255: none, first class twice, second, last."""
    assert confidence_histogram(np.array([[0, 1, 17, 18, 255]], np.uint8)) == (2, 1, *[0] * 12, 1)


def test_more_than_it_can_hold_is_refused(library: Library) -> None:
    """More than 2048 disparities on an image that wide, and sides above 32767 px, are refused; on narrower images any N works."""
    image = noise(2100, 2)
    with pytest.raises(SettingsError, match="2049 is more than tandem can hold"):
        TandemMatcher(2049, library).match(RectifiedPair(image, image))
    assert TandemMatcher(2048, library).match(RectifiedPair(image, image)).shape == image.shape
    narrow = noise(60, 9)
    assert TandemMatcher(10**9, library).match(RectifiedPair(narrow, narrow)).shape == narrow.shape
    wide = np.broadcast_to(np.uint8(7), (1, 32768))
    with pytest.raises(SettingsError, match="32768x1 px are larger"):
        TandemMatcher(16, library).match(RectifiedPair(wide, wide))
    with pytest.raises(SettingsError, match="1x32768 px are larger"):
        TandemMatcher(16, library).match(RectifiedPair(wide.T, wide.T))
