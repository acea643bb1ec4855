"""The HTTP API: what each address answers. `openapi` describes it for programs."""

import asyncio
from collections.abc import AsyncIterator, Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import asynccontextmanager
from functools import partial
from pathlib import Path
from typing import BinaryIO, Final, TypeVar

from aiohttp import web

from common.diagnostic import Diagnostic, Severity
from phone_host.output.json_text import json_text
from phone_host.web.camera_lines import CameraLines
from phone_host.web.door import KNOWN, problem
from phone_host.web.encoder import FILES, has_data
from phone_host.web.gate import Gate, is_loopback
from phone_host.web.hub import Hub
from phone_host.web.openapi import description
from phone_host.web.saved_pairs import is_scan_file, open_plain, open_saved, saved_pairs
from phone_host.web.settings import Limits
from phone_host.web.source import Answer, Command, Do
from phone_host.web.state_json import answer_values, measured_values, whole_text
from phone_host.web.static_files import INDEX, StaticFile, chosen_encoding
from phone_host.web.surface_bytes import surface_bytes
from phone_host.web.viewers import Viewers
from phone_host.web.wishes import read_command, read_measure, read_number

T = TypeVar("T")

_BLOCK_BYTES: Final = 1 << 18
_LEAST_BYTES_PER_S: Final = 20_000
"""A reader that is slower than a Bluetooth line is cut off; it holds a place and memory."""
_BODY_S: Final = 10.0

_SURFACE_POINTS: Final = 200_000
"""In one answer: 4 MB, a second of a phone's Wi-Fi; the rest comes with the next one."""

_SURFACE: Final = {"Content-Type": "application/octet-stream", "Cache-Control": "no-store"}

_KINDS: Final = {
    ".html": "application/octet-stream",
    ".json": "application/octet-stream",
    ".txt": "application/octet-stream",
    ".ply": "application/octet-stream",
    ".pfm": "application/octet-stream",
    ".png": "image/png",
    ".jpg": "image/jpeg",
}
_NOT_YET: Final = Diagnostic("there is nothing here yet", "start a run and wait for its first pair", Severity.FAIL)
_NO_DEPTH: Final = Diagnostic("this run has no depth", "give it a calibration", Severity.FAIL)
_NOT_SAVED: Final = Diagnostic("this file was not saved", "see /api/pairs; save pairs with --save-every", Severity.FAIL)
_NO_SCAN: Final = Diagnostic("there is no scan yet", "begin one on the page, or with the command scan", Severity.FAIL)
_NO_NUMBER: Final = Diagnostic("since is no number", "give that of the last answer, or 0", Severity.FAIL)
_NO_COMMAND: Final = Diagnostic("this is no command", "send JSON as /api/openapi.json describes it", Severity.FAIL)
_NO_POINTS: Final = Diagnostic("these are no points", "send JSON as /api/openapi.json describes it", Severity.FAIL)
_NO_AUTHORITY: Final = Diagnostic("this page has no certificate", "start it with --lan", Severity.FAIL)


