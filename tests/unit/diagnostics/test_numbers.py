"""Two replays whose images cannot belong together are doubted in words; two of one series never are."""

from dataclasses import replace

import pytest

from common.camera.image_numbers import ImageNumbers
from phone_host.diagnostics.codes import Code, Misplaced, diagnose
from phone_host.diagnostics.image_numbers import FilmWatch, ImageEvidence, number_concerns, pairing_words, with_cause
from phone_host.model import Arrangement
from phone_host.sync.stills import PairedBy, WhyOrder

SERIES = ImageNumbers(count=16, first=3, last=18)
LATER = ImageNumbers(count=16, first=4, last=19)
SHORT = ImageNumbers(count=10)


def said(evidence: ImageEvidence) -> str:
    """The one doubt's sentence; empty if there is none."""
    found = number_concerns(evidence)
    of_numbers = {Code.IMAGE_NUMBERS, Code.IMAGES_APART}
    assert all(concern.code in of_numbers and concern.remedy for concern in found)
    return "".join(concern.message for concern in found)


def test_one_series_is_not_doubted() -> None:
    """Equal folders are fine however they are paired, and so is everything where one side is a real camera, or no pair has come."""
    for by in PairedBy:
        assert not said(ImageEvidence(paired_by=by, board=SERIES, own=SERIES, pairs=5))
        assert not said(ImageEvidence(paired_by=by, board=SERIES, own=None, pairs=5))
        assert not said(ImageEvidence(paired_by=by, board=None, own=SHORT, pairs=5))
        assert not said(ImageEvidence(paired_by=by, board=SERIES, own=SHORT, pairs=0))


def test_other_numbers_are_a_doubt_from_the_first_pair_on() -> None:
    """Folders that begin at different numbers are named with their numbers, before any image lacks its partner."""
    first = ImageEvidence(paired_by=PairedBy.NUMBER, board=SERIES, own=LATER, pairs=1)
    assert said(first) == "the board shows 16 images, 3 to 18, this machine 16 images, 4 to 19"
    alone = replace(first, board_alone=1, own_alone=7, board_numbers=(3,), own_numbers=(19, 20, 21, 22, 23))
    assert said(alone).startswith(
        "image 3 of the board and 7 images of this machine (19, 20, 21, 22, 23, ...) have no partner of the same number: the board"
    )


def test_times_that_begin_differently_are_a_doubt_before_any_image_lacks_its_partner() -> None:
    """The words leave times out, so that they say in what the folders differ."""
    board = ImageNumbers(count=9, first=1403636579763555584, last=1403636580163555584)
    other = replace(board, first=1403636579813555456)
    first = ImageEvidence(paired_by=PairedBy.NUMBER, board=board, own=other, pairs=1)
    assert said(first) == "the board shows 9 images, this machine 9 images, the first or last ones of other times"


def test_a_number_that_only_one_side_has_is_a_doubt() -> None:
    """Even if both begin and end alike; the pairs are of one number each, so their depth is not doubted."""
    alike = ImageEvidence(paired_by=PairedBy.NUMBER, board=SERIES, own=SERIES, pairs=3, own_alone=1)
    assert "1 image of this machine has no partner" in said(alike)
    assert all(concern.is_note for concern in number_concerns(alike))


def test_different_counts_are_a_doubt_where_order_or_time_pairs() -> None:
    """Paired in their order, a missing image shifts the rest; two looped films of different length drift apart."""
    for by, words in ((PairedBy.ORDER, "paired in their order"), (PairedBy.TIME, "drift apart")):
        assert words in said(ImageEvidence(paired_by=by, board=SERIES, own=SHORT, pairs=1))


@pytest.mark.parametrize("why", [WhyOrder.OTHER, WhyOrder.LATE])
def test_numbers_that_say_nothing_of_the_pairs_are_a_doubt_even_of_equal_counts(why: WhyOrder) -> None:
    """Both sides are numbered, but the order pairs: the headline must doubt the depth from the first pair on."""
    evidence = ImageEvidence(paired_by=PairedBy.ORDER, why_order=why, board=SERIES, own=SERIES, pairs=1)
    (concern,) = number_concerns(evidence)
    assert "paired in their order" in concern.message
    assert concern.code == Code.IMAGE_NUMBERS
    assert not concern.is_note


def test_a_board_that_does_not_tell_its_numbers_is_named_where_counts_differ() -> None:
    """This machine's names are numbered and the board, maybe an older one, tells only how many it has."""
    evidence = ImageEvidence(paired_by=PairedBy.ORDER, why_order=WhyOrder.UNKNOWN, board=SHORT, own=SERIES, pairs=1)
    assert "update board-agent" in number_concerns(evidence)[0].remedy
    assert "update" not in number_concerns(replace(evidence, own=replace(SHORT, count=9)))[0].remedy


