"""Judges from readings what a host needs besides camera, link and rig: Python, packages, the board's answer. Pure.

It needs no package, because it must be able to say which package is missing.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Final, assert_never

from common.diagnostic import Diagnostic
from common.doctor.finding import fail, ok, warn
from common.doctor.network_checks import CABLE_BOARD, Card
from common.doctor.package_probe import missing_package
from common.errors import SettingsError
from phone_host.native.library import VARIABLE, Library

OPENCV_WHEELS: Final = (
    "opencv-python-headless",
    "opencv-python",
    "opencv-contrib-python",
    "opencv-contrib-python-headless",
)
"""All of them install the same folder `cv2`: they overwrite each other's files, and removing one breaks the others."""

_COST_OF_SGBM: Final = "six times the work for each pair"
"""CPU time of both at 640x480 with 64 disparities (docs/figures.md)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Package:
    """A Python package that the host imports.

    Attributes:
        name: name of the module.
        version: version that the module states; empty if it cannot be imported.
        problem: why it cannot be imported.
        least: lowest tested version.
        below: first version that is too new; empty: no limit.
        wheels: installed distributions that provide it.
    """

    name: str
    version: str
    problem: str
    least: str
    below: str = ""
    wheels: tuple[str, ...] = ()


class Answer(Enum):
    """The outcome of asking the board."""

    BOARD = "board"
    BUSY = "busy"
    OTHER_VERSION = "other version"
    REFUSED = "refused"
    SILENT = "silent"
    NO_WAY = "no way"
    UNKNOWN_NAME = "unknown name"


@dataclass(frozen=True, slots=True, kw_only=True)
class BoardReadings:
    """A board's answer.

    Attributes:
        uri: the link.
        answer: outcome of asking.
        waited_s: how long the doctor waited for the board, s.
        camera: the board's camera.
        round_trip_ns: shortest round trip; 0 if unknown.
        uncertainty_ns: uncertainty of its clock; 0 if unknown.
        problem: why a board of another version does not talk to this host.
        remedy: what to do about that.
    """

    uri: str
    answer: Answer
    waited_s: float
    camera: str = ""
    round_trip_ns: int = 0
    uncertainty_ns: int = 0
    problem: str = "the board speaks another protocol version"
    remedy: str = "update the older of the two"


def check_python(version: tuple[int, int, int], platform: str) -> Diagnostic:
    """Judge the Python version."""
    text = f"Python {'.'.join(map(str, version))} on {platform}"
    if version < (3, 11, 0):
        return fail("python", text, "install Python 3.11 or newer")
    return ok("python", text)


def check_package(package: Package) -> Diagnostic:
    """Judge a package: can it be imported, is its version in range, and is it installed only once?"""
    if len(package.wheels) > 1:
        keep = package.wheels[0]
        remove = " ".join(wheel for wheel in package.wheels if wheel != keep)
        both = f"{' and '.join(package.wheels)} are installed side by side and overwrite each other's files"
        return fail(package.name, both, f"pip uninstall {remove}, then pip install --force-reinstall --no-deps {keep}")
    if not package.version:
        return missing_package(package.name, f"cannot be imported ({package.problem})")
    text = f"{package.name} {package.version}" + (f" ({package.wheels[0]})" if package.wheels else "")
    found = _numbers(package.version)
    if found < _numbers(package.least) or (package.below and found >= _numbers(package.below)):
        span = f"{package.least} or newer" + (f", below {package.below}" if package.below else "")
        return warn(package.name, text, f"tested with {span}: make run-venv, or pipx reinstall tandemscan, installs it")
    return ok(package.name, text)


def check_native(library: Library | Diagnostic | SettingsError, wanted: str = "") -> Diagnostic:
    """Judge the native library: without it everything works, but slower.

    Args:
        library: as loaded, why there is none, or what is wrong with the instruction set that is wanted.
        wanted: value of `TANDEMSCAN_SIMD`, which means nothing without the library.
    """
    match library:
        case Library():
            return ok("native", f"own matcher: {library.simd.text}")
        case Diagnostic(message=reason, remedy=remedy):
            idle = f"; {VARIABLE}={wanted} has no effect" if wanted else ""
            return warn("native", f"own matcher {reason}; sgbm is used, {_COST_OF_SGBM}{idle}", remedy)
        case _:
            return fail("native", library.problem, library.remedy)


def check_board(board: BoardReadings) -> Diagnostic:  # noqa: PLR0911 - one return for each answer
    """Judge the board's answer."""
    match board.answer:
        case Answer.BOARD:
            clock = f", round trip {board.round_trip_ns / 1e6:.2f} ms, clock known to +-{board.uncertainty_ns / 1000:.0f} us"
            return ok("board", f"{board.uri}: {board.camera}{clock if board.round_trip_ns else ''}")
        case Answer.BUSY:
            return warn("board", f"{board.uri}: a board serves another host", "stop that one first: one host at a time")
        case Answer.OTHER_VERSION:
            return fail("board", f"{board.uri}: {board.problem}", board.remedy)
        case Answer.REFUSED:
            remedy = "start board-agent there; its link must be on that address, not on 127.0.0.1 of the board"
            return fail("board", f"{board.uri}: nobody listens at that port", remedy)
        case Answer.NO_WAY:
            return fail("board", f"{board.uri}: no way there", "check cable or Wi-Fi and the address: ping it")
        case Answer.UNKNOWN_NAME:
            return fail("board", f"{board.uri}: no machine of that name", "give its address; .local names need avahi")
        case Answer.SILENT:
            remedy = "run board-agent doctor there; is it the right port, and the right end of the cable?"
            return fail("board", f"{board.uri}: no answer within {board.waited_s:g} s", remedy)
        case _:
            assert_never(board.answer)


