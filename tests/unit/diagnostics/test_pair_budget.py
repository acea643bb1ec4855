"""A run's time budget: what the core does with a choice, what the account tells, and what the user may ask for."""

import html
import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import pytest

from common.errors import SettingsError
from phone_host.cli import main
from phone_host.diagnostics.codes import Code, diagnose
from phone_host.diagnostics.headline import headline
from phone_host.diagnostics.image_judge import ImageTrust
from phone_host.diagnostics.image_rules import ImageFigures
from phone_host.diagnostics.run_rules import concerns
from phone_host.diagnostics.run_snapshot import RunSnapshot
from phone_host.diagnostics.throughput import budget_lines, missed_words, narrowed_words, with_budget
from phone_host.jobs.run_request import budget_wanted
from phone_host.model import (
    BudgetAccount,
    BudgetReason,
    Crop,
    CutCounts,
    Side,
    StereoGeometry,
)
from phone_host.report.run_json import build
from phone_host.report.run_page import run_page
from phone_host.report.summary import summary
from phone_host.run.pair_budget import PairBudget, usable_matchers
from phone_host.settings import check, resolve_settings
from phone_host.stereo.budget import BudgetWanted, Choice
from phone_host.stereo.core import StereoCore
from phone_host.stereo.depth_limits import DepthWanted
from phone_host.stereo.match import MatchSettings
from phone_host.stereo.matcher_names import MatcherName
from phone_host.stereo.rectifier import Rectifier
from tests.support.budget_accounts import ACCOUNT, BEST, MS, NARROW, SMALL
from tests.support.planes import plane
from tests.support.requests import request_of
from tests.support.rigs import unlike_rig
from tests.support.run_snapshots import run

GEOMETRY: Final = StereoGeometry(focal_px=400.0, baseline_m=0.1, cx_px=159.5, cy_px=79.5)
"""f b = 40 px m: 64 disparities reach 0.625 m, 48 reach 0.833 m, 32 reach 1.25 m."""

SIZE: Final = (320, 160)


def settings_core(disparities: int = 64, **wanted: Any) -> StereoCore:
    """A core for rectified images of 320x160 px."""
    return StereoCore(MatchSettings(MatcherName.SGBM, disparities), None, GEOMETRY, DepthWanted(**wanted))


@pytest.mark.parametrize("matcher", MatcherName)
@pytest.mark.parametrize(("scale", "disparities"), [(1.0, 64), (0.5, 64), (0.5, 48)])
def test_a_choice_gives_the_bits_of_a_core_that_was_built_so(
    matcher: MatcherName, scale: float, disparities: int
) -> None:
    """Matcher, scale and range chosen for a pair give the disparity of a core with these settings, also between pairs without a choice."""
    pair, core = plane().pair, settings_core()
    plain = core.compute(pair.left, pair.right, lambda: 0).disparity
    choice = Choice(matcher=matcher, scale=scale, disparities=disparities)
    chosen = core.compute(pair.left, pair.right, lambda: 0, choice=choice)
    built = StereoCore(MatchSettings(matcher, disparities), None, GEOMETRY, DepthWanted(scale=scale))
    expected = built.compute(pair.left, pair.right, lambda: 0)
    assert chosen.search == expected.search
    assert chosen.limits == expected.limits
    assert np.array_equal(np.asarray(chosen.disparity), np.asarray(expected.disparity), equal_nan=True)
    again = core.compute(pair.left, pair.right, lambda: 0).disparity
    assert np.array_equal(np.asarray(plain), np.asarray(again), equal_nan=True)


def test_choices_share_the_maps_of_the_rectification() -> None:
    """A change of the choice must not compute them again: images of twice the calibration's size get one rectifier."""
    core = StereoCore(MatchSettings(disparities=16), Rectifier(unlike_rig()))
    left_px, right_px = (1280, 960), (2560, 1440)
    left, right = (np.zeros((px[1], px[0]), np.uint8) for px in (left_px, right_px))
    made = set()
    for scale in (0.25, 0.3):
        choice = Choice(matcher=MatcherName.BLOCK, scale=scale, disparities=16)
        processed = core.compute(left, right, lambda: 0, choice=choice)
        height_px, width_px = processed.pair.left.shape
        made.add(id(core.rectifier_for((width_px, height_px))))
    assert len(made) == 1


def held(budget_ms: float, times_ms: list[tuple[float, float]], **wanted: Any) -> PairBudget:
    """A budget after some pairs of 320x160 px, 33 ms apart, with their times in all and of matching."""
    core = settings_core()
    budget = PairBudget(BudgetWanted(budget_ns=round(budget_ms * MS), matchers=(MatcherName.SGBM,), **wanted), core)
    for number, (total_ms, match_ms) in enumerate(times_ms):
        budget.choice(SIZE, SIZE)
        budget.add(round(total_ms * MS), round(match_ms * MS), (number + 1) * 33 * MS)
    return budget


