"""The page's half of a browser's camera, played by a program: it says hello, echoes the clock and sends frames for credit.

It runs in a thread with an event loop of its own. What it does by itself, it does right; a test says what it shall do wrong.
"""

import asyncio
import json
import math
import struct
import threading
import time
from collections.abc import Callable, Coroutine, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from types import TracebackType
from typing import Any, Final, Self

import aiohttp

HEAD: Final = struct.Struct("<BBHHHIIdddddII")
JPEG, LUMA = 0, 1

SLOW_S: Final = 60.0

_LAST_TURNS: Final = 5
"""Turns of the loop in which aiohttp closes its sockets, after the session has ended."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Shot:
    """An image with its header, times in us on the browser's clock but for the stamp."""

    payload: bytes
    width: int
    height: int
    encoding: int = JPEG
    rotation: int = 0
    stamp_us: float = 0.0
    capture_us: float = math.nan
    callback_us: float = 0.0
    exposure_us: int = 0
    version: int = 1

    def packed(self, sequence: int, dropped: int, sent_us: float) -> bytes:
        """The message."""
        head = HEAD.pack(
            self.version,
            self.encoding,
            self.rotation,
            self.width,
            self.height,
            sequence,
            dropped,
            self.stamp_us,
            self.capture_us,
            self.callback_us,
            (self.callback_us + sent_us) / 2,
            sent_us,
            self.exposure_us,
            0,
        )
        return head + self.payload


@dataclass(slots=True, kw_only=True)
class Script:
    """How a browser behaves.

    Attributes:
        shots: its images, shown in turn.
        fps: its rate.
        origin_us: its clock's zero, CLOCK_MONOTONIC, us.
        epoch_us: zero of its stamps, likewise; 0: they are CLOCK_MONOTONIC.
        late_s: from the stamp of an image to its callback.
        label: of its camera.
        device: id of its camera.
        track: of its camera.
        spoil: changes what is about to be sent.
    """

    shots: Sequence[Shot]
    fps: float = 30.0
    origin_us: float = -1.7e15
    epoch_us: float = 0.0
    late_s: float = 0.004
    label: str = "camera2 0, facing back"
    device: str = "d0"
    track: str = "t0"
    browser: str = "Mozilla/5.0 (X11; Linux) Chrome/156"
    spoil: Callable[[Shot], Shot] = field(default=lambda shot: shot)


