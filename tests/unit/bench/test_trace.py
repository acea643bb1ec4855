"""Traces for Perfetto of what happens to each pair."""

from dataclasses import replace
from typing import Any

from hypothesis import given, settings
from hypothesis import strategies as st

from common.ledger import BoardMarks, PairLedger, StageTimes
from phone_host.bench.trace import TracedRun, trace_json
from tests.support.samples import LEDGER
from tests.support.trace_format import checked

PARTS = ("capture", "outbox", "propagation", "pairing", "queuing", "processing")


@st.composite
def runs(draw: st.DrawFn) -> tuple[PairLedger, ...]:
    """Pairs in the order in which they were done, with one worker and everything else overlapping freely."""
    done_ns = 10**15
    ledgers = []
    for number in range(draw(st.integers(0, 12))):
        stages = StageTimes(**{name: draw(st.integers(0, 10**7)) for name in StageTimes.__slots__})
        rest_ns = draw(st.integers(0, 10**6))
        dequeued_ns = done_ns + draw(st.integers(0, 10**8))
        queued_ns = dequeued_ns - draw(st.integers(0, 10**9))
        received_ns = queued_ns - draw(st.integers(0, 10**9))
        sent_ns = received_ns - draw(st.integers(0, 10**9))
        grabbed_ns = sent_ns - draw(st.integers(0, 10**9))
        done_ns = dequeued_ns + rest_ns + sum(getattr(stages, name) for name in StageTimes.__slots__)
        board = BoardMarks(exposed_ns=grabbed_ns - draw(st.integers(0, 10**9)), grabbed_ns=grabbed_ns, sent_ns=sent_ns)
        ledgers.append(
            replace(
                LEDGER,
                sequence=number,
                host_sequence=number,
                board=board,
                received_ns=received_ns,
                paired_ns=queued_ns,
                queued_ns=queued_ns,
                dequeued_ns=dequeued_ns,
                done_ns=done_ns,
                stages=stages,
                time_skew_ns=5,
                uncertainty_ns=9,
            )
        )
    return tuple(ledgers)


@given(st.lists(runs(), max_size=3))
@settings(deadline=None, max_examples=60)
def test_any_runs_give_a_trace_by_the_rules(ledgers: list[tuple[PairLedger, ...]]) -> None:
    """Whatever overlaps, every event has the fields that its phase requires, slices nest, and flows join a begin to an end."""
    events = checked(trace_json([TracedRun(f"run {number}", run) for number, run in enumerate(ledgers)]))
    pairs = sum(len(run) for run in ledgers)
    assert sum(event["name"] == "processing" for event in events if event["ph"] == "X") == pairs
    assert sum(event["ph"] == "s" for event in events) == pairs


@given(runs())
@settings(deadline=None, max_examples=40)
def test_a_pairs_slices_are_its_delays_one_behind_the_other(ledgers: tuple[PairLedger, ...]) -> None:
    """The six slices of each pair are as long as the ledger's delays, and each begins where the one before ends."""
    events = checked(trace_json([TracedRun("run", ledgers)]))
    for ledger in ledgers:
        slices: dict[str, Any] = {
            event["name"]: event
            for event in events
            if event["ph"] == "X" and event["name"] in PARTS and event["args"]["sequence"] == ledger.sequence
        }
        at_us = (ledger.board.exposed_ns - min(one.board.exposed_ns for one in ledgers)) / 1e3
        for name in PARTS:
            assert abs(slices[name]["ts"] - at_us) < 1e-3
            assert abs(slices[name]["dur"] - getattr(ledger, f"{name}_ns") / 1e3) < 1e-3
            at_us += slices[name]["dur"]
        sides = {slices[name]["pid"] for name in PARTS[:3]}, {slices[name]["pid"] for name in PARTS[3:]}
        assert sides == ({1}, {2})


def test_a_clock_that_errs_gives_no_negative_slice() -> None:
    """A frame that appears to arrive before it was sent, within the clock's uncertainty, is shown as a slice of length zero."""
    board = BoardMarks(exposed_ns=0, grabbed_ns=1000, sent_ns=2000)
    ledger = replace(
        LEDGER,
        board=board,
        received_ns=1990,
        paired_ns=3000,
        queued_ns=3000,
        dequeued_ns=4000,
        done_ns=5000,
        uncertainty_ns=50,
    )
    events = checked(trace_json([TracedRun("run", (ledger,))]))
    assert [event["dur"] for event in events if event["name"] == "propagation"] == [0.0]
