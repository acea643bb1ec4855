"""Plays a recording into a run: both cameras' frames in the order in which they were received then.

With pace=clock each comes as long after the first as it did then, so that pairing, queue and delays can be studied with other settings. With
pace=demand each comes when the one before it is done with, and time for pairing is the time of then: every run gives the same pairs.
"""

import threading
from dataclasses import replace
from pathlib import Path
from typing import Final, Protocol
from urllib.parse import parse_qsl

from common import now
from common.camera.base import CameraHealth
from common.errors import SettingsError
from common.frame import Frame, SpoiledImageError, find_fault
from common.ledger import BoardMarks, PairLedger, ledger_of
from common.protocol.message import (
    BoardCounts,
    BoardHello,
    FrameMessage,
    Locks,
    LockState,
    Pacing,
    Rung,
    Steering,
)
from common.recording.layout import DELAYS, camera_name
from common.recording.opened import open_recorded
from common.recording.recorded import Shown, size_px
from common.stamp import HOST_CLOCK, Stamp
from phone_host.accounts.link_account import LinkAccount, LinkTally, SessionAccount
from phone_host.model import BoardFrame, Side
from phone_host.recording.both_sides import topics_of
from phone_host.recording.clock_messages import told_clocks
from phone_host.stream.frame_sink import FrameSink
from phone_host.stream.refusals import BoardRefusal
from phone_host.sync.clock import ClockEstimate

LINK: Final = "recording"
_TICK_NS: Final = 50_000_000
"""As often as a receiver lets time pass."""

_LONGEST_WAIT_S: Final = 0.1


class PlayedSink(FrameSink, Protocol):
    """Takes the frames of both sides: a pair queue."""

    def add_host(self, frame: Frame) -> None:
        """Take a frame of this machine's camera."""

    def has_waiting(self) -> bool:
        """Whether a pair waits to be processed."""


class Playback:
    """A recording that is to be played.

    Attributes:
        description: the camera that was this machine's.
        pacing: whether frames come at their times, or when the one before is done with.
        file: the recording.

    Args:
        file: the recording.
        pacing: the same.
        board_side: which images came over the link; None: as the recording says.

    Raises:
        DataError: it cannot be read, or is no recording of two cameras.
    """

    def __init__(self, file: Path, pacing: Pacing, board_side: Side | None = None) -> None:
        self.file, self.pacing = file, pacing
        self.recorded = open_recorded(file)
        self.board_side = board_side or Side(self.recorded.about.board_side)
        topics = topics_of(self.recorded, file)
        self.board = self.recorded.camera(topics[self.board_side])
        self.description = self.recorded.camera(topics[self.board_side.other])
        board = [(each, True) for each in self.recorded.images[topics[self.board_side]]]
        own = [(each, False) for each in self.recorded.images[topics[self.board_side.other]]]
        self.frames = sorted([*board, *own], key=lambda item: item[0].log_ns)
        self.played: PlayedBoard | None = None

    @property
    def is_timeless(self) -> bool:
        """Whether delays from an exposure mean nothing."""
        return self.pacing is Pacing.DEMAND

    def clock_ns(self) -> int:
        """Return the time by which frames are given up, ns."""
        if self.pacing is Pacing.CLOCK or self.played is None:
            return now.monotonic_ns()
        return self.played.now_ns

    def ledgers(self) -> list[PairLedger]:
        """Return the ledgers of the pairs of then."""
        found = []
        for message in self.recorded.texts.get(DELAYS, []):
            try:
                found.append(ledger_of(bytes(message.data).decode("utf-8", "replace")))
            except ValueError:
                continue
        return found

    def into(self, sink: PlayedSink) -> "tuple[PlayedCamera, PlayedBoard]":
        """Return the two streams of a run."""
        self.played = PlayedBoard(self, sink)
        return PlayedCamera(self.played), self.played


