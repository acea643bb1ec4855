"""What is concluded from the evidence: which doubts, when they stand, and the headline that follows."""

import argparse
import math
import re
from dataclasses import replace
from typing import Any, Final

import pytest

from common.program.request import add_options
from phone_host.diagnostics.arrangement import EXCHANGE, ImageSource, tries_of
from phone_host.diagnostics.codes import BLOCKING, Code, diagnose
from phone_host.diagnostics.headline import Grade, answer, depth_error_m, headline
from phone_host.diagnostics.image_judge import ImageJudge, ImageTrust
from phone_host.diagnostics.image_rules import ImageFigures, image_doubts, median_figures
from phone_host.diagnostics.run_rules import concerns, depth_is_wrong
from phone_host.diagnostics.run_snapshot import RunSnapshot
from phone_host.jobs.options import ImageOptions
from phone_host.model import (
    Arrangement,
    CutCounts,
    DepthAccount,
    DepthLimits,
    Evidence,
    Exposure,
    OffMiddle,
    StereoGeometry,
    Support,
)
from phone_host.report.run_json import build
from phone_host.report.summary import summary
from tests.support.run_snapshots import run

SHARP: Final = Exposure(mean_level=110, bright_level=200, structure=30, blur_px=1.0, features=400)
GEOMETRY: Final = StereoGeometry(focal_px=500, baseline_m=0.1, cx_px=320, cy_px=240)


def evidence(**counts: int) -> Evidence:
    """A good pair whose features agree with the named arrangements; 200 with the right one unless told."""
    found = {"right": 200, "tilted": 200} | counts
    supports = tuple(Support(kind, found.get(kind.value, 0)) for kind in Arrangement)
    return Evidence(
        left=SHARP, right=SHARP, density=0.9, consistency=0.9, vertical_px=0.2, vertical_offset_px=0.1,
        supports=supports, disparity_px=25.0,
    )  # fmt: skip


def doubts(found: Evidence) -> list[str]:
    """What is doubtful about it."""
    return [concern.code for concern in image_doubts(found)]


COVERED: Final = Exposure(mean_level=3, bright_level=5, structure=0.3, blur_px=math.nan)
GOOD: Final = evidence()
SWAPPED: Final = replace(evidence(right=0, swapped=150, both_turned=150, both_mirrored=150), density=0.05)
PLAIN: Final = replace(
    evidence(right=2, tilted=3), left=replace(SHARP, structure=2.8), right=replace(SHARP, structure=2.7), density=0.05
)
FOREIGN: Final = OffMiddle(cx_px=602.0, cy_px=183.0, width_px=741, height_px=500)
BLIND: Final = replace(evidence(right=0, tilted=0), right=COVERED)


