"""The delays of then beside those of a run that plays a recording. Pure."""

from collections.abc import Sequence
from dataclasses import dataclass

from common.ledger import PairLedger
from phone_host.measure.delays import DELAYS, DelayStatistics


@dataclass(frozen=True, slots=True)
class ReplayFacts:
    """What is played.

    Attributes:
        file: the recording.
        pace: clock or demand.
        pairs: how many pairs were processed when it was recorded.
        delays: their delays.
    """

    file: str
    pace: str
    pairs: int
    delays: DelayStatistics


def replay_facts(file: str, pace: str, ledgers: Sequence[PairLedger]) -> ReplayFacts:
    """Sum up the ledgers of then.

    Args:
        file: the recording.
        pace: clock or demand.
        ledgers: of the pairs that were processed then.
    """
    delays = DelayStatistics()
    for ledger in ledgers:
        delays.add(ledger)
    return ReplayFacts(file, pace, len(ledgers), delays)


def side_by_side(replay: ReplayFacts, now: DelayStatistics, *, is_timeless: bool) -> list[str]:
    """Return a table: delays of then and of this run; nothing without pairs of then.

    Args:
        replay: what is played.
        now: the delays of this run.
        is_timeless: whether its delays mean nothing.
    """
    if not replay.pairs or is_timeless:
        return []
    lines = [f"{'delay, ms':14} {'then p50':>9} {'now p50':>9} {'then p95':>9} {'now p95':>9}"]
    for name in (*DELAYS, "time_skew"):
        then, today = replay.delays.spread(name), now.spread(name)
        if then.count and today.count:
            values = (then.p50_ns, today.p50_ns, then.p95_ns, today.p95_ns)
            lines.append(f"{name.replace('_', '-'):14} " + " ".join(f"{value / 1e6:9.3f}" for value in values))
    return lines
