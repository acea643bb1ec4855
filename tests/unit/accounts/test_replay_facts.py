"""Delays of then beside those of a replay."""

from dataclasses import replace

from phone_host.accounts.delays import DELAYS, DelayStatistics, replay_facts, side_by_side
from tests.support.samples import LEDGER

MS = 1_000_000


def test_delays_of_then_stand_beside_those_of_now() -> None:
    """One line for each delay and the time skew, with the median and the 95th percentile of both; none without pairs or without times."""
    then = [replace(LEDGER, done_ns=LEDGER.dequeued_ns + n * MS) for n in (10, 20, 30)]
    facts = replay_facts("a.mcap", "clock", then)
    assert (facts.file, facts.pace, facts.pairs) == ("a.mcap", "clock", 3)
    now = DelayStatistics()
    now.add(replace(LEDGER, done_ns=LEDGER.dequeued_ns + 7 * MS))
    lines = side_by_side(facts, now, is_timeless=False)
    assert len(lines) == 1 + len(DELAYS) + 1
    (processing,) = (line.split() for line in lines if line.startswith("processing"))
    assert processing[1:3] == ["20.000", "7.000"]
    assert side_by_side(facts, now, is_timeless=True) == []
    assert side_by_side(replay_facts("a.mcap", "clock", ()), now, is_timeless=False) == []
    assert side_by_side(facts, DelayStatistics(), is_timeless=False) == lines[:1]