@pytest.mark.parametrize(
    ("found", "named"),
    [
        (GOOD, []),
        (SWAPPED, [Code.SWAPPED]),
        (evidence(right=60, swapped=119), []),  # less than twice as many
        (evidence(right=60, swapped=120), [Code.SWAPPED]),
        (evidence(right=0, tilted=4, swapped=11), []),  # too few to name anything
        (evidence(right=20, swapped=100, both_turned=150), [Code.TURNED]),
        (evidence(right=20, swapped=100, both_mirrored=150), [Code.MIRRORED]),
        (evidence(right=0, both_turned_by_quarter=150), [Code.TURNED_BY_QUARTER]),
        (evidence(right=3, tilted=5, turned=90), [Code.TURNED]),
        (evidence(right=3, tilted=5, turned_by_quarter=90), [Code.TURNED_BY_QUARTER]),
        (evidence(right=3, tilted=5, mirrored=90), [Code.MIRRORED]),
        (replace(evidence(right=0, tilted=5, mirrored=90), ambiguous_share=0.9), [Code.AMBIGUOUS]),  # a regular pattern
        (replace(evidence(right=0, tilted=5, mirrored=90), ambiguous_share=0.5), [Code.MIRRORED]),
        (replace(SWAPPED, ambiguous_share=math.nan), [Code.SWAPPED]),
        (replace(GOOD, ambiguous_share=0.78), [Code.AMBIGUOUS]),
        (replace(GOOD, ambiguous_share=0.61), []),
        (replace(GOOD, beyond_share=0.06, enough_disparities=80, density=0.1), [Code.SEARCH_TOO_SHORT]),
        (replace(GOOD, beyond_share=0.04), []),
        (replace(GOOD, skew_px=0.95), [Code.VERTICAL_ERROR]),
        (replace(GOOD, skew_px=0.7), []),
        (evidence(mirrored=90), []),  # a chessboard looks like its mirror image
        (evidence(same_place=160), [Code.SAME_IMAGE]),
        (evidence(same_place=140), []),  # a street whose far end does not move
        (BLIND, [Code.COVERED]),
        (replace(GOOD, right=replace(SHARP, mean_level=10, bright_level=20)), [Code.DARK]),
        (replace(GOOD, right=replace(SHARP, blur_px=2.5)), [Code.UNFOCUSED]),
        (replace(GOOD, left=replace(SHARP, blur_px=1.6), right=replace(SHARP, blur_px=0.8)), [Code.UNFOCUSED]),
        (replace(GOOD, left=replace(SHARP, blur_px=1.4), right=replace(SHARP, blur_px=0.7)), []),
        (replace(evidence(right=2, tilted=3), density=0.05), [Code.OTHER_SCENE]),
        (replace(evidence(right=2, tilted=3), density=0.5), []),  # the matcher finds what features do not
        (PLAIN, [Code.NO_TEXTURE]),  # two pictures of one bare wall
        (replace(PLAIN, left=SHARP), [Code.OTHER_SCENE]),  # a wall and something else
        (replace(PLAIN, density=0.5), []),  # its grain is enough for the matcher
        (replace(PLAIN, supports=GOOD.supports), [Code.LOW_DENSITY]),  # some things before it
        (replace(GOOD, density=0.1), [Code.LOW_DENSITY]),
        (replace(GOOD, consistency=0.2), [Code.LOW_CONSISTENCY]),
        (replace(GOOD, vertical_px=2.1), [Code.VERTICAL_ERROR]),
        (replace(GOOD, vertical_px=4.2, matched_scale=0.22), []),  # 48 megapixels: 0.9 px where they are matched
        (replace(GOOD, vertical_px=9.5, matched_scale=0.22), [Code.VERTICAL_ERROR]),
        (replace(evidence(), is_cropped=True), [Code.CROPPED_RIG]),
        (replace(GOOD, behind_share=0.1), [Code.GEOMETRY]),
        (replace(GOOD, behind_share=0.1, off_middle=FOREIGN), [Code.GEOMETRY]),
        (replace(BLIND, off_middle=FOREIGN), [Code.COVERED, Code.GEOMETRY]),  # what blocks comes first
        (evidence(right=50), [Code.VERTICAL_ERROR]),  # most features are on tilted rows
    ],
)  # fmt: skip
def test_a_doubt_needs_clear_evidence(found: Evidence, named: list[Code]) -> None:
    """Exactly the named doubts follow; each has a sentence and a remedy without NaN."""
    assert doubts(found) == named
    assert all(concern.message and concern.remedy and "nan" not in concern.message for concern in image_doubts(found))


@pytest.mark.parametrize(
    ("found", "words"),
    [
        (SWAPPED, "swap LEFT and RIGHT;"),
        (evidence(right=3, tilted=5, turned=90), "--rotate-left 180 or --rotate-right 180"),
        (evidence(right=3, tilted=5, turned_by_quarter=90), "with 90 or 270"),
        (evidence(right=20, swapped=100, both_turned=150), "--rotate-left 180 --rotate-right 180"),
        (evidence(right=20, swapped=100, both_mirrored=150), "--flip-left h --flip-right h"),
        (evidence(right=0, both_turned_by_quarter=150), "both with 90 or both with 270"),
        (evidence(right=3, tilted=5, mirrored=90), "v if top and bottom are"),
        (evidence(same_place=160), "give the images of two cameras"),
    ],
)
def test_remedies_for_files_name_what_stereo_takes(found: Evidence, words: str) -> None:
    """No option of a camera's address, no --board-side; every option that is named is one of `stereo`, and so is each try."""
    [concern] = image_doubts(found, ImageSource.FILES)
    assert words in concern.remedy
    assert not re.search(r"rotate=|flip=|board-side|camera's app", concern.remedy)
    parser = argparse.ArgumentParser()
    add_options(parser, ImageOptions)
    for given in tries_of(concern.remedy):
        if given != (EXCHANGE,):
            parser.parse_args(given)  # ends the test if it takes them not
    assert set(re.findall(r"--[a-z-]+", concern.remedy)) <= set(re.findall(r"--[a-z-]+", parser.format_help()))
    assert tries_of(image_doubts(found)[0].remedy) == ()


def test_both_cameras_are_named_together() -> None:
    """One covered camera is named by its side, two together."""
    assert "the right camera sees" in image_doubts(BLIND)[0].message
    assert "both cameras see" in image_doubts(replace(BLIND, left=COVERED))[0].message
    dark = replace(SHARP, mean_level=10.0, bright_level=20.0)
    assert "both cameras see" in image_doubts(replace(GOOD, left=dark, right=dark))[0].message


