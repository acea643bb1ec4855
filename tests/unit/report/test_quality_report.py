"""What `quality` tells: headline, table, problems and page, from planes whose figures are known."""

import math
from dataclasses import replace

import pytest

from common.diagnostic import Diagnostic
from phone_host.model import Seen
from phone_host.report.quality_lines import quality_lines
from phone_host.report.quality_page import quality_page
from phone_host.report.quality_report import bias_words, flaw, quality_verdict
from phone_host.report.report_page import Headline
from tests.support.html import Page
from tests.support.quality_pages import SIGMA_PX, pair, quality, report


def test_one_wall_is_told_in_one_sentence_and_one_row() -> None:
    """A wall at 1 m stated at 0.99 m: 10 mm and 1.01 % too far; RMS z^2 sigma / (f b) = 0.1 / 40 m = 2.5 mm."""
    lines = quality_lines(report(), "out")
    assert lines[0].startswith("At 1.000 m depth scatters by 2.5")
    assert "bias +10.0 mm (+1.01%)" in lines[0]
    assert lines[1].split() == ["pair", "distance", "plane-fit", "RMS", "sub-pixel", "fill", "bias", "(Z", "accuracy)"]
    assert lines[2].startswith("1.png  1.000 m   2.5")
    assert lines[-1] == "written to out: report.json, index.html"
    assert quality_verdict(report())[0] is Headline.GOOD


def test_a_narrow_terminal_gets_one_line_for_each_value() -> None:
    """The table is wider than 48 columns: there each value stands behind its title, and no line is folded."""
    lines = quality_lines(report(), "out", 48)
    assert lines[1] == "pair               1.png"
    assert lines[2] == "distance           1.000 m"
    assert lines[6].startswith("bias (Z accuracy)  +10.0 mm")
    assert quality_lines(report(), "out", 200) == quality_lines(report(), "out")


def test_theory_takes_the_median_noise_and_grows_with_the_square() -> None:
    """Of walls at 0.5, 1 and 2 m, theory gives RMS in the ratio of their squares: z^2 sigma / (f b)."""
    told = report(*(pair(f"{z}.png", quality(z)) for z in (0.5, 1.0, 2.0)))
    assert told.sigma_px == pytest.approx(SIGMA_PX, rel=0.03)
    assert told.theory_m(2.0) == pytest.approx(4 * SIGMA_PX / 40, rel=0.03)
    assert told.theory_m(0.5) * 16 == pytest.approx(told.theory_m(2.0))
    for one in told.planes:
        assert one.quality.rms_m == pytest.approx(told.theory_m(one.quality.distance_m), rel=0.05)
    grade, sentence = quality_verdict(told)
    assert grade is Headline.GOOD
    assert sentence.startswith("3 pairs show a plane, 0.500 to 2.000 m away.")
    assert "bias" not in sentence
    assert any("note: give --distance" in line for line in quality_lines(told, "out"))


def test_what_is_no_plane_has_a_remedy_in_one_line() -> None:
    """A bulge and a nearly empty picture: each row says no plane, each problem is one line, and together nothing is a plane."""
    bulge, empty = pair("bulge.png", quality(1.0, bulge_px=1.6)), pair("empty.png", quality(1.0, known=0.05))
    assert (bulge.quality.seen, empty.quality.seen) == (Seen.BENT, Seen.TOO_FEW)
    told = report(bulge, empty)
    lines = quality_lines(told, "out")
    assert lines[0].startswith("No pair shows a plane. The first: the region shows no plane: ")
    assert "no plane" in lines[2]
    warnings = [line for line in lines if line.startswith("warning: ")]
    assert len(warnings) == 2
    for warning, one in zip(warnings, (bulge, empty), strict=True):
        found = flaw(one.quality)
        assert found is not None
        assert found.remedy in warning
    assert quality_verdict(told)[0] is Headline.BAD
    assert not told.is_sound
    assert math.isnan(told.sigma_px)
    assert math.isnan(told.theory_m(1.0))
    assert flaw(report().planes[0].quality) is None
    assert quality_verdict(report(bulge))[1].startswith("The region shows no plane")
    assert quality_verdict(report(bulge, failed=True))[0] is Headline.BAD
    for seen in Seen:
        problem = flaw(replace(bulge.quality, seen=seen))
        assert (problem is None) is (seen is Seen.PLANE)


def test_pages_are_whole_and_show_maps() -> None:
    """One wall: figures and four maps. Several with one that failed: a table, plots beside theory, and maps to open."""
    page = Page(quality_page(report()))
    assert page.open == []
    assert page.script == ""
    assert len(page.every("img")) == 1
    assert len(page.every("svg")) == 3
    assert "+1.01" in page.words
    walls = [pair(f"{z}.png", quality(z, z * 1.01), Diagnostic("it was turned")) for z in (0.5, 1.0, 2.0)]
    several = Page(quality_page(report(*walls, pair("empty.png", quality(1.0, known=0.05)), failed=True)))
    assert several.open == []
    labels = [one.get("aria-label") for one in several.every("svg")]
    assert labels.count("plane-fit RMS over the distance") == labels.count("bias over the distance") == 2
    for words in ("failed: it is torn: mend it", "no plane can be fitted", "it was turned", "RMS by theory"):
        assert words in several.words
    unknown = Page(quality_page(report(pair("a.png", quality(1.0)), pair("b.png", quality(2.0)))))
    assert "bias over the distance" not in [one.get("aria-label") for one in unknown.every("svg")]
    assert "depth minus the fitted plane" in unknown.words.lower()


def test_a_bias_is_signed() -> None:
    """Too near is a minus as printers set it; an unknown bias is a dash."""
    assert bias_words(quality(1.0, 1.01)) == "\u221210.0 mm (\u22120.99%)"
    assert bias_words(quality(1.0)) == "\u2013"