def test_the_account_tells_what_was_chosen_and_why() -> None:
    """Pairs of 50 ms, 45 of them matching, do not hold 30 ms: after the first, which does not count, and three more, less is matched."""
    budget = held(30, [(50, 45)] * 4)
    account = budget.account
    assert account is not None
    assert (account.pairs, account.held, account.changed) == (4, 0, 1)
    [change] = account.changes
    assert (change.pair, change.reason, change.processing_ns) == (4, BudgetReason.TOO_SLOW, 50 * MS)
    assert change.at_s == pytest.approx(0.099)
    assert account.now == change.step
    assert account.now.scale < account.best.scale == 1.0
    assert account.best.nearest_m == pytest.approx(0.625)
    chosen = budget.choice(SIZE, SIZE)
    assert (chosen.scale, chosen.disparities) == (account.now.scale, account.now.disparities)


def test_other_sizes_begin_anew() -> None:
    """When the camera changes its size, the ladder is that of the new one; the account goes on."""
    budget = held(30, [(10, 5)] * 3)
    budget.choice((640, 320), (640, 320))
    budget.add(10 * MS, 5 * MS, 200 * MS)
    assert budget.account is not None
    assert budget.account.best.width_px == 640
    assert (budget.account.pairs, budget.account.changes[0].reason) == (4, BudgetReason.OTHER_SIZE)


def test_a_crop_is_what_is_matched() -> None:
    """Of 320x160 px only a part is matched: 100 px wide, the search and the margin to its left, 32 px of margin to its right."""
    core = settings_core(disparities=32)
    assert core.extent(SIZE, SIZE).width_px == 320
    cropped = settings_core(disparities=32, crop=Crop(x_px=150, y_px=50, width_px=100, height_px=40))
    extent = cropped.extent(SIZE, SIZE)
    assert (extent.width_px, extent.height_px) == (32 + 32 + 100 + 32, 32 + 40 + 32)


def test_every_matcher_of_ours_works_here_or_is_left_out() -> None:
    """The two that need nothing but OpenCV are there, the better one first."""
    assert [name for name in usable_matchers() if name in {MatcherName.SGBM, MatcherName.BLOCK}] == [
        MatcherName.SGBM,
        MatcherName.BLOCK,
    ]


def with_account(account: BudgetAccount | None) -> RunSnapshot:
    """A run whose depth is right."""
    figures = ImageFigures(density=0.9, consistency=0.9, vertical_px=0.2)
    trust = ImageTrust(judged=5, wants_depth=True, has_depth=True, start=figures, now=figures)
    return replace(run(30), images=trust, budget=account)


def test_summary_page_and_report_tell_the_budget() -> None:
    """What was chosen, how many pairs held it, the last change and the range are in each of the three; without a budget none says a word."""
    seen = with_account(ACCOUNT)
    page = html.unescape(run_page(seen, None, Side.LEFT, ()))
    for text in (summary(seen), page):
        for words in (
            "20 ms for each pair: sgbm at 160x120 px (25% of the size), disparities to 47 px",
            "took 14.2 ms; 95% of 200 pairs held it",
            "changed 3 times, last after 2.5 s because pairs took too long (31.0 ms)",
            "nearest depth is now 600 mm, not 300 mm: nearer things get no depth, or a wrong one",
        ):
            assert words in text
    assert "Changes to hold 20 ms" in page
    report: Any = json.loads(json.dumps(build(seen), allow_nan=False))["budget"]
    assert (report["budget_ms"], report["processing_ms"], report["held_pairs"]) == (20.0, 14.2, 190)
    assert report["chosen"]["nearest_m"] == 0.6
    assert report["changes"][0]["reason"] == "too_slow"
    off = with_account(None)
    assert build(off)["budget"] is None
    assert "budget" not in summary(off) + run_page(off, None, Side.LEFT, ())


def test_the_headline_says_that_near_things_are_lost() -> None:
    """As long as the search is narrower, in metres or in px; once it is wide again, the summary still counts those pairs."""
    assert headline(with_account(ACCOUNT)).sentence.endswith(
        " Nearest depth is now 600 mm, not 300 mm, to hold --budget."
    )
    in_px = replace(ACCOUNT, now=replace(NARROW, nearest_m=math.nan), best=replace(BEST, nearest_m=math.nan))
    assert narrowed_words(in_px) == "disparities are now searched to 47 px only, not to 95 px"
    wide = replace(ACCOUNT, now=SMALL)
    assert "budget" not in headline(with_account(wide)).sentence
    assert any("for 7 pairs near things were not looked for" in line for line in budget_lines(wide))