def test_a_doubt_stands_while_most_of_the_latest_three_judgements_have_it() -> None:
    """One judgement of three is not enough, two are; it goes when two of three are free of it."""
    judge = ImageJudge()
    stands: list[list[str]] = []
    for number, found in enumerate((GOOD, SWAPPED, GOOD, SWAPPED, SWAPPED, GOOD, GOOD)):
        judge.add(found, at_s=number / 2, pair=number)
        stands.append([concern.code for concern in judge.concerns])
    named = [Code.SWAPPED]
    assert stands == [[], [], [], named, named, named, []]


def test_a_run_of_one_pair_is_judged_by_it() -> None:
    """The only judgement is most of them."""
    judge = ImageJudge()
    assert judge.judged == 0
    judge.add(SWAPPED, at_s=0.0, pair=0)
    assert [concern.code for concern in judge.concerns] == [Code.SWAPPED]
    assert judge.judged == 1


def test_figures_move_from_the_start_to_now() -> None:
    """The first ten and the latest three judgements have medians of their own; what was not measured is left out."""
    judge = ImageJudge()
    for number in range(30):
        found = replace(GOOD, vertical_px=0.05 * number, consistency=math.nan)
        judge.add(found, at_s=number / 2, pair=number)
    assert judge.start.vertical_px == pytest.approx(0.225)
    assert judge.now.vertical_px == pytest.approx(1.4)
    assert math.isnan(judge.now.consistency)


def with_images(**values: Any) -> RunSnapshot:
    """A run of 30 pairs with a rig, as its images say."""
    images = ImageTrust(judged=3, wants_depth=True, has_depth=True, geometry=GEOMETRY, now=median_figures([GOOD]))
    return replace(run(30), images=replace(images, **values))


def test_the_headline_of_a_good_run_says_how_far_to_trust_it() -> None:
    """Depth is wrong by z^2 * e / (f b): (2 m)^2 * 0.25 px / 50 px m = 20 mm."""
    said = headline(with_images())
    assert said.grade is Grade.GOOD
    assert said.sentence == (
        "Depth looks right: 90% of the pixels have depth, rows agree to 0.2 px;"
        " at 2 m, the middle of the scene, it is good to about 20 mm."
    )
    assert depth_error_m(GEOMETRY, 2.0, 0.25) == pytest.approx(0.02)
    assert summary(with_images()).startswith(said.sentence)


def test_depth_that_is_right_but_old_is_no_good_news() -> None:
    """Results that lag behind a moving scene by a twentieth of its width make the headline a warning that says so, wherever it is shown."""
    fast = replace(with_images(), motion_px_s=5000.0, width_px=640, stamps_exact=True)
    lag = next(concern for concern in concerns(fast) if concern.code == Code.AGE)
    said = headline(fast)
    assert said.grade is Grade.WARNING
    assert said.sentence == f"{headline(with_images()).sentence} But {lag.message}."


def test_a_far_scene_is_answered_for_at_its_own_depth() -> None:
    """At 5 px the scene is 10 m away: 100 * 0.5 / 50 = 1 m of error with the core's own half pixel; without geometry there are no metres."""
    far = ImageFigures(density=0.9, disparity_px=5.0)
    assert "at 10 m, the middle of the scene, it is good to about 1 m" in answer(far, (), GEOMETRY, 0.5).sentence
    assert "in pixels only" in answer(far, (), None).sentence
    assert "was judged" in answer(ImageFigures(), (), None).sentence
    assert (
        "of the pixels inside the crop have depth" in answer(far, (), None, cut=CutCounts(kept=1, outside=1)).sentence
    )


def test_a_blocking_doubt_is_the_headline() -> None:
    """The gravest doubt comes first, before timing, with its remedy; a warning says `may`."""
    swapped = with_images(concerns=image_doubts(SWAPPED))
    said = headline(swapped)
    assert said.grade is Grade.BAD
    assert said.sentence.startswith("Depth is wrong: left and right are exchanged")
    assert "swap LEFT and RIGHT" in said.sentence
    fast = replace(swapped, motion_px_s=1e6, width_px=640)
    assert concerns(fast)[0].code == Code.SWAPPED
    assert len(concerns(fast)) > 1
    unsharp = headline(with_images(concerns=image_doubts(replace(GOOD, right=replace(SHARP, blur_px=2.5)))))
    assert (unsharp.grade, unsharp.sentence.split(":")[0]) == (Grade.WARNING, "Depth may be wrong")


def test_a_run_that_wanted_depth_and_found_none_has_a_doubt() -> None:
    """At the end only, and only if no graver doubt says why; without a rig nothing is wanted."""
    none = with_images(has_depth=False)
    assert [concern.code for concern in concerns(none)] == [Code.NO_DEPTH]
    assert depth_is_wrong(none)
    assert not depth_is_wrong(with_images())
    assert concerns(replace(none, ended="running")) == ()
    assert [concern.code for concern in concerns(with_images(has_depth=False, concerns=image_doubts(SWAPPED)))] == [
        Code.SWAPPED
    ]
    assert concerns(with_images(has_depth=False, wants_depth=False)) == ()


