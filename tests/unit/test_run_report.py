"""A run's summary and page: what was not measured is said so, never as a number that is none."""

from dataclasses import replace
from typing import Any

import pytest

from common.camera.base import CameraHealth, CameraState
from common.ledger import BoardMarks, HostMarks, PairLedger, StageTimes
from common.protocol.message import BoardCounts
from phone_host.measure.accounts import LinkAccount, SessionAccount
from phone_host.measure.delays import DelayStatistics
from phone_host.measure.run_snapshot import RunSnapshot
from phone_host.measure.unused import unused
from phone_host.model import PairCounts, Side, TimeOffset, Unwritten
from phone_host.report.run_json import build
from phone_host.report.run_page import run_page
from phone_host.report.summary import phase_lines, summary
from phone_host.sync.fifo import FifoSettings
from phone_host.sync.phase import Phase
from phone_host.sync.quarantine import Disbelief, Suspects

NAN = float("nan")
MS = 1_000_000


def run(pairs: int) -> RunSnapshot:
    """A run of some pairs, 50 ms apart, whose image motion nobody measured."""
    delays = DelayStatistics()
    for number in range(pairs):
        at = number * 50 * MS
        board = BoardMarks(exposed_ns=at, grabbed_ns=at + MS, sent_ns=at + 2 * MS)
        delays.add(
            PairLedger(
                session="s",
                sequence=number,
                host_sequence=number,
                bytes=9,
                link="ipc",
                board=board,
                received_ns=at + 3 * MS,
                paired_ns=at + 4 * MS,
                queued_ns=at + 4 * MS,
                dequeued_ns=at + 5 * MS,
                done_ns=at + 15 * MS,
                previous_done_ns=at,
                stages=StageTimes(),
                time_skew_ns=0,
                offset_ns=0,
                uncertainty_ns=50,
                host=HostMarks(exposed_ns=at, grabbed_ns=at + MS),
            )
        )
    counts = PairCounts(received=pairs, paired=pairs, taken=pairs)
    seconds = max(0, pairs - 1) * 0.05
    return RunSnapshot(
        ended="stopped",
        processed=pairs,
        undecodable=0,
        seconds=seconds,
        delays=delays,
        counts=counts,
        link=LinkAccount([]),
        estimate=None,
        tolerance_ns=25 * MS,
        fifo=FifoSettings(),
        unwritten=Unwritten(),
        camera=CameraHealth(CameraState.RUNNING),
        period_ns=50 * MS,
    )


@pytest.mark.parametrize("pairs", [0, 1, 30])
def test_what_was_not_measured_is_no_number(pairs: int) -> None:
    """Neither the summary nor the page of a run of no pair, of one or of many shows `nan` or `inf`."""
    text = summary(run(pairs)) + run_page(run(pairs), None, Side.LEFT, ())
    assert not any(word in text for word in (" nan", "(nan", ">nan", " inf ", "nan<"))


def test_a_rate_needs_two_pairs() -> None:
    """One pair has no rate; 31 pairs 50 ms apart are 20 a second."""
    assert summary(run(1)).startswith("1 pairs, ended: stopped\n")
    assert summary(run(31)).startswith("31 pairs in 1.5 s (20.0 /s), ended: stopped\n")


def test_the_phase_is_told_with_its_side() -> None:
    """A board that exposes 5 ms earlier exposes before the host, and a phase that does not drift never comes round."""
    assert phase_lines(Phase(-5.0 * MS, 50 * MS, 0.0, 0), None) == [
        "phase: the board exposes 5.0 of 50.0 ms before the host"
    ]
    assert (
        "5.0 of 50.0 ms after the host, drifts by +100.0 ppm, comes round in 500 s"
        in phase_lines(Phase(5.0 * MS, 50 * MS, 1e-4, 0), None)[0]
    )


def test_a_late_frame_has_one_reason() -> None:
    """A lost frame that came after all stays lost and is no stale one, so that what was sent is what was received and lost, to the frame."""
    sent = BoardCounts(grabbed=10, sent=10)
    account = SessionAccount("s", BoardCounts(), sent, received=7, lost=3, late=2, duplicate=1)
    seen = replace(run(7), link=LinkAccount([account]))
    told: Any = build(seen)["sessions"]
    assert told[0]["sent"] == told[0]["received"] + told[0]["lost"]
    assert (told[0]["lost_late"], told[0]["stale"]) == (2, {"duplicate": 1, "old_session": 0})
    found = {item.place: item.count for item in unused(seen)}
    assert found == {
        "frames lost on the link": 1,
        "frames that came too late over another link": 2,
        "frames delivered again": 1,
    }


def test_only_stamps_that_nobody_knows_are_called_unmeasured() -> None:
    """Cameras whose stamps say by definition when they exposed need no measuring; others are told how; what was measured is told."""
    told = "cameras' stamps"
    assert f"{told} agree to" in summary(run(31))
    assert told not in summary(replace(run(31), stamps_exact=True))
    measured = TimeOffset(offset_ns=3 * MS, uncertainty_ns=MS // 2)
    assert f"{told} differ by +3.00 +-0.50 ms" in summary(replace(run(31), time_offset=measured))


def test_what_was_not_believed_is_told_everywhere() -> None:
    """A step with its suspect frames, frames that were not believed and spoiled images stand by name in JSON, summary and page, and each raises a doubt."""
    account = SessionAccount("s", BoardCounts(), BoardCounts(), received=40)
    account.disbelieved[Disbelief.FUTURE] = 3
    account.disbelieved[Disbelief.CREDIT] = 2
    link = LinkAccount([account], clock_doubts=2, clock_steps=1)
    link.suspects.append(Suspects("s", 11, 17, 7))
    seen = replace(run(30), link=link, own_future=4, spoiled_images=(("too_large", 5),))
    told: Any = build(seen)
    assert told["clock"]["steps"] == 1
    assert told["clock"]["doubts"] == 2
    assert told["clock"]["suspects"] == [{"session": "s", "first": 11, "last": 17, "frames": 7}]
    dropped = {"from_the_future": 3, "beyond_credit": 2, "own_from_the_future": 4}
    assert told["frames"]["disbelieved"] == dropped
    assert {item["doubt"] for item in told["warnings"]} == {"clock_stepped", "disbelieved", "spoiled_images"}
    for text in (summary(seen), run_page(seen, None, Side.LEFT, ())):
        for words in ("stepped 1 times", "7 pairs", "from the future", "beyond credit", "too large"):
            assert words in text
