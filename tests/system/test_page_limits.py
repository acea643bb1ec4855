"""The page's server under load and attack: slow viewers, floods and broken requests cost only those who send them."""
# ruff: noqa: F811 - a fixture is an argument of tests, by its name

import asyncio
import datetime as dt
import json
import socket
import ssl
from contextlib import suppress
from pathlib import Path

import aiohttp
import pytest

from phone_host.web.secret_files import kept_credentials
from phone_host.web.settings import Limits
from phone_host.web.source import Command, Do
from tests.support.page_source import PageSource
from tests.support.served_page import Start, next_pair, start, until, viewer  # noqa: F401 - start is a fixture
from tests.support.stereo_pages import processed


def transport_of(viewer: aiohttp.ClientWebSocketResponse) -> asyncio.Transport:
    """What a viewer reads from."""
    return viewer._response.connection.transport  # type: ignore[union-attr, return-value]  # noqa: SLF001 - aiohttp hides it


def test_a_slow_viewer_delays_no_fast_one(start: Start) -> None:
    """Beside one that never acknowledges and one that never reads, a third gets pair after pair; the two are closed in the end."""
    served = start(PageSource(processed(640, 480)), limits=Limits(silent_s=2.0))

    async def watch() -> None:
        want = {"views": ["left", "right", "disparity"], "width": 1920, "hz": 30}
        async with viewer(served, **want) as deaf, viewer(served, **want) as stuck, viewer(served, **want) as fast:
            transport_of(stuck).pause_reading()
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
            transport_of(stuck).resume_reading()
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


def test_connections_count_before_tls_is_agreed(start: Start, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
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
    assert caplog.records == []  # nobody's end is an error of ours


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
