"""Viewers: WebSockets and event streams. Each has at most one pair under way and gets only the newest.

A viewer that reads slowly is sent less. One that neither reads nor acknowledges for `Limits.silent_s` is closed.
"""

import asyncio
from collections.abc import Coroutine
from contextlib import suppress
from typing import Any, Final

from aiohttp import WSCloseCode, WSMessage, WSMsgType, web

from phone_host.web.encoder import Wanted
from phone_host.web.hub import Hub
from phone_host.web.rates import Rate
from phone_host.web.settings import Limits
from phone_host.web.state_json import whole_text
from phone_host.web.wishes import Ack, Want, read_wish

_NEAR_S: Final = 0.25
"""An acknowledgement within this time: bytes cost nothing on this way, deflating them does."""

_ALIVE_S: Final = 15.0
"""An event stream without news gets a comment this often, a WebSocket a ping, so that a peer that is gone is noticed."""

_CLOSE_S: Final = 1.0


class Viewer:
    """What a viewer has and wants.

    Args:
        hub: what there is.
        is_known: whether it is one of the user's own.
        is_near: whether it is on this machine.
    """

    def __init__(self, hub: Hub, *, is_known: bool, is_near: bool) -> None:
        self._hub, self._loop = hub, asyncio.get_running_loop()
        self.is_known: Final = is_known
        self._is_near = is_near
        self.wake: Final = asyncio.Event()
        self.wake.set()
        self._want = Want((), 0, 0.0)
        self._state = self._report = 0
        self._sample = -1
        self.sent = -1
        self._under_way = False
        self._sent_s = self._due_s = float("-inf")

    def silent_s(self) -> float:
        """Return for how long a pair has not been acknowledged, s."""
        return self._loop.time() - self._sent_s if self._under_way else 0.0

    def hear(self, wish: Ack | Want) -> None:
        """Take in what the viewer says."""
        if isinstance(wish, Want):
            self._want, self._due_s = wish, float("-inf")
        elif self._under_way and wish.number == self.sent:
            self._under_way = False
            self._is_near = self._is_near and self._loop.time() - self._sent_s < _NEAR_S
        self.wake.set()

    def news(self) -> str:
        """Return the state, if there is anything new in it; else nothing."""
        hub = self._hub
        if (self._state, self._report) == (hub.state_version, hub.report_version):
            return ""
        samples = hub.samples_since(self._sample)
        report = hub.report if self._report != hub.report_version else "null"
        self._state, self._report = hub.state_version, hub.report_version
        self._sample = samples[-1].number if samples else self._sample
        return whole_text(hub.state, samples, report)

    async def pair(self) -> bytes:
        """Return the newest pair's message, if the viewer wants one now and does not have it; else nothing."""
        now_s, newest = self._loop.time(), self._hub.newest()
        if newest is None or newest.number == self.sent or self._under_way or not self._want.views:
            return b""
        if now_s < self._due_s:
            self._loop.call_at(self._due_s, self.wake.set)
            return b""
        # Due times on a grid, so that a rate that does not divide the run's is held on average.
        self._due_s = max(self._due_s + 1 / self._want.hz, now_s - 1 / self._want.hz)
        wanted = Wanted(self._want.views, self._want.width_px, packed=not self._is_near)
        data = await self._hub.encoder.message(newest, wanted)
        self.sent, self._under_way, self._sent_s = newest.number, True, self._loop.time()
        return data


