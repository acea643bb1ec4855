"""Judges from readings what a host needs besides camera and link: Python, packages, rig, the board's answer. Pure."""

import re
from dataclasses import dataclass
from enum import Enum
from typing import Final, assert_never

from common.android import INSTALL as TERMUX_INSTALL
from common.doctor.finding import Finding, fail, ok, warn
from common.errors import SettingsError
from phone_host.stereo.native.library import VARIABLE, Library, Missing
from phone_host.stereo.scaled_rig import fits_rig, is_scaling

OPENCV_WHEELS: Final = (
    "opencv-python-headless",
    "opencv-python",
    "opencv-contrib-python",
    "opencv-contrib-python-headless",
)
"""All of them install the same folder `cv2`: they overwrite each other's files, and removing one breaks the others."""

_COST_OF_SGBM: Final = "six times the work for each pair"
"""CPU time of both at 640x480 with 64 disparities (docs/figures.md)."""

_USABLE_PX: Final = 1.0
"""With a stereo RMS above one pixel, the rows of the two images do not match, and no matcher finds much."""


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


@dataclass(frozen=True, slots=True)
class RigReadings:
    """Readings of a rig file.

    Attributes:
        path: the file.
        problem: what is wrong with it; empty if it could be read and rectified.
        remedy: what to do about that.
        rms_px: stereo RMS, px; NaN = unknown.
        baseline_m: baseline, m.
        host_size_px: image size of the host camera in the rig, px.
        asked_size_px: image size that the host camera is asked for, px; None if the URI does not say.
        is_rejected: whether its own calibration found it unfit.
    """

    path: str
    problem: str = ""
    remedy: str = ""
    rms_px: float = float("nan")
    baseline_m: float = float("nan")
    host_size_px: tuple[int, int] = (0, 0)
    asked_size_px: tuple[int, int] | None = None
    is_rejected: bool = False


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


def check_python(version: tuple[int, int, int], platform: str) -> Finding:
    """Judge the Python version."""
    text = f"Python {'.'.join(map(str, version))} on {platform}"
    if version < (3, 11, 0):
        return fail("python", text, "install Python 3.11 or newer")
    return ok("python", text)


def check_package(package: Package) -> Finding:
    """Judge a package: can it be imported, is its version in range, and is it installed only once?"""
    if len(package.wheels) > 1:
        keep = package.wheels[0]
        remove = " ".join(wheel for wheel in package.wheels if wheel != keep)
        both = f"{' and '.join(package.wheels)} are installed side by side and overwrite each other's files"
        return fail(package.name, both, f"pip uninstall {remove}, then pip install --force-reinstall --no-deps {keep}")
    if not package.version:
        return fail(
            package.name,
            f"cannot be imported ({package.problem})",
            f"install it: make run-venv in a checkout, or pipx reinstall tandemscan; in Termux: {TERMUX_INSTALL}",
        )
    text = f"{package.name} {package.version}" + (f" ({package.wheels[0]})" if package.wheels else "")
    found = _numbers(package.version)
    if found < _numbers(package.least) or (package.below and found >= _numbers(package.below)):
        span = f"{package.least} or newer" + (f", below {package.below}" if package.below else "")
        return warn(package.name, text, f"tested with {span}: make run-venv, or pipx reinstall tandemscan, installs it")
    return ok(package.name, text)


def check_native(library: Library | Missing | SettingsError, wanted: str = "") -> Finding:
    """Judge the native library: without it everything works, but slower.

    Args:
        library: as loaded, why there is none, or what is wrong with the instruction set that is wanted.
        wanted: value of `TANDEMSCAN_SIMD`, which means nothing without the library.
    """
    match library:
        case Library():
            return ok("native", f"own matcher: {library.simd.text}")
        case Missing(reason=reason, remedy=remedy):
            idle = f"; {VARIABLE}={wanted} has no effect" if wanted else ""
            return warn("native", f"own matcher {reason}; sgbm is used, {_COST_OF_SGBM}{idle}", remedy)
        case _:
            return fail("native", library.problem, library.remedy)


def check_rig(rig: RigReadings) -> Finding:
    """Judge a rig file."""
    if rig.problem:
        return fail("rig", rig.problem, rig.remedy)
    width_px, height_px = rig.host_size_px
    text = f"{rig.path}: baseline {rig.baseline_m * 1000:.1f} mm, host camera {width_px}x{height_px}"
    if rig.rms_px == rig.rms_px:
        text += f", stereo RMS {rig.rms_px:.2f} px"
    asked_px = rig.asked_size_px
    if asked_px is not None and asked_px != rig.host_size_px:
        asked = f"{asked_px[0]}x{asked_px[1]}"
        if not fits_rig(rig.host_size_px, asked_px):
            remedy = f"ask for size={width_px}x{height_px} or another size of this shape, or calibrate at {asked}"
            return fail("rig", f"{text}, but the camera is asked for {asked}, another shape", remedy)
        text += f", scaled to {asked}" if is_scaling(rig.host_size_px, asked_px) else f", cropped to {asked}"
    if rig.is_rejected:
        return warn("rig", f"{text}, verdict reject", "calibrate again; report.json beside it says what was wrong")
    if rig.rms_px > _USABLE_PX:
        return warn("rig", text, "calibrate again with sharper pictures of a flat board")
    return ok("rig", text)


def check_board(board: BoardReadings) -> Finding:  # noqa: PLR0911 - one return for each answer
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


def check_ports(ports: tuple[str, ...], problem: str) -> Finding:
    """List the serial ports.

    Args:
        ports: names of the ports, with what is attached.
        problem: why they could not be listed; empty if they could.
    """
    if problem:
        return warn("serial", f"no serial links ({problem})", "pip install pyserial, or use another link")
    return ok("serial", ", ".join(ports) if ports else "no USB or Bluetooth serial port is there now")


def check_out(folder: str, obstacle: str) -> list[Finding]:
    """Judge whether results can be written to a folder. If so, return nothing: the disk's finding names the folder.

    Args:
        folder: as the user named it.
        obstacle: why nothing can be written there; empty: it can.
    """
    if not obstacle:
        return []
    return [fail("out", f"{folder} cannot be written to ({obstacle})", "choose another folder with --out")]


def _numbers(version: str) -> tuple[int, ...]:
    return tuple(int(part) for part in re.findall(r"\d+", version)[:3])
