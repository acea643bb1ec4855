"""phone-host print: check a file of G-code, ask, and send it to a printer."""

import argparse
import math
import os
import sys
from pathlib import Path
from typing import IO, Final

from common import now
from common.errors import DataError, SettingsError, UnavailableError
from common.program.commandline import INTERRUPTED
from common.program.signals import StopSignals
from common.program.terminal import say
from common.words import counted
from phone_host.output.json_text import json_text
from phone_host.printers.gcode import GcodeFacts, examine, lines_of
from phone_host.printers.journal import Entry, Journal
from phone_host.printers.line import Line, open_line
from phone_host.printers.marlin import SECOND_NS, MarlinSender, Phase
from phone_host.printers.printer_uri import read_uri
from phone_host.printers.sending import Progress, Wishes, send
from phone_host.run.progress_bar import share_bar
from phone_host.verbs.print.keypad import keypad
from phone_host.verbs.serve.places import data_folder
from phone_host.verbs.units import length_mm

_NOTE_NS: Final = 5 * SECOND_NS
_AXES: Final = "XYZ"
_SLACK_MM: Final = 0.01


def run(options: argparse.Namespace) -> int:
    """Check the file, ask, send it, and say how it ended."""
    uri, path, bed_mm = read_uri(options.printer), options.gcode, _bed_mm(options.bed)
    with _opened(path) as file:
        facts = examine(file, str(path))
        _require_inside(path, facts, bed_mm)
        journal = Journal(data_folder() / "printing.json")
        _tell_left(journal)
        _ask(options, facts)
        file.seek(0)
        line = open_line(uri)
        try:
            sender = MarlinSender(lines_of(file, str(path)), now.monotonic_ns())
            _sent(sender, options, facts, journal, line)
        finally:
            line.close()
    return _told(sender, options, facts)


def _sent(sender: MarlinSender, options: argparse.Namespace, facts: GcodeFacts, journal: Journal, line: Line) -> None:
    """Send the print; keep in the journal how far it is."""
    signals, wishes, noted_ns = StopSignals(), Wishes(), -_NOTE_NS
    name = options.gcode.name

    def tell(progress: Progress) -> None:
        nonlocal noted_ns
        if signals.stop:
            wishes.cancel()
        match pressed():
            case "p":
                wishes.toggle_pause()
            case "c":
                wishes.cancel()
        bar(progress.done / facts.lines)
        bar.say(_words(name, progress))
        if now.monotonic_ns() - noted_ns >= _NOTE_NS:
            noted_ns = now.monotonic_ns()
            journal.note(Entry(str(options.gcode.absolute()), options.printer, progress.done, facts.lines, os.getpid()))

    with keypad() as pressed, share_bar(f"{name}: waiting for the printer") as bar:
        send(line, sender, wishes, tell)
    journal.forget()


def _words(name: str, progress: Progress) -> str:
    heat = progress.heat
    words = f"{name}: {progress.phase.value}, nozzle {heat.nozzle[0]:.0f}/{heat.nozzle[1]:.0f}, bed {heat.bed[0]:.0f}/{heat.bed[1]:.0f} C"
    return f"{words}; p goes on" if progress.phase is Phase.PAUSED else f"{words}; p pauses, c cancels"


def _told(sender: MarlinSender, options: argparse.Namespace, facts: GcodeFacts) -> int:
    """Say how it ended; return the exit code."""
    if options.json:
        told = {
            "command": "print",
            "file": str(options.gcode),
            "printer": options.printer,
            "ended": sender.phase.value,
            "lines": facts.lines,
            "done": sender.done,
            "resent": sender.resent,
        }
        print(json_text(told))
    if sender.phase is Phase.FAILED:
        raise UnavailableError(sender.problem, f"{sender.remedy}; {sender.done} of {facts.lines} lines were done")
    if not options.json:
        again = f"; {counted(sender.resent, 'line')} had to be sent again" if sender.resent else ""
        if sender.phase is Phase.DONE:
            say(f"printed: {counted(facts.lines, 'line')}{again}")
        else:
            say(f"cancelled after {sender.done} of {counted(facts.lines, 'line')}: heaters, fan and motors are off")
    return 0 if sender.phase is Phase.DONE else INTERRUPTED


def _opened(path: Path) -> IO[str]:
    if path.suffix.lower() not in {".gcode", ".gco", ".g"}:
        raise DataError(
            f"{path} is no G-code",
            "slice it first: phone-host export MODEL --to stl, then prusa-slicer -g, or any other slicer",
        )
    try:
        return path.open(encoding="utf-8", errors="replace")
    except OSError as error:
        raise DataError(f"{path} cannot be read ({error.strerror})", "give the file that a slicer wrote") from None


def _bed_mm(text: str) -> tuple[float, float, float]:
    words = text.split(",")
    if len(words) != 3:
        raise SettingsError(f"--bed is {text!r}", "give three lengths, for example 220,220,250")
    x, y, z = (length_mm(word, "--bed", "220,220,250") for word in words)
    return x, y, z


def _require_inside(path: Path, facts: GcodeFacts, bed_mm: tuple[float, float, float]) -> None:
    """Refuse a print that leaves the bed. A slicer does not: it writes such a file without a word."""
    if not facts.extruding:
        raise DataError(f"{path} extrudes nothing", "slice the model again; see what the slicer says of it")
    for axis, low, high, most in zip(_AXES, facts.low_mm, facts.high_mm, bed_mm, strict=True):
        if low < -_SLACK_MM or high > most + _SLACK_MM:
            raise DataError(
                f"{path} leaves the bed: {axis} from {low:.1f} to {high:.1f} mm, the bed from 0 to {most:g}",
                "scale or move the model in the slicer, or give the printer's --bed",
            )


def _tell_left(journal: Journal) -> None:
    left = journal.left()
    if left is None:
        return
    lines = [
        f"phone-host: the last print was not finished: {left.file} on {left.printer} ended near line {left.done} of {left.lines}",
        "phone-host: nothing was sent since, and its heaters may be on; it does not go on by itself",
    ]
    say(lines, sys.stderr)
    journal.forget()


def _ask(options: argparse.Namespace, facts: GcodeFacts) -> None:
    """Ask before anything is heated or moved.

    Raises:
        SettingsError: nobody can be asked.
        DataError: the answer is no.
    """
    if options.yes:
        return
    if not sys.stdin.isatty():
        raise SettingsError("nobody can be asked whether to start", "give --yes")
    minutes = "" if math.isnan(facts.seconds) else f", {facts.seconds / 60:.0f} min"
    say(
        f"print {options.gcode} ({counted(facts.lines, 'line')}{minutes}) on {options.printer}? Is the bed empty? [y/N] ",
        sys.stderr,
    )
    if sys.stdin.readline().strip().lower() not in {"y", "yes"}:
        raise DataError("not started", "answer y to print")
