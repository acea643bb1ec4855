"""board-agent record: keep the camera's frames on this board's disk, without a host."""

import argparse
import json
import os
import shutil
import socket
import sys
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Final

from board_agent.await_camera import wait_for_camera
from board_agent.disk_writer import SIDE, DiskWriter
from board_agent.recording import BoardRecording, End, Outcome
from board_agent.ring import PARTS, BoundedFiles, parts_of
from board_agent.sd_notify import Notifier
from board_agent.settings import LONGEST_S, check, resolve_settings
from common import now
from common.camera.base import Camera, CameraHealth, CameraState, health_values
from common.camera.factory import open_camera
from common.camera.options import EXAMPLE
from common.errors import SettingsError, UnavailableError
from common.program import logs
from common.program.commandline import CHECK_FAILED, INTERRUPTED
from common.program.settings import log_level, with_origins
from common.program.signals import StopSignals
from common.program.terminal import fitted
from common.protocol.message import Pacing
from common.recording.layout import ABOUT, About, camera_name, camera_values
from common.recording.opened import is_recording
from common.recording.recording_file import RecordingFile
from common.stamp import board_clock
from common.versions import all_versions
from common.words import counted

_LEAST_BYTES: Final = 1_000_000
_LEAST_RING_BYTES: Final = PARTS * 2_000_000
"""A part that holds less is mostly what stands at the begin of each."""

_SHARE: Final = 0.9
"""A system whose disk is full does nothing well."""

_BACK_AND_CLEAR: Final = "\r\033[K"


def run(options: argparse.Namespace) -> int:
    """Record until stopped, until the time is over, or until it is full."""
    found = resolve_settings(options)
    settings = found.values
    check(settings)
    logs.set_up(log_level(settings.log_level))
    if not settings.camera:
        raise SettingsError("no camera is given", f"use --camera {EXAMPLE}")
    if not 0 <= options.seconds < LONGEST_S:
        raise SettingsError(f"--seconds is {options.seconds:g}", "give 0 (no limit) or more seconds")
    bound = _bound(options)
    signals = StopSignals()
    boot_id = now.boot_id()
    with closing(Notifier(os.environ)) as notifier:
        clock = board_clock(boot_id)
        if settings.wait_for_camera:
            camera = wait_for_camera(settings.camera, clock, signals.reader, notifier)
        else:
            camera = open_camera(settings.camera, clock, now.monotonic_ns())
        if camera is None:
            return INTERRUPTED if signals.interrupted else 0
        with closing(camera):
            if camera.description.pacing is not Pacing.CLOCK:
                raise SettingsError("--camera has pace=demand, and so no clock", "give it fps= or pace=clock")
            attached = json.dumps(with_origins(found, vars(options), sys.argv)).encode()
            begin = partial(_begin, camera, now.random_id(), boot_id, attached)
            status = _Status(bound, notifier, sys.stderr.isatty() and not options.json, now.monotonic_ns())
            outcome = _record(camera, bound, options.seconds, begin, signals.reader, status)
            health = camera.health
        notifier.stopping(outcome.end.value)
    return _tell(outcome, health, bound, as_json=options.json, is_interrupted=signals.interrupted)


@dataclass(frozen=True, slots=True)
class _Bound:
    """Where a recording lies and what it may take, bytes."""

    path: Path
    most_bytes: int
    is_ring: bool

    @property
    def name(self) -> str:
        """What people are told."""
        return f"{self.path.with_suffix('')}-*.mcap" if self.is_ring else str(self.path)


