"""The real OctoPrint with its virtual printer, and the real Moonraker with a stand-in for Klipper: programs in environments of their own.

`make printers` installs them into build/printers. They are AGPL and GPL: they are run, and imported by no file here.
"""

import http.client
import json
import socket
import subprocess
import threading
import time
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, Final

from tests.support.programs import free_port, until

ROOT: Final = Path(__file__).resolve().parents[2]
OCTOPRINT: Final = ROOT / "build/printers/octoprint/bin/octoprint"
MOONRAKER: Final = ROOT / "build/printers/moonraker/bin/python"
PRINTRUN: Final = ROOT / "build/printers/printrun/bin/python"
HOW: Final = "not installed: make printers"
KEY: Final = "00112233445566778899aabbccddeeff"

_OFF: Final = (
    "softwareupdate, tracking, announcements, discovery, errortracking, pisupport, firmware_check, file_check, health_check,"
    " achievements, corewizard"
)
_OCTOPRINT_CONFIG: Final = """accessControl: {{autologinLocal: false}}
server: {{host: 127.0.0.1, port: {port}, firstRun: false, onlineCheck: {{enabled: false}}, pluginBlacklist: {{enabled: false}}, pythonEolCheck: {{enabled: false}}}}
plugins:
  _disabled: [{off}]
  virtual_printer: {{enabled: true, throttle: 0.0, sendWait: false, rxBuffer: 4096, commandBuffer: 128, simulated_errors: []}}
serial: {{port: "{serial}", baudrate: 115200, autoconnect: true, additionalPorts: [{extra}], logPositionOnCancel: false, logPositionOnPause: false}}
webcam: {{timelapseEnabled: false, ffmpeg: ''}}
gcodeAnalysis: {{runAt: never}}
"""
_MOONRAKER_CONFIG: Final = """[server]
host: 127.0.0.1
port: {port}
klippy_uds_address: {klippy}
[authorization]
force_logins: False
[machine]
provider: none
validate_service: False
validate_config: False
[file_manager]
check_klipper_config_path: False
"""


@contextmanager
def _process(arguments: list[str], log: Path) -> Iterator[subprocess.Popen[bytes]]:
    with log.open("wb") as file, subprocess.Popen(arguments, stdout=file, stderr=file) as process:
        try:
            yield process
        finally:
            process.terminate()
            try:
                process.wait(20)
            except subprocess.TimeoutExpired:
                process.kill()


def asked(url: str, key: str, method: str = "GET", body: object = None) -> Any:
    """Return what a server answers, without the code under test; None: nothing, or an error."""
    data = None if body is None else json.dumps(body).encode()
    request = urllib.request.Request(url, data, {"X-Api-Key": key, "Content-Type": "application/json"}, method=method)
    with (
        suppress(OSError, ValueError, http.client.HTTPException),
        urllib.request.urlopen(request, timeout=10) as answer,
    ):
        return json.loads(answer.read() or b"{}")
    return None


@contextmanager
def octoprint(folder: Path, serial: str = "VIRTUAL") -> Iterator[str]:
    """OctoPrint, connected to a printer; yields HOST:PORT.

    Args:
        folder: for its files.
        serial: the printer's port; VIRTUAL is its own simulated one.
    """
    port = free_port()
    base = folder / "octoprint"
    base.mkdir()
    extra = "" if serial == "VIRTUAL" else f'"{serial}"'
    (base / "config.yaml").write_text(_OCTOPRINT_CONFIG.format(port=port, off=_OFF, serial=serial, extra=extra))
    add = [str(OCTOPRINT), "--basedir", str(base), "user", "add", "tester", "--password", "secret", "--admin"]
    subprocess.run(add, check=True, capture_output=True, timeout=120)
    users = base / "users.yaml"
    users.write_text(users.read_text().replace("apikey: null", f"apikey: {KEY}"))
    serve = ["serve", "--basedir", str(base), "--host", "127.0.0.1", "--port", str(port), "--iknowwhatimdoing"]
    with _process([str(OCTOPRINT), *serve], folder / "octoprint.log"):
        url = f"http://127.0.0.1:{port}/api/connection"
        until(lambda: asked(url, KEY) is not None, "OctoPrint answers")

        def is_connected() -> bool:
            state = ((asked(url, KEY) or {}).get("current") or {}).get("state", "")
            if state.startswith(("Closed", "Offline")):
                asked(url, KEY, "POST", {"command": "connect", "port": serial, "baudrate": 115200})
            return bool(state == "Operational")

        until(is_connected, "OctoPrint has its printer")
        yield f"127.0.0.1:{port}"