def test_a_search_that_the_budget_has_narrowed_asks_for_a_longer_budget() -> None:
    """--disparities would be the wrong remedy then; of other doubts and other searches the remedy stays."""
    short = diagnose(Code.SEARCH_TOO_SHORT, "s", "give --disparities 96")
    assert with_budget(short, replace(ACCOUNT, now=SMALL)) == short
    seen = with_account(ACCOUNT)
    seen = replace(seen, images=replace(seen.images, concerns=(short,), newest=(short,)))
    [told] = [item for item in concerns(seen) if item.code == Code.SEARCH_TOO_SHORT]
    assert "--budget" in told.remedy
    assert with_budget(replace(short, code=Code.DARK), ACCOUNT).remedy == short.remedy


def test_a_missed_budget_is_a_warning() -> None:
    """Only if pairs are too slow and nothing is left: it says what matching takes of the time."""
    missed = replace(ACCOUNT, processing_ns=31 * MS, is_missed=True)
    words = missed_words(missed)
    assert "--budget 20 cannot be held: pairs take 31.0 ms, of which matching takes 6.0 ms" in words
    assert f"warning: {words}" in summary(with_account(missed))
    assert words in html.unescape(run_page(with_account(missed), None, Side.LEFT, ()))
    assert missed_words(ACCOUNT) == missed_words(None) == ""


def wanted_of(*words: str, core: StereoCore | None = None) -> BudgetWanted | None:
    """What these words of `run` ask for."""
    request = request_of("run", *words)
    resolved = resolve_settings(request.given)
    check(resolved.values)
    return budget_wanted(request, resolved, core or settings_core())


def test_what_is_given_stays_as_given() -> None:
    """--scale, --matcher, --disparities and --near are kept; what is not given may change."""
    free = wanted_of("--budget", "30ms")
    assert free is not None
    assert (free.budget_ns, free.may_scale, free.may_narrow) == (30 * MS, True, True)
    assert free.matchers == usable_matchers()
    named = wanted_of("--budget", "0.03s", "--matcher", "block", "--scale", "0.5")
    assert named == BudgetWanted(budget_ns=30 * MS, matchers=(MatcherName.BLOCK,), may_scale=False, may_narrow=True)
    for words in (("--near", "500"), ("--disparities", "64")):
        fixed = wanted_of("--budget", "30", *words)
        assert fixed is not None
        assert not fixed.may_narrow
    assert wanted_of() is None


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ("0", "--budget is 0 ms"),
        ("0.5", "budget is 0.5 ms"),
        ("1e9", "budget is 1e+09 ms"),
        ("fast", "--budget is 'fast'"),
        ("-5", "--budget is '-5'"),
        ("nan", "--budget is 'nan'"),
    ],
)
def test_nonsense_is_refused_in_one_line(words: str, says: str, capsys: pytest.CaptureFixture[str]) -> None:
    """Exit 2 and one line, before the camera is opened, which is not there."""
    assert main(["run", "--camera", "replay:nowhere", f"--budget={words}"]) == 2
    said = capsys.readouterr().err
    assert says in said
    assert said.count("\n") == 1


def test_a_budget_that_may_change_nothing_is_refused() -> None:
    """Matcher, scale and range are all given: the line names them."""
    for words in (["--disparities", "64"], ["--near", "500"]):
        with pytest.raises(SettingsError, match=f"--matcher, --scale and {words[0]} has nothing left to choose"):
            wanted_of("--budget", "30", "--matcher", "sgbm", "--scale", "1", *words)


def test_a_budget_without_depth_is_refused() -> None:
    """There is nothing to match; one from a settings file waits for the next run with depth."""
    request = request_of("run", "--budget", "30")
    with pytest.raises(SettingsError, match="without --calibration or --rectified"):
        budget_wanted(request, resolve_settings(request.given), None)


def test_a_budget_may_stand_in_the_settings_file(tmp_path: Path) -> None:
    """With its unit or in ms; without depth it is no mistake."""
    file = tmp_path / "host.toml"
    for text in ('budget = "0.04s"', "budget = 40.0"):
        file.write_text(text)
        wanted = wanted_of("--config", str(file))
        assert wanted is not None
        assert wanted.budget_ns == 40 * MS
    request = request_of("run", "--config", str(file))
    assert budget_wanted(request, resolve_settings(request.given), None) is None


def test_counts_of_pixels_go_on_over_changes() -> None:
    """The result of each choice has the full size: the six counts add up to its pixels."""
    pair, core = plane().pair, settings_core()
    for scale in (1.0, 0.42):
        cut = core.compute(
            pair.left,
            pair.right,
            lambda: 0,
            choice=Choice(matcher=MatcherName.SGBM, scale=scale, disparities=32),
        ).cut
        assert cut is not None
        assert sum(getattr(cut, name) for name in CutCounts.__slots__) == 320 * 160