GIVEN = DepthLimits(near_m=0.3, far_m=0.002, disparity_error_px=0.25, from_rig=False)
OF_RIG = DepthLimits(near_m=0.3, far_m=38.0, disparity_error_px=0.25, from_rig=True)


@pytest.mark.parametrize(
    ("cut", "limits", "sentence", "remedy"),
    [
        (CutCounts(unmatched=60, too_far=40), GIVEN, "all points lie farther than --far 2 mm", "larger --far"),
        (CutCounts(too_far=60, too_near=40), GIVEN, "most points lie farther than --far 2 mm", "larger --far"),
        (CutCounts(too_far=100), OF_RIG, "all points lie farther than 38 m", "farther apart"),
        (CutCounts(too_near=100, outside=900), OF_RIG, "all points lie nearer than --near 300 mm", "smaller --near"),
        (CutCounts(at_zero=90, too_far=10), OF_RIG, "too far to measure", "farther apart"),
        (CutCounts(unmatched=90, too_far=10), OF_RIG, "no pair has depth", "--calibration or --rectified fits"),
    ],
)
def test_what_became_of_the_pixels_says_why_there_is_no_depth(
    cut: CutCounts, limits: DepthLimits, sentence: str, remedy: str
) -> None:
    """The limit that cut the points is named with its option, and the remedy is to move it; where hardly anything was matched, images and calibration do not fit."""
    none = replace(with_images(has_depth=False), depth=DepthAccount(cut=cut, limits=limits))
    [concern] = concerns(none)
    assert concern.code == Code.NO_DEPTH
    assert sentence in concern.message
    assert remedy in concern.remedy


def test_a_run_without_a_rig_is_answered_about_delays() -> None:
    """It measured delays only and says so; a covered camera is told all the same; no pairs are no success."""
    plain = run(30)
    assert headline(plain).sentence.startswith("This run measured pairs and delays only")
    covered = replace(plain, images=ImageTrust(concerns=image_doubts(replace(BLIND, supports=()))))
    assert headline(covered).grade is Grade.WARNING
    assert not depth_is_wrong(covered)
    assert headline(covered).sentence.startswith("The right camera sees no scene")
    fast = replace(plain, motion_px_s=1e6, width_px=640)
    assert headline(fast).grade is Grade.WARNING
    assert headline(run(0)).grade is Grade.BAD
    assert "whole images" in headline(replace(run(0), spoiled_images=(("too_large", 3),))).sentence


def test_the_report_holds_the_answer_and_every_doubt() -> None:
    """The block `trust` of report.json: grade, headline, doubts with sentence, remedy and whether they block, figures at first and now."""
    told: Any = build(with_images(concerns=image_doubts(SWAPPED)))["trust"]
    assert told["grade"] == "bad"
    assert told["doubts"][0]["doubt"] == "swapped"
    assert told["doubts"][0]["blocking"] is True
    assert told["doubts"][0]["remedy"]
    assert told["now"] == {
        "density": 0.9,
        "consistency": 0.9,
        "scattered": None,
        "vertical_error_px": 0.2,
        "vertical_offset_px": 0.1,
    }
    assert told["at_first"]["density"] is None


def test_which_doubts_block() -> None:
    """Timing, dark, unfocused and low figures warn; what makes depth impossible blocks."""
    assert {
        "swapped", "turned", "turned_by_quarter", "mirrored", "same_image", "other_scene", "covered", "no_depth",
        "no_whole_image", "images_apart",
    } == BLOCKING  # fmt: skip
    assert all(diagnose(code, "", "").is_failure is (code in BLOCKING) for code in Code)


def test_depth_with_specks_is_not_called_right_without_reserve() -> None:
    """Boards before bare walls: 43 % of the depth is confirmed; no doubt stands, but the first line says where to trust it."""
    said = answer(ImageFigures(density=0.28, consistency=0.43, vertical_px=0.2, disparity_px=50.0), (), GEOMETRY)
    assert said.grade is Grade.GOOD
    assert said.sentence.startswith("Depth looks right where the scene has texture, specks elsewhere: 28%")
    assert "43% are confirmed" in said.sentence
    strewn = ImageFigures(density=0.37, consistency=0.68, vertical_px=0.3, disparity_px=50.0, scattered_share=0.21)
    assert (
        "specks elsewhere: 37% of the pixels have depth, 21% of it in specks" in answer(strewn, (), GEOMETRY).sentence
    )
    assert "specks" not in answer(ImageFigures(density=0.7, consistency=0.8, vertical_px=0.2), (), GEOMETRY).sentence
