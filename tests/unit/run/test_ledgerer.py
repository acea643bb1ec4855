"""The books of a run: a time without the board counts neither as starvation nor for the rate."""

from phone_host.accounts.link_account import Absence, LinkAccount
from phone_host.model import CutCounts, FramePair, Processed, RectifiedPair
from phone_host.run.ledgerer import Ledgerer
from tests.support.numbered import draw
from tests.support.samples import LEDGER
from tests.unit.stream.test_pair_queue import MS, board_frame, host_frame


def enter(books: Ledgerer, at_ns: int, cut: CutCounts | None = None) -> None:
    """Enter a pair that was queued at a time and done 5 ms later."""
    image = draw(1)
    processed = Processed(RectifiedPair(image, image), None, None, LEDGER.stages, cut=cut)
    pair = FramePair(
        board=board_frame(0, at_ns), host=host_frame(0, at_ns), time_skew_ns=0, paired_ns=at_ns, queued_ns=at_ns
    )
    books.enter(pair, processed, dequeued_ns=at_ns, computed_ns=at_ns + 5 * MS, done_ns=at_ns + 5 * MS)


def test_a_gap_of_the_board_is_no_starvation() -> None:
    """Ten pairs 50 ms apart, 6 s without the board, ten more: the processor waited 45 ms before each pair, and the rest is the gap."""
    gone_ns, back_ns = 1500 * MS, 7400 * MS
    for knows in (True, False):
        account = LinkAccount(absences=(Absence(gone_ns, back_ns),) if knows else ())
        books = Ledgerer(account.was_away)
        for number in range(10):
            enter(books, (1000 + 50 * number) * MS)
        for number in range(10):
            enter(books, (7450 + 50 * number) * MS)
        told = books.books()
        gap_ns = (7450 - 1455) * MS
        assert (told.gaps, told.gap_ns) == ((1, gap_ns) if knows else (0, 0))
        assert told.delays.spread("starvation").max_ns == (45 * MS if knows else gap_ns)
        assert told.last_done_ns - told.first_done_ns == (7900 - 1000) * MS


def test_labels_give_no_delay_from_an_exposure() -> None:
    """Stills are counted in every delay but those that begin at an exposure."""
    books = Ledgerer(is_timeless=lambda: True)
    enter(books, 1000 * MS)
    delays = books.books().delays
    assert [delays.spread(name).count for name in ("capture", "end_to_end", "time_skew", "processing")] == [0, 0, 0, 1]


def test_what_was_cut_is_summed_over_all_pairs() -> None:
    """A run's report counts the pixels of every pair; a run without a core has none."""
    books = Ledgerer()
    enter(books, 1000 * MS)
    assert books.books().depth.cut is None
    enter(books, 1050 * MS, CutCounts(kept=5, too_far=3))
    enter(books, 1100 * MS, CutCounts(kept=6, unmatched=1, too_far=1))
    assert books.books().depth.cut == CutCounts(kept=11, unmatched=1, too_far=4)