class Viewers:
    """All viewers, so that there are not too many and all can be closed."""

    def __init__(self, hub: Hub, limits: Limits) -> None:
        self._hub, self._limits = hub, limits
        self._known: Final[dict[bool, int]] = {True: 0, False: 0}
        self._tasks: Final[set[asyncio.Task[None]]] = set()
        self._served: Final[set[asyncio.Task[Any]]] = set()
        self._closing = False

    def __len__(self) -> int:
        """Return how many there are."""
        return sum(self._known.values())

    def has_room(self, *, is_known: bool) -> bool:
        """Whether another one may come. The user's own are counted apart from strangers."""
        return self._known[is_known] < self._limits.viewers

    async def sockets(self, request: web.Request, *, is_known: bool, is_near: bool) -> web.WebSocketResponse:
        """Serve a WebSocket until it ends."""
        socket = web.WebSocketResponse(
            compress=False, max_msg_size=self._limits.message_bytes, autoping=False, timeout=_CLOSE_S
        )
        await socket.prepare(request)
        viewer = Viewer(self._hub, is_known=is_known, is_near=is_near)
        await self._serve(viewer, request.transport, self._send(socket, viewer), self._hear(socket, viewer))
        code = WSCloseCode.GOING_AWAY if self._closing else WSCloseCode.OK
        with suppress(OSError, RuntimeError, TimeoutError):
            await asyncio.wait_for(socket.close(code=code), _CLOSE_S)
        return socket

    async def events(self, request: web.Request, *, is_known: bool) -> web.StreamResponse:
        """Serve an event stream (HTML standard, server-sent events) until it ends."""
        stream = web.StreamResponse(headers={"Content-Type": "text/event-stream", "Cache-Control": "no-store"})
        await stream.prepare(request)
        if request.method == "GET":
            viewer = Viewer(self._hub, is_known=is_known, is_near=True)
            await self._serve(viewer, request.transport, self._stream(stream, viewer))
        return stream

    async def close(self) -> None:
        """Tell all of them goodbye."""
        self._closing = True
        for task in self._tasks:
            task.cancel()
        if self._served:
            await asyncio.wait(self._served, timeout=2 * _CLOSE_S)

    async def _serve(
        self, viewer: Viewer, transport: asyncio.Transport | None, *parts: Coroutine[Any, Any, None]
    ) -> None:
        """Run a viewer's parts until the first of them ends."""
        served = asyncio.current_task()
        assert served is not None
        self._served.add(served)
        served.add_done_callback(self._served.discard)
        self._known[viewer.is_known] += 1
        self._hub.watchers.add(viewer.wake)
        tasks = [asyncio.ensure_future(part) for part in (*parts, self._patience(viewer))]
        self._tasks.update(tasks)
        try:
            done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
            gone = [
                task for task in done if not task.cancelled() and isinstance(task.exception(), asyncio.TimeoutError)
            ]
            if gone and transport is not None:
                transport.abort()
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
            self._tasks.difference_update(tasks)
            self._hub.watchers.discard(viewer.wake)
            self._known[viewer.is_known] -= 1

    async def _send(self, socket: web.WebSocketResponse, viewer: Viewer) -> None:
        await self._hub.refresh()
        while not socket.closed:
            await self._wait(viewer)
            if text := viewer.news():
                await asyncio.wait_for(socket.send_str(text), self._limits.silent_s)
            if data := await viewer.pair():
                await asyncio.wait_for(socket.send_bytes(data), self._limits.silent_s)

    async def _hear(self, socket: web.WebSocketResponse, viewer: Viewer) -> None:
        loop = asyncio.get_running_loop()
        rate = Rate(self._limits.messages_per_s, self._limits.messages_per_s, loop.time())
        async for said in socket:
            if not rate.take(loop.time()):
                await socket.close(code=1008, message=b"too many messages")
                return
            if not await self._understand(socket, viewer, said):
                return

    async def _understand(self, socket: web.WebSocketResponse, viewer: Viewer, said: WSMessage) -> bool:
        """Take a message in. Return whether to go on."""
        if said.type is WSMsgType.PING:
            await asyncio.wait_for(socket.pong(said.data), self._limits.silent_s)
            return True
        if said.type is WSMsgType.PONG:
            return True
        wish = read_wish(said.data) if said.type is WSMsgType.TEXT else None
        if wish is None:
            await socket.close(code=1003, message=b"say ack or want, as JSON")
            return False
        viewer.hear(wish)
        return True

    async def _stream(self, stream: web.StreamResponse, viewer: Viewer) -> None:
        await self._hub.refresh()
        while True:
            with suppress(asyncio.TimeoutError):
                await asyncio.wait_for(self._wait(viewer), _ALIVE_S)
            text = viewer.news()
            said = f"event: state\ndata: {text}\n\n" if text else ":\n\n"
            await asyncio.wait_for(stream.write(said.encode()), self._limits.silent_s)

    async def _wait(self, viewer: Viewer) -> None:
        await viewer.wake.wait()
        viewer.wake.clear()

    async def _patience(self, viewer: Viewer) -> None:
        """End when a viewer has left a pair without acknowledgement for too long.

        Raises:
            TimeoutError: it has.
        """
        while True:
            left_s = self._limits.silent_s - viewer.silent_s()
            if left_s <= 0:
                raise TimeoutError
            await asyncio.sleep(min(left_s, 1.0))
