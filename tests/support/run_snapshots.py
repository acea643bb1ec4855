"""Snapshots of runs for tests of what presenters say."""

from dataclasses import replace

from common.camera.base import CameraHealth, CameraState
from common.ledger import BoardMarks, HostMarks
from phone_host.accounts.delays import DelayStatistics
from phone_host.accounts.link_account import LinkAccount
from phone_host.diagnostics.run_snapshot import RunSnapshot
from phone_host.model import PairCounts, Unwritten
from phone_host.sync.fifo import FifoSettings
from tests.support.samples import LEDGER

MS = 1_000_000


def run(pairs: int) -> RunSnapshot:
    """A run of some pairs, 50 ms apart, without a measurement of image motion."""
    delays = DelayStatistics()
    for number in range(pairs):
        at = number * 50 * MS
        board = BoardMarks(exposed_ns=at, grabbed_ns=at + MS, sent_ns=at + 2 * MS)
        delays.add(
            replace(
                LEDGER,
                sequence=number,
                host_sequence=number,
                board=board,
                received_ns=at + 3 * MS,
                paired_ns=at + 4 * MS,
                queued_ns=at + 4 * MS,
                dequeued_ns=at + 5 * MS,
                done_ns=at + 15 * MS,
                previous_done_ns=at,
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
