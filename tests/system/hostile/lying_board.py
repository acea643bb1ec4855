"""A program that plays the board's role with the product's own session, over a real link, and lies when told to.

Its images are those of a replay on the same clock, and it remembers the true exposure of each frame: its pairs are judged by that, whatever its
stamps say. Lies are encoded by hand (`wire.encode`); everything else is done as the board does it.
"""

import queue
import threading
import time
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Final, Self

from board_agent.outbox import Outbox
from common import now
from common.errors import ProtocolError
from common.frame import Frame, PixelFormat
from common.ledger import BoardMarks
from common.link.base import Packet, SendResult
from common.link.waiter import Waiter
from common.link.zeromq import ZeroMqListener
from common.protocol.board_session import BoardSession
from common.protocol.message import (
    BoardCounts,
    CameraDescription,
    DropReason,
    End,
    FrameMessage,
    HostHello,
    Knock,
    Lane,
    Message,
    Pacing,
    Pong,
    Steering,
)
from common.protocol.session import Outgoing
from common.protocol.wire import decode, encode
from common.stamp import Stamp
from tests.support.numbered import HEIGHT_PX, WIDTH_PX
from tests.support.sent_frames import frame_outgoing
from tests.system.hostile.scene import FPS, FRAMES, PERIOD_NS, Pair, film

Twist = Callable[[Message], Iterable[Message]]
"""Turns an outgoing message into what is sent instead."""

_STEP_MS: Final = 2
_MOST_S: Final = 20.0


def honest(message: Message) -> Iterable[Message]:
    """The original, unchanged."""
    return (message,)


