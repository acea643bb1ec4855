"""The page's server as programs and browsers meet it: what they get, and what strangers do not."""

import asyncio
import datetime as dt
import json
import socket
import ssl
import sys
from collections.abc import AsyncIterator, Callable, Coroutine, Iterator
from contextlib import asynccontextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import aiohttp
import numpy as np
import pytest
from multidict import CIMultiDict

from common.errors import TakenError, UnavailableError
from phone_host.output.ply import read_ply
from phone_host.web.frames import taken_apart
from phone_host.web.secret_files import kept_credentials
from phone_host.web.server import PageServer
from phone_host.web.settings import LIMITS, Limits, PageSettings
from phone_host.web.source import Command, Do
from tests.support.page_source import PageSource, page_folder
from tests.support.stereo_pages import GEOMETRY, processed

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


def test_the_page_and_its_files(start: Start) -> None:
    """The page with all headers that keep others away, in the smallest form, not sent again when unchanged; no other path leads anywhere."""
    served = start()
    status, headers, body = served.get("/")
    assert (status, body[:15]) == (200, b"<!doctype html>")
    assert "'sha256-" in headers["Content-Security-Policy"]
    assert "unsafe" not in headers["Content-Security-Policy"]
    wanted = {
        "Cross-Origin-Opener-Policy": "same-origin",
        "Cross-Origin-Embedder-Policy": "require-corp",
        "X-Content-Type-Options": "nosniff",
    }
    assert wanted == {name: headers[name] for name in wanted}
    status, headers, body = served.get(
        "/static/main.js", headers={"Accept-Encoding": "gzip, br"}, auto_decompress=False
    )
    assert (headers["Content-Encoding"], body) == ("br", b"brotli's bytes")
    assert served.get("/static/main.js", headers={"If-None-Match": headers["ETag"]})[0] == 304
    assert served.get("/static/main.js", method="HEAD")[2] == b""
    for path in (
        "/static/",
        "/static/lib",
        "/static/main.js.br",
        "/static/../source.py",
        "/static/%2e%2e/source.py",
        "/static//etc/passwd",
        "/main.js",
    ):
        assert served.get(path)[0] == 404, path


