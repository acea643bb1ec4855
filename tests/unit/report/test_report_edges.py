"""What reports say where there is little to say: no geometry, no search, no pair that was measured, no budget's change."""

import math
from dataclasses import replace

import numpy as np
import pytest

from common.diagnostic import Diagnostic
from common.doctor.finding import exit_code, settings_finding, table
from common.errors import SettingsError
from common.ledger import StageTimes
from phone_host.diagnostics.headline import Answer, Grade
from phone_host.diagnostics.image_rules import ImageFigures
from phone_host.diagnostics.throughput import budget_lines
from phone_host.model import MatchReport, Processed, RectifiedPair
from phone_host.output.axes import Axes
from phone_host.output.pair_files import WrittenPair
from phone_host.report import depth_data
from phone_host.report.depth_view import depth_view
from phone_host.report.match_words import corrected_words
from phone_host.report.quality_lines import quality_lines
from phone_host.report.quality_page import quality_page
from phone_host.report.quality_report import QualityReport, quality_verdict
from phone_host.report.report_page import Headline
from phone_host.report.stereo_lines import cut_lines, pair_lines, set_lines
from phone_host.report.stereo_page import stereo_page, thumbnail
from phone_host.report.stereo_report import FailedPair, PairReport, SetReport
from phone_host.report.stereo_trust import PairTrust
from phone_host.svg.plot_marks import Mark, over_distance
from tests.support.budget_accounts import ACCOUNT, BEST
from tests.support.html import Page
from tests.support.quality_pages import pair, quality, report
from tests.support.stereo_pages import page_data, processed

_BARE = PairReport(
    name="7",
    left="left/7.png",
    right="right/7.png",
    left_px=(40, 25),
    right_px=(40, 25),
    rectified_px=(40, 25),
    matcher="block",
    search=None,
    geometry=None,
    limits=None,
    cut=None,
    density=0.5,
    axes=Axes.CAMERA,
    written=WrittenPair(files=("disparity.pfm",), points=None),
    stages_ms=(("total", 20.0),),
    trust=PairTrust(ImageFigures(), (), Answer(Grade.GOOD, "Disparity looks right.")),
)
_TORN = FailedPair(name="9", left="left/9.png", right="right/9.png", failure=Diagnostic("it is torn", "mend it"))


def test_a_pair_without_geometry_has_size_and_density_and_no_word_of_metres() -> None:
    """Without calibration and without a search of its own, a pair's lines are three: answer, density, files."""
    assert pair_lines(_BARE, "out") == [
        "Disparity looks right.",
        "40x25 px, block: 50.0% of the pixels matched (20 ms)",
        "written to out: disparity.pfm, report.json, index.html",
    ]
    assert cut_lines(_BARE) == []


@pytest.mark.parametrize("by_number", [True, False])
def test_a_failed_pair_is_listed_with_its_problem_and_remedy(*, by_number: bool) -> None:
    """Beside a pair that was computed, the torn one has a line, and the sum says that one of two failed."""
    lines = set_lines(SetReport(pairs=(_BARE, _TORN), by_number=by_number), "out")
    assert lines[1] == f"9{'' if by_number else ' 9.png'}  failed: it is torn: mend it"
    assert "1 of 2 pairs computed, 1 failed; written to out: one folder per pair, report.json and index.html" in lines


def test_a_quality_of_failed_pairs_only_has_no_table() -> None:
    """If no pair was measured, the first problem is told at once and in its own line; a table would have no row."""
    failed = QualityReport(pairs=(replace(_TORN, name="9.png"),), matcher="tandem")
    assert quality_verdict(failed) == (Headline.BAD, "No pair was measured. The first: it is torn")
    assert quality_lines(failed, "out") == [
        "No pair was measured. The first: it is torn",
        "9.png failed: it is torn: mend it",
        "written to out: report.json, index.html",
    ]