class PlayedBoard:
    """The board of then, see BoardStream; and the thread that brings the frames of both sides.

    Attributes:
        spoiled: images that are none, of both cameras.
        now_ns: when the newest frame was due, CLOCK_MONOTONIC.
    """

    def __init__(self, playback: Playback, sink: PlayedSink) -> None:
        self._sink, self._frames, self._pacing = sink, playback.frames, playback.pacing
        self._camera, self._recorded = playback.board, playback.recorded
        told = self._recorded.metadata.get(camera_name(playback.board_side.value), {})
        self._first_session = told.get("session", LINK)
        began = told.get("began_ns", "")
        self._began_ns = int(began) if began.isdecimal() else 0  # the board said hello; 0: before all frames
        self._shift_ns = 0  # from the times of the recording to those of this run
        self._estimates = [(told.log_ns, told.estimate) for told in told_clocks(self._recorded)]
        self._last_sequence = -1
        self._stop, self._changed = threading.Event(), threading.Event()
        self._thread = threading.Thread(target=self._run, name="playback", daemon=True)
        self.account = LinkAccount(links=(LinkTally(LINK),))
        self.hello: BoardHello | None = None
        self.estimate: ClockEstimate | None = None
        self.spoiled = 0
        self.now_ns = 0
        self.ended = False
        self.failure: Exception | None = None
        self.refused: BoardRefusal | None = None
        self.connected = True
        self.carrier = LINK
        self.locks: LockState | None = None

    def start(self) -> None:
        """Let frames come."""
        self._thread.start()

    def stop(self) -> None:
        """Let none come any more."""
        self._stop.set()
        self._changed.set()
        if self._thread.ident is not None:
            self._thread.join()

    def wake(self) -> None:
        """There is room for a frame."""
        self._changed.set()

    def steer(self, later_ns: int) -> None:
        """Do nothing: it exposed when it did."""

    def hold(self, locks: Locks) -> None:
        """Do nothing: it was held as it was."""

    def _run(self) -> None:
        try:
            self._play()
        except Exception as error:  # noqa: BLE001 - a thread's root: the run's root reports it once
            self.failure = error

    def _play(self) -> None:
        self._shift_ns = now.monotonic_ns() - self._frames[0][0].log_ns
        ticked_ns = 0
        for shown, is_board in self._frames:
            due_ns = shown.log_ns + self._shift_ns
            self._await(due_ns)
            if self._stop.is_set():
                return
            self.now_ns = due_ns
            if due_ns - ticked_ns >= _TICK_NS:
                self._sink.tick()
                ticked_ns = due_ns
            if self.hello is None and shown.log_ns >= self._began_ns:
                self._begin()
            self._bring(shown, is_board=is_board)
        self._await(self.now_ns)
        self.ended = True
        self.account.current.ended = True

    def _await(self, due_ns: int) -> None:
        """Wait until a frame is due: at its time, or when no pair waits any more."""
        while not self._stop.is_set():
            if self._pacing is Pacing.DEMAND:
                if not self._sink.has_waiting():
                    return
                self._changed.wait(_LONGEST_WAIT_S)
                self._changed.clear()
                continue
            left_s = (due_ns - now.monotonic_ns()) / 1e9
            if left_s <= 0:
                return
            if left_s > _TICK_NS / 1e9:
                self._sink.tick()
            self._stop.wait(min(left_s, _TICK_NS / 1e9))

    def _bring(self, shown: Shown, *, is_board: bool) -> None:
        image = shown.image.loaded()
        shown = replace(shown, image=image)
        fault = find_fault(image.pixel_format, image.payload)
        try:
            size = size_px(image) if fault is None else (0, 0)
        except SpoiledImageError:
            size = (0, 0)
        if not all(size):
            self.spoiled += 1
        elif is_board:
            self._bring_board(shown, size)
        else:
            self._sink.add_host(self._own_frame(shown, size))

    def _own_frame(self, shown: Shown, size: tuple[int, int]) -> Frame:
        return Frame(
            sequence=shown.sequence,
            exposed=Stamp(shown.image.stamp_ns + self._shift_ns, HOST_CLOCK),
            grabbed=Stamp(shown.grabbed_ns + self._shift_ns, HOST_CLOCK),
            width_px=size[0],
            height_px=size[1],
            pixel_format=shown.image.pixel_format,
            exposure_ns=None,
            payload=shown.image.payload,
        )

    def _bring_board(self, shown: Shown, size: tuple[int, int]) -> None:
        if self.hello is None or shown.sequence < self._last_sequence:
            self._begin()
        self._last_sequence = shown.sequence
        account, tally, hello = self.account.current, self.account.links[0], self.hello
        assert hello is not None
        account.received += 1
        account.latest = BoardCounts(account.received, account.received)
        tally.frames += 1
        tally.bytes += len(shown.image.payload)
        frame = self._board_frame(shown, size, hello.session)
        tally.age.add(frame.received_ns - frame.marks.exposed_ns)
        if self._pacing is Pacing.CLOCK and (objection := self._sink.objection(frame)) is not None:
            account.disbelieved[objection] += 1
            return
        self._sink.add_board(frame)

    def _board_frame(self, shown: Shown, size: tuple[int, int], session: str) -> BoardFrame:
        shift_ns = self._shift_ns
        marks = BoardMarks(
            exposed_ns=shown.image.stamp_ns + shift_ns,
            grabbed_ns=shown.grabbed_ns + shift_ns,
            sent_ns=shown.publish_ns + shift_ns,
        )
        received_ns = shown.log_ns + shift_ns
        if self._pacing is Pacing.DEMAND:  # everything but the exposure, by which it is paired, counts from now
            late_ns = now.monotonic_ns() - received_ns
            received_ns += late_ns
            marks = replace(marks, grabbed_ns=marks.grabbed_ns + late_ns, sent_ns=marks.sent_ns + late_ns)
        while self._estimates and self._estimates[0][0] <= shown.log_ns:
            self.estimate = self._estimates.pop(0)[1]
        known = self.estimate
        offset_ns = 0 if known is None else known.offset_ns + shift_ns + self._recorded.about.unix_ns
        message = FrameMessage(
            session=session,
            sent_index=self.account.current.received - 1,
            sequence=shown.sequence,
            width_px=size[0],
            height_px=size[1],
            pixel_format=shown.image.pixel_format,
            exposure_ns=None,
            marks=marks.moved_to(marks.sent_ns - offset_ns),
            payload=shown.image.payload,
        )
        return BoardFrame(
            message=message,
            link=LINK,
            marks=marks,
            received_ns=received_ns,
            offset_ns=offset_ns,
            uncertainty_ns=0 if known is None else known.uncertainty_ns,
            asked_px=(self._camera.width_px, self._camera.height_px),
            orientation=self._camera.orientation,
        )

    def _begin(self) -> None:
        number = len(self.account.sessions)
        session = f"{self._first_session}{f'-{number}' if number else ''}"
        self.account.sessions.append(SessionAccount(session, BoardCounts(), BoardCounts()))
        self.account.links[0].is_up = True
        self.account.connects += 1
        self.hello = BoardHello(
            session=session, boot_id="", camera=self._camera, counts=BoardCounts(), rung=Rung(), is_long=True
        )
        self._sink.begin(self._camera)
        self._sink.change_period(self._camera.period_ns)


