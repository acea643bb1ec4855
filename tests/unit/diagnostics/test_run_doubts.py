"""What a run says of its depth when the state changed: figures of the verdict, what has gone, who went away, what to type."""

from dataclasses import replace
from typing import Any

import pytest

from common.camera.base import CameraHealth, CameraState
from common.orientation import UPRIGHT, Flip, Orientation
from phone_host.accounts.link_account import Away
from phone_host.diagnostics.arrangement import ImageSource, mirrored_further, turned_further, with_final_options
from phone_host.diagnostics.codes import Code, diagnose
from phone_host.diagnostics.headline import Answer, Grade, headline
from phone_host.diagnostics.image_judge import ImageJudge, ImageTrust, history_lines, past_seconds
from phone_host.diagnostics.image_numbers import ImageEvidence
from phone_host.diagnostics.image_rules import ImageFigures, image_doubts
from phone_host.diagnostics.run_rules import concerns, depth_is_wrong
from phone_host.diagnostics.run_snapshot import RunSnapshot
from phone_host.model import Arrangement, Evidence, Side
from phone_host.report.run_json import build
from phone_host.report.run_page import doubtful_pairs, run_page
from phone_host.report.summary import summary
from tests.support.run_snapshots import run
from tests.unit.diagnostics.test_image_doubts import BLIND, GEOMETRY, GOOD, SWAPPED, evidence
from tests.unit.diagnostics.test_numbers import SERIES, SHORT

LOW = replace(BLIND, density=0.0)
TURN_90 = Orientation(90)


def judged(*found: Evidence, pairs_each: int = 5, seconds_each: float = 1.0) -> ImageTrust:
    """What a run's images say after these judgements, one in every five pairs and a second."""
    judge = ImageJudge()
    for number, item in enumerate(found):
        judge.add(item, at_s=number * seconds_each, pair=number * pairs_each)
    return ImageTrust(
        judged=judge.judged, wants_depth=True, has_depth=True, start=judge.start, now=judge.now,
        concerns=judge.concerns, newest=judge.newest, history=judge.history, geometry=GEOMETRY,
    )  # fmt: skip


def with_judged(*found: Evidence, ended: str = "seconds_over", pairs: int = 91) -> RunSnapshot:
    """A run of 91 pairs, every 30th saved, with these judgements."""
    return replace(run(pairs), images=judged(*found), ended=ended, save_every=30)


def test_the_figures_of_the_headline_are_those_of_the_pairs_that_it_speaks_of() -> None:
    """The camera was covered at first: 0 % is no figure of depth that looks right, and no median of both is either."""
    said = headline(with_judged(LOW, GOOD, GOOD, GOOD, ended="running"))
    assert (said.grade, said.sentence.split(";")[0]) == (
        Grade.GOOD, "Depth looks right: 90% of the pixels have depth, rows agree to 0.2 px",
    )  # fmt: skip
    assert judged(LOW, LOW, LOW, GOOD, GOOD).now.density == 0.9
    assert judged(GOOD, GOOD, GOOD, LOW, LOW).now.density == 0.0


def test_while_the_newest_pair_contradicts_the_others_depth_is_judged_again() -> None:
    """Neither right nor wrong is claimed of a run that goes on; the new doubt, or the old one that is gone, is named."""
    coming = headline(with_judged(GOOD, GOOD, LOW, ended="running"))
    assert coming == Answer(Grade.WARNING, "Depth is being judged again: the right camera sees no scene at all.")
    going = headline(with_judged(LOW, LOW, GOOD, ended="running"))
    assert going.grade is Grade.WARNING
    assert going.sentence.startswith("Depth is being judged again: the newest pair is free of this: the right camera")


def test_at_the_end_the_last_judgements_decide() -> None:
    """Two of three covered: wrong. One, the very last: right until then, which is no green either."""
    assert headline(with_judged(LOW, LOW, GOOD)).grade is Grade.BAD
    last = headline(with_judged(GOOD, GOOD, LOW))
    assert (last.grade, last.sentence.split(":")[0]) == (Grade.WARNING, "Depth looked right until the last judged pair")
    assert headline(with_judged(GOOD, GOOD, GOOD)).grade is Grade.GOOD


