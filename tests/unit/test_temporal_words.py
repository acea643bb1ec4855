"""What a run says of pairs that were searched where the last one found something, from the core to the summary and report.json."""

from dataclasses import replace
from itertools import count

import pytest

from phone_host.measure.temporal_words import temporal_lines
from phone_host.model import CutCounts, DepthAccount, Searched, SearchedAs, TemporalAccount
from phone_host.report.run_json import build
from phone_host.report.run_page import notes
from phone_host.report.summary import summary
from phone_host.stereo.core import StereoCore
from phone_host.stereo.depth_limits import DepthWanted
from phone_host.stereo.match import MatchSettings
from phone_host.stereo.matcher_names import MatcherName
from tests.support.layers import Layer, layers
from tests.support.run_snapshots import run

_LINE = (
    "temporal: 2 of 4 pairs searched where the last one found something, 2 in full (1 first of their size, 1 fitted better elsewhere);"
    " 62% of the disparities on average"
)


def account() -> TemporalAccount:
    """The first pair, two narrowed to a quarter, a cut: 2.5 of 4 ranges, 62 % when rounded to even."""
    found = TemporalAccount()
    found = found.plus(Searched(why=SearchedAs.FIRST, share=1.0)).plus(Searched(why=SearchedAs.NARROWED, share=0.25))
    return found.plus(Searched(why=SearchedAs.NARROWED, share=0.25)).plus(Searched(why=SearchedAs.ELSEWHERE, share=1.0))


def test_terminal_page_and_report_tell_how_many_pairs_were_narrowed_and_why_others_were_not() -> None:
    """The same line in summary and page; the counts by reason in report.json, which add up to the pairs."""
    told = replace(run(4), depth=DepthAccount(cut=CutCounts(kept=1), temporal=account()))
    assert temporal_lines(account()) == [_LINE]
    assert _LINE in summary(told)
    assert any(_LINE[1:] in note for note in notes(told))
    depth = build(told)["depth"]
    assert isinstance(depth, dict)
    assert depth["temporal"] == {
        "narrowed_pairs": 2,
        "full_pairs": {"first": 1, "due": 0, "elsewhere": 1, "wide": 0, "empty": 0},
        "searched_share": 0.625,
    }


def test_a_run_without_the_option_says_nothing() -> None:
    """No line, and null in report.json."""
    plain = replace(run(4), depth=DepthAccount(cut=CutCounts(kept=1)))
    assert temporal_lines(None) == []
    assert "temporal" not in summary(plain)
    depth = build(plain)["depth"]
    assert isinstance(depth, dict)
    assert depth["temporal"] is None


@pytest.mark.parametrize("scale", [1.0, 0.5])
def test_a_core_narrows_at_every_working_size(scale: float) -> None:
    """Of 128 disparities 24 to 34 px are used; the second pair is narrowed, and its depth is that of a core without the option within a quarter pixel."""
    scenes = [
        layers([Layer(disparity=34, x=140, y=80, width=80, height=80, seed=2), Layer(disparity=24)], sensor_seed=n)
        for n in (0, 1)
    ]
    wanted = DepthWanted(scale=scale)
    often = StereoCore(MatchSettings(MatcherName.SGBM, 128, temporal=True), wanted=wanted)
    once = StereoCore(MatchSettings(MatcherName.SGBM, 128), wanted=wanted)
    ticks = count()
    found = [often.compute(scene.pair.left, scene.pair.right, lambda: next(ticks)) for scene in scenes]
    reports = [item.match_report for item in found]
    assert [None if item is None or item.searched is None else item.searched.why for item in reports] == [
        SearchedAs.FIRST,
        SearchedAs.NARROWED,
    ]
    expected = once.compute(scenes[1].pair.left, scenes[1].pair.right, lambda: next(ticks)).disparity
    disparity = found[1].disparity
    assert expected is not None
    assert disparity is not None
    assert (abs(disparity - expected) <= 0.25)[expected > 0].mean() > 0.98