class ScriptedBrowser:
    """A browser that gives its camera while the block lasts.

    Args:
        url: the page's first address, with its token.
        script: how it behaves.
    """

    def __init__(self, url: str, script: Script) -> None:
        self._address, _, self._token = url.partition("/?token=")
        self.script = script
        self.heard: list[dict[str, Any]] = []
        self.sent = self.dropped = self.sequence = 0
        self.up_to = 0
        self.is_away = self.is_still = False
        self.locks: dict[str, dict[str, object]] = {}
        self._loop = asyncio.new_event_loop()
        self._socket: aiohttp.ClientWebSocketResponse | None = None
        self._stop = asyncio.Event()
        self._thread = threading.Thread(target=self._loop.run_until_complete, args=(self._run(),), daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._loop.call_soon_threadsafe(self._stop.set)
        self._thread.join(SLOW_S)
        self._loop.close()

    def now_us(self) -> float:
        """The browser's clock."""
        return time.monotonic_ns() / 1000 - self.script.origin_us

    def say(self, **words: object) -> None:
        """Send a text."""
        self._do(lambda socket: socket.send_str(json.dumps(words)))

    def send(self, data: bytes) -> None:
        """Send bytes."""
        self._do(lambda socket: socket.send_bytes(data))

    def leave(self) -> None:
        """Go away, and stay away until `come`."""
        self.is_away = True
        self._do(lambda socket: socket.close())

    def come(self) -> None:
        """Come back."""
        self.is_away = False

    def told(self, kind: str) -> list[dict[str, Any]]:
        """What the host has said of one kind."""
        return [said for said in list(self.heard) if said.get("kind") == kind]

    def _do(self, what: Callable[[aiohttp.ClientWebSocketResponse], Coroutine[Any, Any, Any]]) -> None:
        socket = self._socket
        assert socket is not None
        asyncio.run_coroutine_threadsafe(what(socket), self._loop).result(SLOW_S)

    async def _run(self) -> None:
        visits = asyncio.ensure_future(self._visits())
        await self._stop.wait()
        visits.cancel()
        await asyncio.gather(visits, return_exceptions=True)
        for _ in range(_LAST_TURNS):
            await asyncio.sleep(0)

    async def _visits(self) -> None:
        async with aiohttp.ClientSession(self._address) as client:
            while True:
                if not self.is_away:
                    with suppress(OSError, aiohttp.ClientError):
                        await self._visit(client)
                await asyncio.sleep(0.05)

    async def _visit(self, client: aiohttp.ClientSession) -> None:
        self.sent = self.up_to = 0
        async with client.ws_connect("/ws/camera") as socket:
            self._socket = socket
            await socket.send_str(json.dumps(self.hello()))
            parts: list[asyncio.Future[None]] = []
            try:
                async for message in socket:
                    said = json.loads(message.data)
                    self.heard.append(said)
                    if said["kind"] == "welcome":
                        parts += [
                            asyncio.ensure_future(self._film(socket)),
                            asyncio.ensure_future(self._clock(client, said["session"])),
                        ]
                    elif said["kind"] == "credit":
                        self.up_to = said["up_to"]
                    elif said["kind"] == "lock":
                        self.locks |= said["groups"]
                        got = {name: {"asked": group, "got": group} for name, group in self.locks.items()}
                        await socket.send_str(json.dumps({"kind": "locked", "groups": got, "refused": {}}))
            finally:
                for part in parts:
                    part.cancel()
                await asyncio.gather(*parts, return_exceptions=True)

    def hello(self) -> dict[str, object]:
        """Its first words."""
        script = self.script
        return {
            "kind": "hello",
            "version": 1,
            "token": self._token,
            "browser": script.browser,
            "track": script.track,
            "device": {"id": script.device, "label": script.label, "facing": "environment"},
            "path": "processor",
            "isolated": True,
            "settings": {},
            "capabilities": {},
        }

    def shot(self, index: int) -> Shot:
        """Image `index` of its film, exposed at index / fps of CLOCK_MONOTONIC and handed over now."""
        script = self.script
        shown = script.shots[index % len(script.shots)]
        stamp_us = index / script.fps * 1e6 - script.epoch_us
        return replace(shown, stamp_us=stamp_us, callback_us=self.now_us())

    async def _film(self, socket: aiohttp.ClientWebSocketResponse) -> None:
        index = int(time.monotonic() * self.script.fps)
        while True:
            index = max(index + 1, int((time.monotonic() - self.script.late_s) * self.script.fps))
            await asyncio.sleep(max(0.0, index / self.script.fps + self.script.late_s - time.monotonic()))
            if self.is_still:
                continue
            shot = self.shot(index)
            number, self.sequence = self.sequence, self.sequence + 1
            if self.sent < self.up_to:
                self.sent += 1
                shot = self.script.spoil(shot)
                await socket.send_bytes(shot.packed(number, self.dropped, self.now_us()))
            else:
                self.dropped += 1

    async def _clock(self, client: aiohttp.ClientSession, session: str) -> None:
        async with client.ws_connect("/ws/camera/clock") as socket:
            await socket.send_str(json.dumps({"kind": "hello", "session": session}))
            number = 0
            while True:
                t0_us = self.now_us()
                await socket.send_str(json.dumps({"kind": "echo", "n": number, "t0": t0_us}))
                said = json.loads((await socket.receive()).data)
                t3_us = self.now_us()
                assert (said["n"], said["t0"]) == (number, t0_us)
                await socket.send_str(json.dumps({"kind": "echoed", "n": number, "t0": t0_us, "t3": t3_us}))
                number += 1
                await asyncio.sleep(0.02 if number < 10 else 0.1 if number < 30 else 1.0)