@pytest.mark.parametrize(
    "bad", [ImageFigures(density=0.9, vertical_px=5.9), ImageFigures(density=0.14), ImageFigures(density=0.9, consistency=0.2)]
)  # fmt: skip
def test_no_good_words_about_bad_figures(bad: ImageFigures) -> None:
    """Even if no doubt is handed over, rows off by 5.9 px or a density of 14 % are never called right."""
    good = with_judged(GOOD, GOOD)
    assert headline(replace(good, images=replace(good.images, now=bad))).grade is Grade.WARNING


def test_a_cover_that_was_taken_off_is_remembered() -> None:
    """It was seen from 2 s to 6 s, at pairs 10, 15, 20 and 25; twelve pairs between these were not judged."""
    covered = with_judged(GOOD, GOOD, LOW, LOW, LOW, LOW, GOOD, GOOD, GOOD)
    (past,) = covered.images.history
    assert (past.from_s, past.to_s, past.first_pair, past.last_pair, past.is_over) == (2.0, 6.0, 10, 25, True)
    said = headline(covered)
    assert said.grade is Grade.WARNING
    assert said.sentence.endswith("; but for 4.0 of 4.5 s it was not: the right camera sees no scene at all.")
    line = (
        "from 2.0 s to 6.0 s the right camera sees no scene at all: 4 judged pairs of 91 are wrong,"
        " 12 pairs between them not judged"
    )
    assert f"warning: {line}" in summary(covered)
    assert f"Warning: {line}." in run_page(covered, None, Side.LEFT, ())
    told: Any = build(covered)
    assert [(item["doubt"], item["sentence"]) for item in told["warnings"]] == [("covered", line)]
    assert not depth_is_wrong(covered)


def test_saved_pairs_of_a_bad_while_are_named_and_marked_on_the_page() -> None:
    """Of the saved pairs 0, 30, 60 and 90, number 30 was judged under the cover that was seen at pairs 25 to 40."""
    covered = with_judged(GOOD, GOOD, GOOD, GOOD, GOOD, LOW, LOW, LOW, LOW, GOOD, GOOD)
    assert "(saved: pair 30 wrong)" in summary(covered)
    saved = [f"pair-{number:06d}/cloud.ply" for number in (0, 30, 60)]
    page = run_page(covered, None, Side.LEFT, (), saved)
    assert page.count("wrong: the right camera sees no scene at all") == 1
    assert page.index("pair-000030/cloud.ply") < page.index("wrong: the right camera") < page.index("pair-000060")
    told: Any = build(covered)["trust"]
    assert told["doubts"] == []
    assert told["history"] == [
        {
            "doubt": "covered", "sentence": "the right camera sees no scene at all", "blocking": True,
            "remedy": "take off the lens cap, the shutter or the finger",
            "from_s": 5.0, "to_s": 9.0, "is_over": True, "first_pair": 25, "last_pair": 40,
            "judged_pairs": 4, "saved_pairs": [30], "saved_pairs_between": [],
        }
    ]  # fmt: skip


def test_only_a_judged_pair_is_called_wrong() -> None:
    """Of 31 saved pairs every fifth was judged, 10 and 15 as covered: 11 to 14 lie between, 6 to 9 and 16 to 19 are not accused."""
    covered = replace(with_judged(GOOD, GOOD, LOW, LOW, GOOD, GOOD, GOOD, pairs=31), save_every=1)
    marked = doubtful_pairs(covered)
    assert sorted(marked) == list(range(10, 16))
    assert [number for number, words in marked.items() if words.startswith("wrong: ")] == [10, 15]
    assert {marked[number] for number in range(11, 15)} == {
        "not judged, between pairs that are wrong: the right camera sees no scene at all"
    }
    told: Any = build(covered)["trust"]
    assert (told["history"][0]["saved_pairs"], told["history"][0]["saved_pairs_between"]) == (
        [10, 15],
        [11, 12, 13, 14],
    )


