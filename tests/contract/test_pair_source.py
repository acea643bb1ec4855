"""What holds of every source of a run's pairs: they come once and in order, every frame is accounted for, and the run ends when the source or the user does."""

import threading
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path

import pytest

from common import now
from common.camera.factory import open_camera
from common.link.factory import open_link, parse_link
from common.protocol.message import Pacing
from common.stamp import HOST_CLOCK
from phone_host.model import Result
from phone_host.recording.playback import Playback
from phone_host.run.host import Host
from phone_host.run.host_settings import EndReason, HostSettings
from phone_host.run.sinks import FunctionSink, Sink
from tests.support.board_thread import board_of
from tests.support.numbered import write_film
from tests.support.own_threads import own_threads
from tests.support.recorded import recording_file

PAIRS = 12
MISSING = frozenset({3, 7})
"""Left images that are not in the recording."""

SOURCES = ("link", "folders", "recording at its pace", "recording at ours")


@contextmanager
def host_of(source: str, folder: Path, sink: Sink, pairs: int = PAIRS) -> Iterator[Host]:
    """A host of that many pairs from this source, at most, which has not run yet."""
    settings = HostSettings(pairs=pairs)
    with ExitStack() as opened:
        if source.startswith("recording"):
            pacing = Pacing.CLOCK if source.endswith("its pace") else Pacing.DEMAND
            yield Host(settings, Playback(recording_file(folder, PAIRS, missing=MISSING), pacing), [], None, [sink])
            return
        options = "pace=demand" if source == "folders" else "fps=20&loop=1"
        film, address = write_film(folder / "film", PAIRS), f"ipc://{folder}/board"
        opened.enter_context(board_of(open_camera(f"replay:{film}?{options}", "board", now.monotonic_ns()), address))
        camera = opened.enter_context(closing(open_camera(f"replay:{film}?{options}", HOST_CLOCK, now.monotonic_ns())))
        link = open_link(parse_link(address, listens_by_default=False))  # the host closes it
        yield Host(settings, camera, [link], None, [sink])


@pytest.mark.parametrize("source", SOURCES)
def test_pairs_come_once_and_in_order_and_every_frame_is_accounted_for(source: str, tmp_path: Path) -> None:
    """Numbers of both sides only grow; where both show one film or a recording, they are equal; no frame is lost unsaid."""
    seen: list[tuple[int, int]] = []

    def take(result: Result) -> None:
        seen.append((result.pair.board.message.sequence, result.pair.host.sequence))

    with host_of(source, tmp_path, FunctionSink("seen", take, waits=True)) as host:
        ended = host.run(lambda: False)
        counts = host.snapshot().counts
    assert ended is (EndReason.STREAM_ENDED if source.startswith("recording") else EndReason.PAIRS_REACHED)
    assert seen
    for numbers in zip(*seen, strict=True):
        assert list(numbers) == sorted(set(numbers))
    if source == "recording at its pace":  # a busy machine may come too late for some
        assert {left for left, _ in seen} <= set(range(PAIRS)) - MISSING
        assert all(left == right for left, right in seen)
    elif source != "link":
        missing: frozenset[int] = frozenset() if source == "folders" else MISSING
        assert seen == [(number, number) for number in range(PAIRS) if number not in missing]
    assert counts.received == counts.paired + sum(n for _, n in counts.board_orphans) + counts.held_board
    assert counts.host_frames == counts.paired + sum(n for _, n in counts.host_orphans) + counts.held_host
    assert counts.paired == counts.taken + counts.dropped + counts.waiting
    assert len(seen) <= counts.taken


@pytest.mark.parametrize("source", SOURCES)
def test_a_user_who_stops_ends_it(source: str, tmp_path: Path) -> None:
    """While the first pair is processed and others wait: the run ends, and no thread of it is left."""
    before, one, asked = own_threads(), threading.Event(), threading.Event()

    def take(_: Result) -> None:
        one.set()
        assert asked.wait(60)

    def stop() -> bool:
        if one.is_set():
            asked.set()
        return asked.is_set()

    with host_of(source, tmp_path, FunctionSink("first", take), pairs=0) as host:
        ended = host.run(stop)
    # A recording at our pace has been read to its end by then.
    assert ended is EndReason.STOPPED or (source == "recording at ours" and ended is EndReason.STREAM_ENDED)
    assert not {thread.name for thread in own_threads() - before if thread.is_alive()}
