"""What a printer says, read line by line: answers, requests, temperatures, and what its display wants of the host. Pure.

Source: the RepRap wiki, "G-code", section Replies from the machine; Marlin's queue.cpp; for `//action:`, Marlin's documentation of
HOST_ACTION_COMMANDS, and OctoPrint's of action commands.
"""

import re
from dataclasses import dataclass
from enum import Enum
from typing import Final

MAX_MESSAGE: Final = 120
"""Characters of a printer's own words that are shown."""

_NEAR_C: Final = 3.0
"""A heater this near to its goal has reached it, degrees C; Marlin's own window is 1 to 3."""

_FATAL: Final = re.compile(
    r"halted|halt asserted|kill\(\)|killed|thermal|heating failed|maxtemp|mintemp|stopped|emergency|M999", re.IGNORECASE
)
_DEAD: Final = re.compile(
    r"!!|fatal:|alarm:|//\s*klipper state: (?:shutdown|disconnect)|:.*(?:max|min)temp triggered", re.IGNORECASE
)
"""How the last words of Klipper, Repetier, Smoothieware and an old Marlin begin, which says `Error:0` on a line of its own before them."""

_RESEND: Final = re.compile(r"(?:resend|rs)[: ]+N?(\d{1,9})(?!\d)", re.IGNORECASE)
_ORDER: Final = re.compile(r"line number is not|expected line", re.IGNORECASE)
_BUSY: Final = re.compile(r"(?:echo:\s*)?busy:\s*(.*)", re.IGNORECASE)
_START: Final = re.compile(r"start\b", re.IGNORECASE)
_ACTION: Final = re.compile(r"//\s*action:\s*(\w+)\s*(.*)", re.IGNORECASE)
_HEAT: Final = re.compile(r"\b(T|B|C)\d?:\s*(-?\d{1,5}(?:\.\d+)?)\s*/\s*(-?\d{1,5}(?:\.\d+)?)")
"""A cable spoils what the printer says, too: only numbers are taken for numbers."""

_WAITS: Final = re.compile(r"\bW:\s*[\d?]")
"""Marlin adds this to temperatures while M109 and M190 wait for them."""


class ReplyKind(Enum):
    """What a line of the printer means for what is sent."""

    OK = "ok"
    RESEND = "resend"
    BUSY = "busy"
    START = "start"
    FATAL = "fatal"
    ERROR = "error"
    ACTION = "action"
    OTHER = "other"


class HostAction(Enum):
    """What the printer's display, its sensors or the G-code itself want of the host."""

    NONE = "none"
    CANCEL = "cancel"
    PAUSE = "pause"
    RESUME = "resume"
    SHOW = "show"


_ACTIONS: Final = {
    "cancel": HostAction.CANCEL,
    "disconnect": HostAction.CANCEL,
    "poweroff": HostAction.CANCEL,
    "shutdown": HostAction.CANCEL,
    "pause": HostAction.PAUSE,
    "paused": HostAction.PAUSE,
    "out_of_filament": HostAction.PAUSE,
    "filament_runout": HostAction.PAUSE,
    "resume": HostAction.RESUME,
    "resumed": HostAction.RESUME,
    "notification": HostAction.SHOW,
    "prompt_begin": HostAction.SHOW,
    "prompt_end": HostAction.SHOW,
}
"""Others, such as the buttons of a question, are for hosts that can answer in the printer's place."""


@dataclass(frozen=True, slots=True)
class Reply:
    """A line that the printer has said.

    Attributes:
        kind: what it means for what is sent.
        text: its words; of a busy printer, with what; of an action, its argument.
        number: of the line that is requested.
        action: that is wanted of the host.
        name: of the action, as the printer wrote it.
        heat: temperature and goal of each heater, degrees C: T nozzle, B bed, C chamber.
        is_heating: whether it tells that a heater has not reached its goal yet.
        is_about_order: whether it complains of the number of a line.
    """

    kind: ReplyKind
    text: str = ""
    number: int = 0
    action: HostAction = HostAction.NONE
    name: str = ""
    heat: tuple[tuple[str, float, float], ...] = ()
    is_heating: bool = False
    is_about_order: bool = False


def read_reply(text: str) -> Reply:
    """Read a line of the printer.

    Args:
        text: without its end; zero bytes, as a starting port leaves them, are ignored.
    """
    said = "".join(each if each.isprintable() else " " for each in text.replace("\0", "")).strip()
    shown = said[:MAX_MESSAGE]
    heat = tuple((letter, float(now), float(goal)) for letter, now, goal in _HEAT.findall(said))
    is_heating = bool(_WAITS.search(said)) or any(goal > 0 and abs(now - goal) > _NEAR_C for _, now, goal in heat)
    lower = said.lower()
    if found := _ACTION.match(said):
        name = found[1].lower()
        return Reply(ReplyKind.ACTION, found[2][:MAX_MESSAGE], action=_ACTIONS.get(name, HostAction.NONE), name=name)
    if found := _BUSY.match(said):
        return Reply(ReplyKind.BUSY, f"busy: {found[1]}"[:MAX_MESSAGE])
    if found := _RESEND.match(said):
        return Reply(ReplyKind.RESEND, shown, number=int(found[1]))
    if _DEAD.match(said):
        return Reply(ReplyKind.FATAL, shown)
    if lower.startswith("error"):
        kind = ReplyKind.FATAL if _FATAL.search(said) else ReplyKind.ERROR
        return Reply(kind, shown, is_about_order=bool(_ORDER.search(said)))
    kind = ReplyKind.OK if lower.startswith("ok") else ReplyKind.START if _START.match(said) else ReplyKind.OTHER
    return Reply(kind, shown, heat=heat, is_heating=is_heating)