def test_a_page_of_very_many_pairs_holds_the_maps_of_the_first_thirty() -> None:
    """Of 31 walls the page shows 30 pictures and says so, and so does the terminal."""
    wall = pair("wall.png", quality(1.0, 1.0))
    page = Page(quality_page(report(*[wall] * 31)))
    assert "maps are those of the first 30 pairs; report.json has the tiles of all" in page.words
    assert len(page.every("img")) == 30
    assert "note: maps are those of the first 30 pairs; report.json has the tiles of all" in quality_lines(
        report(*[wall] * 31), "out"
    )


def test_a_gain_that_cannot_be_tells_no_levels() -> None:
    """A right image has no brightness for a gain of 0: only its place is told."""
    words = corrected_words(MatchReport(vertical_px=0.6, gain=0.0))
    assert words == "the right image lay 0.6 px too low; this was corrected before matching"


def test_a_budget_that_was_held_from_the_start_has_one_line() -> None:
    """Nothing was changed or narrowed, so nothing is said beside how the budget was held: 190 of 200 are 95 %."""
    [line] = budget_lines(replace(ACCOUNT, now=BEST, narrowed=0, changed=0, changes=()))
    assert line.endswith("the newest pairs took 14.2 ms; 95% of 200 pairs held it")


def test_a_plot_of_nothing_says_so() -> None:
    """A measurement without distance or value cannot be drawn."""
    marks = (Mark(math.nan, 1.0, "a"), Mark(1.0, math.nan, "b"))
    for shown in ((), marks):
        drawn = over_distance(shown, (), "mm", "RMS", 400)
        assert "nothing was measured" in drawn
        assert "<circle" not in drawn


def test_wrong_settings_are_a_failed_finding_with_their_exit_code() -> None:
    """A doctor tells what is wrong with the settings, without control characters, and ends as every verb does then."""
    wrong = SettingsError("port\x1b 70000 is none", "give 1 to 65535")
    found = settings_finding("my.conf", wrong)
    line = table([found])
    assert line.startswith("fail  settings  port")
    assert line.endswith("70000 is none -> give 1 to 65535")
    assert "\x1b" not in line
    assert exit_code([found], wrong) == wrong.exit_code
    assert table([settings_finding("my.conf", None)]) == "ok    settings  my.conf"
    assert exit_code([settings_finding("", None)]) == 0


def _without_core() -> Processed:
    """A pair of grey images that nothing was computed from."""
    grey = np.full((20, 30), 90, np.uint8)
    return Processed(
        RectifiedPair(grey, grey),
        None,
        None,
        StageTimes(decode=0, interpolate=0, rectify=0, match=0, reproject=0, write=0),
    )


def test_a_pair_without_disparity_has_no_density_and_no_thumbnail() -> None:
    """Nothing was matched: no share is known, there is nothing to draw, and no figure stands on the page."""
    bare = _without_core()
    assert math.isnan(depth_data.density(bare))
    assert thumbnail(bare) is None
    page = Page(stereo_page(page_data(processed=bare)))
    assert page.open == []
    assert "density" not in page.words


def test_no_uncertainty_stands_beside_depth_that_is_wrong() -> None:
    """The wall at 2 m is known to 50 mm if depth is right; of wrong depth nothing is certain."""
    assert "uncertainty" in Page(stereo_page(page_data(verdict=Headline.GOOD))).words
    assert "uncertainty" not in Page(stereo_page(page_data(verdict=Headline.BAD))).words


@pytest.mark.parametrize(
    ("decades", "marks"), [(8, {"10000", "100", "1", "0.01"}), (2, {"0.05", "0.02", "0.01", "0.005", "0.002"})]
)
def test_depths_over_many_decades_have_few_round_marks(decades: int, marks: set[str]) -> None:
    """From 1 mm to 100 km only powers of ten are marked, every second one for room; from 1 mm to 100 mm 2 and 5 times them, too."""
    depth = np.logspace(-3, -3 + decades, 160 * 120).reshape(120, 160).astype(np.float32)
    view = depth_view(replace(processed(), cloud=np.dstack([depth, depth, depth])), ("left", "right"))
    shown = Page(view).words.split("the scale is in metres")[1].split("depth Z")[0]
    assert set(shown.removesuffix(" m").split(" m")) == marks
