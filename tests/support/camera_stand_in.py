"""The program's half of a browser's camera, played: it speaks the wire, keeps what came, and says what a test wants it to say."""

import asyncio
import json
import struct
import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from aiohttp import WSCloseCode, WSMsgType, web

from common import now

HEADER = struct.Struct("<BBHHHIIdddddII")
BUSY = {"problem": "another browser is the camera", "remedy": "stop it there, or close its page"}


@dataclass(frozen=True, slots=True)
class Frame:
    """One frame as it came; stamps in us on the browser's line, arrival on this machine's.

    Attributes:
        payload: JPEG, or luma.
        received_ns: CLOCK_MONOTONIC.
    """

    is_luma: bool
    rotation: int
    width: int
    height: int
    sequence: int
    dropped: int
    timestamp_us: float
    capture_us: float
    callback_us: float
    encoded_us: float
    sent_us: float
    exposure_us: int
    payload: bytes
    received_ns: int


@dataclass
class CameraStandIn:
    """Answers `/ws/camera` and `/ws/camera/clock`.

    Attributes:
        token: that a browser must say.
        welcome: what it is told first, beside the session.
        window: frames that may be under way; None: nothing is granted but by `grant`.
        frames: that came, newest last.
        said: texts that came, but for echoes.
        offsets_us: of each echo: round trip, and this machine's clock minus the browser's.
    """

    token: str
    welcome: dict[str, Any] = field(default_factory=lambda: {"want": {}, "locks": None})
    window: int | None = 4
    frames: list[Frame] = field(default_factory=list)
    said: list[dict[str, Any]] = field(default_factory=list)
    offsets_us: list[tuple[float, float]] = field(default_factory=list)
    is_away: bool = False

    def __post_init__(self) -> None:
        """Begin without a browser."""
        self._loop: asyncio.AbstractEventLoop | None = None
        self._seat: web.WebSocketResponse | None = None
        self._changed = threading.Condition()

    def routes(self) -> list[web.RouteDef]:
        """Its two addresses."""
        return [web.get("/ws/camera", self._camera), web.get("/ws/camera/clock", self._clock)]

    def until(self, holds: Callable[[], object]) -> None:
        """Wait until something holds, up to a minute."""
        with self._changed:
            assert self._changed.wait_for(holds, 60), self.said[-3:]

    def of_kind(self, kind: str) -> list[dict[str, Any]]:
        """All texts of a kind that came."""
        return [each for each in self.said if each["kind"] == kind]

    def tell(self, **message: Any) -> None:
        """Say something to the browser that feeds."""
        self._do(lambda seat: seat.send_str(json.dumps(message)))

    def grant(self, count: int) -> None:
        """Let the browser send until it has sent so many on this connection."""
        self.tell(kind="credit", up_to=count)

    def hang_up(self) -> None:
        """Close the connection, as a program that ends."""
        self._do(lambda seat: seat.close(code=WSCloseCode.GOING_AWAY))

    def _do(self, work: Callable[[web.WebSocketResponse], Any]) -> None:
        assert self._loop is not None
        assert self._seat is not None
        asyncio.run_coroutine_threadsafe(work(self._seat), self._loop).result(30)

    def _note(self, note: Callable[[], None]) -> None:
        with self._changed:
            note()
            self._changed.notify_all()

    async def _camera(self, request: web.Request) -> web.StreamResponse:
        if self.is_away:
            raise web.HTTPServiceUnavailable
        socket = web.WebSocketResponse(compress=False, max_msg_size=1 << 23)
        await socket.prepare(request)
        self._loop = asyncio.get_running_loop()
        hello = json.loads((await socket.receive(30)).data)
        self._note(lambda: self.said.append(hello))
        if hello["token"] != self.token or (self._seat is not None and not self._seat.closed):
            await socket.send_str(json.dumps({"kind": "refused"} | BUSY))
            await socket.close(code=WSCloseCode.POLICY_VIOLATION)
            return socket
        self._seat = socket
        await socket.send_str(json.dumps({"kind": "welcome", "session": "5e55"} | self.welcome))
        count = 0
        if self.window:
            await socket.send_str(json.dumps({"kind": "credit", "up_to": self.window}))
        async for message in socket:
            received_ns = now.monotonic_ns()
            if message.type is WSMsgType.TEXT:
                self._note(lambda text=message.data: self.said.append(json.loads(text)))  # type: ignore[misc]
            if message.type is WSMsgType.BINARY:
                count += 1
                frame = _frame(message.data, received_ns)
                self._note(lambda frame=frame: self.frames.append(frame))  # type: ignore[misc]
                if self.window:
                    await socket.send_str(json.dumps({"kind": "credit", "up_to": count + self.window}))
        return socket

    async def _clock(self, request: web.Request) -> web.StreamResponse:
        socket = web.WebSocketResponse(compress=False)
        await socket.prepare(request)
        hello = json.loads((await socket.receive(30)).data)
        assert hello == {"kind": "hello", "session": "5e55"}
        marks: dict[int, tuple[int, int]] = {}
        async for message in socket:
            t1 = now.monotonic_ns()
            said = json.loads(message.data)
            if said["kind"] == "echo":
                marks[said["n"]] = (t1, now.monotonic_ns())
                await socket.send_str(json.dumps(said | {"t1": str(t1), "t2": str(marks[said["n"]][1])}))
            else:
                first, second = (mark / 1000 for mark in marks.pop(said["n"]))
                trip = (said["t3"] - said["t0"]) - (second - first)
                offset = ((first - said["t0"]) + (second - said["t3"])) / 2
                self._note(lambda pair=(trip, offset): self.offsets_us.append(pair))  # type: ignore[misc]
        return socket


def _frame(message: bytes, received_ns: int) -> Frame:
    version, encoding, *values, reserved = HEADER.unpack_from(message)
    assert (version, reserved) == (1, 0)
    return Frame(encoding == 1, *(*values, message[HEADER.size :], received_ns))
