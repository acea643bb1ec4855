"""Firmware as no manual describes it: each takes lines in its own way, and has two heaters whose goals a test may see at the end.

Written as a stranger would who knows printers and not this program. What a printer does and what it says are two things here.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

_LINE: Final = re.compile(r"(?:N(?P<number>\d+)\s*)?(?P<text>[^*]*)")
_HEAT: Final = re.compile(r"(M104|M109|M140|M190)\b.*?S(\d+)")


@dataclass(slots=True)
class Firmware:
    """A printer.

    Attributes:
        says: what it says to a line that it has done: takes the firmware, the number and the text of the line.
        does: whether it does the line at all.
        goals: of nozzle and bed, degrees C.
        count: lines that came.
    """

    says: "Callable[[Firmware, int, str], bytes]"
    does: "Callable[[Firmware, str], bool]" = lambda _, __: True
    goals: dict[str, float] = field(default_factory=lambda: {"T": 0.0, "B": 0.0})
    count: int = 0

    @property
    def is_cold(self) -> bool:
        """Whether both heaters are off."""
        return not any(self.goals.values())

    @property
    def report(self) -> bytes:
        """Its temperatures, as Marlin reports them."""
        return f"T:99.5 /{self.goals['T']:.2f} B:44.5 /{self.goals['B']:.2f} @:0 B@:0".encode()

    def answer(self, line: str, _: int) -> bytes:
        """Take a line; return what it says."""
        self.count += 1
        found = _LINE.match(line)
        assert found is not None
        text = found["text"].strip()
        if not text:
            return b""
        if self.does(self, text) and (heat := _HEAT.match(text)):
            self.goals["T" if heat[1] in {"M104", "M109"} else "B"] = float(heat[2])
        return self.says(self, int(found["number"] or -1), text)


def _resets(firmware: Firmware, number: int, text: str) -> bytes:
    """It browns out once, with both heaters off after that, and counts from nothing."""
    del number, text
    if firmware.count == 30:
        firmware.goals.update(T=0.0, B=0.0)
        return b"start\r\necho: External Reset\r\nMarlin 2.1.2\r\necho:SD card ok\r\n"
    return b"ok\r\n"


def _resets_quietly(firmware: Firmware, number: int, text: str) -> bytes:
    """It begins anew without `start`, heats on as its panel says, and asks for its first line."""
    del text
    if firmware.count < 30 or number < 0:
        return b"ok\n"
    return b"Error:Line Number is not Last Line Number+1, Last Line: 0\nResend: 1\nok\n"


_GARBLED: Final = (
    b"Resend: \xff\xfe\n",
    b"Resend: -3\nok\n",
    b"Resend: 1e9\nok\n",
    b"rs N4\x007\n",
    b"Resend:\n",
    b"Resend: 12 34\n",
)


def _garbles(firmware: Firmware, number: int, text: str) -> bytes:
    del number, text
    return b"ok\n" if firmware.count < 12 else _GARBLED[firmware.count % len(_GARBLED)]


def _never_sums(firmware: Firmware, number: int, text: str) -> bytes:
    """Every checksum is wrong from some line on; what has no number is taken."""
    del text
    if firmware.count < 12 or number < 0:
        return b"ok\n"
    return b"Error:checksum mismatch, Last Line: 10\nResend: 11\nok\n"


def _is_sound(firmware: Firmware, text: str) -> bool:
    return firmware.count < 12 or text.startswith(("M104 S0", "M140 S0"))


def _kills(firmware: Firmware, number: int, text: str) -> bytes:
    del number, text
    return b"ok\n" if firmware.count < 20 else b"!! Lost communication with MCU 'mcu'\n"


def _reports_only(firmware: Firmware, number: int, text: str) -> bytes:
    """`ok` went missing from the build: temperatures are all it says."""
    del number, text
    return b"ok\n" if firmware.count < 12 else firmware.report + b"\n"


def _echoes(firmware: Firmware, number: int, text: str) -> bytes:
    """It shows every line that comes, and at some point a stop that nobody has sent."""
    del number
    stop = b"echo:M112\nError:Printer halted. kill() called!\n" if firmware.count == 25 else b""
    return b"echo:" + text.encode() + b"\n" + stop + b"ok\n"


def _knows_little(firmware: Firmware, number: int, text: str) -> bytes:
    """An old build: no M85, M107, M141, M105, nor M84."""
    del firmware, number
    if text.split(maxsplit=1)[0] in {"M85", "M107", "M141", "M105", "M84", "M108"}:
        return f'echo:Unknown command: "{text}"\nok\n'.encode()
    return b"ok 0\n"


def _knows_little_and_sulks(firmware: Firmware, number: int, text: str) -> bytes:
    """As before, and without `ok` after what it does not know."""
    said = _knows_little(firmware, number, text)
    return said.removesuffix(b"ok\n") if said.startswith(b"echo") else said


def _starts_twice(firmware: Firmware, number: int, text: str) -> bytes:
    del number, text
    return b"start\nstart\nok\n" if firmware.count == 1 else b"ok " + firmware.report + b"\n"


def _answers_and_heats(firmware: Firmware, number: int, text: str) -> bytes:
    del number
    return b"ok " + firmware.report + b"\n" if text == "M105" else b"ok\n"


def _is_no_cooling(firmware: Firmware, text: str) -> bool:
    del firmware
    return not text.endswith("S0")


def _colours(firmware: Firmware, number: int, text: str) -> bytes:
    """It paints its answers for a terminal."""
    del number, text
    return b"ok\n" if firmware.count < 12 else b"\x1b[32mok\x1b[0m\n"


FIRMWARES: Final[dict[str, Callable[[], Firmware]]] = {
    "resets": lambda: Firmware(_resets),
    "resets quietly": lambda: Firmware(_resets_quietly),
    "garbled requests": lambda: Firmware(_garbles, _is_sound),
    "checksums always wrong": lambda: Firmware(_never_sums, _is_sound),
    "flood of ok": lambda: Firmware(lambda *_: b"ok\n" * 40),
    "flood of ok, does nothing": lambda: Firmware(lambda *_: b"ok\n" * 40, _is_no_cooling),
    "!!": lambda: Firmware(_kills),
    "temperatures without ok": lambda: Firmware(_reports_only),
    "M112 echo": lambda: Firmware(_echoes),
    "unknown commands": lambda: Firmware(_knows_little),
    "unknown commands without ok": lambda: Firmware(_knows_little_and_sulks),
    "start twice": lambda: Firmware(_starts_twice),
    "answers and heats": lambda: Firmware(_answers_and_heats, _is_no_cooling),
    "colours": lambda: Firmware(_colours),
    "split lines": lambda: Firmware(_answers_and_heats),
}
