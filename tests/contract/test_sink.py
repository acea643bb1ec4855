"""What holds of every sink of a run: the worker never waits for `offer`, nothing is lost unsaid, and it ends."""

import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from phone_host.model import Side
from phone_host.recording.recorder import Recorder
from phone_host.recording.switch import RecordingSwitch
from phone_host.run.file_sink import FileSink
from phone_host.run.recording_sinks import Computed, ComputedSink, RecordingSink
from phone_host.run.sinks import FunctionSink, Sink
from phone_host.run.trust_sink import TrustSink
from tests.support.results import result

RESULTS = 20


def _off(_: Path) -> Recorder:
    raise AssertionError("nobody begins a recording")


SINKS: dict[str, Callable[[Path], Sink]] = {
    "function": lambda _: FunctionSink("function", lambda _: None),
    "function that waits": lambda _: FunctionSink("patient", lambda _: None, depth=1, waits=True),
    "files": lambda out: FileSink(out, save_every=3),
    "no files": lambda _: FileSink(None, save_every=3),
    "delays of a recording": lambda _: RecordingSink(RecordingSwitch(_off)),
    "depth of a recording": lambda _: ComputedSink(RecordingSwitch(_off), {Computed.DEPTH}, Side.LEFT),
    "trust": lambda _: TrustSink(None),
}


@pytest.fixture(params=SINKS)
def sink(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Sink]:
    """Each sink."""
    made = SINKS[request.param](tmp_path / "out")
    yield made
    made.finish()
    if isinstance(made, FileSink):
        made.abandon()


def test_what_was_offered_is_accounted_for_when_it_ends(sink: Sink) -> None:
    """After `finish` nothing waits, nothing failed, and no queue claims more than it was offered."""
    for number in range(RESULTS):
        sink.await_place(number)
        sink.offer(result(number))
    sink.finish()
    assert sink.failure is None
    for account in sink.accounts:
        assert (account.waiting, account.failed) == (0, 0)
        assert 0 <= account.written + account.dropped <= RESULTS


def test_after_its_end_it_writes_nothing_more(sink: Sink) -> None:
    """A pair that was given up may still come back after the end: it is dropped, and nobody waits."""
    sink.offer(result(0))
    sink.finish()
    written = [account.written for account in sink.accounts]
    sink.await_place(3)
    sink.offer(result(3))
    sink.finish()
    assert [account.written for account in sink.accounts] == written
    assert sink.failure is None


def test_a_run_that_never_begins_leaves_no_thread(sink: Sink) -> None:
    """A sink without a result has no thread, and ends at once."""
    threads = threading.active_count()
    sink.finish()
    assert threading.active_count() == threads
    assert not any(account.written or account.dropped for account in sink.accounts)
