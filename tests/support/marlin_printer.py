"""A printer on a pseudo terminal that speaks Marlin's protocol, with everything that goes wrong on cables. It judges: what was done, in order.

Written from Marlin's documentation, not from its code. Corrupted lines are changed on their way, lost answers are never written.
"""

import os
import pty
import random
import re
import socket
import termios
import threading
import time
import tty
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import reduce
from operator import xor
from select import select
from typing import Final

_NUMBERED: Final = re.compile(rb"N(-?\d+) ?(.*?)\*(\d+)\s*$")
_BITS: Final = 10
"""On the wire for each byte: start and stop bit included."""


@dataclass(slots=True)
class Faults:
    """What goes wrong.

    Attributes:
        corrupted: share of the lines of which a byte is changed on the way.
        lost: share of the answers that never arrive.
        delay_s: from a line to its answer.
        baud: bits per second of the wire; 0: no limit.
        answers_ok_after_resend: whether `ok` follows `Resend`.
        silent: commands that take so many seconds without a word.
        holds: commands that it does when the test releases it.
        dies_after: lines after which the plug is pulled.
        says: to be said once before a line of this number is answered.
        heating_s: that M109 and M190 wait, with a temperature every tenth of a second; M108 ends the wait of firmware that hears it at once.
        hears_at_once: whether M108 is heard while it waits (EMERGENCY_PARSER); else what comes meanwhile is done afterwards.
        has_m85: whether it knows M85.
        busy: commands that it is busy with for ever, or until it hears M108.
        lost_answers: numbers of lines whose answer never arrives, once each.
        chatter: said again and again, whatever is done: reports of M155, `wait` of Repetier.
        chatter_s: between two of these.
        reports: whether it answers M105 with its temperatures.
        stays_hot: whether it answers what switches a heater off, and heats all the same.
        greets: whether it says `start` once its port has been opened, as a board that restarts then; it always does on a socket.
    """

    corrupted: float = 0.0
    lost: float = 0.0
    delay_s: float = 0.0
    baud: int = 0
    answers_ok_after_resend: bool = True
    silent: dict[str, float] = field(default_factory=dict)
    holds: frozenset[str] = frozenset()
    dies_after: int = 1 << 60
    says: dict[int, str] = field(default_factory=dict)
    heating_s: float = 0.0
    hears_at_once: bool = True
    has_m85: bool = True
    busy: frozenset[str] = frozenset()
    lost_answers: set[int] = field(default_factory=set)
    chatter: str = ""
    chatter_s: float = 0.2
    greets: bool = False
    reports: bool = True
    stays_hot: bool = False