def test_a_pair_that_was_judged_sound_between_wrong_ones_is_neither() -> None:
    """Covered at pairs 5, 10, 20 and 25, free of it at 15: that one is not marked, and not counted as unjudged."""
    flicker = replace(with_judged(GOOD, LOW, LOW, GOOD, LOW, LOW, GOOD, GOOD, GOOD, pairs=41), save_every=5)
    marked = doubtful_pairs(flicker)
    assert {number: words.split(":")[0] for number, words in marked.items()} == dict.fromkeys((5, 10, 20, 25), "wrong")
    assert "4 judged pairs of 41 are wrong, 16 pairs between them not judged" in summary(flicker)


def test_a_cut_list_of_pairs_says_how_many_are_left_out() -> None:
    """Of 13 pairs 6 are named; the page's full stop follows no dots."""
    covered = replace(with_judged(GOOD, *[LOW] * 13, GOOD, GOOD, GOOD, pairs=81), save_every=5)
    assert "(saved: pairs 5, 10, 15, 20, 25, 30 and 7 more wrong)." in run_page(covered, None, Side.LEFT, ())
    assert "..." not in summary(covered)


def test_a_single_judgement_is_not_remembered_and_one_that_stands_is_not_past() -> None:
    """A camera's first image may be dark. What stands is in the history too, but is told as a doubt, not as the past."""
    assert judged(LOW, GOOD, GOOD, GOOD).history == ()
    standing = judged(GOOD, LOW, LOW)
    assert [item.is_over for item in standing.history] == [False]
    assert history_lines(standing.history, 15, 1) == []
    back = judged(GOOD, LOW, LOW, GOOD, LOW, LOW, GOOD, GOOD, GOOD)
    assert [(item.from_s, item.to_s) for item in back.history] == [(1.0, 6.0)]  # it never ceased to stand


def test_two_doubts_at_once_count_their_seconds_once() -> None:
    """Swapped from 1 to 5 s and covered from 3 to 8 s are seven seconds."""
    swapped, covered = image_doubts(SWAPPED)[0], image_doubts(BLIND)[0]
    (one,) = judged(GOOD, SWAPPED, SWAPPED, SWAPPED, SWAPPED, GOOD, GOOD).history
    overlap = (
        replace(one, concern=swapped, from_s=1.0, to_s=5.0),
        replace(one, concern=covered, from_s=3.0, to_s=8.0),
    )
    assert past_seconds(overlap) == pytest.approx(7.0)
    assert past_seconds((replace(one, is_over=False),)) == 0.0


def test_a_rejected_rig_is_doubted_but_does_not_block() -> None:
    """Its figures may look fine; the headline names the rig, in the report too."""
    used = replace(with_judged(GOOD, GOOD, GOOD), rig_rejected=True)
    said = headline(used)
    assert said.grade is Grade.WARNING
    assert said.sentence.startswith("Depth may be wrong: the calibration itself was rejected")
    assert [concern.code for concern in concerns(used)] == [Code.REJECTED_RIG]
    assert not depth_is_wrong(used)
    for text in (summary(used), run_page(used, None, Side.LEFT, ())):
        assert "rejected" in text


def test_what_was_not_used_makes_no_depth_doubtful_unless_somebody_lies() -> None:
    """Spoiled images are told with the doubts, and the depth of the others is right. Stamps from the future are no accident."""
    spoiled = replace(with_judged(GOOD, GOOD), spoiled_images=(("truncated", 2),))
    assert [concern.code for concern in concerns(spoiled)] == [Code.SPOILED_IMAGES]
    assert headline(spoiled).sentence.startswith("Depth looks right")
    lying = replace(with_judged(GOOD, GOOD), own_future=2)
    assert headline(lying).sentence.startswith("Depth may be wrong: 2 of")


def test_rows_that_no_matcher_can_bridge_are_wrong_and_fail_the_run() -> None:
    """12 px and 17 % of depth: `is wrong`, and the exit code says the same; 12 px and dense depth: `may be wrong`."""
    off = replace(evidence(), vertical_px=12.0, density=0.17)
    said = headline(with_judged(off, off, off))
    assert said.grade is Grade.BAD
    assert said.sentence.startswith("Depth is wrong: the rows of the two images do not agree by 12.0 px")
    assert depth_is_wrong(with_judged(off, off, off))
    dense = replace(off, density=0.8)
    assert headline(with_judged(dense, dense, dense)).grade is Grade.WARNING
    assert not depth_is_wrong(with_judged(dense, dense, dense))