class Klipper:
    """A stand-in for Klipper: what Moonraker asks of its socket, with a print that only counts.

    Attributes:
        scripts: G-code that it was given, in order.
        nozzle: where its heater shall go, degrees C.
        cooled_s: when it was switched off, time.monotonic().
        state: of print_stats.
        rate: share of a print that is done in a second.

    Args:
        path: of its socket.
    """

    def __init__(self, path: Path) -> None:
        self.path, self.scripts = path, list[str]()
        self.nozzle = self.cooled_s = self.share = 0.0
        self.rate = 1.0
        self.state, self.file = "standby", ""
        self._at_s = time.monotonic()
        self._lines = list[socket.socket]()
        self._listening = socket.socket(socket.AF_UNIX)
        self._listening.bind(str(path))
        self._listening.listen()
        threading.Thread(target=self._serve, daemon=True).start()

    def stop(self) -> None:
        """Switch it off. May be called again."""
        for each in (self._listening, *self._lines):
            with suppress(OSError):
                each.shutdown(socket.SHUT_RDWR)
            each.close()

    def _serve(self) -> None:
        with suppress(OSError):
            while True:
                line, _ = self._listening.accept()
                self._lines.append(line)
                threading.Thread(target=self._talk, args=(line,), daemon=True).start()

    def _talk(self, line: socket.socket) -> None:
        waiting = b""
        with suppress(OSError):
            while data := line.recv(65536):
                *asked_for, waiting = (waiting + data).split(b"\x03")
                for each in map(json.loads, asked_for):
                    said = self._answer(each["method"], each.get("params") or {})
                    line.sendall(json.dumps({"id": each.get("id"), "result": said}).encode() + b"\x03")

    def _answer(self, method: str, params: dict[str, Any]) -> Any:
        match method:
            case "info":
                home = str(self.path.parent / "klipper")
                return {
                    "state": "ready",
                    "state_message": "Printer is ready",
                    "hostname": "test",
                    "software_version": "v0.12.0",
                    "cpu_info": "",
                    "klipper_path": home,
                    "python_path": home,
                    "config_file": f"{home}.cfg",
                    "log_file": f"{home}.log",
                    "process_id": 1,
                    "user_id": 0,
                    "group_id": 0,
                }
            case "list_endpoints":
                return {
                    "endpoints": [
                        "info",
                        "list_endpoints",
                        "objects/list",
                        "objects/query",
                        "objects/subscribe",
                        "gcode/script",
                        "gcode/help",
                        "pause_resume/pause",
                        "pause_resume/resume",
                        "pause_resume/cancel",
                        "emergency_stop",
                    ]
                }
            case "objects/list":
                return {"objects": list(self._status())}
            case "objects/query" | "objects/subscribe":
                names = params.get("objects") or {}
                return {
                    "eventtime": time.monotonic(),
                    "status": {name: value for name, value in self._status().items() if name in names},
                }
            case "gcode/script":
                self._do(params["script"])
            case "pause_resume/pause":
                self.go()
                self.state = "paused"
            case "pause_resume/resume":
                self.go()
                self.state = "printing"
            case "pause_resume/cancel":  # as Klipper's own does: the heaters stay on
                self.go()
                self.state = "cancelled"
        return {}

    def _do(self, script: str) -> None:
        self.scripts.append(script)
        if script.startswith("SDCARD_PRINT_FILE"):
            self.state, self.share, self.nozzle, self._at_s = "printing", 0.0, 200.0, time.monotonic()
            self.file = script.partition('"')[2].rstrip('"')
        if "TURN_OFF_HEATERS" in script:
            self.nozzle, self.cooled_s = 0.0, time.monotonic()

    def go(self) -> None:
        """Let the time pass."""
        now_s = time.monotonic()
        if self.state == "printing":
            self.share = min(1.0, self.share + (now_s - self._at_s) * self.rate)
            if self.share >= 1:
                self.state, self.nozzle = "complete", 0.0
        self._at_s = now_s

    def _status(self) -> dict[str, Any]:
        self.go()
        return {
            "webhooks": {"state": "ready", "state_message": "Printer is ready"},
            "configfile": {"config": {}, "settings": {}, "warnings": [], "save_config_pending": False},
            "print_stats": {
                "filename": self.file,
                "state": self.state,
                "print_duration": 3.0,
                "total_duration": 3.0,
                "filament_used": 0.0,
                "message": "",
                "info": {"total_layer": None, "current_layer": None},
            },
            "virtual_sdcard": {
                "file_path": self.file,
                "progress": self.share,
                "is_active": self.state == "printing",
                "file_position": 0,
                "file_size": 100,
            },
            "heaters": {
                "available_heaters": ["extruder", "heater_bed"],
                "available_sensors": [],
                "available_monitors": [],
            },
            "extruder": {"temperature": 199.0, "target": self.nozzle, "power": 0.0},
            "heater_bed": {"temperature": 20.0, "target": 0.0, "power": 0.0},
            "gcode_macro": {},
        }


@contextmanager
def moonraker(folder: Path) -> Iterator[tuple[str, str, Klipper]]:
    """Moonraker; yields HOST:PORT, its key, and the Klipper behind it."""
    port, data = free_port(), folder / "moonraker"
    for name in ("config", "logs", "gcodes", "comms", "database"):
        (data / name).mkdir(parents=True)
    klipper = Klipper(folder / "klippy.sock")
    try:
        config = _MOONRAKER_CONFIG.format(port=port, klippy=klipper.path)
        (data / "config" / "moonraker.conf").write_text(config)
        with _process([str(MOONRAKER), "-m", "moonraker", "-d", str(data)], folder / "moonraker.log"):
            own = data / "comms" / "moonraker.sock"
            until(own.exists, "Moonraker listens")
            key = _moonraker_key(own)
            url = f"http://127.0.0.1:{port}/server/info"

            def is_ready() -> bool:
                return bool(((asked(url, key) or {}).get("result") or {}).get("klippy_state") == "ready")

            until(is_ready, "Moonraker has its Klipper")
            yield f"127.0.0.1:{port}", key, klipper
    finally:
        klipper.stop()


def _moonraker_key(path: Path) -> str:
    """Ask Moonraker for its key over its own socket, which only its user can open."""
    with socket.socket(socket.AF_UNIX) as line:
        line.settimeout(20)
        line.connect(str(path))
        line.sendall(json.dumps({"jsonrpc": "2.0", "method": "access.get_api_key", "id": 1}).encode() + b"\x03")
        said = b""
        while True:
            said += line.recv(65536)
            for part in said.split(b"\x03")[:-1]:
                if (answer := json.loads(part)).get("id") == 1:
                    return str(answer["result"])