@dataclass(frozen=True, slots=True)
class _Status:
    """Shows how it goes, on a terminal and in the service's status."""

    bound: _Bound
    notifier: Notifier
    is_seen: bool
    began_ns: int

    def show(self, writer: DiskWriter, grabbed: int, state: CameraState) -> None:
        """Show it."""
        now_ns, written = now.monotonic_ns(), writer.account
        minutes, seconds = divmod((now_ns - self.began_ns) // 1_000_000_000, 60)
        left = f"{max(0, self.bound.most_bytes - written.size_bytes) / 1e6:.0f} MB left"
        left = f"{counted(written.gave_way, 'part')} gave way" if self.bound.is_ring else left
        gone = "" if state is CameraState.RUNNING else ", the camera is gone"
        text = f"{minutes}:{seconds:02} {counted(grabbed, 'frame')}, {written.size_bytes / 1e6:.0f} MB, {left}{gone}"
        if self.is_seen:
            print(_BACK_AND_CLEAR + text, end="", file=sys.stderr, flush=True)
        if self.notifier.due(now_ns):
            self.notifier.alive(now_ns, f"recording: {text}")

    def clear(self) -> None:
        """Leave the terminal's line empty."""
        if self.is_seen:
            print(end=_BACK_AND_CLEAR, file=sys.stderr, flush=True)


def _bound(options: argparse.Namespace) -> _Bound:
    """Return what the recording may take.

    Raises:
        SettingsError: it is too little, or the file has another ending.
        UnavailableError: its folder is not there, or has no room.
    """
    path: Path = options.out
    if not is_recording(path.name):
        raise SettingsError(f"--out {path} does not end in .mcap", "give FILE.mcap")
    try:
        free = shutil.disk_usage(path.parent).free
    except OSError as error:
        raise UnavailableError(
            f"{path.parent} cannot be used ({error.strerror})", "name a folder that is there"
        ) from None
    is_ring = options.ring is not None
    option = "--ring" if is_ring else "--most"
    least = _LEAST_RING_BYTES if is_ring else _LEAST_BYTES
    given = options.ring if is_ring else options.most
    if given is not None and given < least:
        raise SettingsError(f"{option} is {given / 1e6:g} MB", f"give at least {least // 1_000_000}MB")
    if is_ring:
        free += sum(part.stat().st_size for part in parts_of(path).values())
    most = round(free * _SHARE) if given is None else round(given)
    if most > free or most < least:
        remedy = f"give at most {int(free * _SHARE) // 1_000_000}MB, or make room" if free > 2 * least else "make room"
        raise UnavailableError(f"the disk of {path} has room for {free / 1e6:.0f} MB", remedy)
    return _Bound(path, most, is_ring)


def _record(  # noqa: PLR0917 - what a recording is made of
    camera: Camera,
    bound: _Bound,
    seconds: float,
    begin: Callable[[int, RecordingFile], None],
    wake: socket.socket,
    status: _Status,
) -> Outcome:
    unix_ns = now.unix_offset_ns()
    try:
        files = BoundedFiles(bound.path, bound.most_bytes, partial(begin, unix_ns), is_ring=bound.is_ring)
    except OSError as error:
        raise UnavailableError(f"{bound.name} cannot be written ({error.strerror})", "make room") from None
    writer = DiskWriter(files, unix_ns)
    until_ns = now.monotonic_ns() + round(seconds * 1e9) if seconds else None
    recording = BoardRecording(camera, writer, wake, until_ns, partial(status.show, writer))
    try:
        return recording.run()
    finally:
        status.clear()


def _begin(camera: Camera, session: str, boot_id: str, attached: bytes, unix_ns: int, file: RecordingFile) -> None:  # noqa: PLR0917 - bound in two steps
    """Write whose recording it is, at the begin of each file."""
    at_ns = unix_ns + now.monotonic_ns()
    about = About(unix_ns=unix_ns, board_side=SIDE, board_boot_id=boot_id, versions=all_versions())
    file.tell(ABOUT, about.values())
    told = {**camera_values(camera.description), "session": session, "boot_id": boot_id, "began_ns": str(at_ns)}
    file.tell(camera_name(SIDE), told)
    file.attach("settings.json", "application/json", attached, at_ns)
    file.sync()


_ENDS: Final[dict[End, str]] = {
    End.STOPPED: "",
    End.TIME: "",
    End.CAMERA: "; the camera ended",
    End.FULL: "; it is full",
    End.FAILED: "; it ended early",
    End.SLEPT: "; it ended early: this machine slept, and its clock stood still meanwhile: record again",
}


def _tell(outcome: Outcome, health: CameraHealth, bound: _Bound, *, as_json: bool, is_interrupted: bool) -> int:
    written = outcome.written
    if as_json:
        values = {
            "file": str(bound.path),
            "ended": outcome.end.name.lower(),
            "grabbed": outcome.grabbed,
            "frames": written.frames,
            "dropped": written.dropped,
            "lost": written.lost,
            "spoiled": outcome.spoiled,
            "skipped": outcome.skipped,
            "size_bytes": written.size_bytes,
            "files": written.files,
            "gave_way": written.gave_way,
            "camera": health_values(health),
        }
        print(json.dumps(values))
    else:
        print(fitted(_words(outcome, bound)))
    if is_interrupted:
        return INTERRUPTED
    return CHECK_FAILED if outcome.end in {End.FAILED, End.SLEPT} or written.dropped or not written.frames else 0


def _words(outcome: Outcome, bound: _Bound) -> str:
    """Return one line for people."""
    written = outcome.written
    parts = f" in {counted(written.files, 'part')}, {written.gave_way} gave way" if bound.is_ring else ""
    missing = [
        f"{count} {why}"
        for count, why in (
            (written.dropped, "too fast for the disk"),
            (outcome.skipped, "too fast for this machine"),
            (outcome.spoiled, "spoiled"),
        )
        if count
    ]
    told = f"; not in it: {', '.join(missing)}" if missing else ""
    ended = _ENDS[outcome.end]
    if outcome.end is End.FAILED:
        ended += f" ({written.cause}): {written.remedy}"
    if not written.frames and outcome.end is not End.FAILED:
        ended += "; no image came: look at the camera with board-agent doctor"
    size = f"{written.size_bytes / 1e6:.1f} MB"
    return f"recorded: {counted(written.frames, 'image')}, {size} in {bound.name}{parts}{told}{ended}"
