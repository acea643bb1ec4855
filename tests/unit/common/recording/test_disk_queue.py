"""The queue before the disk: bounded, nothing lost without being counted, synced in time, ended by what fails."""

import errno
import os
import threading
import time
from collections.abc import Callable

import pytest

from common.errors import UnavailableError
from common.recording.disk_queue import DiskQueue, FullRecordingError, Queued, WriteEnd
from common.recording.mcap_writer import CHUNK_BYTES

_MOST_BYTES = 4 * CHUNK_BYTES
_PATIENCE_S = 60.0


class _Disk:
    """A disk that notes what is done to it, how often it was synced, and that can be held up or break."""

    def __init__(self) -> None:
        self.done: list[object] = []
        self.syncs = 0
        self.may_go_on = threading.Event()
        self.may_go_on.set()
        self.error: Exception | None = None

    def write(self, what: object) -> None:
        self.may_go_on.wait(_PATIENCE_S)
        self.done.append(what)

    def end_chunk(self) -> None:
        if self.error is not None:
            raise self.error
        self.done.append("chunk")

    def sync(self) -> None:
        self.syncs += 1

    def close(self) -> None:
        self.done.append("closed")

    def abandon(self, cause: str) -> None:
        self.done.append(f"abandoned: {cause}")

    def job(self, what: object) -> Callable[[], None]:
        return lambda: self.write(what)


def _full() -> None:
    raise FullRecordingError


def test_all_is_written_in_its_order() -> None:
    """Jobs that are no frames do not count; the target is closed behind the last one."""
    disk = _Disk()
    queue = DiskQueue("test", disk, _MOST_BYTES)
    for number in range(5):
        queue.put(disk.job(number), 10, is_frame=number % 2 == 0)
    ended = queue.finish()
    assert [each for each in disk.done if each != "chunk"] == [0, 1, 2, 3, 4, "closed"]
    assert (ended.frames, ended.dropped, ended.lost, ended.end) == (3, 0, 0, None)
    assert ended.ended_ns > 0
    queue.put(disk.job(9), 10, is_frame=True)
    assert queue.account.lost == 1
    assert 9 not in disk.done


def test_what_a_slow_disk_cannot_take_is_dropped() -> None:
    """Whoever brings it never waits, what waits is bounded, and every frame is counted once."""
    disk = _Disk()
    disk.may_go_on.clear()
    queue = DiskQueue("test", disk, _MOST_BYTES)
    for number in range(20):
        queue.put(disk.job(number), CHUNK_BYTES, is_frame=True)
    assert not disk.done, "all were put, and the disk has not finished one"
    disk.may_go_on.set()
    ended = queue.finish()
    assert ended.frames + ended.dropped == 20
    assert ended.frames in {4, 5}  # the thread may have taken one before the queue was full


def test_it_syncs_while_little_comes() -> None:
    """It syncs again and again before the end, and far less often than something comes; how often, bench_recording measures."""
    disk, put = _Disk(), 0
    queue = DiskQueue("test", disk, _MOST_BYTES)
    began = time.monotonic()
    while disk.syncs < 2 and time.monotonic() - began < _PATIENCE_S:
        queue.put(disk.job(0), 10)
        put += 1
        time.sleep(0.01)
    syncs = disk.syncs
    queue.finish()
    assert syncs == 2
    assert put > 2 * syncs


def test_what_does_not_fit_ends_it_in_order() -> None:
    """What came before is in the file, which is closed; the rest is lost, and told."""
    disk = _Disk()
    disk.may_go_on.clear()
    queue = DiskQueue("test", disk, _MOST_BYTES)
    for job in (disk.job(1), _full, disk.job(2), disk.job(3)):
        queue.put(job, 10, is_frame=True)
    disk.may_go_on.set()
    ended = queue.finish()
    assert disk.done == [1, "chunk", "closed"]
    assert (ended.frames, ended.lost, ended.end) == (1, 3, WriteEnd.FULL)


@pytest.mark.parametrize(
    ("error", "cause", "remedy"),
    [
        (
            OSError(errno.ENOSPC, os.strerror(errno.ENOSPC)),
            os.strerror(errno.ENOSPC),
            "make room; what is in it can be used",
        ),
        (UnavailableError("a.mcap exists already", "name another file"), "a.mcap exists already", "name another file"),
        (ZeroDivisionError("oh"), "ZeroDivisionError: oh", "what is in it can be used"),
    ],
)
def test_what_fails_is_told(error: Exception, cause: str, remedy: str) -> None:
    """The thread ends, its target is left as it is, and no frame of the chunk that failed counts as written."""
    disk = _Disk()
    disk.error = error
    queue = DiskQueue("test", disk, _MOST_BYTES)
    queue.put(disk.job(1), CHUNK_BYTES, is_frame=True)
    while not queue.account.ended_ns:
        time.sleep(0.01)
    queue.put(disk.job(2), 10, is_frame=True)
    ended = queue.finish()
    assert disk.done == [1, f"abandoned: {cause}"]
    assert ended == Queued(lost=2, ended_ns=ended.ended_ns, end=WriteEnd.FAILED, cause=cause, remedy=remedy)
