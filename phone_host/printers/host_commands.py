"""Commands within G-code that are for the host, not for the printer: lines that begin with `@`. Pure.

OctoPrint obeys `@pause`, `@resume`, `@cancel` and `@abort`; Repetier-Host, from which they come, also has `@kill`, and `@info` and others for its own
windows; plugins have more (`@PAUSE_POSITION`). Cura's "Pause at height" writes `@pause` for both. A printer knows none of them.
Source: OctoPrint's documentation, "@ Commands"; Cura's PauseAtHeight.py.
"""

import re
from collections.abc import Sequence
from typing import Final

from phone_host.printers.marlin_reply import HostAction

_COMMAND: Final = re.compile(r"@([A-Za-z]\w*)(?:\s.*)?")
_ACTIONS: Final = {
    "pause": HostAction.PAUSE,
    "resume": HostAction.RESUME,
    "cancel": HostAction.CANCEL,
    "abort": HostAction.CANCEL,
    "kill": HostAction.CANCEL,
}


def host_command(text: str) -> str:
    """Return the name of a command for the host, in small letters; empty: the line is none.

    Args:
        text: a line of G-code, without comment and blanks around it.
    """
    found = _COMMAND.fullmatch(text)
    return found[1].lower() if found and text.isprintable() else ""


def action_of(name: str) -> HostAction:
    """Return what a command wants; NONE: it is for another host."""
    return _ACTIONS.get(name, HostAction.NONE)


def ignored_note(names: Sequence[str]) -> tuple[str, ...]:
    """Return a sentence on the commands that are not obeyed here; nothing if there are none."""
    others = [f"@{name}" for name in names if action_of(name) is HostAction.NONE]
    return (f"its G-code has commands for another host ({', '.join(others)}): they were ignored",) if others else ()


def passed_note(names: Sequence[str], whose: str) -> tuple[str, ...]:
    """Return a sentence on commands in a file that somebody else prints; nothing if there are none."""
    listed = ", ".join(f"@{name}" for name in names)
    return (f"its G-code has commands for a host ({listed}): {whose} obeys or ignores them",) if names else ()