class MarlinPrinter:
    """The printer.

    Attributes:
        path: of the pseudo terminal; empty: it has none.
        uri: of it, or of the TCP port.
        done: commands that were done, in order.
        nozzle: where the heater of the tool in use shall go, degrees C.
        tools: where the heaters of tools that were named shall go, likewise.
        bed: likewise.
        inactivity_s: after which it kills itself without a command (M85), s; 0: never.
        guards: every value that M85 has set.
        refused_to_cool: lines that switch a heater off which it has answered and not done.
        cooled_s: when the last heater was switched off, time.monotonic().
        is_released: set by a test that lets it do what it holds.
        resends: how often it asked for a line again.
        lost: answers of it that never arrived.

    Args:
        faults: what goes wrong.
        seed: of the faults.
        on_socket: whether it is behind a TCP port, as with ser2net.
    """

    def __init__(self, faults: Faults, seed: int = 1, *, on_socket: bool = False) -> None:
        self._faults, self._random = faults, random.Random(seed)
        self._listener: socket.socket | None = None
        if on_socket:
            self._listener = socket.create_server(("127.0.0.1", 0))
            self.path, self._master, self._slave = "", -1, -1
            self.uri = f"socket://127.0.0.1:{self._listener.getsockname()[1]}"
        else:
            self._master, self._slave = pty.openpty()
            tty.setraw(self._slave)
            self.path = os.ttyname(self._slave)
            self.uri = f"serial:{self.path}?baud=115200"
        self.done: list[str] = []
        self.nozzle = self.bed = 0.0
        self.tools: dict[int, float] = {}
        self.inactivity_s, self.guards = 0, list[int]()
        self.cooled_s = 0.0
        self.refused_to_cool = 0
        self.resends = self.lost = 0
        self._said_with_ok = ""
        self._last = 0
        self.waiting = b""
        self._is_over, self.is_released = threading.Event(), threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)

    def start(self) -> None:
        """Switch it on."""
        self._thread.start()
        if self._listener is None and not self._faults.greets:
            self._say("start")

    def stop(self) -> None:
        """Switch it off."""
        self._is_over.set()
        self._thread.join(10)
        if self._listener is not None:
            self._listener.close()
        for descriptor in (self._master, self._slave):
            try:
                os.close(descriptor)
            except OSError:
                continue

    @property
    def is_cold(self) -> bool:
        """Whether no heater shall be warm."""
        return not self.nozzle and not self.bed and not any(self.tools.values())

    def _run(self) -> None:
        chatter = threading.Thread(target=self._chat, daemon=True)
        try:
            self._open()
            chatter.start()
            while not self._is_over.is_set():
                self._read(0.02)
                while b"\n" in self.waiting:
                    line, _, self.waiting = self.waiting.partition(b"\n")
                    if len(self.done) >= self._faults.dies_after:
                        os.close(self._master)
                        return
                    self._take(self._on_the_way(line))
        except OSError:
            return
        finally:
            self._is_over.set()
            if chatter.is_alive():
                chatter.join(10)

    def _open(self) -> None:
        """Wait until a host has opened the port, where that is told from outside."""
        if self._listener is not None:
            while not select([self._listener], [], [], 0.05)[0]:
                if self._is_over.is_set():
                    return
            connection, _ = self._listener.accept()
            self._master = connection.detach()
            self._say("start")
        elif self._faults.greets:
            # pyserial sets the port up for reading without waiting, then drops what came before; were this dropped, too, the host waits 3 s.
            while termios.tcgetattr(self._slave)[6][termios.VMIN] not in {0, b"\0"} and not self._is_over.wait(0.02):
                pass
            self._is_over.wait(0.1)
            self._say("start")

    def _read(self, wait_s: float) -> bytes:
        """Take what has come into the buffer."""
        if not select([self._master], [], [], wait_s)[0]:
            return b""
        data = os.read(self._master, 4096)
        if not data:
            raise OSError("the host has closed the connection")
        if self._faults.baud:
            self._is_over.wait(len(data) * _BITS / self._faults.baud)
        self.waiting += data
        return data

    def _chat(self) -> None:
        while self._faults.chatter and not self._is_over.wait(self._faults.chatter_s):
            self._say(self._faults.chatter)

    def _on_the_way(self, line: bytes) -> bytes:
        if self._random.random() >= self._faults.corrupted or not line:
            return line
        at = self._random.randrange(len(line))
        return line[:at] + bytes([line[at] ^ 1 << self._random.randrange(6)]) + line[at + 1 :]

    def _take(self, line: bytes) -> None:
        if not line.strip():
            return
        if not line.startswith(b"N"):
            if re.fullmatch(rb"[GM]\d+.*", line.strip()):
                self._do(line.decode("ascii", "replace").strip())
            else:
                self._say(f'echo:Unknown command: "{line.decode("ascii", "replace")}"')
            self._ok()
            return
        found = _NUMBERED.match(line)
        if found is None or reduce(xor, line[: line.rindex(b"*")], 0) != int(found[3]):
            self._ask("checksum mismatch")
            return
        number, text = int(found[1]), found[2].decode("ascii", "replace").strip()
        if text.startswith("M110"):
            self._last = number
        elif number != self._last + 1:
            self._ask("Line Number is not Last Line Number+1")
            return
        else:
            self._last = number
            if number in self._faults.says:
                self._say(self._faults.says.pop(number))
            self._do(text)
        if number in self._faults.lost_answers:
            self._faults.lost_answers.discard(number)
            self.lost += 1
            return
        self._ok()

    def _do(self, text: str) -> None:
        name = text.split(maxsplit=1)[0]
        if name == "M85":
            self._guard(text)
            return
        if name == "M105":
            self._report()
            return
        self.done.append(text)
        self._take_time(name)
        target, tool = re.search(r"S(\d+)", text), re.search(r"T(\d+)", text)
        if self._faults.stays_hot and name in {"M104", "M140"} and text.endswith("S0"):
            self.refused_to_cool += 1
            return
        if name in {"M104", "M109"} and target and tool:
            self.tools[int(tool[1])] = float(target[1])
        elif name in {"M104", "M109"} and target:
            self.nozzle = float(target[1])
        if name in {"M140", "M190"} and target:
            self.bed = float(target[1])
        if name in {"M104", "M140"} and self.is_cold:
            self.cooled_s = time.monotonic()
        if name in {"M109", "M190"}:
            self._heat()

    def _take_time(self, name: str) -> None:
        while name in self._faults.busy and not self._is_over.is_set():
            self._say("echo:busy: paused for user")
            if b"M108" in self._read(0.2) and self._faults.hears_at_once:
                break
        while name in self._faults.holds and not (self.is_released.wait(0.02) or self._is_over.is_set()):
            pass
        if (seconds := self._faults.silent.get(name)) is not None:
            self._is_over.wait(seconds)

    def _report(self) -> None:
        goals = {**{f"T{tool}": goal for tool, goal in self.tools.items()}, "B": self.bed}
        if self._faults.reports:
            self._said_with_ok = f" T:21.0 /{self.nozzle:.1f} " + " ".join(
                f"{key}:21.0 /{goal:.1f}" for key, goal in goals.items()
            )

    def _guard(self, text: str) -> None:
        if not self._faults.has_m85:
            self._say(f'echo:Unknown command: "{text}"')
            return
        self.inactivity_s = int(text.partition("S")[2])
        self.guards.append(self.inactivity_s)

    def _heat(self) -> None:
        """Wait for a temperature; what comes meanwhile stays in the buffer."""
        end_s = time.monotonic() + self._faults.heating_s
        while time.monotonic() < end_s and not self._is_over.is_set():
            self._say(f"T:21.0 /{self.nozzle:.1f} B:21.0 /{self.bed:.1f} W:?")
            if b"M108" in self._read(0.1) and self._faults.hears_at_once:
                return

    def _ask(self, why: str) -> None:
        self.resends += 1
        self._say(f"Error:{why}, Last Line: {self._last}")
        self._say(f"Resend: {self._last + 1}")
        if self._faults.answers_ok_after_resend:
            self._ok()

    def _ok(self) -> None:
        if self._faults.delay_s:
            self._is_over.wait(self._faults.delay_s)
        if self._random.random() >= self._faults.lost:
            self._say("ok" + self._said_with_ok)
        else:
            self.lost += 1
        self._said_with_ok = ""

    def _say(self, text: str) -> None:
        try:
            os.write(self._master, text.encode() + b"\n")
        except OSError:
            return


@contextmanager
def printer(faults: Faults | None = None, seed: int = 1, *, on_socket: bool = False) -> Iterator[MarlinPrinter]:
    """A printer that is on while the block runs."""
    made = MarlinPrinter(faults or Faults(), seed, on_socket=on_socket)
    made.start()
    try:
        yield made
    finally:
        made.stop()


Check = Callable[[], bool]


def cube(lines: int) -> list[str]:
    """Return a print of so many lines, each unlike the others: heat up, home, draw, cool down."""
    head = ["M140 S60", "M104 S200", "G28", "G90", "M83"]
    tail = ["M104 S0", "M140 S0", "M84"]
    drawn = [
        f"G1 X{10 + n % 97:.2f} Y{10 + n % 89:.2f} E{0.01 + n / 1e5:.5f} F3000"
        for n in range(lines - len(head) - len(tail))
    ]
    return [*head, *drawn, *tail]