def test_judgements_that_are_doubtful_for_unlike_reasons_do_not_cancel_out() -> None:
    """One sparse, one with rows apart: neither holds in most, yet none was clean. The newest one's reason stands, in headline and report."""
    off = replace(evidence(), vertical_px=12.0, density=0.17)
    mixed = with_judged(replace(evidence(), density=0.1), off)
    assert [concern.code for concern in concerns(mixed)] == [Code.VERTICAL_ERROR]
    assert headline(mixed).grade is Grade.BAD
    assert concerns(with_judged(off, GOOD)) == ()


def test_pairs_of_different_images_are_wrong_and_fail_the_run() -> None:
    """All 35 pairs are of different images; two films of different length are blamed, and not exchanged cameras."""
    apart = replace(with_judged(GOOD, GOOD), replayed=ImageEvidence(board=SERIES, own=SERIES, pairs=35, apart=35))
    assert headline(apart).sentence.startswith("Depth is wrong: 35 of 35 pairs are of different images")
    assert depth_is_wrong(apart)
    films = replace(with_judged(SWAPPED, SWAPPED), replayed=ImageEvidence(board=SERIES, own=SHORT, pairs=5))
    assert "drift apart" in headline(films).sentence
    assert depth_is_wrong(films)
    assert "exchanged" not in summary(films)
    past = replace(films, images=judged(GOOD, SWAPPED, SWAPPED, SWAPPED, GOOD, GOOD))
    assert "exchanged" not in summary(past)
    assert "films of different length drift apart: 3 judged pairs of 91 are wrong" in summary(past)


def test_a_run_without_pairs_has_no_doubt_about_its_rig() -> None:
    """No board ever came: that is the reason, and starting one is the remedy. It is no success."""
    none = replace(run(0), images=ImageTrust(wants_depth=True))
    assert concerns(none) == ()
    assert headline(none).sentence == "No pair was processed: no board came. Remedy: start board-agent on the board."
    assert "--calibration" not in summary(none)
    assert depth_is_wrong(none)


@pytest.mark.parametrize(
    ("ended", "words"),
    [("stream_ended", "the stream ended"), ("seconds_over", "the time was over"), ("stopped", ""), ("running", "")],
)
def test_a_stream_that_ends_early_is_told_unless_a_person_stopped_it(ended: str, words: str) -> None:
    """5 of 50 pairs, in the summary, the page and the report."""
    short = replace(run(5), asked_pairs=50, ended=ended)
    told = f"only 5 of 50 pairs came before {words}" if words else ""
    assert short.shortfall == told
    assert ("warning: only" in summary(short)) == bool(words)
    assert build(short)["shortfall"] == (told or None)
    assert (f"Warning: {told}." in run_page(short, None, Side.LEFT, ())) == bool(words)


def test_a_board_that_stays_away_is_the_headline_and_what_it_gave_until_then() -> None:
    """Green would be of the first 3 s only. A board that came back, or whose stream ended, is none of this."""
    away = replace(with_judged(GOOD, GOOD), away=(Away(3.0, 7.0, is_over=False),))
    said = headline(away)
    assert said.grade is Grade.WARNING
    assert said.sentence.startswith(
        "The board went away at 3 s and did not come back: there is no newer depth. Remedy:"
    )
    assert "Until then: depth looks right: 90%" in said.sentence
    assert not depth_is_wrong(away)
    assert headline(replace(away, away=(Away(3.0, 7.0, is_over=True),))).grade is Grade.GOOD
    assert headline(replace(away, ended="stream_ended")).grade is Grade.GOOD
    assert "has not come back" in headline(replace(away, ended="running")).sentence
    wrong = replace(away, images=judged(SWAPPED, SWAPPED))
    assert headline(wrong).sentence.startswith("Depth is wrong: left and right are exchanged")


