"""Slicing, by the PrusaSlicer that the user has installed: a program of its own, which is run and not believed."""

import math
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from common.errors import DataError, UnavailableError
from phone_host.printers.gcode import GcodeFacts, examine

_NAMES: Final = ("prusa-slicer", "PrusaSlicer", "prusa-slicer-console")
_USUAL: Final = (
    "--nozzle-diameter=0.4",
    "--filament-diameter=1.75",
    "--layer-height=0.2",
    "--fill-density=15%",
    "--temperature=205",
    "--first-layer-temperature=210",
    "--bed-temperature=60",
    "--first-layer-bed-temperature=60",
    "--end-gcode=M104 S0\nM140 S0\nM107\nG91\nG1 Z5 F600\nG90\nM84",
)
"""PLA in a printer with a nozzle of 0.4 mm: what nearly everybody begins with. Without the last one, the bed would stay hot."""

_PATIENCE_S: Final = 1800
_AXES: Final = "XYZ"
_SLACK_MM: Final = 0.01


@dataclass(frozen=True, slots=True)
class SlicingWanted:
    """How a model is sliced.

    Attributes:
        bed_mm: of the printer.
        profile: settings that the slicer itself has exported (.ini); None: PLA, 0.2 mm layers.
    """

    bed_mm: tuple[float, float, float]
    profile: Path | None = None


def find_slicer() -> str:
    """Return the path of the slicer.

    Raises:
        UnavailableError: none is installed.
    """
    found = next((path for name in _NAMES if (path := shutil.which(name))), None)
    if found is None:
        raise UnavailableError(
            "no slicer is installed", "sudo apt install prusa-slicer, or slice elsewhere and print the G-code"
        )
    return found


def sliced(stl: Path, gcode: Path, wanted: SlicingWanted) -> GcodeFacts:
    """Slice a model in the middle of the bed.

    Args:
        stl: the model, mm.
        gcode: the file to write.
        wanted: how.

    Returns:
        What the file asks of the printer.

    Raises:
        UnavailableError: no slicer is installed.
        DataError: it cannot slice the model, or what it wrote leaves the bed.
    """
    slicer = find_slicer()
    x, y, _ = wanted.bed_mm
    given = (f"--load={wanted.profile}",) if wanted.profile else _USUAL
    bed = f"--bed-shape=0x0,{x:g}x0,{x:g}x{y:g},0x{y:g}"
    asked = [slicer, "--export-gcode", *given, bed, f"--center={x / 2:g},{y / 2:g}", f"--output={gcode}", str(stl)]
    try:
        done = subprocess.run(asked, capture_output=True, text=True, check=False, timeout=_PATIENCE_S, errors="replace")
    except (OSError, subprocess.TimeoutExpired) as error:
        raise UnavailableError(
            f"{slicer} does not end in order ({error})", "slice elsewhere and print the G-code"
        ) from None
    if done.returncode or not gcode.exists():
        said = [line.strip() for line in (done.stderr + done.stdout).splitlines() if line.strip()]
        raise DataError(
            f"the slicer refuses the model ({said[-1] if said else f'exit code {done.returncode}'})",
            "see what phone-host printcheck says of it",
        )
    facts = facts_of(gcode)
    require_inside(gcode, facts, wanted.bed_mm)
    return facts


def facts_of(gcode: Path) -> GcodeFacts:
    """Read a file of G-code.

    Raises:
        DataError: it is none, or cannot be read.
    """
    try:
        with gcode.open(encoding="utf-8", errors="replace") as file:
            return examine(file, str(gcode))
    except OSError as error:
        raise DataError(f"{gcode} cannot be read ({error.strerror})", "give the file that a slicer wrote") from None


def require_inside(gcode: Path, facts: GcodeFacts, bed_mm: tuple[float, float, float]) -> None:
    """Refuse a print that leaves the bed. A slicer does not: it writes such a file without a word.

    Raises:
        DataError: it does, or extrudes nothing.
    """
    if not facts.extruding:
        raise DataError(f"{gcode} extrudes nothing", "slice the model again; see what the slicer says of it")
    for axis, low, high, most in zip(_AXES, facts.low_mm, facts.high_mm, bed_mm, strict=True):
        if math.isfinite(low) and (low < -_SLACK_MM or high > most + _SLACK_MM):
            raise DataError(
                f"{gcode} leaves the bed: {axis} from {low:.1f} to {high:.1f} mm, the bed from 0 to {most:g}",
                "scale or move the model in the slicer, or give the printer's --bed",
            )
