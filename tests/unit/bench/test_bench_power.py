"""The bench's power cut: what counts is what the last fsync that had returned found in the file."""

from pathlib import Path

import pytest

from common.recording.layout import topics
from common.recording.mcap_writer import McapWriter
from tests.bench.recording_power import Sync, longest_loss_s, syncs

_FILE = Path("/r/x.mcap")


def test_syncs_are_read_from_the_trace() -> None:
    """Other files and other calls do not count; a sync brings what was written before it."""
    trace = [
        "100.1 writev(3</r/x.mcap>, [...], 2) = 10 <0.000033>",
        "100.2 write(4</r/y.mcap>, ..., 7) = 7 <0.1>",
        "100.5 fsync(3</r/x.mcap>) = 0 <0.25>",
        "100.6 write(3</r/x.mcap>, ..., 5) = 5 <0.1>",
        "101.0 fsync(3</r/x.mcap>) = 0 <0.5>",
        "101.6 +++ exited with 0 +++",
    ]
    assert syncs(trace, _FILE) == [Sync(10, 100.75), Sync(15, 101.5)]
    with pytest.raises(ValueError, match="ftruncate is not appending"):
        syncs(["1.0 ftruncate(3</r/x.mcap>, 5) = 0 <0.1>"], _FILE)


def test_the_worst_moment_is_before_a_sync_returns() -> None:
    """One image every 0.1 s, each synced in 0.05 s; a sync that is missing makes the loss longer."""
    data, done = bytearray(), list[Sync]()
    writer = McapWriter(data.extend, "a test", topics())
    for number in range(5):
        at_ns = 1000 * 10**9 + number * 10**8
        writer.add("/left/image/compressed", bytes(20_000), sequence=number, log_ns=at_ns, publish_ns=at_ns)
        writer.end_chunk()
        done.append(Sync(len(data), at_ns / 1e9 + 0.05))
    assert longest_loss_s(bytes(data), done) == pytest.approx(0.05)
    assert longest_loss_s(bytes(data), done[1::2]) == pytest.approx(0.15)
    assert longest_loss_s(bytes(data), done[-1:]) == pytest.approx(0.45)
