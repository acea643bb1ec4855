"""Moonraker, the server before Klipper, by its HTTP API. Source: Moonraker's documentation, "External API" (https://moonraker.readthedocs.io)."""

import math
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Final
from urllib.parse import quote

from common.errors import UnavailableError
from phone_host.printers.door import Heat
from phone_host.printers.printer_uri import ServerUri
from phone_host.printers.server import Condition, KeyedServer, ServerState, form_of, note_refusal, require_good
from phone_host.printers.server_answer import Value, or_zero
from phone_host.printers.server_talk import ServerLostError

_OF_STATE: Final = {
    "standby": Condition.READY,
    "printing": Condition.PRINTING,
    "paused": Condition.PAUSED,
    "complete": Condition.DONE,
    "cancelled": Condition.CANCELLED,
    "error": Condition.CANCELLED,
}
"""Of print_stats. An error there ended the print; Klipper itself is ready again."""

_OF_KLIPPER: Final = {"startup": Condition.BUSY, "error": Condition.ERROR, "shutdown": Condition.ERROR}


class Moonraker(KeyedServer):
    """See PrintServer.

    Args:
        uri: where it is.
        key: of its API; empty: none, which it takes from trusted networks.
    """

    def __init__(self, uri: ServerUri, key: str) -> None:
        super().__init__(uri, key, "Fluidd and Mainsail show it under Settings, Authorization")
        self._heaters: tuple[str, ...] = ()

    def state(self) -> ServerState:
        """See PrintServer."""
        info = self._told("/server/info")
        klipper = info["klippy_state"].text
        if klipper != "ready":
            words = self._why() or f"Klipper is {klipper or 'not there'}"
            condition = _OF_KLIPPER.get(klipper, Condition.OFFLINE)
            return ServerState(condition=condition, words=words)
        if not self._heaters:
            self._heaters = self._told("/printer/objects/query?heaters")["status"]["heaters"]["available_heaters"].texts
        asked = "&".join(quote(name) for name in ("print_stats", "virtual_sdcard", *self._heaters))
        status = self._told(f"/printer/objects/query?{asked}")["status"]
        return _state(status, self._heaters)

    def start(self, gcode: Path, name: str, sent: Callable[[float], None]) -> None:
        """See PrintServer."""
        form = form_of(name, {"root": "gcodes", "print": "true"})
        said = self._given("/server/files/upload", form, gcode, sent).json()
        started = said["print_started"] if "print_started" in said.keys else said["result"]["print_started"]
        if started.is_false:
            raise UnavailableError(f"{self.title} has the file, but did not start it", "look at its own page")

    def pause(self) -> None:
        """See PrintServer."""
        self._do("/printer/print/pause", "pause")

    def go_on(self) -> None:
        """See PrintServer."""
        self._do("/printer/print/resume", "resume")

    def cancel(self) -> None:
        """See PrintServer. The macro behind it is the user's own; many leave heaters on, so `cool` follows."""
        with suppress(ServerLostError):
            require_good(self._ordered("/printer/print/cancel", {}), "to end the print")

    def cool(self) -> bool:
        """See PrintServer."""
        answer = self._ordered(f"/printer/gcode/script?script={quote('TURN_OFF_HEATERS')}", {})
        require_good(answer, "to switch its heaters off")
        return True

    def halt(self) -> str:
        """See PrintServer."""
        self._do("/printer/emergency_stop", "stopping")
        return "give FIRMWARE_RESTART on its page"

    def _why(self) -> str:
        """What Klipper says of itself; nothing where it is not connected."""
        answer = self._talk.ask("GET", "/printer/info", self._headers())
        return answer.json()["result"]["state_message"].text if answer.is_good else ""

    def _told(self, target: str) -> Value:
        answer = self._asked(target)
        require_good(answer, "to tell how its printer is")
        return answer.json()["result"]

    def _do(self, target: str, what: str) -> None:
        """Give an order. Klipper answers when it was done, which may be after it has heated; it is done all the same."""
        with suppress(ServerLostError):  # it is done later, or the next question tells that the server is gone
            note_refusal(self._ordered(target, {}), what)


def _state(status: Value, heaters: tuple[str, ...]) -> ServerState:
    stats = status["print_stats"]
    condition = _OF_STATE.get(stats["state"].text, Condition.BUSY)
    share = min(max(or_zero(status["virtual_sdcard"]["progress"].number), 0.0), 1.0)
    if condition is Condition.DONE:
        share = 1.0
    passed_s = stats["print_duration"].number
    left_s = passed_s * (1 - share) / share if share > 0 else math.nan
    pairs = {
        name: (or_zero(status[name]["temperature"].number), or_zero(status[name]["target"].number)) for name in heaters
    }
    off = (0.0, 0.0)
    heat = Heat(pairs.get("extruder", off), pairs.get("heater_bed", off))
    is_hot = any(goal > 0 for _, goal in pairs.values())
    return ServerState(
        condition=condition,
        share=share,
        seconds_left=left_s,
        heat=heat,
        is_hot=is_hot,
        words=stats["message"].text,
    )