class Answers:
    """Answers requests that the door has let in.

    Args:
        hub: what there is to tell.
        viewers: those who look all the time.
        cameras: browsers that give their cameras.
        gate: makes the cookie.
        files: the page's files.
        limits: how much at once.
        authority: certificate of the page's own authority, PEM; empty without https.
        values: schemas of what commands take.
    """

    def __init__(
        self,
        *,
        hub: Hub,
        viewers: Viewers,
        cameras: CameraLines,
        gate: Gate,
        files: dict[str, StaticFile],
        limits: Limits,
        authority: bytes,
        values: Mapping[str, object],
    ) -> None:
        self._hub, self._viewers, self._gate, self._files, self._limits = hub, viewers, gate, files, limits
        self._authority, self._cameras, self._values = authority, cameras, values
        self._commander = ThreadPoolExecutor(limits.commands + 1, "page command")
        self._commands = 0
        self._downloads = {False: 0, True: 0}

    def routes(self) -> list[web.RouteDef]:
        """Return all addresses."""
        newest = [web.get(f"/api/{name}", self._newest_file) for name in FILES]
        return [
            web.get("/", self._index),
            web.get("/static/{path:.+}", self._static),
            web.get("/ws", self._socket),
            web.get("/ws/camera", self._camera),
            web.get("/ws/camera/clock", self._camera_clock),
            web.get("/api/events", self._events),
            web.get("/api/state", self._state),
            web.get("/api/report.json", self._report),
            web.get("/api/openapi.json", self._openapi),
            web.get("/api/authority.pem", self._authority_file),
            web.get("/api/pairs", self._pairs),
            web.get(r"/api/pairs/{number:[0-9]{1,9}}/{name}", self._saved_file),
            web.get("/api/surface", self._surface),
            web.get("/api/scan/{name}", self._scan_file),
            web.post("/api/command", self._command),
            web.post("/api/measure", self._measure),
            *newest,
        ]

    def close(self) -> None:
        """Take no more commands."""
        self._commander.shutdown(wait=False, cancel_futures=True)

    async def _index(self, request: web.Request) -> web.StreamResponse:
        token = request.query.get("token")
        if token is None:
            return await self._file(request, INDEX)
        if not self._gate.is_token(token):  # nor may it take the place of the right one that the page keeps
            return web.Response(status=303, headers={"Location": "/", "Cache-Control": "no-store"})
        # The page itself takes the token out of the address, and keeps it where only its own origin reaches it.
        return await self._file(request, INDEX, {"Set-Cookie": self._gate.set_cookie, "Cache-Control": "no-store"})

    async def _static(self, request: web.Request) -> web.StreamResponse:
        return await self._file(request, request.match_info["path"])

    async def _file(
        self, request: web.Request, path: str, further: Mapping[str, str] | None = None
    ) -> web.StreamResponse:
        file = self._files.get(path)
        if file is None:
            raise web.HTTPNotFound
        encoding = chosen_encoding(request.headers.get("Accept-Encoding", ""), file)
        headers = {
            "Content-Type": file.kind,
            "ETag": f'W/"{file.tag}"',
            "Cache-Control": "no-cache",
            "Vary": "Accept-Encoding",
            **(further or {}),
        }
        if any(tag.value == file.tag for tag in request.if_none_match or ()):
            return web.Response(status=304, headers=headers)
        if encoding != "identity":
            headers["Content-Encoding"] = encoding
        return await _send(request, len(file.content[encoding]), _blocks(file.content[encoding]), headers)

    async def _socket(self, request: web.Request) -> web.StreamResponse:
        if not self._viewers.has_room(is_known=request[KNOWN]):
            raise web.HTTPServiceUnavailable(headers={"Retry-After": "5"})
        if request.headers.get("Upgrade", "").lower() != "websocket":
            raise web.HTTPBadRequest
        is_near = is_loopback(request.remote or "")
        return await self._viewers.sockets(request, is_known=request[KNOWN], is_near=is_near)

    async def _camera(self, request: web.Request) -> web.StreamResponse:
        return await self._cameras.frames(request)

    async def _camera_clock(self, request: web.Request) -> web.StreamResponse:
        return await self._cameras.echoes(request)

    async def _events(self, request: web.Request) -> web.StreamResponse:
        if not self._viewers.has_room(is_known=request[KNOWN]):
            raise web.HTTPServiceUnavailable(headers={"Retry-After": "5"})
        return await self._viewers.events(request, is_known=request[KNOWN])

    async def _state(self, _request: web.Request) -> web.StreamResponse:
        await self._hub.refresh()
        return _json(whole_text(self._hub.state, self._hub.samples_since(-1)))

    async def _report(self, _request: web.Request) -> web.StreamResponse:
        await self._hub.refresh(report_s=0)
        return problem(404, _NOT_YET) if self._hub.report == "null" else _json(self._hub.report)

    async def _openapi(self, _request: web.Request) -> web.StreamResponse:
        return _json(json_text(description(self._values)))

    async def _authority_file(self, _request: web.Request) -> web.StreamResponse:
        if not self._authority:
            return problem(404, _NO_AUTHORITY)
        return web.Response(body=self._authority, content_type="application/x-x509-ca-cert")

    async def _newest_file(self, request: web.Request) -> web.StreamResponse:
        name, newest = request.path.rpartition("/")[2], self._hub.newest()
        if newest is None:
            return problem(404, _NOT_YET)
        if not has_data(name, newest.result.processed):
            return problem(404, _NO_DEPTH)
        async with self._place(request):
            data = await self._hub.encoder.file(newest, name)
            headers = _file_headers(name) | {"X-Pair-Number": str(newest.number)}
            return await _send(request, len(data), _blocks(data), headers)

    async def _pairs(self, request: web.Request) -> web.StreamResponse:
        async with self._place(request):
            found = await _aside(lambda: saved_pairs(self._hub.source.saved()))
        pairs = [{"number": pair.number, "files": list(pair.files)} for pair in found]
        return _json(json_text({"pairs": pairs}))

    async def _saved_file(self, request: web.Request) -> web.StreamResponse:
        number, name = int(request.match_info["number"]), request.match_info["name"]
        try:
            async with self._place(request):
                file = await _aside(lambda: open_saved(self._hub.source.saved(), number, name))
                with file:
                    size = await _aside(lambda: file.seek(0, 2))
                    return await _send(request, size, _read(file, size), _file_headers(name))
        except FileNotFoundError:
            return problem(404, _NOT_SAVED)

    async def _surface(self, request: web.Request) -> web.StreamResponse:
        since = read_number(request.query.get("since", "0"))
        if since is None:
            return problem(400, _NO_NUMBER)
        async with self._place(request):
            surface = await _aside(lambda: self._hub.source.surface(since, _SURFACE_POINTS))
            if surface is None:
                return problem(404, _NO_SCAN)
            data = await self._hub.encoder.run(lambda: surface_bytes(surface, since))
            return await _send(request, len(data), _blocks(data), _SURFACE)

    async def _scan_file(self, request: web.Request) -> web.StreamResponse:
        name, folder = request.match_info["name"], self._hub.source.scanned()
        if not folder or not is_scan_file(name):
            return problem(404, _NO_SCAN)
        try:
            async with self._place(request):
                file = await _aside(lambda: open_plain(Path(folder), name))
                with file:
                    size = await _aside(lambda: file.seek(0, 2))
                    return await _send(request, size, _read(file, size), _file_headers(name))
        except FileNotFoundError:
            return problem(404, _NO_SCAN)

    @asynccontextmanager
    async def _place(self, request: web.Request) -> AsyncIterator[None]:
        """Hold one of the places for large answers. Readers without the token never take those of the token's holder.

        Raises:
            HTTPServiceUnavailable: all are taken.
        """
        is_known = request[KNOWN]
        if self._downloads[is_known] >= self._limits.downloads:
            raise web.HTTPServiceUnavailable(headers={"Retry-After": "1"})
        self._downloads[is_known] += 1
        try:
            yield
        finally:
            self._downloads[is_known] -= 1

    async def _command(self, request: web.Request) -> web.StreamResponse:
        command = read_command(await _body(request))
        if command is None:
            return problem(400, _NO_COMMAND)
        answer = await self._done(command)
        if answer is None:
            raise web.HTTPServiceUnavailable(headers={"Retry-After": "1"})
        self._hub.outdate()
        return _json(json_text(answer_values(answer)), 200 if answer.trouble is None else 409)

    async def _measure(self, request: web.Request) -> web.StreamResponse:
        asked = read_measure(await _body(request))
        if asked is None:
            return problem(400, _NO_POINTS)
        measured = await self._hub.encoder.run(lambda: self._hub.source.measure(asked.points_px, asked.number))
        return _json(json_text(measured_values(measured)))

    async def _done(self, command: Command) -> Answer | None:
        """Have a command done; None: too many are under way. To stop is always possible."""
        counts = command.do is not Do.STOP
        if counts and self._commands >= self._limits.commands:
            return None
        self._commands += counts
        try:
            loop = asyncio.get_running_loop()
            return await loop.run_in_executor(self._commander, self._hub.source.command, command)
        finally:
            self._commands -= counts


