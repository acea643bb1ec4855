"""Browsers that give their cameras: two WebSockets each, whose messages go to the program's feed as they come.

Here only the door is kept: the token or the session comes first and in time, sizes, rates and numbers are bounded, and a
peer that has gone is noticed. What the messages mean is the feed's business.
"""

import asyncio
from collections.abc import Callable
from contextlib import suppress
from typing import Any, Final

from aiohttp import WSCloseCode, WSMsgType, web

from common import now
from common.diagnostic import Diagnostic, Severity
from phone_host.output.json_text import json_text
from phone_host.web.door import KNOWN, problem
from phone_host.web.gate import Gate, is_loopback
from phone_host.web.rates import Rate
from phone_host.web.settings import Limits
from phone_host.web.source import Feed, Hearer
from phone_host.web.wishes import token_in

_NO_FEED: Final = Diagnostic(
    "nothing here takes a browser's camera", "start phone-host serve, or run --serve --camera browser:", Severity.FAIL
)
_NO_TOKEN: Final = Diagnostic(
    "this needs the token of the first address", "open the address that phone-host printed", Severity.FAIL
)

_ALIVE_S: Final = 5.0
"""A browser that has gone without a word, as when its Wi-Fi is lost, is noticed within this time and half of it again."""

_CLOSE_S: Final = 1.0
_MOST_SAID: Final = 256
"""Texts that wait to be sent; a browser that reads none of so many is gone."""


class SocketLine:
    """One WebSocket, for threads that know no event loop."""

    def __init__(self, socket: web.WebSocketResponse, *, is_near: bool) -> None:
        self._socket, self._loop = socket, asyncio.get_running_loop()
        self._said: asyncio.Queue[str | None] = asyncio.Queue()
        self.is_near: Final = is_near

    def say(self, text: str) -> None:
        """See Line."""
        self._put(text)

    def close(self) -> None:
        """See Line."""
        self._put(None)

    def _put(self, text: str | None) -> None:
        with suppress(RuntimeError):  # the loop has ended
            self._loop.call_soon_threadsafe(self._said.put_nowait, text)

    async def send(self) -> None:
        """Send what is said until the line is to be closed, and close it."""
        text = await self._said.get()
        while text is not None and self._said.qsize() < _MOST_SAID:
            await self._socket.send_str(text)
            text = await self._said.get()
        await self._socket.close(code=WSCloseCode.POLICY_VIOLATION)


class CameraLines:
    """All WebSockets of browsers that give their cameras.

    Args:
        feed: takes them; None: nothing does.
        gate: knows the token.
        limits: of numbers, sizes and rates.
    """

    def __init__(self, feed: Feed | None, gate: Gate, limits: Limits) -> None:
        self._feed, self._gate, self._limits = feed, gate, limits
        self._open: Final[dict[web.WebSocketResponse, bool]] = {}

    async def frames(self, request: web.Request) -> web.StreamResponse:
        """Serve a browser's first WebSocket until it ends."""
        feed = self._feed
        if feed is None:
            return problem(404, _NO_FEED)

        def begun(line: SocketLine, hello: str) -> Hearer | None:
            if self._gate.is_token(token_in(hello)):
                return feed.camera(line, hello)
            line.say(json_text({"kind": "refused", "problem": _NO_TOKEN.message, "remedy": _NO_TOKEN.remedy}))
            line.close()
            return None

        return await self._serve(request, begun, self._limits.frame_bytes)

    async def echoes(self, request: web.Request) -> web.StreamResponse:
        """Serve a browser's second WebSocket until it ends."""
        return (
            problem(404, _NO_FEED)
            if self._feed is None
            else await self._serve(request, self._feed.clock, self._limits.message_bytes)
        )

    async def close(self) -> None:
        """Tell all of them goodbye."""
        closing = (self._closed(socket) for socket in list(self._open))
        await asyncio.gather(*closing)

    async def _serve(
        self, request: web.Request, begin: Callable[[SocketLine, str], Hearer | None], most_bytes: int
    ) -> web.StreamResponse:
        is_known = request[KNOWN]
        if sum(known is is_known for known in self._open.values()) >= self._limits.cameras:
            raise web.HTTPServiceUnavailable(headers={"Retry-After": "5"})
        if request.headers.get("Upgrade", "").lower() != "websocket":
            raise web.HTTPBadRequest
        socket = web.WebSocketResponse(compress=False, max_msg_size=most_bytes, heartbeat=_ALIVE_S, timeout=_CLOSE_S)
        self._open[socket] = is_known
        try:
            await socket.prepare(request)
            line = SocketLine(socket, is_near=is_loopback(request.remote or ""))
            await self._talk(socket, line, begin)
        finally:
            del self._open[socket]
        return socket

    async def _talk(
        self, socket: web.WebSocketResponse, line: SocketLine, begin: Callable[[SocketLine, str], Hearer | None]
    ) -> None:
        first = await self._first(socket)
        if first is None:
            await socket.close(code=WSCloseCode.POLICY_VIOLATION, message=b"say hello")
            return
        hearer = begin(line, first)
        sending = asyncio.ensure_future(line.send())
        try:
            if hearer is not None:
                await self._hear(socket, hearer)
            else:
                await asyncio.wait([sending], timeout=_CLOSE_S)
        finally:
            if hearer is not None:
                hearer.left()
            sending.cancel()
            await asyncio.gather(sending, return_exceptions=True)
            await self._closed(socket)

    async def _first(self, socket: web.WebSocketResponse) -> str | None:
        """Return the first message; None: it is no text, or did not come in time."""
        try:
            said = await socket.receive(self._limits.hello_s)
        except TimeoutError:
            return None
        return said.data if said.type is WSMsgType.TEXT else None

    async def _hear(self, socket: web.WebSocketResponse, hearer: Hearer) -> None:
        loop = asyncio.get_running_loop()
        rate = Rate(self._limits.words_per_s, 2 * self._limits.words_per_s, loop.time())
        async for said in socket:
            now_ns = now.monotonic_ns()
            if said.type is WSMsgType.TEXT and not rate.take(loop.time()):
                await socket.close(code=WSCloseCode.POLICY_VIOLATION, message=b"too many messages")
                return
            if said.type is WSMsgType.TEXT or said.type is WSMsgType.BINARY:
                data: Any = said.data
                if answer := hearer.heard(data, now_ns):
                    await socket.send_str(answer)

    @staticmethod
    async def _closed(socket: web.WebSocketResponse) -> None:
        with suppress(OSError, RuntimeError, TimeoutError):
            await asyncio.wait_for(socket.close(code=WSCloseCode.GOING_AWAY), _CLOSE_S)
