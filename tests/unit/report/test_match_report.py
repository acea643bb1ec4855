"""What a matcher corrected reaches the report, in px of the rectified images, and is told in plain words."""

from dataclasses import replace

import numpy as np
import pytest

from common.errors import SettingsError
from phone_host.accounts.delays import MatchedMedians
from phone_host.model import (
    Crop,
    CutCounts,
    DepthAccount,
    Epipolar,
    Matched,
    MatchReport,
    RectifiedPair,
    Side,
)
from phone_host.report.match_words import corrected_words, run_corrected_words
from phone_host.report.run_json import build
from phone_host.report.run_page import run_page
from phone_host.report.summary import summary
from phone_host.stereo.core import StereoCore
from phone_host.stereo.depth_limits import DepthWanted
from phone_host.stereo.match import MatchSettings, create_matcher
from phone_host.stereo.match_block import BlockMatcher
from phone_host.stereo.match_sgbm import SgbmMatcher
from phone_host.stereo.match_tandem import TandemMatcher
from phone_host.stereo.matcher_names import MatcherName, matcher_named
from phone_host.stereo.matcher_protocol import ReportingMatcher, matched_by
from tests.support.planes import plane
from tests.support.run_snapshots import run


class _Confident:
    """A matcher that is certain of one disparity, and says that it moved the right image up by 0.5 px."""

    def match(self, pair: RectifiedPair) -> np.ndarray:
        return self.matched(pair).disparity

    def matched(self, pair: RectifiedPair) -> Matched:
        shape = pair.left.shape[:2]
        return Matched(
            disparity=np.full(shape, 10, np.float32),
            confidence=np.full(shape, 200, np.uint8),
            report=MatchReport(vertical_px=0.5, confidence_histogram=(0, shape[0] * shape[1])),
        )


def test_a_name_as_typed_makes_a_matcher() -> None:
    """A matcher is made by the name that a user types, and an unknown one is refused."""
    for name, kind in (("block", BlockMatcher), ("sgbm", SgbmMatcher), ("tandem", TandemMatcher)):
        assert isinstance(create_matcher(MatchSettings(matcher_named(name), 16)), kind)
    with pytest.raises(SettingsError, match="magic"):
        matcher_named("magic")


def test_sgbm_reports_the_vertical_error_and_the_levels() -> None:
    """A right image 0.8 px too low and of 0.7 times the levels plus 20 is reported so; its gain within 5 %, position within 0.3 px."""
    scene = plane(vertical_px=0.8, shortest_px=8)
    right = np.rint(scene.pair.right * 0.7 + 20).astype(np.uint8)
    matcher = SgbmMatcher(64)
    assert isinstance(matcher, ReportingMatcher)
    matched = matcher.matched(RectifiedPair(scene.pair.left, right))
    assert matched.report.vertical_px == pytest.approx(0.8, abs=0.3)
    assert matched.report.gain == pytest.approx(1 / 0.7, rel=0.05)
    assert matched.report.offset_levels == pytest.approx(-20 / 0.7, abs=8)
    assert matched.disparity.tobytes() == matcher.match(RectifiedPair(scene.pair.left, right)).tobytes()


def test_a_matcher_that_reports_nothing_corrected_nothing() -> None:
    """`block` has no confidence, and its report says that nothing was changed."""
    matched = matched_by(create_matcher(MatchSettings(MatcherName.BLOCK, 32)), plane().pair)
    assert matched.confidence is None
    assert matched.report == MatchReport()


def test_the_core_gives_confidence_and_report_at_the_size_of_the_rectified_images() -> None:
    """At half the size 0.5 px are 1 px of the rectified images; confidence fills them, and is 0 outside the crop."""
    pair = plane(width_px=200, height_px=100).pair
    crop = Crop(x_px=60, y_px=20, width_px=50, height_px=40)
    processed = StereoCore(_Confident(), wanted=DepthWanted(scale=0.5, crop=crop)).compute(
        pair.left, pair.right, lambda: 0
    )
    assert processed.match_report is not None
    assert processed.match_report.vertical_px == pytest.approx(1.0)
    assert processed.confidence is not None
    assert processed.confidence.shape == pair.left.shape
    assert (processed.confidence[20:60, 60:110] == 200).all()
    assert np.count_nonzero(processed.confidence) == 40 * 50


