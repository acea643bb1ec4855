"""A recording that begins and ends while frames flow, and what is said of it."""

import resource
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest

from common import now
from common.diagnostic import Diagnostic, Severity
from common.errors import SettingsError
from common.recording.opened import open_recorded
from phone_host.diagnostics.run_snapshot import RecordingAccount
from phone_host.model import Side
from phone_host.recording.recorder import begin_recording
from phone_host.recording.switch import RecordingSwitch
from tests.support.programs import until
from tests.support.recorded import board_frame, own_frame, payload
from tests.support.samples import CAMERA

_CAMERA = replace(CAMERA, width_px=32, height_px=24)


def _bring(switch: RecordingSwitch, number: int, image: bytes = payload(0)) -> None:
    """A frame of each camera."""
    switch.board_frame(board_frame(number, image, now.monotonic_ns()))
    switch.own_frame(own_frame(number, image, now.monotonic_ns()))
    switch.clock(None, "", 0)


@contextmanager
def _small_files(most_bytes: int) -> Iterator[None]:
    """While the block runs, no file may grow beyond this."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (most_bytes, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def test_a_recording_holds_what_came_between_its_begin_and_its_end(tmp_path: Path) -> None:
    """Not what came before or behind; the board that said hello long before is described; two recordings of a run are two files."""
    switch = RecordingSwitch(lambda path: begin_recording(path, _CAMERA, Side.LEFT))
    assert [switch.end(), switch.account] == [None, None]
    switch.board_camera(_CAMERA)
    _bring(switch, 0)
    switch.begin(tmp_path / "1.mcap")
    with pytest.raises(SettingsError, match="is going on"):
        switch.begin(tmp_path / "no.mcap")
    _bring(switch, 1)
    _bring(switch, 2)
    ended = switch.end('{"a": 1}')
    _bring(switch, 3)
    assert ended is not None
    assert (ended.frames, ended.is_whole, ended.is_over) == (4, True, True)
    assert switch.account == ended
    switch.begin(tmp_path / "2.mcap")
    account = switch.account
    assert account is not None
    assert (account.file, account.is_over) == (str(tmp_path / "2.mcap"), False)
    switch.end()
    found = open_recorded(tmp_path / "1.mcap")
    assert [shown.sequence for shown in found.images["/left/image/compressed"]] == [1, 2]
    assert bytes(found.attachments["cameras.json"]) == b'{"a": 1}'
    assert found.metadata["camera left"]["session"] == "s"
    assert not (tmp_path / "no.mcap").exists()


def test_after_a_failure_another_recording_may_begin(tmp_path: Path) -> None:
    """The disk takes no more: the recording is over, what comes then is counted, and a new one begins elsewhere."""
    switch = RecordingSwitch(lambda path: begin_recording(path, _CAMERA, Side.LEFT))
    with _small_files(300_000):
        switch.begin(tmp_path / "full.mcap")
        _bring(switch, 0, bytes(400_000))
        until(lambda: switch.account is not None and switch.account.is_over, "the recording ends")
    _bring(switch, 1)
    account = switch.account
    assert account is not None
    assert account.lost >= 2
    assert "File too large" in account.words
    switch.begin(tmp_path / "other.mcap")
    _bring(switch, 2)
    ended = switch.end()
    assert ended is not None
    assert (ended.frames, ended.failure) == (2, None)


def test_what_is_said_while_it_grows_and_then() -> None:
    """Time, images, size and room; then what became of them."""
    growing = RecordingAccount(
        file="s.mcap",
        frames=90,
        dropped=0,
        lost=0,
        size_bytes=4_600_000,
        seconds=61.9,
        left_bytes=5 * 10**10,
        is_over=False,
    )
    assert growing.words == "recording: 1:01, 90 images, 5 MB, 50.0 GB left"
    slow = RecordingAccount(file="s.mcap", frames=90, dropped=7, lost=0, size_bytes=0, is_over=False)
    assert slow.words == "recording: 0:00, 90 images, 0 MB, 7 dropped: the disk is too slow"
    assert not slow.is_whole
    failed = RecordingAccount(
        file="s",
        frames=1,
        dropped=0,
        lost=3,
        size_bytes=9,
        failure=Diagnostic("it is full", "make room", Severity.FAIL),
    )
    assert failed.words == "recorded: 1 image, 0.0 MB in s; not in it: 3 came after its end; it is full: make room"
