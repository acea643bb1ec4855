"""What kept pairs from being processed is told with its remedy, the same in the headline, in report.json and on the page."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from common.diagnostic import Diagnostic, Severity, diagnostic_of
from common.errors import BusyBoardError, DataError
from common.ledger import PairLedger
from phone_host.accounts.link_account import Absence, Away, LinkAccount, LinkTally
from phone_host.diagnostics.headline import Grade, headline
from phone_host.diagnostics.run_rules import gone_concerns
from phone_host.model import PairCounts, Side
from phone_host.report.report_page import delay_series
from phone_host.report.run_json import build
from phone_host.report.run_page import run_page
from phone_host.report.summary import summary
from phone_host.run.course import patience_s
from phone_host.run.ledgerer import Ledgerer
from phone_host.svg.plots import Percentiles
from phone_host.verbs.run import WaitingNote
from tests.support.run_snapshots import run
from tests.unit.run.test_ledgerer import enter
from tests.unit.stream.test_pair_queue import MS

SIDE = DataError("the right image is 370x1226 px: it lies on its side", "turn it upright: --rotate-right 90")
BUSY = Diagnostic("the board is busy with another host", "stop that one first", Severity.FAIL)


def test_the_error_that_ended_a_run_is_told_everywhere() -> None:
    """Eleven pairs were of one upright and one lying image: headline, report.json and page name that and its remedy."""
    lying = diagnostic_of(SIDE)
    counts = PairCounts(received=12, paired=11, taken=11)
    failed = replace(run(0), ended="failed", counts=counts, undecodable=11, failed_pairs=((lying, 11),), failure=lying)
    said = headline(failed)
    assert (said.grade, said.sentence) == (
        Grade.BAD, f"No pair was processed: {SIDE.problem}. Remedy: {SIDE.remedy}.",
    )  # fmt: skip
    told: Any = build(failed)
    assert told["error"] == {"problem": SIDE.problem, "remedy": SIDE.remedy}
    assert told["trust"]["headline"] == said.sentence
    assert told["unused"] == [{"place": "pairs that could not be processed", "reason": SIDE.problem, "count": 11}]
    page = run_page(failed, None, Side.LEFT, ())
    assert said.sentence in page
    assert f"<li>{SIDE.remedy[:1].upper()}{SIDE.remedy[1:]}.</li>" in page
    assert build(run(3))["error"] is None


def test_an_error_after_some_pairs_comes_before_what_was_found_until_then() -> None:
    """The disk failed after 31 pairs: that is bad news, and what was measured is told behind it."""
    said = headline(
        replace(run(31), ended="failed", failure=Diagnostic("the disk is gone", "plug it in", Severity.FAIL))
    )
    assert said.grade is Grade.BAD
    assert said.sentence.startswith(
        "The run broke off: the disk is gone. Remedy: plug it in. Until then: this run meas"
    )


def test_pairs_that_failed_are_the_reason_for_a_run_without_pairs() -> None:
    """Five pairs were too few to end the run; the commonest reason is told, not that no frames came together."""
    books = Ledgerer()
    for error in (DataError("a", "b"), SIDE, SIDE, SIDE, SIDE):
        books.enter_failed(error)
    found = books.books().failed_pairs
    assert found == ((diagnostic_of(SIDE), 4), (Diagnostic("a", "b", Severity.FAIL), 1))
    seen = replace(run(0), ended="stream_ended", undecodable=5, failed_pairs=found)
    assert headline(seen).sentence.startswith(f"No pair was processed: {SIDE.problem}")


def test_reasons_without_number_take_bounded_memory() -> None:
    """Of 100 images of 100 sizes each is counted; beyond 16 different reasons they are counted together."""
    ledgerer = Ledgerer()
    for width in range(100):
        ledgerer.enter_failed(DataError(f"{width} px", "calibrate"))
    counts = ledgerer.books().failed_pairs
    assert (len(counts), sum(count for _, count in counts), counts[0][1]) == (17, 100, 84)


def test_a_mistake_of_the_program_is_named_as_one() -> None:
    """A ZeroDivisionError is nobody's camera; no control character of its text reaches the page."""
    found = diagnostic_of(ZeroDivisionError("by\x1b[1m zero"))
    assert found.message == "the program itself failed (ZeroDivisionError: by\\x1b[1m zero)"


