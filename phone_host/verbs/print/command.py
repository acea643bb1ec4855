"""phone-host print: slice a model or take G-code, check it, ask, and send it to a printer."""

import argparse
import math
import os
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

import numpy as np

from common import now
from common.errors import DataError, SettingsError, UnavailableError
from common.program.commandline import INTERRUPTED
from common.program.signals import StopSignals
from common.program.terminal import say
from common.words import counted
from phone_host.output.atomic import write_bytes
from phone_host.output.json_text import json_text
from phone_host.output.meshes.formats import mesh_bytes
from phone_host.output.meshes.printable import Printer, problems
from phone_host.output.meshes.solid import Solid
from phone_host.printers.gcode import GcodeFacts, lines_of
from phone_host.printers.journal import Entry, Journal
from phone_host.printers.line import Line, open_line
from phone_host.printers.marlin import SECOND_NS, MarlinSender, Phase
from phone_host.printers.printer_uri import read_uri
from phone_host.printers.sending import Progress, Wishes, send
from phone_host.printers.slicing import SlicingWanted, facts_of, find_slicer, require_inside, sliced
from phone_host.run.progress_bar import busy_bar, share_bar, step_bar
from phone_host.verbs.output_folders import unwritable
from phone_host.verbs.print.keypad import keypad
from phone_host.verbs.printable_model import Upright, bed_of, upright_model
from phone_host.verbs.serve.places import data_folder

_NOTE_NS: Final = 5 * SECOND_NS
_SUFFIXES: Final = frozenset({".gcode", ".gco", ".g"})


def run(options: argparse.Namespace) -> int:
    """Slice a model, check the G-code, ask, send it, and say how it ended."""
    uri, bed_mm = read_uri(options.printer), bed_of(options)
    with _gcode(options, bed_mm) as path:
        facts = facts_of(path)
        require_inside(path, facts, bed_mm)
        journal = Journal(data_folder() / "printing.json")
        _tell_left(journal)
        _ask(options, facts)
        line = open_line(uri)
        try:
            with path.open(encoding="utf-8", errors="replace") as file:
                sender = MarlinSender(lines_of(file, str(path)), now.monotonic_ns())
                _sent(sender, options, facts, journal, line)
        finally:
            line.close()
    return _told(sender, options, facts)


@contextmanager
def _gcode(options: argparse.Namespace, bed_mm: tuple[float, float, float]) -> Iterator[Path]:
    """Give the file to print: the user's own, or that of his model, sliced, for as long as the block runs."""
    given = options.what
    if given.suffix.lower() in _SUFFIXES:
        if options.profile or options.unit or options.up:
            raise SettingsError(
                "--profile, --unit and --up are for models", f"leave them out, or give a model, not {given}"
            )
        yield given
        return
    find_slicer()
    upright = upright_model(given, options.unit, options.up)
    _require_printable(upright, bed_mm)
    with tempfile.TemporaryDirectory() as folder:
        stl, gcode = Path(folder) / f"{upright.model.stem}.stl", Path(folder) / f"{upright.model.stem}.gcode"
        points_m = (upright.points_mm / 1000).astype(np.float32)
        solid = Solid(points_m, upright.model.solid.triangles, np.zeros((0, 3), np.uint8))
        try:
            write_bytes(stl, mesh_bytes(solid, "stl", None))
            with busy_bar(f"slicing {given}"):
                sliced(stl, gcode, SlicingWanted(bed_mm, options.profile))
        except OSError as error:
            raise unwritable(Path(folder), error) from error
        yield gcode


def _require_printable(upright: Upright, bed_mm: tuple[float, float, float]) -> None:
    with step_bar("edges", None) as watcher:
        found = problems(upright.points_mm, upright.model.solid.triangles, Printer(bed_mm=bed_mm), watcher.say)
    blocking = [problem for problem in found if problem.blocks]
    if blocking:
        raise DataError(
            f"{upright.model.path} cannot be printed: {'; '.join(problem.sentence for problem in blocking)}",
            f"{blocking[0].remedy}; phone-host printcheck shows where",
        )


def _sent(sender: MarlinSender, options: argparse.Namespace, facts: GcodeFacts, journal: Journal, line: Line) -> None:
    """Send the print; keep in the journal how far it is."""
    signals, wishes, noted_ns = StopSignals(), Wishes(), -_NOTE_NS
    name = options.what.name

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
            journal.note(Entry(str(options.what.absolute()), options.printer, progress.done, facts.lines, os.getpid()))

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
            "file": str(options.what),
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
        f"print {options.what} ({counted(facts.lines, 'line')}{minutes}) on {options.printer}? Is the bed empty? [y/N] ",
        sys.stderr,
    )
    if sys.stdin.readline().strip().lower() not in {"y", "yes"}:
        raise DataError("not started", "answer y to print")