def test_what_was_corrected_is_told_in_plain_words() -> None:
    """A darker image that lies too low is told as such; 2 % of gain and 0.1 px are not worth a word."""
    both = corrected_words(MatchReport(vertical_px=0.6, gain=1 / 0.7))
    assert both == "the right image lay 0.6 px too low and was 30% darker; both were corrected before matching"
    assert corrected_words(MatchReport(vertical_px=-0.6)) == (
        "the right image lay 0.6 px too high; this was corrected before matching"
    )
    assert "off to one side" in corrected_words(MatchReport(vertical_px=0.6), Epipolar.UP)
    assert "had 30% less contrast" in corrected_words(MatchReport(gain=1 / 0.7, offset_levels=-50))
    assert corrected_words(MatchReport(vertical_px=0.1, gain=1.02)) == ""
    uneven = corrected_words(MatchReport(vignetting_percent=25.0, shading_percent=12.0))
    assert "was 20% darker at its corners and was 12% darker at one side than at the other" in uneven
    assert corrected_words(None) == ""


def test_a_run_tells_the_medians_of_what_was_corrected_in_one_line() -> None:
    """Summary, page and report.json tell the medians; of a matcher that reports nothing they say nothing."""
    medians = MatchedMedians()
    for number in range(1000):
        medians.add(MatchReport(vertical_px=0.4 + 0.0001 * number, gain=1.25, offset_levels=-3, vignetting_percent=12))
    medians.add(None)
    found = medians.report()
    assert found is not None
    assert found.vertical_px == pytest.approx(0.45, abs=0.001)
    assert (found.gain, found.offset_levels, found.vignetting_percent) == (1.25, -3, 12)
    line = "corrected before matching, right image (medians): moved up by 0.45 px, levels x 1.25 -3.0, corners another +12%"
    told = replace(run(5), depth=DepthAccount(cut=CutCounts(kept=5), median_report=found))
    assert line in summary(told).splitlines()
    assert f"C{line[1:]}." in run_page(told, None, Side.LEFT, ())
    depth = build(told)["depth"]
    assert isinstance(depth, dict)
    assert depth["corrected_median"]["vertical_px"] == pytest.approx(0.45, abs=0.001)


def test_a_run_says_nothing_of_a_matcher_that_reports_nothing() -> None:
    """`block` reports nothing: no line; a matcher that found nothing to correct says so."""
    medians = MatchedMedians()
    medians.add(MatchReport())
    assert medians.report() is None
    silent = replace(run(5), depth=DepthAccount(cut=CutCounts(kept=5)))
    assert "corrected" not in summary(silent)
    medians.add(MatchReport(confidence_histogram=(1,)))
    assert run_corrected_words(medians.report()).endswith("(medians): nothing")


def test_a_run_of_stacked_cameras_tells_the_direction_that_was_corrected() -> None:
    """Of cameras one above the other the correction is sideways; a lamp at one side is told, too."""
    words = run_corrected_words(MatchReport(vertical_px=-0.3, shading_percent=9), Epipolar.UP)
    assert words.endswith("moved sideways by 0.30 px, one side 9% more than the other")
    assert "moved down by 0.30 px" in run_corrected_words(MatchReport(vertical_px=-0.3))


def test_pairs_of_which_nothing_was_corrected_count_in_the_median() -> None:
    """One pair in a hundred that was moved by 1.5 px is no run that was moved by 1.5 px."""
    medians = MatchedMedians()
    for _ in range(99):
        medians.add(MatchReport())
    medians.add(MatchReport(vertical_px=1.5))
    found = medians.report()
    assert found is not None
    assert found.vertical_px == 0.0