def test_the_first_url_gives_a_cookie_and_the_page_its_token(start: Start) -> None:
    """The token leaves the URL for the fragment; a wrong one gives nothing; coming from another site, a page leads on."""
    served = start()
    path = served.server.url.removeprefix(served.address.rstrip("/"))
    status, headers, _ = served.get(path, allow_redirects=False)
    assert (status, headers["Location"]) == (303, f"/#token={served.server.token}")
    assert "HttpOnly; SameSite=Strict" in headers["Set-Cookie"]
    assert "Set-Cookie" not in served.get("/?token=wrong", allow_redirects=False)[1]
    status, headers, body = served.get(path, headers={"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "navigate"})
    assert (status, b"refresh" in body, "Set-Cookie" in headers) == (200, True, True)


@pytest.mark.parametrize(
    "path", ["/", "/api/state", "/api/events", "/ws", "/static/main.js", "/api/pairs/1/cloud.ply", "/nothing"]
)
def test_strangers_get_nothing(start: Start, path: str) -> None:
    """Under a strange name or from a strange origin every address is closed, with words, and with the token, too."""
    served = start()
    for headers, status in (
        ({"Host": "evil.example"}, 421),
        ({"Origin": "http://evil.example"}, 403),
        ({"Origin": "null"}, 403),
    ):
        answer = served.get(path, headers=headers | served.token)
        assert answer[0] == status
        assert set(json.loads(answer[2])) == {"problem", "remedy"}


def test_commands_need_the_token(start: Start) -> None:
    """Without it nothing reaches the program; with it the answer comes back; nonsense is refused in words."""
    served = start()
    said = json.dumps({"do": "stop"})
    for headers in ({}, {"Authorization": "Bearer wrong"}, {"Origin": "http://evil.example"} | served.token):
        assert served.get("/api/command", method="POST", data=said, headers=headers)[0] in {401, 403}
    assert served.source.commands == []
    status, _, body = served.get("/api/command", method="POST", data=said, headers=served.token)
    assert (status, json.loads(body)) == (200, {"words": "Did stop."})
    refused = served.get("/api/command", method="POST", data='{"do":"run"}', headers=served.token)
    assert (refused[0], json.loads(refused[2])["remedy"]) == (409, "choose one first")
    assert served.source.commands == [Command(do=Do.STOP), Command(do=Do.RUN)]
    for data, status in (("{", 400), ('{"do":"format"}', 400), (b"\xff" * 100, 400), ("x" * 100_000, 413)):
        assert served.get("/api/command", method="POST", data=data, headers=served.token)[0] == status
    measured = served.get("/api/measure", method="POST", data='{"points":[[1,2],[3,4]]}', headers=served.token)
    assert json.loads(measured[2])["length_m"] == 0.0
    assert served.get("/api/measure", method="POST", data='{"points":[]}', headers=served.token)[0] == 400
    assert served.get("/api/state", method="DELETE", headers=served.token)[0] == 405


def test_the_newest_pair_as_files(start: Start, tmp_path: Path) -> None:
    """Before a pair there is none, with words; then each file, with the number of its pair; points are where geometry puts them."""
    served = start()
    assert served.get("/api/cloud.ply")[0] == 404
    served.source.show(3)
    for name in ("left.jpg", "right.jpg", "disparity.png", "cloud.ply"):
        status, headers, body = served.get(f"/api/{name}")
        assert (status, headers["X-Pair-Number"], headers["Cache-Control"]) == (200, "2", "no-store")
        (tmp_path / name).write_bytes(body)
    depths = read_ply(tmp_path / "cloud.ply").points_m[:, 2]
    assert set(np.unique(depths)) == {1.0, 2.0}
    assert json.loads(served.get("/api/state")[2])["matchers"] == ["tandem", "sgbm"]
    assert served.get("/api/report.json")[0] == 404
    served.source.start_run(4)
    while (answer := served.get("/api/report.json"))[0] == 404:  # it may be a moment old
        pass
    assert json.loads(answer[2])["pairs"] == 4


def test_saved_pairs(start: Start, tmp_path: Path) -> None:
    """What a run has saved can be listed and fetched; nothing else in or beside the folder can."""
    pair = tmp_path / "out" / "pair-000007"
    pair.mkdir(parents=True)
    (pair / "cloud.ply").write_bytes(b"x" * 1_000_000)
    (pair / "notes.txt").write_text("secret")
    served = start(PageSource(saved=str(tmp_path / "out")))
    assert json.loads(served.get("/api/pairs")[2]) == {"pairs": [{"number": 7, "files": ["cloud.ply"]}]}
    assert served.get("/api/pairs/7/cloud.ply")[2] == b"x" * 1_000_000
    for path in (
        "7/notes.txt",
        "7/..%2fpair-000007%2fcloud.ply",
        "8/cloud.ply",
        "-1/cloud.ply",
        "7/",
        "99999999999/cloud.ply",
    ):
        assert served.get(f"/api/pairs/{path}")[0] == 404, path


def test_a_viewer_gets_the_newest_pair_once_it_has_shown_the_last(start: Start) -> None:
    """One pair under way, the newest next, none twice; the disparity is that of the scene; the state comes along."""
    served = start()
    served.source.start_run(3)

    async def watch() -> None:
        async with viewer(served, views=["left", "disparity"], width=160, hz=30) as socket_:
            first = json.loads((await socket_.receive(60)).data)
            assert (first["kind"], first["live"]["pairs"]) == ("state", 3)
            served.source.show()
            header, parts = await next_pair(socket_)
            assert [part["name"] for part in header["parts"]] == ["left", "disparity"]
            _, grid = header["parts"]
            cells = np.frombuffer(parts[1], "<u2").reshape(grid["height"], grid["width"])
            box_px = grid["low"] + (cells[60, 80] - 1) / grid["scale"]
            assert GEOMETRY.focal_px * GEOMETRY.baseline_m / box_px == pytest.approx(1.0, rel=1e-3)
            served.source.show(50)
            await socket_.send_json({"kind": "ack", "number": 99})  # not the one under way
            await asyncio.sleep(0.2)
            await socket_.send_json({"kind": "ack", "number": header["number"]})
            assert (await next_pair(socket_))[0]["number"] == 50

    asyncio.run(watch())


def test_a_slow_viewer_delays_no_fast_one(start: Start) -> None:
    """Beside one that never acknowledges and one that never reads, a third gets pair after pair; the two are closed in the end."""
    served = start(PageSource(processed(640, 480)), limits=Limits(silent_s=2.0))

    async def watch() -> None:
        want = {"views": ["left", "right", "disparity"], "width": 1920, "hz": 30}
        async with viewer(served, **want) as deaf, viewer(served, **want) as stuck, viewer(served, **want) as fast:
            stuck._response.connection.transport.pause_reading()  # type: ignore[union-attr]
            served.source.show()
            await next_pair(deaf)
            seen: list[int] = []
            while len(seen) < 20:
                served.source.show()
                header, _ = await next_pair(fast)
                seen.append(header["number"])
                await fast.send_json({"kind": "ack", "number": header["number"]})
            assert seen == sorted(set(seen))
            while (await deaf.receive(60)).type is not aiohttp.WSMsgType.CLOSED:
                pass
            await asyncio.sleep(1)
            stuck._response.connection.transport.resume_reading()  # type: ignore[union-attr]
            while (message := await stuck.receive(60)).type is aiohttp.WSMsgType.TEXT:
                pass
            assert message.type in {aiohttp.WSMsgType.CLOSED, aiohttp.WSMsgType.ERROR}  # in the middle of a pair

    asyncio.run(watch())


@pytest.mark.parametrize(
    "said",
    ["{", "[]", '{"kind":"feed"}', '{"kind":"want","views":["up"]}', "x" * 10_000, b"\x00\x01", b"\xff" * 10_000],
)
def test_a_viewer_that_talks_nonsense_is_closed(start: Start, said: str | bytes) -> None:
    """Malformed and oversized messages end that viewer, and no other."""
    served = start()

    async def watch() -> None:
        async with viewer(served, views=["left"]) as good, viewer(served) as bad:
            await (bad.send_str(said) if isinstance(said, str) else bad.send_bytes(said))
            while (message := await bad.receive(60)).type is not aiohttp.WSMsgType.CLOSE:
                assert message.type is aiohttp.WSMsgType.TEXT
            assert message.data in {1003, 1009}
            served.source.show()
            assert (await next_pair(good))[0]["number"] == 0

    asyncio.run(watch())


def test_a_flood_of_messages_ends_its_viewer(start: Start) -> None:
    """More messages than any page sends are a reason to close."""
    served = start()

    async def watch() -> None:
        async with viewer(served) as flood:
            with suppress(ConnectionError):  # it may be closed before all is sent
                for number in range(1000):
                    await flood.send_json({"kind": "ack", "number": number})
            while (message := await flood.receive(60)).type is aiohttp.WSMsgType.TEXT:
                pass
            # Its close frame is lost when the flood that was not read resets the connection.
            assert message.type in {aiohttp.WSMsgType.CLOSE, aiohttp.WSMsgType.CLOSED, aiohttp.WSMsgType.ERROR}
            assert message.data in {1008, None}

    asyncio.run(watch())


def test_events_are_the_state(start: Start) -> None:
    """Server-sent events: the state at once, and again when it has changed; with a run, its samples only once."""
    served = start()
    served.source.start_run(3)

    async def work(client: aiohttp.ClientSession) -> list[dict[str, Any]]:
        found = []
        async with client.get("/api/events") as stream:
            assert stream.headers["Content-Type"] == "text/event-stream"
            served.source.show(2)
            async for line in stream.content:
                if line.startswith(b"data: "):
                    found.append(json.loads(line[6:]))
                    served.source.show()
                    served.source.start_run(3 + len(found))
                if len(found) == 3:
                    return found
        return found

    states = served.asked(work)
    numbers = [row[0] for state in states for row in state["live"]["samples"]]
    assert numbers == sorted(set(numbers))
    assert [state["live"]["pairs"] for state in states] == sorted({state["live"]["pairs"] for state in states})


def test_a_hundred_connections(start: Start) -> None:
    """Strangers that hold every connection open and say nothing, or little, do not keep the user out, and are cut off."""
    served = start(limits=Limits(connections=40, idle_s=1.0))
    lines = [socket.create_connection(("127.0.0.1", served.port)) for _ in range(100)]
    for number, line in enumerate(lines):
        line.sendall(b"GET / HTTP/1.1\r\nHost: 127"[: number % 25])
    assert served.get("/api/state")[0] == 200
    for line in lines:
        line.settimeout(60)
        with suppress(ConnectionResetError):
            assert line.recv(1) in {b"", b"H"}
        line.close()


def test_connections_count_before_tls_is_agreed(start: Start, tmp_path: Path) -> None:
    """Strangers that connect and never begin TLS, or speak something else, take no more descriptors than others."""
    credentials = kept_credentials(tmp_path / "keys", (), dt.datetime.now(dt.UTC))
    served = start(limits=Limits(connections=20), credentials=credentials)
    held = len(list(Path("/proc/self/fd").iterdir()))
    lines = [socket.create_connection(("127.0.0.1", served.port)) for _ in range(100)]
    for line in lines[::2]:
        with suppress(OSError):
            line.sendall(b"GET / HTTP/1.1\r\n\r\n")
    trusted = ssl.create_default_context(cadata=credentials.authority.decode())
    assert served.get("/api/state", ssl=trusted)[0] == 200
    assert len(list(Path("/proc/self/fd").iterdir())) - held - len(lines) <= 25
    for line in lines[:40]:  # those that were idle longest
        line.settimeout(60)
        with suppress(ConnectionError):
            assert line.recv(1) in {b"", b"\x15"}  # 0x15: a TLS alert
    for line in lines:
        line.close()


def test_viewers_without_the_token_leave_room_for_those_with_it(start: Start) -> None:
    """Beyond their number strangers are refused in words; the user's own have places of their own."""
    served = start(limits=Limits(viewers=2))

    async def watch() -> None:
        async with viewer(served), viewer(served), aiohttp.ClientSession(served.address) as client:
            with pytest.raises(aiohttp.WSServerHandshakeError) as refused:
                await client.ws_connect("/ws")
            assert refused.value.status == 503
            assert (await client.get("/api/events")).status == 503
            async with client.ws_connect("/ws", headers=served.token) as own:
                assert json.loads((await own.receive(60)).data)["kind"] == "state"

    asyncio.run(watch())


def test_too_many_requests(start: Start) -> None:
    """A program that asks all the time is told to wait, while the user's own requests pass."""
    served = start(limits=Limits(requests_per_s=0.01, requests_burst=5))

    async def work(client: aiohttp.ClientSession) -> list[int]:
        return [(await client.get("/api/openapi.json")).status for _ in range(8)]

    assert served.asked(work) == [200] * 5 + [429] * 3
    assert served.get("/api/openapi.json", headers=served.token)[0] == 200


def test_not_too_many_commands_at_once(start: Start) -> None:
    """While some take long, more are refused in words; the state is told, and to stop is always possible."""
    served = start(limits=Limits(commands=2))
    served.source.blocked.clear()

    async def work(client: aiohttp.ClientSession) -> list[int]:
        async def command(do: str = "find") -> int:
            async with client.post("/api/command", json={"do": do}, headers=served.token) as answer:
                return answer.status

        asked = [asyncio.ensure_future(command()) for _ in range(5)]
        await asyncio.wait(asked, return_when=asyncio.FIRST_COMPLETED)
        assert (await client.get("/api/state")).status == 200
        await until(lambda: sum(each.done() for each in asked) == 3)
        stopping = asyncio.ensure_future(command("stop"))
        await until(lambda: Command(do=Do.STOP) in served.source.asked)
        served.source.blocked.set()
        assert await stopping == 200
        return sorted(await asyncio.gather(*asked))

    assert served.asked(work) == [200, 200, 503, 503, 503]


@pytest.mark.parametrize(
    "data",
    [b"GET http://evil.example/ HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\n", b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03", b"GET / HTTP/9.9\r\n\r\n", b"GET " + b"a" * 100_000, b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n" + b"X: y\r\n" * 10_000 + b"\r\n",
     b"GET / HTTP/1.1\r\n\r\n", b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nHost: evil\r\nConnection: close\r\n\r\n",
     b"POST /api/command HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 5\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n"],
)  # fmt: skip
def test_broken_requests(start: Start, data: bytes) -> None:
    """Bytes that are no request, or an ambiguous one, get an error or nothing; the server goes on."""
    served = start(limits=Limits(idle_s=1.0))
    try:
        answer = served.sent(data)
    except ConnectionResetError:
        answer = b""
    assert not answer.startswith(b"HTTP/1.1 2")
    assert b"Traceback" not in answer
    assert served.get("/api/state")[0] == 200


def test_a_port_that_is_taken_is_named(start: Start) -> None:
    """One line with the remedy, exit 3; and a server can begin again on its port at once."""
    served = start()
    with pytest.raises(TakenError, match="is taken: end the program that has it"):
        PageServer(PageSource(), PageSettings(port=served.port)).start()
    served.get("/")
    served.server.stop()
    served.server.stop()
    again = start(port=served.port)
    assert again.get("/")[0] == 200


def test_a_missing_package_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """One line that says what to install."""
    for name in [name for name in sys.modules if name.startswith(("phone_host.web.serving", "phone_host.web.answers"))]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "aiohttp", None)
    with pytest.raises(UnavailableError, match="the page needs the package aiohttp"):
        PageServer(PageSource(), PageSettings(port=0)).start()


def test_viewers_are_told_goodbye(start: Start) -> None:
    """At the end a viewer is closed with 1001, so that its page knows to come back."""
    served = start()

    async def watch() -> None:
        async with viewer(served) as last:
            await last.receive(60)
            stopping = asyncio.ensure_future(asyncio.to_thread(served.server.stop))
            message = await last.receive(60)
            assert (message.type, message.data) == (aiohttp.WSMsgType.CLOSE, 1001)
            await stopping

    asyncio.run(watch())


def test_elsewhere_everything_needs_the_token_and_https(start: Start, tmp_path: Path) -> None:
    """By another address of this machine: https that its authority signed; nothing without cookie or token, all with one."""
    credentials = kept_credentials(tmp_path / "keys", ("127.0.0.2",), dt.datetime.now(dt.UTC))
    served = start(host="0.0.0.0", names=("127.0.0.2",), credentials=credentials)
    trusted = ssl.create_default_context(cadata=credentials.authority.decode())
    there = served.server.url_at("127.0.0.2")

    async def work() -> None:
        jar = aiohttp.CookieJar(unsafe=True)
        async with aiohttp.ClientSession(connector=aiohttp.TCPConnector(ssl=trusted), cookie_jar=jar) as client:
            base = there.partition("?")[0]
            assert (await client.get(f"{base}api/state")).status == 401
            assert (await client.get(base)).status == 401
            async with client.get(there) as opened:
                assert (opened.status, opened.url.path, opened.url.query_string) == (200, "/", "")
            assert (await client.get(f"{base}api/state")).status == 200
            assert (await client.post(f"{base}api/command", data='{"do":"stop"}')).status == 401
            assert await (await client.get(f"{base}api/authority.pem")).read() == credentials.authority
        async with aiohttp.ClientSession() as stranger:
            with pytest.raises(aiohttp.ClientConnectorCertificateError):
                await stranger.get(base)

    asyncio.run(work())
