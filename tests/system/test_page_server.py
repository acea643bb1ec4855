"""The page's server as programs and browsers meet it: what they get, and what strangers do not."""
# ruff: noqa: F811 - a fixture is an argument of tests, by its name

import asyncio
import datetime as dt
import json
import ssl
import sys
from pathlib import Path
from typing import Any
from urllib.parse import quote

import aiohttp
import numpy as np
import pytest
from multidict import CIMultiDict

from common.errors import TakenError, UnavailableError
from phone_host.geometry.se3 import SE3
from phone_host.scan.patches import Patches
from phone_host.scan.volume import Volume
from phone_host.scan.volume_settings import VolumeSettings
from phone_host.web.secret_files import kept_credentials
from phone_host.web.server import PageServer
from phone_host.web.settings import PageSettings
from phone_host.web.source import Command, Do
from tests.support.page_source import PageSource
from tests.support.plane_films import plane_view, texture
from tests.support.point_files import read_ply
from tests.support.programs import until
from tests.support.served_page import Start, next_pair, start, viewer  # noqa: F401 - start is a fixture
from tests.support.stereo_pages import GEOMETRY


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
    """The page takes the token out of the address itself, also when a person comes from another site; a wrong one never reaches it."""
    served = start()
    path = served.server.url.removeprefix(served.address.rstrip("/"))
    for more in ({}, {"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "navigate"}):
        status, headers, body = served.get(path, headers=more)
        assert (status, headers["Cache-Control"], body) == (200, "no-store", served.get("/")[2])
        assert "HttpOnly; SameSite=Strict" in headers["Set-Cookie"]
    status, headers, _ = served.get("/?token=wrong", allow_redirects=False)
    assert (status, headers["Location"], "Set-Cookie" in headers) == (303, "/", False)


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
        ([("Origin", served.address.rstrip("/")), ("Origin", "http://evil.example")], 403),
    ):
        answer = served.get(path, headers=CIMultiDict(headers, **served.token))
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
    until(lambda: served.get("/api/report.json")[0] != 404, "the report is no longer the one of a moment ago")
    status, _, body = served.get("/api/report.json")
    assert (status, json.loads(body)["pairs"]) == (200, 4)


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


def test_a_scan_as_surface_and_files(start: Start, tmp_path: Path) -> None:
    """Without a scan there is nothing; then its surface comes in patches, each once, and its files by their names alone, never through a link."""
    source = PageSource()
    served = start(source)
    assert served.get("/api/surface")[0] == served.get("/api/scan/model.ply")[0] == 404
    volume = Volume(VolumeSettings(voxel_m=0.01, far_m=3.0))
    volume.fuse(plane_view(SE3.identity(), texture()), SE3.identity())
    source.patches = Patches(1)
    source.patches.renew(volume)
    status, _, body = served.get("/api/surface?since=0")
    head = json.loads(body[4 : 4 + int.from_bytes(body[:4], "little")])
    assert status == 200
    assert head["newest"] == len(head["patches"]) > 1
    again = served.get(f"/api/surface?since={head['newest']}")[2]
    assert json.loads(again[4:]) == {
        "kind": "surface",
        "begun": 1,
        "newest": head["newest"],
        "axes": "camera",
        "patches": [],
    }
    for wrong in ("-1", "1.5", "", "x", "9" * 400, "%00", "\u0663"):
        assert served.get(f"/api/surface?since={quote(wrong, safe='%')}")[0] == 400, wrong
    source.scan_folder = str(tmp_path)
    (tmp_path / "model.ply").write_bytes(b"x" * 1_000_000)
    (tmp_path / "secret.txt").write_text("secret")
    (tmp_path / "report.json").symlink_to(tmp_path / "secret.txt")
    status, headers, body = served.get("/api/scan/model.ply")
    assert (status, len(body)) == (200, 1_000_000)
    assert headers["Content-Disposition"] == 'attachment; filename="model.ply"'
    for path in ("secret.txt", "report.json", "index.html", "..%2fmodel.ply", ""):
        assert served.get(f"/api/scan/{path}")[0] == 404, path


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


def test_viewers_hear_of_a_change_that_another_has_asked_for_first(start: Start) -> None:
    """Whoever asks all the time has the state made anew each time; those who only listen are told all the same."""
    served = start()

    async def work(client: aiohttp.ClientSession) -> None:
        async def listen(stream: aiohttp.StreamReader) -> None:
            async for line in stream:
                if b'"pairs": 7' in line:
                    return

        async with client.get("/api/events") as stream, asyncio.timeout(10):
            await stream.content.readline()
            served.source.start_run(7)
            hearing = asyncio.ensure_future(listen(stream.content))
            while not hearing.done():
                async with client.get("/api/state") as asked:
                    await asked.read()
                await asyncio.sleep(0.02)

    served.asked(work)


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
                assert opened.status == 200
            plainly = there.replace("https", "http")
            async with client.get(plainly, allow_redirects=False) as led:
                assert (led.status, led.headers["Location"]) == (307, base)
            assert (await client.get(f"{base}api/state")).status == 200
            assert (await client.post(f"{base}api/command", data='{"do":"stop"}')).status == 401
            assert await (await client.get(f"{base}api/authority.pem")).read() == credentials.authority
        async with aiohttp.ClientSession() as stranger:
            with pytest.raises(aiohttp.ClientConnectorCertificateError):
                await stranger.get(base)

    asyncio.run(work())
