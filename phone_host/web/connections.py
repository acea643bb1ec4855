"""Keeps the page's connections few and busy. A shell around the HTTP protocol of each.

aiohttp limits neither how many there are nor how long a peer takes for its first request. Beyond the limit, the one that
has been idle longest makes room: strangers who hold connections open do not keep the user out.
"""

import asyncio
import re
import ssl
from collections.abc import Callable
from typing import Final, cast

from phone_host.web.settings import Limits

_SWEEP_S: Final = 1.0
_HANDSHAKE_S: Final = 10.0

_PLAINLY: Final = re.compile(
    rb"(?:GET|HEAD) [^\n]*\r\n(?:.*\r\n)?Host: *(?P<host>[A-Za-z0-9._:\[\]-]{1,260})\r\n", re.DOTALL | re.IGNORECASE
)
"""A browser's request without TLS."""

_LED_TO_HTTPS: Final = (
    b"HTTP/1.1 307 Temporary Redirect\r\nLocation: https://%s/\r\nCache-Control: no-store\r\nContent-Length: 0\r\n"
    b"Connection: close\r\n\r\n"
)
"""The token does not go along: whoever sends it unencrypted shall notice."""


class Connection(asyncio.Protocol):
    """Passes everything on to the HTTP protocol, and knows since when nothing is being answered."""

    def __init__(self, inner: asyncio.Protocol, all_of_them: "Connections") -> None:
        self._inner, self._all = inner, all_of_them
        self.transport: asyncio.Transport | None = None
        self.answering = 0
        self.idle_since_s = asyncio.get_running_loop().time()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Begin, if there is room."""
        self.transport = cast("asyncio.Transport", transport)
        self._inner.connection_made(transport)
        self._all.begun(self)

    def connection_lost(self, exc: Exception | None) -> None:
        """End, unless TLS never began."""
        if self.transport is not None:
            self._all.ended(self)
            self._inner.connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Pass bytes on."""
        self._inner.data_received(data)

    def eof_received(self) -> bool | None:
        """Pass the end of the peer's bytes on."""
        return self._inner.eof_received()

    def pause_writing(self) -> None:
        """Pass on that the peer reads slowly."""
        self._inner.pause_writing()

    def resume_writing(self) -> None:
        """Pass on that the peer has caught up."""
        self._inner.resume_writing()

    def abort(self) -> None:
        """Cut the connection; what was not sent is lost."""
        if self.transport is not None:
            self.transport.abort()


class Handshake(asyncio.Protocol):
    """Counts a connection from its first moment, while TLS is agreed; asyncio's own server would count it only afterwards.

    Who asks without TLS is led to https.
    """

    def __init__(self, tls: ssl.SSLContext, all_of_them: "Connections") -> None:
        self._tls, self._all = tls, all_of_them
        self.transport: asyncio.Transport | None = None
        self.answering = 0
        self.idle_since_s = asyncio.get_running_loop().time()
        self._task: asyncio.Task[None] | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Begin, if there is room."""
        self.transport = cast("asyncio.Transport", transport)
        self._all.begun(self)

    def data_received(self, data: bytes) -> None:
        """Take the first bytes, which tell what the peer speaks."""
        assert self.transport is not None
        if asked := _PLAINLY.match(data):
            self.transport.write(_LED_TO_HTTPS % asked["host"])
            self.transport.close()
        else:
            self.transport.pause_reading()  # what follows is for TLS
            self._task = asyncio.ensure_future(self._agree(self.transport, data))

    def connection_lost(self, exc: Exception | None) -> None:
        """End before TLS began."""
        del exc
        self._all.ended(self)

    def abort(self) -> None:
        """Cut the connection."""
        if self.transport is not None:
            self.transport.abort()

    async def _agree(self, plain: asyncio.Transport, first: bytes) -> None:
        connection = self._all.connection()
        agreeing = asyncio.ensure_future(self._begun(plain, connection))
        secure = None
        try:
            for _ in ("takes the transport over", "begins"):
                await asyncio.sleep(0)
            if not plain.is_closing():
                taker = cast("asyncio.BufferedProtocol", plain.get_protocol())
                cast("memoryview", taker.get_buffer(len(first)))[: len(first)] = first
                taker.buffer_updated(len(first))
            secure = await agreeing
        except (OSError, RuntimeError):  # no TLS, another version, gone, or too slow
            plain.abort()
        finally:
            self._all.ended(self)
        if secure is not None:
            connection.connection_made(secure)

    async def _begun(self, plain: asyncio.Transport, connection: Connection) -> asyncio.Transport | None:
        if plain.is_closing():  # it had to make room: asyncio would never hear of its end
            raise ConnectionResetError
        return await asyncio.get_running_loop().start_tls(
            plain, connection, self._tls, server_side=True, ssl_handshake_timeout=_HANDSHAKE_S
        )


class Connections:
    """All connections of the server.

    Args:
        limits: how many, and how long they may be idle.
        serve: makes the HTTP protocol of a new one.
        tls: for https; None: http.
    """

    def __init__(self, limits: Limits, serve: Callable[[], asyncio.Protocol], tls: ssl.SSLContext | None) -> None:
        self._limits, self._serve, self._tls = limits, serve, tls
        self._open: dict[asyncio.Transport, Connection | Handshake] = {}
        self._is_closed = False

    def __call__(self) -> asyncio.Protocol:
        """Make the protocol of a new connection."""
        return self.connection() if self._tls is None else Handshake(self._tls, self)

    def connection(self) -> Connection:
        """Make a connection that speaks HTTP."""
        return Connection(self._serve(), self)

    def __len__(self) -> int:
        """Return how many are open."""
        return len(self._open)

    def begun(self, connection: Connection | Handshake) -> None:
        """Take a new connection in, at the cost of the one that is idle longest, or of itself."""
        assert connection.transport is not None
        if self._is_closed:  # it was accepted just before the server ended
            connection.abort()
            return
        self._open[connection.transport] = connection
        if len(self._open) > self._limits.connections:
            idle = [each for each in self._open.values() if not each.answering]
            longest = min(idle, key=lambda each: each.idle_since_s)
            self.ended(longest)  # at once: many may come before the loop closes it
            longest.abort()

    def ended(self, connection: Connection | Handshake) -> None:
        """Forget a connection."""
        assert connection.transport is not None
        self._open.pop(connection.transport, None)

    def answering(self, transport: asyncio.BaseTransport | None, change: int) -> None:
        """Note that an answer begins (1) or ends (-1)."""
        found = self._open.get(cast("asyncio.Transport", transport))
        if found is not None:
            found.answering += change
            found.idle_since_s = asyncio.get_running_loop().time()

    async def sweep(self) -> None:
        """Close what has been idle for too long, for ever."""
        while True:
            await asyncio.sleep(_SWEEP_S)
            now_s = asyncio.get_running_loop().time()
            for each in list(self._open.values()):
                if not each.answering and now_s - each.idle_since_s > self._limits.idle_s:
                    each.abort()

    def close(self) -> None:
        """Cut all that are left, and all that are still being accepted."""
        self._is_closed = True
        for each in list(self._open.values()):
            each.abort()