def test_a_busy_board_is_not_absent() -> None:
    """Another host has it: no word tells the user to start the board, neither at the end nor when it went away in between."""
    waiting = replace(run(0), refused=BUSY)
    assert headline(waiting).sentence == f"No pair was processed: {BUSY.message}. Remedy: {BUSY.remedy}."
    busy = diagnostic_of(BusyBoardError(BUSY.message, BUSY.remedy))
    assert headline(replace(run(0), ended="failed", failure=busy)).sentence == headline(waiting).sentence
    assert "no board came" in headline(run(0)).sentence
    (gone,) = gone_concerns(replace(run(1), away=(Away(3.0, 7.0, is_over=False),), refused=BUSY))
    assert "did not come back, because the board is busy with another host" in gone.message
    assert gone.remedy == BUSY.remedy


def test_a_wait_says_at_once_that_the_board_is_busy() -> None:
    """The first look that knows of a refusal tells it, once, and nothing claims afterwards that a board is waited for."""
    said: list[str] = []
    refusals = iter((None, BUSY, BUSY, None, BUSY))
    note = WaitingNote(["tcp://board:5555"], lambda: False, lambda: next(refusals), said.append)
    for _ in range(5):
        note.refresh()
    assert said == [f"phone-host: waiting: {BUSY.message}: {BUSY.remedy}"]


@pytest.mark.parametrize(
    ("wait_s", "seconds", "patience"), [(None, 0.0, None), (None, 2.0, 12.0), (0.0, 2.0, 0.0), (60.0, 2.0, 60.0)]
)
def test_a_limited_run_does_not_wait_for_ever(wait_s: float | None, seconds: float, patience: float | None) -> None:
    """`--seconds 2` alone waits 12 s for a board: 2 and the 10 that the first pair may take. `--wait` overrides it."""
    assert patience_s(wait_s, seconds) == patience


def test_the_page_leaves_the_boards_absence_out_of_starvation() -> None:
    """Six seconds without the board: the summary's greatest wait, 45 ms, is the page's, too, and the gap is not drawn."""
    account = LinkAccount(absences=(Absence(1500 * MS, 7400 * MS),))
    books = Ledgerer(account.was_away)
    for at_ms in (1000, 1050, 1100, 7450, 7500):
        enter(books, at_ms * MS)
    told = books.books()
    starvation = delay_series(books.sample(), after_gap_ns=told.after_gap_ns, statistics=told.delays).starvation
    assert starvation.values_ns.tolist() == pytest.approx([0, 45e6, 45e6, np.nan, 45e6], nan_ok=True)
    spread = told.delays.spread("starvation")
    assert starvation.percentiles == Percentiles(spread.p50_ns, spread.p95_ns, spread.p99_ns, 45e6)
    page = run_page(
        replace(run(5), delays=told.delays, after_gap_ns=told.after_gap_ns), None, Side.LEFT, books.sample()
    )
    strip = page[page.index(">starvation<title>") :]
    assert "max 45.0\u202fms" in strip[: strip.index("</g>")]


def test_a_page_of_a_sample_tells_the_percentiles_of_all_pairs() -> None:
    """The slowest of 31 pairs is not in the sample; its delay is the greatest on the page all the same."""
    seen = run(31)
    ledgers: list[PairLedger] = []
    assert delay_series(ledgers, statistics=seen.delays).end_to_end.percentiles == Percentiles(15e6, 15e6, 15e6, 15e6)


def test_stills_have_neither_overflow_nor_age() -> None:
    """They come on demand: no policy drops any, and no bound in frame periods is claimed."""
    stills: Any = build(replace(run(5), timeless=True, link=LinkAccount([], links=(LinkTally("ipc", 24, carried=1),))))
    assert (stills["fifo"]["overflow"], stills["fifo"]["age_bound"].split(":")[0]) == (None, "none needed")
    assert (stills["links"][0]["frames"], stills["links"][0]["took_over"]) == (24, 1)
    film: Any = build(run(5))
    assert (film["fifo"]["overflow"], film["fifo"]["age_bound"].split(":")[0]) == ("drop-oldest", "1 frame period(s)")
    assert "on demand" not in summary(run(5))