class PlayedCamera:
    """This machine's camera of then; see OwnStream."""

    def __init__(self, player: PlayedBoard) -> None:
        self._player = player
        self.health = CameraHealth()
        self.held: Locks = ()
        self.has_held = True
        self.steering = Steering.NONE
        self.skipped = self.from_the_future = 0
        self.failure: Exception | None = None

    @property
    def spoiled(self) -> int:
        """Images that are none, of both cameras."""
        return self._player.spoiled

    @property
    def ended(self) -> bool:
        """Whether the last frame has come."""
        return self._player.ended

    def hold(self, locks: Locks) -> None:
        """Do nothing: it was held as it was."""

    def steer(self, later_ns: int) -> None:
        """Do nothing: it exposed when it did."""

    def start(self) -> None:
        """Do nothing: the board's side brings both."""

    def stop(self) -> None:
        """Let none come any more."""
        self._player.stop()


_PACES = {pacing.name.lower(): pacing for pacing in Pacing}


def open_playback(text: str, board_side: str | None = None) -> Playback:
    """Open a recording that is to be played.

    Args:
        text: FILE.mcap, FILE.mcap?pace=clock or FILE.mcap?pace=demand.
        board_side: left or right: which images came over the link; None: as the recording says.

    Raises:
        SettingsError: the option is none.
        DataError: it cannot be read, or is no recording of two cameras.
    """
    path, mark, query = text.partition("?")
    options = dict(parse_qsl(query, keep_blank_values=True))
    pace = options.pop("pace", "demand")
    if pace not in _PACES or options or (mark and not query):
        raise SettingsError(f"--replay {text!r} is not understood", "give FILE.mcap, or 'FILE.mcap?pace=clock'")
    return Playback(Path(path), _PACES[pace], None if board_side is None else Side(board_side))
