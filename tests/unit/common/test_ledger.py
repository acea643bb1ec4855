"""Marks and delays of a pair: exact sums, whatever the marks."""

import json
from dataclasses import replace

from hypothesis import given, settings
from hypothesis import strategies as st

from common.ledger import BoardMarks, HostMarks, PairLedger, StageTimes

TIMES_NS = st.integers(-(2**62), 2**62)
MARKS = st.builds(BoardMarks, exposed_ns=TIMES_NS, grabbed_ns=TIMES_NS, sent_ns=TIMES_NS)
DURATIONS_NS = st.integers(0, 2**40)
LEDGERS = st.builds(
    PairLedger,
    session=st.text(max_size=20),
    sequence=st.integers(0, 2**53),
    host_sequence=st.integers(0, 2**53),
    bytes=st.integers(0, 2**24),
    link=st.sampled_from(["tcp", "ipc"]),
    board=MARKS,
    received_ns=TIMES_NS,
    paired_ns=TIMES_NS,
    queued_ns=TIMES_NS,
    dequeued_ns=TIMES_NS,
    done_ns=TIMES_NS,
    previous_done_ns=TIMES_NS,
    stages=st.builds(StageTimes, **dict.fromkeys(("decode", "rectify", "match", "reproject", "write"), DURATIONS_NS)),
    time_skew_ns=TIMES_NS,
    offset_ns=TIMES_NS,
    uncertainty_ns=DURATIONS_NS,
    host=st.builds(HostMarks, exposed_ns=TIMES_NS, grabbed_ns=TIMES_NS),
)

KEYS = (
    "session, sequence, host_sequence, bytes, link, exposed_ns grabbed_ns sent_ns received_ns paired_ns queued_ns dequeued_ns done_ns, "
    "capture_ns outbox_ns propagation_ns pairing_ns queuing_ns processing_ns end_to_end_ns starvation_ns, stages_ns, time_skew_ns, "
    "offset_ns, uncertainty_ns, host_exposed_ns host_grabbed_ns"
)
"""The keys of delays.jsonl as listed in the design, and the host frame's own marks."""


@given(LEDGERS)
@settings(deadline=None)
def test_delays_add_up_to_the_nanosecond(ledger: PairLedger) -> None:
    """Capture, outbox, propagation, pairing, queuing and processing sum to end-to-end exactly, for any marks."""
    waits = ledger.capture_ns + ledger.outbox_ns + ledger.propagation_ns + ledger.pairing_ns + ledger.queuing_ns
    assert waits + ledger.processing_ns == ledger.end_to_end_ns
    assert ledger.end_to_end_ns == ledger.done_ns - ledger.board.exposed_ns


@given(LEDGERS)
@settings(deadline=None)
def test_starvation_is_the_idle_time_before_the_pair(ledger: PairLedger) -> None:
    """Starvation of pair k is max(0, queued_k - done_(k-1)); the first pair uses its own queued_ns as done, so its starvation is 0."""
    expected = ledger.queued_ns - ledger.previous_done_ns
    assert ledger.starvation_ns == max(0, expected)
    assert replace(ledger, previous_done_ns=ledger.queued_ns).starvation_ns == 0


@given(MARKS, TIMES_NS)
@settings(deadline=None)
def test_another_clock_keeps_the_differences(marks: BoardMarks, sent_ns: int) -> None:
    """Moved to another clock, `sent` is the given stamp and the other marks keep their distance to it."""
    moved = marks.moved_to(sent_ns)
    assert moved.sent_ns == sent_ns
    assert moved.sent_ns - moved.grabbed_ns == marks.sent_ns - marks.grabbed_ns
    assert moved.grabbed_ns - moved.exposed_ns == marks.grabbed_ns - marks.exposed_ns


@given(LEDGERS)
@settings(deadline=None)
def test_json_has_exactly_the_agreed_keys(ledger: PairLedger) -> None:
    """A line of delays.jsonl is one line with the design's keys and with integers that survive the round trip."""
    line = ledger.to_json()
    assert "\n" not in line
    record = json.loads(line)
    assert set(record) == set(KEYS.replace(",", " ").split())
    assert set(record["stages_ns"]) == {"decode", "rectify", "match", "reproject", "write", "interpolate"}
    assert record["exposed_ns"] == ledger.board.exposed_ns
    assert record["paired_ns"] == ledger.paired_ns
    assert record["end_to_end_ns"] == ledger.end_to_end_ns
    assert record["stages_ns"]["write"] == ledger.stages.write
    assert (record["session"], record["bytes"]) == (ledger.session, ledger.bytes)
    assert all(type(value) is int for key, value in record.items() if key.endswith("_ns") and key != "stages_ns")