def _json(text: str, status: int = 200) -> web.Response:
    headers = {"Cache-Control": "no-store"}
    return web.Response(status=status, text=text, content_type="application/json", headers=headers)


def _file_headers(name: str) -> dict[str, str]:
    kind = _KINDS[f".{name.rpartition('.')[2]}"]
    shown = "attachment" if kind == "application/octet-stream" else "inline"
    disposition = f'{shown}; filename="{name}"'
    return {"Content-Type": kind, "Content-Disposition": disposition, "Cache-Control": "no-store"}


async def _body(request: web.Request) -> bytes:
    """Return a request's body.

    Raises:
        HTTPRequestTimeout: it takes too long.
        HTTPRequestEntityTooLarge: it is too long.
    """
    try:
        return await asyncio.wait_for(request.read(), _BODY_S)
    except TimeoutError:
        raise web.HTTPRequestTimeout from None


async def _aside(do: Callable[[], T]) -> T:
    """Run something that waits for a disk in another thread."""
    return await asyncio.get_running_loop().run_in_executor(None, do)


async def _blocks(data: bytes) -> AsyncIterator[bytes | memoryview]:
    whole = memoryview(data)
    for at in range(0, len(data), _BLOCK_BYTES):
        yield whole[at : at + _BLOCK_BYTES]


async def _read(file: BinaryIO, size: int) -> AsyncIterator[bytes]:
    file.seek(0)
    for at in range(0, size, _BLOCK_BYTES):  # no more than was announced, should it grow
        yield await _aside(partial(file.read, min(size - at, _BLOCK_BYTES)))


async def _send(
    request: web.Request, size: int, blocks: AsyncIterator[bytes | memoryview], headers: dict[str, str]
) -> web.StreamResponse:
    """Send an answer block by block, and cut off a peer that reads too slowly."""
    answer = web.StreamResponse(headers=headers)
    answer.content_length = size
    await answer.prepare(request)
    if request.method == "HEAD":
        return answer
    transport = request.transport
    try:
        async for block in blocks:
            await asyncio.wait_for(answer.write(block), 10.0 + len(block) / _LEAST_BYTES_PER_S)
        await answer.write_eof()
    except TimeoutError:
        if transport is not None:
            transport.abort()
    return answer
