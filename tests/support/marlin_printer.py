"""A printer on a pseudo terminal that speaks Marlin's protocol, with everything that goes wrong on cables. It judges: what was done, in order.

Written from Marlin's documentation, not from its code. Corrupted lines are changed on their way, lost answers are never written.
"""

import os
import pty
import random
import re
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
        dies_after: lines after which the plug is pulled.
        says: to be said once before a line of this number is answered.
    """

    corrupted: float = 0.0
    lost: float = 0.0
    delay_s: float = 0.0
    baud: int = 0
    answers_ok_after_resend: bool = True
    silent: dict[str, float] = field(default_factory=dict)
    dies_after: int = 1 << 60
    says: dict[int, str] = field(default_factory=dict)


class MarlinPrinter:
    """The printer.

    Attributes:
        path: of the pseudo terminal.
        done: commands that were done, in order.
        nozzle: where the nozzle's heater shall go, degrees C.
        bed: likewise.
        cooled_s: when the last heater was switched off, time.monotonic().
        resends: how often it asked for a line again.
        lost: answers of it that never arrived.

    Args:
        faults: what goes wrong.
        seed: of the faults.
    """

    def __init__(self, faults: Faults, seed: int = 1) -> None:
        self._faults, self._random = faults, random.Random(seed)
        self._master, slave = pty.openpty()
        tty.setraw(slave)
        self.path = os.ttyname(slave)
        self._slave = slave
        self.done: list[str] = []
        self.nozzle = self.bed = 0.0
        self.cooled_s = 0.0
        self.resends = self.lost = 0
        self._last = 0
        self._is_over = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)

    def start(self) -> None:
        """Switch it on."""
        self._thread.start()
        self._say("start")

    def stop(self) -> None:
        """Switch it off."""
        self._is_over.set()
        self._thread.join(10)
        for descriptor in (self._master, self._slave):
            try:
                os.close(descriptor)
            except OSError:
                continue

    def _run(self) -> None:
        waiting = b""
        while not self._is_over.is_set():
            if not select([self._master], [], [], 0.02)[0]:
                continue
            try:
                data = os.read(self._master, 4096)
            except OSError:
                return
            if self._faults.baud:
                self._is_over.wait(len(data) * _BITS / self._faults.baud)
            *lines, waiting = (waiting + data).split(b"\n")
            for line in lines:
                if len(self.done) >= self._faults.dies_after:
                    os.close(self._master)
                    return
                self._take(self._on_the_way(line))

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
        self._ok()

    def _do(self, text: str) -> None:
        name = text.split(maxsplit=1)[0]
        self.done.append(text)
        if (seconds := self._faults.silent.get(name)) is not None:
            self._is_over.wait(seconds)
        target = re.search(r"S(\d+)", text)
        if name in {"M104", "M109"} and target:
            self.nozzle = float(target[1])
        if name in {"M140", "M190"} and target:
            self.bed = float(target[1])
        if name in {"M104", "M140"} and not self.nozzle and not self.bed:
            self.cooled_s = time.monotonic()

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
            self._say("ok")
        else:
            self.lost += 1

    def _say(self, text: str) -> None:
        try:
            os.write(self._master, text.encode() + b"\n")
        except OSError:
            return


@contextmanager
def printer(faults: Faults | None = None, seed: int = 1) -> Iterator[MarlinPrinter]:
    """A printer that is on while the block runs."""
    made = MarlinPrinter(faults or Faults(), seed)
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
