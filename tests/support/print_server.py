"""A printer's server on the loopback: OctoPrint, Moonraker or PrusaLink as far as `phone-host print` asks them, with a printer that only counts.

Written from their descriptions, not from their code. It judges: what was handed over, what was asked, whether the heaters are off.
"""

import json
import re
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from hashlib import md5
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any, Final
from urllib.parse import parse_qs, urlsplit

from phone_host.printers.printer_uri import ServerKind

KEY: Final = "0123456789abcdef"
PASSWORD: Final = "hunter2"
_NONCE: Final = "dcd98b7102dd2f0e"


@dataclass(slots=True, kw_only=True)
class ServerFaults:
    """What goes wrong, or is so before the first print.

    Attributes:
        condition: of the printer, in the words of this stand-in.
        words: that it says with an error.
        wants_digest: whether it asks for a user's password in place of a key.
        rate: share of a print that is done in a second.
        fails_at: share at which the printer reports an error.
        ends_at: share at which somebody ends the print at the printer.
        ends_between: whether the print is done as soon as, half way, the first of the questions after its state has been answered.
        refuses: status with which a file is refused; 0: it is not.
        starts: whether a file that was handed over is begun.
        cools: whether the heaters can be switched off.
        refuses_to_cool: whether the order to switch heaters off gets 404.
        refuses_to_end: whether the order to end the print gets 500.
        raw: sent in place of every answer; empty: the answer.
        forbids: end of the paths that the key does not open; empty: it opens all.
        silent_after: answers after which it hangs up on everybody.
        holds: methods whose requests are taken and done, and get no answer while they stand here.
        second_nozzle: where the heater of a second tool shall go, degrees C; negative: it has none.
    """

    condition: str = "ready"
    words: str = ""
    wants_digest: bool = False
    rate: float = 2.0
    fails_at: float = 9.0
    ends_at: float = 9.0
    ends_between: bool = False
    refuses: int = 0
    starts: bool = True
    cools: bool = True
    refuses_to_cool: bool = False
    refuses_to_end: bool = False
    raw: bytes = b""
    forbids: str = ""
    silent_after: int = 1 << 30
    holds: frozenset[str] = frozenset()
    second_nozzle: float = -1.0