def test_the_words_say_what_paired_the_stills() -> None:
    """By numbers, by order with its reason; nothing of films and live cameras."""
    stills = ImageEvidence(paired_by=PairedBy.NUMBER, board=SERIES, own=SERIES)
    assert pairing_words(stills) == "stills, paired by the numbers in their names"
    said_of = {pairing_words(replace(stills, paired_by=PairedBy.ORDER, why_order=why)) for why in WhyOrder}
    assert len(said_of) == len(WhyOrder)
    assert all(words.startswith("stills, paired in their order: ") for words in said_of)
    assert not pairing_words(replace(stills, paired_by=PairedBy.TIME))
    assert not pairing_words(replace(stills, board=None))


def test_films_that_run_once_and_began_apart_are_a_doubt() -> None:
    """The host's film was 10 images ahead: all pairs are of different images, and the first one is named."""
    watch = FilmWatch()
    watch.begin(SERIES, SERIES, by_time=True)
    for number in range(5):
        watch.pair(number, number + 10)
    assert (watch.pairs, watch.apart, watch.first_apart) == (5, 5, (0, 10))
    evidence = ImageEvidence(board=SERIES, own=SERIES, pairs=5, apart=watch.apart, first_apart=watch.first_apart)
    assert "5 of 5 pairs are of different images: first of image 0 of the board and image 10 of this machine" in said(
        evidence
    )


def test_where_the_place_in_a_film_is_not_known_nothing_is_compared() -> None:
    """Loops, labels, live cameras, and a board that leaves images out say nothing about the place."""
    looped = replace(SERIES, looped=True)
    for board, own, by_time in (
        (looped, looped, True),
        (SERIES, SERIES, False),
        (None, SERIES, True),
        (SERIES, None, True),
    ):
        watch = FilmWatch()
        watch.begin(board, own, by_time=by_time)
        watch.pair(0, 10)
        assert watch.apart == 0
    watch = FilmWatch()
    watch.begin(SERIES, SERIES, by_time=True)
    watch.lowered()
    watch.pair(0, 10)
    assert watch.apart == 0


def test_most_pairs_apart_make_depth_impossible_a_few_make_it_doubtful() -> None:
    """18 of 35 pairs of different images block, 17 of 35 warn."""
    for apart, doubt in ((18, Code.IMAGES_APART), (17, Code.IMAGE_NUMBERS)):
        evidence = ImageEvidence(board=SERIES, own=SERIES, pairs=35, apart=apart)
        assert [concern.code for concern in number_concerns(evidence)] == [doubt]


def test_films_of_different_rate_drift_apart_unless_they_last_equally_long() -> None:
    """16 images at 5 /s last 3.2 s and at 8 /s 2 s; 16 at 5 /s last as long as 32 at 10 /s, whatever their numbers."""
    slow, fast, faster = 200_000_000, 125_000_000, 100_000_000
    same = ImageEvidence(board=SERIES, own=SERIES, pairs=1, board_period_ns=slow, own_period_ns=fast)
    assert "at 5 /s, this machine 16 images, 3 to 18 at 8 /s: films of different rate drift apart" in said(same)
    long = ImageNumbers(count=32)
    assert not said(replace(same, own=long, own_period_ns=faster))
    assert "different length" in said(replace(same, own=long, own_period_ns=slow))


def test_films_that_drift_apart_are_blamed_and_not_the_cameras() -> None:
    """What pairs of two moments look like is left out, and the cause blocks in its place; images paired by number are believed."""
    swapped, covered = diagnose(Code.SWAPPED, "s", "r"), diagnose(Code.COVERED, "c", "r")
    by_time = ImageEvidence(board=SERIES, own=SHORT, pairs=5)
    numbers, images = with_cause(number_concerns(by_time), (swapped, covered), by_time)
    assert [concern.code for concern in (*numbers, *images)] == [Code.IMAGES_APART, Code.COVERED]
    assert "drift apart" in numbers[0].message
    by_number = replace(by_time, paired_by=PairedBy.NUMBER)
    told = number_concerns(by_number)
    assert with_cause(told, (swapped,), by_number) == (told, (swapped,))
    assert with_cause((), (swapped,), by_time) == ((), (swapped,))
    for arrangement, kept in ((Arrangement.TURNED, True), (Arrangement.BOTH_TURNED, False)):
        turned = diagnose(Code.TURNED, "t", "r", evidence=Misplaced(arrangement))  # one on its head is so at any moment
        assert bool(with_cause(number_concerns(by_time), (turned,), by_time)[1]) == kept
