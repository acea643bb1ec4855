"""A print on its way to a simulated printer by each kind of door, brought into a state, so that a test may end it from there."""

import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Final

from phone_host.printers.printer_uri import ServerKind
from tests.support.marlin_printer import Faults, MarlinPrinter, printer
from tests.support.print_server import KEY, PrintServerStandIn, ServerFaults, print_server
from tests.support.programs import until


class Door(Enum):
    """How the printer is reached."""

    SERIAL = "serial"
    SOCKET = "socket"
    OCTOPRINT = "octoprint"
    MOONRAKER = "moonraker"


class State(Enum):
    """What the printer does when the print is ended."""

    HEATING = "heating"
    PRINTING = "printing"
    WAITING = "waiting"
    PAUSED = "paused"
    CANCELLING = "cancelling"


@dataclass(slots=True)
class Scene:
    """A printer, and what can be seen of it.

    Attributes:
        options: of `phone-host print` for it.
        is_there: whether it is in the state.
        is_hot: whether both heaters are on.
        is_cold: whether both are off.
        is_cancelling: whether it was asked to end the print.
        count: lines that it has done, or answers that it has given.
        obey: lets it do what it was asked, where it has not yet.
    """

    options: list[str]
    is_there: Callable[[], bool]
    is_hot: Callable[[], bool]
    is_cold: Callable[[], bool]
    is_cancelling: Callable[[], bool]
    count: Callable[[], int]
    obey: Callable[[], None]


_HEAD: Final = ["M140 S60", "M104 S200"]
_STATE_LINE: Final = {State.HEATING: "M109 S200", State.WAITING: "M0 Change filament"}


def gcode_of(state: State) -> str:
    """A print that comes into a state, and stays there for long."""
    drawn = [f"G1 X{10 + n % 90} Y{10 + n % 80} E{n / 100:.2f} F3000" for n in range(2000)]
    return "\n".join([*_HEAD, *([_STATE_LINE[state]] if state in _STATE_LINE else []), *drawn]) + "\n"


@contextmanager
def scene(door: Door, state: State, folder: Path) -> Iterator[Scene]:
    """A printer that gets into a state while a print goes to it."""
    if door in {Door.SERIAL, Door.SOCKET}:
        faults = Faults(
            delay_s=0.01,
            greets=True,
            heating_s=60.0,
            busy=frozenset({"M0"}),
            says={20: "//action:pause"} if state is State.PAUSED else {},
            holds=frozenset({"M107"} if state is State.CANCELLING else ()),
        )
        with printer(faults, on_socket=door is Door.SOCKET) as there:
            yield _line_scene(there, state)
        return
    kind = ServerKind(door.value)
    faults_there = ServerFaults(rate=0.001, cools=state is not State.CANCELLING)
    with print_server(kind, faults_there) as server:
        yield server_scene(server, state, folder)


def _line_scene(there: MarlinPrinter, state: State) -> Scene:
    lines = {State.HEATING: 3, State.WAITING: 3, State.PAUSED: 18}.get(state, 40)
    return Scene(
        options=["--printer", there.uri],
        is_there=lambda: len(there.done) >= lines,
        is_hot=lambda: (there.nozzle, there.bed) == (200.0, 60.0),
        is_cold=lambda: there.is_cold,
        is_cancelling=lambda: "M108" in there.done,
        count=lambda: len(there.done),
        obey=there.is_released.set,
    )


def server_scene(there: PrintServerStandIn, state: State, folder: Path) -> Scene:
    """A scene of a server that is there."""
    config = folder / "host.toml"
    config.write_text(f'[printers]\n"{there.uri}" = "{KEY}"\n')
    conditions = {State.WAITING: "finishing", State.PAUSED: "paused"}

    def is_there() -> bool:
        with there.lock:
            if there.condition == "printing" and state in conditions:
                there.condition = conditions[state]
            seen = there.answers > 8  # it was asked several times since the file came
            return bool(there.files) and seen and (state is not State.PRINTING or there.share > 0)

    def obey() -> None:
        there.faults.cools = True

    return Scene(
        options=["--printer", there.uri, "--config", str(config)],
        is_there=is_there,
        is_hot=lambda: (there.goal, there.bed) == (205.0, 60.0),
        is_cold=lambda: (there.goal, there.bed) == (0.0, 0.0),
        is_cancelling=lambda: any("cancel" in asked or asked.endswith("/job") for asked in there.asked),
        count=lambda: there.answers,
        obey=obey,
    )


def until_or_over(process: "subprocess.Popen[str]", condition: Callable[[], bool], what: str) -> None:
    """Wait for a condition, or for the end of the process."""
    until(lambda: process.poll() is not None or condition(), what)
