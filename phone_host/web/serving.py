"""Puts the page's server together within its event loop: the only place where its parts meet."""

import asyncio
import logging
import socket
import ssl
from typing import Final

from aiohttp import web

from phone_host.web.answers import Answers
from phone_host.web.camera_lines import CameraLines
from phone_host.web.connections import Connections
from phone_host.web.door import Door
from phone_host.web.gate import Gate
from phone_host.web.hub import Hub
from phone_host.web.settings import Limits, PageSettings, content_policy
from phone_host.web.source import Source
from phone_host.web.static_files import INDEX, PACKAGE_PAGE, read_files, script_hashes
from phone_host.web.viewers import Viewers

_LINGER_S: Final = 1.0
"""How long a refused body is read on, so that the refusal is not lost."""
_LINE_BYTES: Final = 4096
_FIELD_BYTES: Final = 8192


class Serving:
    """The server's parts, alive between `start` and `stop`.

    Args:
        source: the program behind the page.
        settings: where, and for whom.
        limits: what strangers may use up.
        gate: judges requests.
        tls: for https; None: http.
    """

    def __init__(
        self, source: Source, settings: PageSettings, limits: Limits, gate: Gate, tls: ssl.SSLContext | None
    ) -> None:
        files = read_files(settings.page or PACKAGE_PAGE)
        page = files[INDEX].content["identity"] if INDEX in files else b""
        self._hub = Hub(source)
        self._viewers = Viewers(self._hub, limits)
        self._cameras = CameraLines(source.feed, gate, limits)
        self._connections = Connections(limits, self._protocol, tls)
        door = Door(gate, limits, self._connections, content_policy(script_hashes(page)))
        authority = b"" if settings.credentials is None else settings.credentials.authority
        self._answers = Answers(
            hub=self._hub,
            viewers=self._viewers,
            cameras=self._cameras,
            gate=gate,
            files=files,
            limits=limits,
            authority=authority,
            values=settings.values,
        )
        app = web.Application(middlewares=[door.middleware()], client_max_size=limits.body_bytes)
        app.add_routes(self._answers.routes())
        app.on_response_prepare.append(door.dress)
        self._runner = web.AppRunner(
            app,
            access_log=None,
            handle_signals=False,
            keepalive_timeout=limits.idle_s,
            max_line_size=_LINE_BYTES,
            max_field_size=_FIELD_BYTES,
            auto_decompress=False,  # a body of ours is never compressed; a bomb would be
            logger=_quiet(),
            lingering_time=_LINGER_S,
            shutdown_timeout=1.0,
        )
        self._tasks: list[asyncio.Task[None]] = []
        self._server: asyncio.Server | None = None

    async def start(self, listener: socket.socket) -> None:
        """Begin to serve.

        Args:
            listener: a listening socket.
        """
        await self._runner.setup()
        loop = asyncio.get_running_loop()
        self._server = await loop.create_server(self._connections, sock=listener)
        self._tasks = [asyncio.ensure_future(each) for each in (self._connections.sweep(), self._hub.watch())]

    async def stop(self) -> None:
        """Tell viewers goodbye, and end."""
        assert self._server is not None
        self._server.close()
        await asyncio.gather(self._viewers.close(), self._cameras.close())
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        self._connections.close()
        await self._runner.cleanup()
        self._hub.close()  # last: an answer under way still needs it
        self._answers.close()

    def _protocol(self) -> asyncio.Protocol:
        """Make the HTTP protocol of a new connection."""
        assert self._runner.server is not None
        return self._runner.server()


def _quiet() -> logging.Logger:
    """Return a logger that drops what aiohttp says of strangers' broken requests; the door logs what is ours."""
    logger = logging.getLogger("phone_host.web.aiohttp")
    logger.setLevel(logging.CRITICAL + 1)
    return logger