class LyingBoard:
    """A board in a thread.

    Args:
        address: `tcp://HOST:PORT` or `ipc://PATH` to listen at.
    """

    def __init__(self, address: str) -> None:
        self._link = ZeroMqListener(address, board=True)
        self._waiter = Waiter(self._link.pollables)
        self._images = [(film() / f"{number}.jpg").read_bytes() for number in range(FRAMES)]
        self.camera = CameraDescription(
            name="liar",
            width_px=WIDTH_PX,
            height_px=HEIGHT_PX,
            pixel_format=PixelFormat.MJPEG,
            period_ns=PERIOD_NS,
            pacing=Pacing.CLOCK,
            steering=Steering.GRID,
        )
        self._boot_id = now.random_id()
        self.lanes: dict[Lane, bytes] = {}
        self._outbox = Outbox()
        self.session = BoardSession(now.random_id(), self._boot_id, self.camera)
        self._sequence = 0
        self._exposed: dict[int, int] = {}
        self.spoilt: set[int] = set()
        self._next = self._image_at(now.monotonic_ns()) + 1
        self._twist: Twist = honest
        self._jobs: queue.SimpleQueue[Callable[[], object]] = queue.SimpleQueue()
        self._stopping = False
        self.failure: BaseException | None = None
        self._thread = threading.Thread(target=self._run, name="liar", daemon=True)
        self._thread.start()

    @property
    def counts(self) -> BoardCounts:
        """The honest account of its frames."""
        return self._outbox.counts

    def true_ns(self, pair: Pair) -> int:
        """Return the true exposure of a pair's board frame."""
        return self._exposed.get(pair.sequence, 0)

    def twist(self, twist: Twist) -> None:
        """Pass everything through this filter from now on."""
        self._twist = twist

    def lie(
        self, kind: type[Message], times: int, change: Callable[[Message], Iterable[Message]], *, spoils: bool = False
    ) -> None:
        """Change the next messages of a kind, and wait until that is done.

        Args:
            kind: of the messages.
            times: how many.
            change: turns a message into its lie.
            spoils: whether the changed messages are frames that can no longer be paired.
        """
        done = threading.Event()
        left = times

        def once(message: Message) -> Iterable[Message]:
            nonlocal left
            if not isinstance(message, kind):
                return (message,)
            left -= 1
            if spoils and isinstance(message, FrameMessage):
                self.spoilt.add(message.sequence)
            if left <= 0:
                self._twist = honest
                done.set()
            return change(message)

        self._twist = once
        if not done.wait(_MOST_S):
            self._twist = honest

    def do(self, job: Callable[[], object]) -> None:
        """Run a job in the board's thread, between its other work, and wait for it."""
        done = threading.Event()

        def run() -> None:
            job()
            done.set()

        self._jobs.put(run)
        assert done.wait(_MOST_S) or self._stopping, "the liar's thread does not answer"

    def say(self, lane: Lane, message: Message) -> SendResult:
        """Send a message on a lane of the host; call this from a job."""
        header, payload = encode(message)
        return self.say_bytes(lane, header, payload)

    def say_bytes(self, lane: Lane, header: bytes, payload: bytes | bytearray | memoryview = b"") -> SendResult:
        """Send any bytes likewise."""
        return self._link.send(self.lanes[lane], header, payload) if lane in self.lanes else SendResult.UNREACHABLE

    def say_parts(self, lane: Lane, parts: list[bytes]) -> None:
        """Send any number of parts likewise; none of our links does that."""
        self._link.router.send_multipart([self.lanes[lane], *parts])

    def begin_session(self, camera: CameraDescription) -> None:
        """Begin a new session with this camera, and have the host say hello again; call this from a job."""
        self._outbox = Outbox()
        self.session = BoardSession(now.random_id(), self._boot_id, camera)
        for lane in self.lanes:
            self.say(lane, Knock(lane, self.session.session))

    def a_frame(self, payload: bytes, index: int) -> FrameMessage:
        """Return a current frame that nobody asked for."""
        ns = now.monotonic_ns()
        frame = self._frame(ns, ns, payload)
        return FrameMessage(
            session=self.session.session,
            sent_index=index,
            sequence=frame.sequence,
            width_px=frame.width_px,
            height_px=frame.height_px,
            pixel_format=frame.pixel_format,
            exposure_ns=None,
            marks=BoardMarks(exposed_ns=ns, grabbed_ns=ns, sent_ns=ns),
            payload=frame.payload,
        )

    def end(self) -> None:
        """Say that no frame follows."""
        self.say(Lane.FRAMES, End(self.session.session, self.counts))

    def stop(self) -> None:
        """Stop the board without a goodbye."""
        self._stopping = True
        self._thread.join()
        self._link.close()
        if self.failure is not None:
            raise self.failure

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """End the board."""
        self.stop()

    def _run(self) -> None:
        try:
            while not self._stopping:
                self._waiter.wait(_STEP_MS)
                self._receive()
                self._show()
                if now.monotonic_ns() >= self.session.due_ns:
                    self._send_all(self.session.tick(now.monotonic_ns(), self.counts))
                while not self._jobs.empty():
                    self._jobs.get()()
        except BaseException as error:  # noqa: BLE001 - a thread's root: `stop` raises it
            self.failure = error
            self._stopping = True

    def _receive(self) -> None:
        for incoming in self._link.receive():
            if not isinstance(incoming, Packet):
                continue
            try:
                message = decode(incoming.header, incoming.payload)
            except ProtocolError:
                continue
            if isinstance(message, HostHello):
                self.lanes[message.lane] = incoming.connection
            connection = b"\0" + incoming.connection
            self._send_all(self.session.receive(connection, message, now.monotonic_ns(), self.counts))

    def _show(self) -> None:
        now_ns = now.monotonic_ns()
        while (exposed_ns := self._time_of(self._next)) <= now_ns:
            frame = self._frame(exposed_ns, now_ns, self._images[self._next % FRAMES])
            self._next += 1
            self._outbox.put(frame, has_host=self.session.has_host)
        waiting = self._outbox.waiting
        if waiting is None or not self.session.has_credit:
            return
        if self._send(frame_outgoing(self.session, waiting)) is SendResult.SENT:
            self.session.sent(now.monotonic_ns())
            self._outbox.sent()
        else:
            self._outbox.discard(DropReason.LINK_FULL)

    def _frame(self, exposed_ns: int, now_ns: int, image: bytes) -> Frame:
        self._exposed[self._sequence] = exposed_ns
        frame = Frame(
            sequence=self._sequence,
            exposed=Stamp(exposed_ns, "liar"),
            grabbed=Stamp(now_ns, "liar"),
            width_px=self.camera.width_px,
            height_px=self.camera.height_px,
            pixel_format=PixelFormat.MJPEG,
            exposure_ns=None,
            payload=image,
        )
        self._sequence += 1
        return frame

    def _send_all(self, outgoing: list[Outgoing]) -> None:
        for item in outgoing:
            self._send(item)

    def _send(self, outgoing: Outgoing) -> SendResult:
        result = SendResult.SENT
        for message in self._twist(_stamped(outgoing.message)):
            header, payload = encode(message)
            result = self._link.send(outgoing.connection[1:], header, payload)
        return result

    @staticmethod
    def _time_of(index: int) -> int:
        return (2 * index * 1_000_000_000 + FPS) // (2 * FPS)

    @staticmethod
    def _image_at(now_ns: int) -> int:
        return now_ns * FPS // 1_000_000_000


def _stamped(message: Message) -> Message:
    """Insert the time of sending at the last moment, as the board does."""
    match message:
        case FrameMessage():
            return replace(message, marks=replace(message.marks, sent_ns=time.monotonic_ns()))
        case Pong():
            return replace(message, t2_ns=time.monotonic_ns())
        case _:
            return message
