"""A host ten times slower than the camera: the age of pairs stays bounded, the camera is never throttled, every drop is counted."""

from pathlib import Path

import pytest

from common import now
from common.camera.factory import open_camera
from common.ledger import PairLedger
from common.link.factory import open_link, parse_link
from common.stamp import HOST_CLOCK
from phone_host.diagnostics.throughput import Regime, figures, judge
from phone_host.model import Result
from phone_host.run.host import Host
from phone_host.run.host_settings import EndReason, HostSettings
from phone_host.run.sinks import FunctionSink
from phone_host.stereo.core import StereoCore
from phone_host.sync.fifo import FifoSettings
from tests.support.numbered import write_film
from tests.support.programs import board
from tests.support.slow import SlowMatcher

FPS = 30
PERIOD_NS = 1_000_000_000 // FPS


@pytest.mark.parametrize("fifo", ["1:drop-oldest", "1:drop-newest", "1:block", "3:drop-oldest"])
def test_pairs_do_not_get_older_on_a_slow_host(fifo: str, tmp_path: Path) -> None:
    """No pair waits longer than its policy allows, the board keeps grabbing at its own pace, and the account balances."""
    film, link = write_film(tmp_path / "film", 60), f"ipc://{tmp_path}/link"
    uri, policy = f"replay:{film}?fps={FPS}&loop=1", FifoSettings.parse(fifo)
    kept: list[PairLedger] = []

    def keep(result: Result) -> None:
        kept.append(result.ledger)

    slow_ns = 10 * PERIOD_NS
    with board(["run", "--camera", uri, "--link", link, "--json"], tmp_path) as sender:
        camera = open_camera(uri, HOST_CLOCK, now.monotonic_ns())
        core = StereoCore(SlowMatcher(slow_ns / 1e9))
        host = Host(
            HostSettings(fifo=policy, pairs=12),
            camera,
            [open_link(parse_link(link, listens_by_default=False))],
            core,
            [FunctionSink("test", keep, waits=True)],
        )
        assert host.run(lambda: False) is EndReason.PAIRS_REACHED
        assert sender.stop() == 0
        account = sender.json()
    # Age is judged by events, not by a clock: while a pair waits, at most as many others are finished as the FIFO is deep. In an
    # unbounded queue the last of these twelve would have waited for all the others.
    for ledger in kept:
        finished_meanwhile = sum(ledger.queued_ns < other.done_ns <= ledger.dequeued_ns for other in kept)
        assert finished_meanwhile <= policy.depth
    assert account["grabbed"] == account["sent"] + sum(account["dropped"].values())
    assert account["camera"]["missed"] == 0
    assert account["grabbed"] > kept[-1].sequence
    judgement = judge(figures(host.snapshot("pairs_reached")))
    assert judgement.regime is Regime.BACKLOG
    assert any("smaller images" in remedy for remedy in judgement.remedies)
    counts = host.snapshot("pairs_reached").counts
    assert counts.received == counts.paired + counts.held_board + sum(n for _, n in counts.board_orphans)
    assert counts.paired == counts.taken + counts.dropped + counts.waiting
    if fifo.endswith("block"):
        assert counts.dropped == 0  # credit holds the board back: it drops at the source
        assert account["dropped"]["replaced"] > 0
    else:
        assert counts.dropped > 0