class PrintServerStandIn:
    """The server.

    Attributes:
        uri: for --printer.
        files: that were handed over: name and content.
        asked: methods and paths of all that changes something, in order.
        goal: where the nozzle's heater shall go, degrees C.
        bed: where the bed's shall go, likewise.
        cooled_s: when they were switched off, time.monotonic().
        paused: how often it was.
        answers: how often it was asked.
    """

    def __init__(self, kind: ServerKind, faults: ServerFaults) -> None:
        self.kind, self.faults = kind, faults
        self.files: list[tuple[str, bytes]] = []
        self.asked: list[str] = []
        self.goal = self.bed = 0.0
        self.cooled_s = 0.0
        self.paused = 0
        self.condition = faults.condition
        self.share = 0.0
        self.answers = 0
        self.first_question = ""
        self._at_s = time.monotonic()
        self.lock, self.is_over = threading.Lock(), threading.Event()
        stand_in = self

        class Handler(_Handler):
            server_of = stand_in

        self._http = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self._http.daemon_threads = True
        self.port = self._http.server_address[1]
        self.uri = f"{kind.value}://127.0.0.1:{self.port}"
        self._thread = threading.Thread(target=self._http.serve_forever, args=(0.02,), daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Switch it off."""
        self.is_over.set()
        self._http.shutdown()
        self._http.server_close()
        self._thread.join(10)

    def begin(self, name: str, content: bytes) -> None:
        """Take a file, and begin."""
        self.files.append((name, content))
        if self.faults.starts:
            self.condition, self.share, self._at_s = "printing", 0.0, time.monotonic()
            self.goal, self.bed = 205.0, 60.0

    def go(self) -> None:
        """Let the time pass."""
        now_s = time.monotonic()
        if self.condition == "printing":
            self.share = min(self.share + (now_s - self._at_s) * self.faults.rate, 1.0)
            if self.share >= self.faults.fails_at:
                self.condition, self.faults.words = "error", self.faults.words or "Thermal runaway"
            elif self.share >= self.faults.ends_at:
                self.condition = "cancelled"
            elif self.share >= 1:
                self.condition, self.goal, self.bed = "done", 0.0, 0.0
        self._at_s = now_s

    def answered(self, path: str) -> None:
        """Let the print end now, if it shall end between two questions."""
        self.first_question = self.first_question or path
        if self.faults.ends_between and path == self.first_question and self.share >= 0.5:
            self.share = 1.0
            self.go()

    def cool(self, *, nozzle: bool = True, bed: bool = True) -> None:
        """Switch the heaters off, if that can be done."""
        if self.faults.cools:
            self.goal, self.bed = 0.0 if nozzle else self.goal, 0.0 if bed else self.bed
            self.cooled_s = time.monotonic()

    def may_answer(self) -> bool:
        """Count an answer; return whether it is given."""
        self.answers += 1
        return self.answers <= self.faults.silent_after


class _Handler(BaseHTTPRequestHandler):
    server_of: PrintServerStandIn
    protocol_version = "HTTP/1.1"

    def log_message(self, *_: object) -> None:
        """Say nothing."""

    def do_GET(self) -> None:
        """Answer a question."""
        self._serve()

    do_POST = do_PUT = do_DELETE = do_GET  # noqa: N815 - the names that http.server calls

    def _serve(self) -> None:
        there = self.server_of
        length = int(self.headers.get("Content-Length") or 0)
        body = self.rfile.read(length)
        if len(body) < length:  # whoever sent it has broken off
            self.close_connection = True
            return
        with there.lock:
            if not there.may_answer():
                self.close_connection = True
                return
            if there.faults.raw:
                self.wfile.write(there.faults.raw)
                self.close_connection = True
                return
            there.go()
            path = urlsplit(self.path).path
            if self.command != "GET":
                there.asked.append(f"{self.command} {path}")
            status, said = self._refusal(path) or _ANSWERS[there.kind](there, self, path, body)
            there.answered(path)
        while self.command in there.faults.holds and not there.is_over.wait(0.02):
            pass
        self._say(status, said)

    def _refusal(self, path: str) -> tuple[int, Any] | None:
        if self.server_of.faults.refuses_to_end and self.command in {"POST", "DELETE"} and path in _ENDS:
            return 500, {"error": "the macro failed"}
        if self.server_of.faults.wants_digest:
            return None if self._proves() else (401, {"error": "Unauthorized"})
        forbids = self.server_of.faults.forbids
        if self.headers.get("X-Api-Key") == KEY and not (forbids and path.endswith(forbids)):
            return None
        return (403 if self.server_of.kind is ServerKind.OCTOPRINT else 401), {
            "error": "You do not have the permission"
        }

    def _proves(self) -> bool:
        parts = dict(re.findall(r'(\w+)="?([^",]*)"?', self.headers.get("Authorization") or ""))
        secret = md5(f"maker:Printer API:{PASSWORD}".encode()).hexdigest()
        asked = md5(f"{self.command}:{self.path}".encode()).hexdigest()
        due = md5(f"{secret}:{_NONCE}:00000001:{parts.get('cnonce')}:auth:{asked}".encode()).hexdigest()
        return parts.get("response") == due and parts.get("uri") == self.path

    def _say(self, status: int, said: Any) -> None:
        with suppress(OSError):  # whoever asked may be gone
            self._write(status, said)

    def _write(self, status: int, said: Any) -> None:
        body = b"" if said is None else json.dumps(said).encode()
        self.send_response(status)
        if status == 401 and self.server_of.faults.wants_digest:
            self.send_header("WWW-Authenticate", f'Digest realm="Printer API", nonce="{_NONCE}", qop="auth"')
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)


def _in_form(content_type: str, body: bytes) -> tuple[str, bytes, dict[str, str]]:
    """Return the name and content of the file in a form, and its other fields."""
    boundary = content_type.partition("boundary=")[2].encode()
    name, content, fields = "", b"", dict[str, str]()
    for part in body.split(b"--" + boundary)[1:-1]:
        head, _, value = part.removeprefix(b"\r\n").removesuffix(b"\r\n").partition(b"\r\n\r\n")
        found = re.search(rb'name="([^"]*)"(?:; filename="([^"]*)")?', head)
        assert found is not None
        if found[2]:
            name, content = found[2].decode(), value
        else:
            fields[found[1].decode()] = value.decode()
    return name, content, fields


def _octoprint(there: PrintServerStandIn, handler: _Handler, path: str, body: bytes) -> tuple[int, Any]:  # noqa: PLR0911 - one return for each question
    condition = there.condition
    is_there = condition not in {"offline", "error"}
    match handler.command, path:
        case "GET", "/api/job":
            said = {"ready": "Operational", "done": "Operational", "cancelled": "Operational", "offline": "Offline"}
            state = said.get(condition, condition.capitalize())
            progress = {"completion": there.share * 100, "printTimeLeft": 60}
            return 200, {
                "state": state,
                "progress": progress,
                **({"error": there.faults.words} if condition == "error" else {}),
            }
        case "GET", "/api/printer":
            if not is_there:
                return 409, {"error": "Printer is not operational"}
            flags = {"operational": True, condition: True, "printing": condition == "printing"}
            heat = {"tool0": {"actual": 204.9, "target": there.goal}, "bed": {"actual": 22.0, "target": there.bed}}
            if there.faults.second_nozzle >= 0:
                heat["tool1"] = {"actual": 204.9, "target": there.faults.second_nozzle}
            return 200, {"temperature": heat, "state": {"flags": flags}}
        case "POST", "/api/files/local":
            if there.faults.refuses:
                return there.faults.refuses, {"error": "Could not upload the file"}
            name, content, fields = _in_form(handler.headers["Content-Type"], body)
            assert fields == {"select": "true", "print": "true"}
            there.begin(name, content)
            return 201, {"done": True, "effectivePrint": there.faults.starts}
        case "POST", "/api/job":
            return _ordered(there, json.loads(body).get("action") or json.loads(body)["command"])
        case "POST", "/api/printer/command" if not there.faults.refuses_to_cool:
            commands = json.loads(body)["commands"]
            there.cool(nozzle="M104 S0" in commands, bed="M140 S0" in commands)
            if "M104 T1 S0" in commands:
                there.faults.second_nozzle = min(there.faults.second_nozzle, 0.0)
            return 204, None
    return 404, None


def _moonraker(there: PrintServerStandIn, handler: _Handler, path: str, body: bytes) -> tuple[int, Any]:  # noqa: PLR0911 - one return for each question
    match handler.command, path:
        case "GET", "/server/info":
            klipper = {"offline": "disconnected", "error": "shutdown"}.get(there.condition, "ready")
            return 200, {"result": {"klippy_state": klipper}}
        case "GET", "/printer/info":
            if there.condition == "offline":
                return 503, {"error": {"code": 503, "message": "Klippy Host not connected"}}
            return 200, {"result": {"state_message": there.faults.words}}
        case "GET", "/printer/objects/query":
            state = {"ready": "standby", "done": "complete"}.get(there.condition, there.condition)
            status = {
                "heaters": {"available_heaters": ["extruder", "heater_bed", "heater_generic oven"]},
                "print_stats": {"state": state, "print_duration": 3.0, "message": there.faults.words},
                "virtual_sdcard": {"progress": there.share},
                "extruder": {"temperature": 204.9, "target": there.goal},
                "heater_bed": {"temperature": 22.0, "target": there.bed},
                "heater_generic oven": {"temperature": 22.0, "target": 0.0},
            }
            asked = parse_qs(urlsplit(handler.path).query, keep_blank_values=True)
            return 200, {"result": {"status": {name: status[name] for name in asked}}}
        case "POST", "/server/files/upload":
            if there.faults.refuses:
                return there.faults.refuses, {"error": {"message": "Could not upload the file"}}
            name, content, fields = _in_form(handler.headers["Content-Type"], body)
            assert fields == {"root": "gcodes", "print": "true"}
            there.begin(name, content)
            return 201, {"item": {"path": name}, "print_started": there.faults.starts}
        case "POST", "/printer/gcode/script":
            there.cool()
            return 200, {"result": "ok"}
        case "POST", "/printer/emergency_stop":
            there.condition, there.faults.words = "error", "Shutdown due to webhooks request"
            there.goal = there.bed = 0.0
            return 200, {"result": "ok"}
    return _ordered(there, path.removeprefix("/printer/print/"))


def _prusalink(there: PrintServerStandIn, handler: _Handler, path: str, body: bytes) -> tuple[int, Any]:
    if path == "/api/v1/storage":
        stores = [{"path": "/local", "available": False}, {"path": "/usb", "available": True, "read_only": False}]
        return 200, {"storage_list": stores}
    if path == "/api/v1/status":
        state = {"ready": "IDLE", "done": "FINISHED", "cancelled": "STOPPED", "offline": "BUSY"}
        heat = {"temp_nozzle": 204.9, "target_nozzle": there.goal, "temp_bed": 22.0, "target_bed": there.bed}
        printer = {"state": state.get(there.condition, there.condition.upper()), **heat}
        if there.faults.words:
            printer["status_printer"] = {"ok": False, "message": there.faults.words}
        job = {"id": 7, "progress": there.share * 100, "time_remaining": 60}
        return 200, {"printer": printer, **({"job": job} if there.condition in {"printing", "paused"} else {})}
    if handler.command == "PUT" and path.startswith("/api/v1/files/usb/"):
        if there.faults.refuses:
            return there.faults.refuses, {"title": "409: Conflict", "message": "Could not upload the file"}
        assert handler.headers["Print-After-Upload"] == handler.headers["Overwrite"] == "?1"
        there.begin(path.rpartition("/")[2], body)
        return 201, None
    if handler.command == "DELETE" and path == "/api/v1/job/7":
        there.cool()  # as its firmware does
        return _ordered(there, "cancel")
    return _ordered(there, path.removeprefix("/api/v1/job/7/"))


def _ordered(there: PrintServerStandIn, order: str) -> tuple[int, Any]:
    if there.condition not in {"printing", "paused", "finishing"}:
        return 409, {"error": "no print goes on"}
    match order:
        case "pause":
            there.condition, there.paused = "paused", there.paused + 1
        case "resume":
            there.condition = "printing"
        case "cancel" | "stop":
            there.condition = "cancelled"
        case _:
            return 404, None
    return 204, None


_ENDS: Final = ("/api/job", "/printer/print/cancel", "/api/v1/job/7")
_ANSWERS: Final = {
    ServerKind.OCTOPRINT: _octoprint,
    ServerKind.MOONRAKER: _moonraker,
    ServerKind.PRUSALINK: _prusalink,
}


@contextmanager
def print_server(kind: ServerKind, faults: ServerFaults | None = None) -> Iterator[PrintServerStandIn]:
    """A server that is on while the block runs."""
    made = PrintServerStandIn(kind, faults or ServerFaults())
    try:
        yield made
    finally:
        made.stop()
