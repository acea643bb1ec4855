"""OctoPrint, by its REST API. Source: OctoPrint's documentation, "REST API" (https://docs.octoprint.org/en/master/api/)."""

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Final

from common.errors import UnavailableError
from phone_host.printers.cooling import heaters_off
from phone_host.printers.printer_uri import ServerUri
from phone_host.printers.progress import Heat
from phone_host.printers.server import (
    Condition,
    ServerState,
    form_of,
    note_refusal,
    require_good,
    require_key,
)
from phone_host.printers.server_answer import Answer, Value, or_zero
from phone_host.printers.server_talk import ORDER_S, ServerTalk

_WHERE: Final = "OctoPrint shows it under User settings, Application keys"
_TOOL: Final = re.compile(r"tool(\d{1,2})")
_WHOLE: Final = 0.9999
_NOT_OPERATIONAL: Final = 409


class OctoPrint:
    """See PrintServer.

    Args:
        uri: where it is.
        key: of a user, or of an application; empty: none.
    """

    def __init__(self, uri: ServerUri, key: str) -> None:
        self._talk, self._key, self._example = ServerTalk(uri), key, f'"{uri.text}" = "KEY"'
        self._heaters: tuple[str, ...] = ()
        self.title = self._talk.server

    def state(self) -> ServerState:
        """See PrintServer.

        The printer is asked before the job: of a print that ends between the two, the share is the final one.
        """
        printer_answer = self._ask("GET", "/api/printer?exclude=sd")
        job_answer = self._ask("GET", "/api/job")
        require_good(job_answer, "to tell what it prints")
        job = job_answer.json()
        said = job["state"].text
        share = min(max(or_zero(job["progress"]["completion"].number) / 100, 0.0), 1.0)
        left_s = job["progress"]["printTimeLeft"].number
        if printer_answer.status == _NOT_OPERATIONAL:
            is_error = "error" in said.lower()
            words = job["error"].text or said
            condition = Condition.ERROR if is_error else Condition.OFFLINE
            return ServerState(
                condition=condition, share=share, seconds_left=left_s, heat=Heat(), is_hot=False, words=words
            )
        require_good(printer_answer, "to tell how its printer is")
        printer = printer_answer.json()
        self._heaters = printer["temperature"].keys
        heat, is_hot = _heat(printer["temperature"])
        condition = _condition(printer["state"]["flags"], share)
        return ServerState(condition=condition, share=share, seconds_left=left_s, heat=heat, is_hot=is_hot, words=said)

    def start(self, gcode: Path, name: str, sent: Callable[[float], None]) -> None:
        """See PrintServer."""
        form = form_of(name, {"select": "true", "print": "true"})
        headers = {**self._headers(), "Content-Type": form.content_type}
        answer = self._talk.hand_over("POST", "/api/files/local", headers, form.body(gcode, sent), form.size(gcode))
        require_key(answer, self._key, self._example, _WHERE)
        require_good(answer, "the file")
        if answer.json()["effectivePrint"].is_false:
            raise UnavailableError(f"{self.title} has the file, but did not start it", "look at its own page")

    def pause(self) -> None:
        """See PrintServer."""
        note_refusal(self._command("/api/job", {"command": "pause", "action": "pause"}), "pause")

    def go_on(self) -> None:
        """See PrintServer."""
        note_refusal(self._command("/api/job", {"command": "pause", "action": "resume"}), "resume")

    def cancel(self) -> None:
        """See PrintServer."""
        require_good(self._command("/api/job", {"command": "cancel"}), "to end the print")

    def cool(self) -> bool:
        """See PrintServer."""
        tools = [int(found[1]) for name in self._heaters if (found := _TOOL.fullmatch(name))]
        cold = [*heaters_off(tools, has_chamber="chamber" in self._heaters), "M107", "M84"]
        require_good(self._command("/api/printer/command", {"commands": cold}), "to switch its heaters off")
        return True

    def halt(self) -> str:
        """See PrintServer. M112 is heard at once by firmware with an emergency parser, by the others when they hear again."""
        note_refusal(self._command("/api/printer/command", {"commands": ["M112"]}), "stopping")
        return "restart the printer, and connect it again in OctoPrint"

    def hurry(self) -> None:
        """See PrintServer."""
        self._talk.hurry()

    def _headers(self) -> dict[str, str]:
        return {"X-Api-Key": self._key} if self._key else {}

    def _ask(self, method: str, target: str) -> Answer:
        answer = self._talk.ask(method, target, self._headers())
        require_key(answer, self._key, self._example, _WHERE)
        return answer

    def _command(self, target: str, command: dict[str, object]) -> Answer:
        headers = {**self._headers(), "Content-Type": "application/json"}
        answer = self._talk.ask("POST", target, headers, json.dumps(command).encode(), ORDER_S)
        require_key(answer, self._key, self._example, _WHERE)
        return answer


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
