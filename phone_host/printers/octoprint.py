"""OctoPrint, by its REST API. Source: OctoPrint's documentation, "REST API" (https://docs.octoprint.org/en/master/api/)."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Final

from common.errors import UnavailableError
from phone_host.printers.cooling import heaters_off
from phone_host.printers.door import Heat
from phone_host.printers.printer_uri import ServerUri
from phone_host.printers.server import Condition, KeyedServer, ServerState, form_of, note_refusal, require_good
from phone_host.printers.server_answer import Value, or_zero

_TOOL: Final = re.compile(r"tool(\d{1,2})")
_WHOLE: Final = 0.9999
_NOT_OPERATIONAL: Final = 409


class OctoPrint(KeyedServer):
    """See PrintServer.

    Args:
        uri: where it is.
        key: of a user, or of an application; empty: none.
    """

    def __init__(self, uri: ServerUri, key: str) -> None:
        super().__init__(uri, key, "OctoPrint shows it under User settings, Application keys")
        self._heaters: tuple[str, ...] = ()

    def state(self) -> ServerState:
        """See PrintServer.

        The printer is asked before the job: of a print that ends between the two, the share is the final one.
        """
        printer_answer = self._asked("/api/printer?exclude=sd")
        job_answer = self._asked("/api/job")
        require_good(job_answer, "to tell what it prints")
        job = job_answer.json()
        said = job["state"].text
        share = min(max(or_zero(job["progress"]["completion"].number) / 100, 0.0), 1.0)
        left_s = job["progress"]["printTimeLeft"].number
        if printer_answer.status == _NOT_OPERATIONAL:
            is_error = "error" in said.lower()
            words = job["error"].text or said
            condition = Condition.ERROR if is_error else Condition.OFFLINE
            return ServerState(condition=condition, share=share, seconds_left=left_s, words=words)
        require_good(printer_answer, "to tell how its printer is")
        printer = printer_answer.json()
        self._heaters = printer["temperature"].keys
        heat, is_hot = _heat(printer["temperature"])
        condition = _condition(printer["state"]["flags"], share)
        return ServerState(condition=condition, share=share, seconds_left=left_s, heat=heat, is_hot=is_hot, words=said)

    def start(self, gcode: Path, name: str, sent: Callable[[float], None]) -> None:
        """See PrintServer."""
        form = form_of(name, {"select": "true", "print": "true"})
        if self._given("/api/files/local", form, gcode, sent).json()["effectivePrint"].is_false:
            raise UnavailableError(f"{self.title} has the file, but did not start it", "look at its own page")

    def pause(self) -> None:
        """See PrintServer."""
        note_refusal(self._ordered("/api/job", {"command": "pause", "action": "pause"}), "pause")

    def go_on(self) -> None:
        """See PrintServer."""
        note_refusal(self._ordered("/api/job", {"command": "pause", "action": "resume"}), "resume")

    def cancel(self) -> None:
        """See PrintServer."""
        require_good(self._ordered("/api/job", {"command": "cancel"}), "to end the print")

    def cool(self) -> bool:
        """See PrintServer."""
        tools = [int(found[1]) for name in self._heaters if (found := _TOOL.fullmatch(name))]
        cold = [*heaters_off(tools, has_chamber="chamber" in self._heaters), "M107", "M84"]
        require_good(self._ordered("/api/printer/command", {"commands": cold}), "to switch its heaters off")
        return True

    def halt(self) -> str:
        """See PrintServer. M112 is heard at once by firmware with an emergency parser, by the others when they hear again."""
        note_refusal(self._ordered("/api/printer/command", {"commands": ["M112"]}), "stopping")
        return "restart the printer, and connect it again in OctoPrint"


def _condition(flags: Value, share: float) -> Condition:
    if flags["error"].is_true or flags["closedOrError"].is_true:
        return Condition.ERROR
    if flags["cancelling"].is_true or flags["finishing"].is_true or flags["pausing"].is_true:
        return Condition.BUSY
    if flags["paused"].is_true:
        return Condition.PAUSED
    if flags["printing"].is_true:
        return Condition.PRINTING
    if not flags["operational"].is_true:
        return Condition.OFFLINE
    return Condition.DONE if share >= _WHOLE else Condition.READY


def _heat(temperature: Value) -> tuple[Heat, bool]:
    pairs = {
        key: (or_zero(temperature[key]["actual"].number), or_zero(temperature[key]["target"].number))
        for key in temperature.keys
    }
    off = (0.0, 0.0)
    return Heat(pairs.get("tool0", off), pairs.get("bed", off)), any(goal > 0 for _, goal in pairs.values())