def test_a_camera_of_this_machine_that_stays_away_is_told_with_a_remedy() -> None:
    """It failed 12 times and is gone; a camera that failed and is back is none of this."""
    gone = replace(with_judged(GOOD, GOOD), camera=CameraHealth(CameraState.GONE, failures=12), last_s=5.2)
    said = headline(gone)
    assert said.grade is Grade.WARNING
    assert said.sentence.startswith("This machine's camera went away at about 5 s and did not come back")
    assert "check its power" in summary(gone)
    back = replace(gone, camera=CameraHealth(CameraState.RUNNING, failures=12, returned=1))
    assert headline(back).grade is Grade.GOOD


def test_turns_and_mirrorings_add_up_behind_a_mirroring() -> None:
    """Flipped after its turn: a quarter more of the image is a quarter less of the camera; mirrored twice is not mirrored."""
    assert turned_further(TURN_90, 180) == Orientation(270)
    assert turned_further(Orientation(90, Flip.H), 90) == Orientation(0, Flip.H)
    assert turned_further(Orientation(90, Flip.H), 180) == Orientation(270, Flip.H)
    assert mirrored_further(Orientation(90, Flip.H)) == TURN_90
    assert mirrored_further(Orientation(90)) == Orientation(90, Flip.H)
    assert mirrored_further(Orientation(90, Flip.V)) == Orientation(270)


def remedy(found: Evidence, *present: Orientation, source: ImageSource = ImageSource.CAMERAS) -> str:
    """What is to be done about the first doubt of a pair."""
    return with_final_options(image_doubts(found)[0], present, source).remedy


def test_a_remedy_names_the_final_option() -> None:
    """The right camera was given rotate=90 where 270 is right: it looks turned by half, and rotate=180 would lead nowhere."""
    on_head = evidence(right=3, tilted=5, turned=90)
    assert remedy(on_head, UPRIGHT, TURN_90) == (
        "mount the wrong camera upright, or give the right camera rotate=270 in place of rotate=90,"
        " or else the left camera rotate=180"
    )
    assert remedy(on_head, UPRIGHT, UPRIGHT) == "mount it upright, or give that camera rotate=180"
    assert "the right camera neither rotate= nor flip= in place of rotate=180" in remedy(
        on_head, UPRIGHT, Orientation(180)
    )
    files = remedy(on_head, UPRIGHT, TURN_90, source=ImageSource.FILES)
    assert "give --rotate-right 270 in place of --rotate-right 90, or else --rotate-left 180" in files
    assert remedy(on_head, UPRIGHT, UPRIGHT, source=ImageSource.FILES) == remedy(on_head, UPRIGHT, UPRIGHT)
    both = evidence(right=20, swapped=100, both_mirrored=150)
    assert "the left camera flip=h and the right camera flip=h" not in remedy(both, UPRIGHT, UPRIGHT)
    assert "the right camera rotate=90&flip=h in place of rotate=90 and the left camera flip=h" in remedy(
        both, UPRIGHT, TURN_90
    )
    snapshot = replace(with_judged(on_head, on_head), orientations=(UPRIGHT, TURN_90))
    assert "rotate=270 in place of rotate=90" in summary(snapshot)


def test_a_quarter_is_named_with_its_direction() -> None:
    """The right image lies a quarter clockwise of the left one: turn it on by three, or the left one by one."""
    lying = evidence(right=3, tilted=5, turned_by_quarter=90)
    known = replace(
        lying,
        supports=tuple(
            replace(item, quarters=1) if item.arrangement is Arrangement.TURNED_BY_QUARTER else item
            for item in lying.supports
        ),
    )
    assert remedy(known, UPRIGHT, UPRIGHT) == (
        "mount the wrong camera upright, or give the left camera rotate=90, or else the right camera rotate=270"
    )
    assert "rotate=90 or rotate=270" in remedy(lying, UPRIGHT, UPRIGHT)
    other = diagnose(Code.COVERED, "c", "r")
    assert with_final_options(other, (UPRIGHT, TURN_90)) is other