def check_ports(ports: tuple[str, ...], problem: str) -> Diagnostic:
    """List the serial ports."""
    if problem:
        return missing_package("serial", f"no serial links ({problem})")
    return ok("serial", ", ".join(ports) if ports else "no USB or Bluetooth serial port is there now")


def check_out(folder: str, obstacle: str) -> list[Diagnostic]:
    """Judge whether results can be written to a folder. If so, return nothing: the disk's finding names the folder."""
    if not obstacle:
        return []
    return [fail("out", f"{folder} cannot be written to ({obstacle})", "choose another folder with --out")]


def _numbers(version: str) -> tuple[int, ...]:
    return tuple(int(part) for part in re.findall(r"\d+", version)[:3])


_CABLE = CABLE_BOARD.rpartition(".")[0] + "."


@dataclass(frozen=True, slots=True, kw_only=True)
class Phone:
    """What a phone says of itself; an empty text where it does not.

    Attributes:
        model: maker and name.
        android: version.
        termux: version of the app, with the shop that it came from.
        processor: architecture.
    """

    model: str
    android: str
    termux: str
    processor: str


def check_phone(phone: Phone) -> Diagnostic:
    """Name the phone: whoever reads a pasted report wants to know."""
    android = f"Android {phone.android or '(of a version that it does not say)'}"
    termux = f"Termux {phone.termux}" if phone.termux else "not in Termux"
    return ok("phone", f"{phone.model or 'unnamed'}, {android}, {termux}, {phone.processor}")


def check_camera(uri: str = "") -> Diagnostic:
    """Say which camera there is instead of the kernel's, which Android shows to no app."""
    stead = "the page's browser is the camera, or an MJPEG app (--camera http:)"
    if uri:
        return fail("camera", f"{uri}: Android shows no camera to Termux", stead)
    return ok("camera", f"Android shows none to Termux: {stead}")


def check_usb(cards: Sequence[Card], serial_links: Sequence[str]) -> Diagnostic:
    """Say what a USB cable can carry, and whether one does."""
    if serial_links:
        problem = f"{serial_links[0]}: Android gives no app a serial port (without root)"
        return fail("usb", problem, f"use the cable as a network: --link tcp://{CABLE_BOARD}:5555")
    cable = [card for card in cards if card.address.startswith(_CABLE)]
    if cable:
        return ok("usb", f"Ethernet over USB: {cable[0].name} is {cable[0].address}, on the board's cable")
    return ok("usb", f"means Ethernet over USB here (tcp://{CABLE_BOARD}:5555); no board is on a cable now")


def check_bluetooth(links: Sequence[str]) -> Diagnostic:
    """Say that Bluetooth needs another host."""
    problem = "Android gives Termux no Bluetooth: that needs a laptop as the host"
    if not links:
        return ok("bluetooth", f"{problem}; no link asks for it")
    return fail(
        "bluetooth", f"{links[0]}: {problem}", "use the USB cable, the phone's hotspot or the board's own Wi-Fi"
    )
