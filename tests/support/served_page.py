"""The page's server on a free port, with clients: what tests of it share."""

import asyncio
import socket
from collections.abc import AsyncIterator, Callable, Coroutine, Iterator
from contextlib import asynccontextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import aiohttp
import pytest
from multidict import CIMultiDict

from phone_host.web.frames import taken_apart
from phone_host.web.server import PageServer
from phone_host.web.settings import LIMITS, Limits, PageSettings
from tests.support.page_source import PageSource, page_folder

Start = Callable[..., "Served"]


class Served:
    """A server on a free port, and its source."""

    def __init__(self, source: PageSource, server: PageServer) -> None:
        self.source, self.server = source, server
        self.address, self.port = server.address, server.port
        self.token = {"Authorization": f"Bearer {server.token}"}

    def asked(self, work: Callable[[aiohttp.ClientSession], Coroutine[Any, Any, Any]]) -> Any:
        """Do something with an HTTP client that starts without cookies."""

        async def inside() -> Any:
            async with aiohttp.ClientSession(self.address, timeout=aiohttp.ClientTimeout(60)) as client:
                return await work(client)

        return asyncio.run(inside())

    def get(self, path: str, **options: Any) -> tuple[int, CIMultiDict[str], bytes]:
        """GET. Return status, headers and body."""

        async def work(client: aiohttp.ClientSession) -> tuple[int, CIMultiDict[str], bytes]:
            async with client.request(options.pop("method", "GET"), path, **options) as answer:
                return answer.status, CIMultiDict(answer.headers), await answer.read()

        result: tuple[int, CIMultiDict[str], bytes] = self.asked(work)
        return result

    def sent(self, data: bytes) -> bytes:
        """Send bytes over a connection of their own. Return all that comes until the server closes it."""
        with socket.create_connection(("127.0.0.1", self.port), timeout=60) as line:
            line.sendall(data)
            return b"".join(iter(lambda: line.recv(65536), b""))


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Start]:
    """Start servers, each with the small page; stop them all at the end."""
    running: list[Served] = []

    def begin(source: PageSource | None = None, limits: Limits = LIMITS, **settings: Any) -> Served:
        folder = tmp_path / "page"
        page = folder if folder.exists() else page_folder(folder)
        source = source or PageSource()
        server = PageServer(source, replace(PageSettings(port=0, page=page), **settings), limits)
        server.start()
        running.append(Served(source, server))
        return running[-1]

    yield begin
    for served in running:
        served.server.stop()
        assert served.source.listeners == 0


@asynccontextmanager
async def viewer(served: Served, **want: Any) -> AsyncIterator[aiohttp.ClientWebSocketResponse]:
    """A viewer that has asked for something."""
    async with (
        aiohttp.ClientSession(served.address) as client,
        client.ws_connect("/ws", max_msg_size=1 << 24) as socket_,
    ):
        if want:
            await socket_.send_json({"kind": "want"} | want)
        yield socket_


async def next_pair(socket_: aiohttp.ClientWebSocketResponse) -> tuple[dict[str, Any], tuple[bytes, ...]]:
    """Wait for a pair."""
    while True:
        said = await socket_.receive(60)
        assert said.type in {aiohttp.WSMsgType.TEXT, aiohttp.WSMsgType.BINARY}, said
        if said.type is aiohttp.WSMsgType.BINARY:
            return taken_apart(said.data)


async def until(holds: Callable[[], object]) -> None:
    """Wait until something holds, up to a minute."""
    async with asyncio.timeout(60):
        while not holds():  # noqa: ASYNC110 - another thread makes it hold
            await asyncio.sleep(0.01)
