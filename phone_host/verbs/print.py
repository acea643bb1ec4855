"""phone-host print: slice a model or take G-code, check it, ask, and send it to a printer."""

import math
import select
import sys
import termios
import tty
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from common.android import is_android
from common.errors import DataError, SettingsError, UnavailableError
from common.program.commandline import INTERRUPTED
from common.program.interrupts import HUNG_UP
from common.program.request import Request, option
from common.program.signals import StopSignals
from common.program.terminal import say
from common.words import counted
from phone_host.output.json_text import json_text
from phone_host.printers.bed import BED_HELP, Bed, parse_bed
from phone_host.printers.door import Ended, Job, Phase, Progress, Wishes
from phone_host.printers.journal import Journal
from phone_host.printers.preparing import Wanted, is_gcode
from phone_host.printers.printer_uri import (
    SERVICES,
    FileUri,
    FoundPrinter,
    PrinterUri,
    ServerUri,
    printers_of,
    read_uri,
)
from phone_host.printers.printing import RunningPrint, begun, printed
from phone_host.printers.slicing import Slicer, SlicingWanted
from phone_host.run.model_job import PreparedPrint, prepare_print
from phone_host.run.progress_bar import busy_bar, share_bar, step_bar

EXAMPLES = """  phone-host print --find                                   # printers that announce themselves in the network
  phone-host print scan --printer octoprint://octopi.local  # scan: the folder that phone-host scan wrote; needs a slicer
  phone-host print cup.gcode --printer moonraker://192.168.1.20
  phone-host print cup.gcode --printer serial:/dev/ttyUSB0
  phone-host print cup.gcode --printer 'serial:/dev/ttyACM0?baud=250000' --bed 180,180,180
  phone-host print cup.gcode --printer socket://192.168.1.20:8080 --yes    # ser2net, or a bridge app of a phone
  phone-host print cup.gcode --printer rfcomm://00:11:22:33:44:55          # Bluetooth
  phone-host print scan --printer file:cup.gcode            # the sliced G-code, for a card or a stick
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class PrintRequest(Request):
    """What print can be told."""

    what: Path | None = option(
        type=Path,
        nargs="?",
        metavar="MODEL_OR_GCODE",
        help="the folder of a scan or a mesh, which is sliced, or the G-code of a slicer",
    )
    printer: str | None = option(
        "--printer",
        metavar="URI",
        help="octoprint://HOST, moonraker://HOST, prusalink://HOST (keys: table [printers] of the settings file),"
        " serial:DEVICE?baud=115200, rfcomm://ADDRESS, socket://HOST:PORT, or file:OUT.gcode",
    )
    find: bool = option("--find", action="store_true", help="list the printers that announce themselves in the network")
    bed: Bed | None = option(
        "--bed",
        read=parse_bed,
        metavar="X,Y,Z",
        help=f"{BED_HELP} (default: what the G-code states, else 220,220,250); no model that leaves it is sent",
    )
    slicer: Slicer | None = option(
        "--slicer",
        read=lambda text, _: Slicer(text),
        choices=("prusa", "cura"),
        help="of those installed (default: prusa, else cura)",
    )
    profile: Path | None = option(
        "--profile",
        type=Path,
        metavar="FILE",
        help="settings that PrusaSlicer has exported (.ini), or a machine of Cura (.def.json) (default: PLA, layers of 0.2 mm, nozzle of 0.4 mm)",
    )
    unit: str | None = option("--unit", choices=("m", "mm"), help="unit of a mesh file of another program (default m)")
    up: str | None = option(
        "--up", choices=("z", "y", "-y"), help="axis of the model that points up (default: as its axes say, else z)"
    )
    yes: bool = option("--yes", action="store_true", help="start without asking")
    config: Path | None = option(
        "--config",
        type=Path,
        metavar="FILE",
        help="settings file with the keys (default: ~/.config/tandemscan/phone-host.toml)",
    )


_STEP_S: Final = 0.1


def run(request: PrintRequest) -> int:
    """Slice a model, check the G-code, ask, send it, and say how it ended."""
    if request.find:
        return _find(request)
    if request.what is None or not request.printer:
        raise SettingsError("print needs a model or G-code, and --printer", "phone-host print --find lists printers")
    uri = read_uri(request.printer)
    if request.slicer is not None and is_gcode(request.what):
        raise SettingsError("--slicer is for models", f"leave it out, or give a model, not {request.what}")
    wanted = Wanted(
        SlicingWanted(request.bed, request.profile, request.slicer),
        request.unit,
        request.up,
    )
    with ExitStack() as kept:
        with step_bar("reading", None) as watcher:
            prepared = kept.enter_context(
                closing(prepare_print(request.what, request.printer, wanted, config=request.config, tell=watcher.say))
            )
        if isinstance(uri, FileUri):
            return _told(printed(prepared.place, prepared.job, Wishes(), lambda _: None), request, uri, prepared.job)
        if prepared.place.journal is not None:
            _tell_left(prepared.place.journal)
        _ask(request, prepared.job)
        signals = StopSignals()
        code = _told(_sent(prepared, signals), request, uri, prepared.job)
        return HUNG_UP if signals.hung_up and code == INTERRUPTED else code


def _find(request: PrintRequest) -> int:
    """List the printers.

    Raises:
        UnavailableError: this machine cannot listen for them.
    """
    with busy_bar("listening for printers"):
        found = _announced()
    if request.as_json:
        told = [{"printer": each.uri, "name": each.name} for each in found]
        print(json_text({"command": "print", "printers": told}))
        return 0
    if not found:
        say("no printer announces itself in this network: give its address with --printer")
        return 0
    width = max(len(each.uri) for each in found)
    say(
        [f"{counted(len(found), 'printer')} found", *(f"  --printer {each.uri:{width}}  {each.name}" for each in found)]
    )
    return 0


def _announced() -> list[FoundPrinter]:
    try:
        from phone_host.discovery.announced import listen  # noqa: PLC0415 - zeroconf is optional
    except ImportError:
        why = "Android keeps mDNS from Termux" if is_android() else "the package zeroconf is missing"
        raise UnavailableError(f"printers cannot be looked for: {why}", "give the address with --printer") from None
    return printers_of(listen(SERVICES))


def _sent(prepared: PreparedPrint, signals: StopSignals) -> Ended:
    """Send the print in a thread of its own; show how far it is, and take keys and signals.

    A terminal that is held or gone stops what is shown, never what is sent: a print must end cold.
    """
    name = prepared.job.name

    def heed_signals(_: Progress) -> None:
        if signals.stop:
            running.cancel()

    running = RunningPrint(prepared.place, prepared.job, tell=heed_signals)
    with begun(running), suppress(OSError, termios.error):
        _show(running, name)
    return running.ended()


def _show(running: RunningPrint, name: str) -> None:
    """Show how far a print is until it has ended.

    Raises:
        OSError: the terminal is gone.
        termios.error: likewise.
    """
    with _keypad() as pressed, share_bar(f"{name}: waiting for the printer") as bar:
        while not running.join(_STEP_S):
            match pressed():
                case "p":
                    running.toggle_pause()
                case "c":
                    running.cancel()
            bar(running.progress.share)
            bar.say(_words(name, running.progress))


@contextmanager
def _keypad() -> Iterator[Callable[[], str]]:
    """While the block runs, keys need no Enter; Ctrl-C stays what it is.

    Yields:
        A function that returns the key that was pressed; empty: none.
    """
    if not sys.stdin.isatty():
        yield lambda: ""
        return
    before = termios.tcgetattr(sys.stdin)
    tty.setcbreak(sys.stdin)
    try:
        yield _pressed
    finally:
        termios.tcsetattr(sys.stdin, termios.TCSADRAIN, before)


def _pressed() -> str:
    ready, _, _ = select.select([sys.stdin], [], [], 0)
    return sys.stdin.read(1).lower() if ready else ""


def _words(name: str, progress: Progress) -> str:
    if progress.phase is Phase.SENDING:
        return f"{name}: sending"
    heat = progress.heat
    left = "" if math.isnan(progress.seconds_left) else f", {progress.seconds_left / 60:.0f} min left"
    message = f" ({progress.message})" if progress.message else ""
    words = f"{name}: {progress.phase.value}{message}, nozzle {heat.nozzle[0]:.0f}/{heat.nozzle[1]:.0f}, bed {heat.bed[0]:.0f}/{heat.bed[1]:.0f} C{left}"
    return f"{words}; p goes on" if progress.phase is Phase.PAUSED else f"{words}; p pauses, c cancels"


def _told(ended: Ended, request: PrintRequest, uri: PrinterUri, job: Job) -> int:
    """Say how it ended; return the exit code."""
    lines, done = job.facts.lines, round(ended.share * job.facts.lines)
    if request.as_json:
        told = {
            "command": "print",
            "file": str(request.what),
            "printer": request.printer,
            "ended": ended.phase.value,
            "share": round(ended.share, 4),
            "lines": lines,
            "done": done,
            "resent": ended.resent,
            "notes": list(ended.notes),
        }
        print(json_text(told))
    if ended.phase is Phase.FAILED:
        raise UnavailableError(ended.problem, ended.remedy)
    if not request.as_json:
        say([_sentence(ended, uri, done, lines), *(f"note: {note}" for note in ended.notes)])
    return 0 if ended.phase is Phase.DONE else INTERRUPTED


def _sentence(ended: Ended, uri: PrinterUri, done: int, lines: int) -> str:
    again = f"; {counted(ended.resent, 'line')} had to be sent again" if ended.resent else ""
    if ended.phase is Phase.DONE:
        return f"written to {uri.path}" if isinstance(uri, FileUri) else f"printed: {counted(lines, 'line')}{again}"
    if isinstance(uri, ServerUri):
        return f"cancelled at {ended.share:.0%}: heaters are off"
    return f"cancelled after {done} of {counted(lines, 'line')}: heaters, fan and motors are off"


def _tell_left(journal: Journal) -> None:
    """Say what became of prints whose programs were killed."""
    for left in journal.take_left():
        what = f"{left.file} on {left.printer}"
        if isinstance(read_uri(left.printer), ServerUri):
            lines = [
                f"phone-host: nobody watches the last print any more: {what}, near {left.done / max(left.lines, 1):.0%} when last seen",
                "phone-host: its server may still be printing it: look there",
            ]
        else:
            lines = [
                f"phone-host: the last print was not finished: {what} ended near line {left.done} of {left.lines}",
                "phone-host: nothing was sent since, and its heaters may be on; it does not go on by itself",
            ]
        say(lines, sys.stderr)


def _ask(request: PrintRequest, job: Job) -> None:
    """Ask before anything is heated or moved.

    Raises:
        SettingsError: nobody can be asked.
        DataError: the answer is no.
    """
    if request.yes:
        return
    if not sys.stdin.isatty():
        raise SettingsError("nobody can be asked whether to start", "give --yes")
    seconds = job.facts.seconds
    minutes = "" if math.isnan(seconds) else f", {seconds / 60:.0f} min"
    say(
        f"print {request.what} ({counted(job.facts.lines, 'line')}{minutes}) on {request.printer}? Is the bed empty? [y/N] ",
        sys.stderr,
    )
    if sys.stdin.readline().strip().lower() not in {"y", "yes"}:
        raise DataError("not started", "answer y to print")
