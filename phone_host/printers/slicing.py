"""Slicing, by a slicer that the user has installed: a program of its own, which is run and not believed.

PrusaSlicer, SuperSlicer (its sister, with the same options) and CuraEngine are known; the first that is installed is taken.
"""

import math
import os
import shutil
import subprocess
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from enum import Enum
from itertools import product
from pathlib import Path
from typing import Final, assert_never

from common import now
from common.errors import DataError, SettingsError, UnavailableError
from common.places import Kind, kind_of
from phone_host.printers.bed import USUAL_BED, Bed
from phone_host.printers.gcode import MOST_FOR_LINES, GcodeFacts, examine, first_outside


class Slicer(Enum):
    """The slicers that are known, in the order in which they are looked for."""

    PRUSA = "prusa"
    CURA = "cura"


_NAMES: Final = {
    Slicer.PRUSA: ("prusa-slicer", "PrusaSlicer", "prusa-slicer-console", "superslicer", "SuperSlicer"),
    Slicer.CURA: ("CuraEngine", "curaengine", "cura-engine"),
}
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

_AROUND: Final = tuple(index * math.tau / 72 for index in range(72))
"""Angles of the corners of a round bed."""

_BARE: Final = "--skirts=0"
"""Without the line that is drawn around the thing first, for what fills the bed."""

_USUAL_CURA: Final = {
    "machine_nozzle_size": "0.4",
    "material_diameter": "1.75",
    "layer_height": "0.2",
    "layer_height_0": "0.2",
    "infill_sparse_density": "15",
    "infill_line_distance": "5.33",
    "material_print_temperature": "205",
    "material_print_temperature_layer_0": "210",
    "material_initial_print_temperature": "205",
    "material_final_print_temperature": "205",
    "material_bed_temperature": "60",
    "material_bed_temperature_layer_0": "60",
    "roofing_layer_count": "0",
    "machine_start_gcode": "G28",
    "machine_end_gcode": "M104 S0\nM140 S0\nM107\nG91\nG1 Z5 F600\nG90\nM84",
}
"""The same for CuraEngine, whose own defaults are a filament of 2.85 mm. It computes no setting from another one (5.33 mm between lines of
0.4 mm in two directions are 15 %)."""

_CURA_RESOURCES: Final = (Path("/usr/share/cura/resources"), Path("/usr/local/share/cura/resources"))
_CURA_PATH: Final = "CURA_ENGINE_SEARCH_PATH"
_CURA_MACHINE: Final = "fdmprinter.def.json"

_PATIENCE_S: Final = 1800
_TELL_S: Final = 0.2
_NEAR_MM: Final = 20.0
"""So far beyond the bed may start code go that no mark tells from the model: printers reach 2 to 10 mm beyond."""

_OTHER_BED: Final = "move or scale the model in the slicer; if this printer has another bed, or its origin elsewhere, give --bed, such as 200,200,300@centre; if that line is the printer's own code, put ;TYPE:Custom before it"


@dataclass(frozen=True, slots=True)
class SlicingWanted:
    """How a model is sliced.

    Attributes:
        bed: of the printer; None: what the G-code states, else the usual one.
        profile: settings for the slicer: an .ini that PrusaSlicer has exported, or a machine's .def.json of Cura; None: PLA, 0.2 mm layers.
        slicer: which one; None: the first that is installed.
    """

    bed: Bed | None = None
    profile: Path | None = None
    slicer: Slicer | None = None

    @property
    def model_bed(self) -> Bed:
        """The bed that a model is sliced for."""
        return self.bed or USUAL_BED


class _OutsideError(DataError):
    """Raised for a print that leaves the bed. The slicer's fault, or that of whoever placed the model."""


def find_slicer(wanted: Slicer | None = None) -> tuple[Slicer, str]:
    """Return a slicer, and the path of its program.

    Args:
        wanted: which one; None: the first that is installed.

    Raises:
        UnavailableError: none is installed.
    """
    for slicer in Slicer if wanted is None else (wanted,):
        if found := next((path for name in _NAMES[slicer] if (path := shutil.which(name))), None):
            return slicer, found
    which = "no slicer" if wanted is None else f"the slicer {wanted.value}"
    raise UnavailableError(
        f"{which} is not installed" if wanted else "no slicer is installed",
        "sudo apt install prusa-slicer, or slice elsewhere and print the G-code",
    )


def sliced(
    stl: Path,
    gcode: Path,
    wanted: SlicingWanted,
    most_characters: int = MOST_FOR_LINES,
    tell: Callable[[], None] = lambda: None,
) -> GcodeFacts:
    """Slice a model in the middle of the bed.

    Args:
        stl: the model, mm.
        gcode: the file to write.
        wanted: how.
        most_characters: that a line of it may have.
        tell: called several times a second; what it raises ends the slicer.

    Raises:
        UnavailableError: no slicer is installed.
        SettingsError: the profile is none of this slicer.
        DataError: it cannot slice the model, or what it wrote leaves the bed.
    """
    slicer, program = find_slicer(wanted.slicer)
    if wanted.profile is not None and kind_of(wanted.profile) is not Kind.FILE:
        raise SettingsError(f"--profile {wanted.profile} is no file", "give settings that the slicer has exported")
    environment = dict(os.environ)
    match slicer:
        case Slicer.PRUSA:
            asked = _prusa(program, stl, gcode, wanted)
        case Slicer.CURA:
            asked = _cura(program, stl, gcode, wanted)
            environment.setdefault(_CURA_PATH, os.pathsep.join(map(str, _cura_folders())))
        case _:
            assert_never(slicer)
    slicing = _Slicing(asked, environment, gcode, wanted.model_bed, most_characters, tell)
    if slicer is Slicer.PRUSA and wanted.profile is None:
        return _sliced_bare_if_needed(slicing)
    return _run(slicing)


@dataclass(frozen=True, slots=True)
class _Slicing:
    """A slicer as it is started, and what is asked of its file.

    Attributes:
        asked: its words.
        environment: of its process.
        gcode: that it writes.
        bed: that must hold it.
        most_characters: of its lines.
        tell: called several times a second; what it raises ends the slicer.
    """

    asked: list[str]
    environment: dict[str, str]
    gcode: Path
    bed: Bed
    most_characters: int
    tell: Callable[[], None]


def _sliced_bare_if_needed(slicing: _Slicing) -> GcodeFacts:
    """Slice with a skirt around the thing; where that leaves the bed, without."""
    try:
        return _run(slicing)
    except _OutsideError:
        program, *words = slicing.asked
        return _run(replace(slicing, asked=[program, _BARE, *words]))


def _run(slicing: _Slicing) -> GcodeFacts:
    program, gcode = slicing.asked[0], slicing.gcode
    try:
        code, told = _ended(slicing)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise UnavailableError(
            f"{program} does not end in order ({error})", "slice elsewhere and print the G-code"
        ) from None
    if code or not gcode.exists():
        said = [line.strip() for line in told.splitlines() if line.strip()]
        words = next((line for line in said if "error" in line.lower()), said[-1] if said else "")
        raise DataError(
            f"the slicer refuses the model ({words[:200] or f'exit code {code}'})",
            "see what phone-host printcheck says of it",
        )
    facts = facts_of(gcode, slicing.most_characters)
    require_inside(gcode, facts, slicing.bed)
    return facts


def _ended(slicing: _Slicing) -> tuple[int, str]:
    """Run a slicer to its end; return its exit code, and all that it said. Whatever is raised meanwhile ends it."""
    end_ns = now.monotonic_ns() + _PATIENCE_S * 1_000_000_000
    with subprocess.Popen(
        slicing.asked,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        errors="replace",
        env=slicing.environment,
    ) as process:
        try:
            while True:
                slicing.tell()
                with suppress(subprocess.TimeoutExpired):
                    said, complaints = process.communicate(timeout=_TELL_S)
                    return process.returncode, said + complaints
                if now.monotonic_ns() > end_ns:
                    raise subprocess.TimeoutExpired(slicing.asked[0], _PATIENCE_S)
        except BaseException:
            process.kill()
            raise


def _prusa(program: str, stl: Path, gcode: Path, wanted: SlicingWanted) -> list[str]:
    bed = wanted.model_bed
    (x, y), middle = bed.origin_mm, bed.centre_mm
    corners = (
        [
            (middle[0] + bed.size_mm[0] / 2 * math.cos(at), middle[1] + bed.size_mm[0] / 2 * math.sin(at))
            for at in _AROUND
        ]
        if bed.is_round
        else [(x + a * bed.size_mm[0], y + b * bed.size_mm[1]) for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]
    )
    given = (f"--load={wanted.profile}",) if wanted.profile else _USUAL
    shape = f"--bed-shape={','.join(f'{a:.6g}x{b:.6g}' for a, b in corners)}"
    centre = f"--center={middle[0]:g},{middle[1]:g}"
    return [program, "--export-gcode", *given, shape, centre, f"--output={gcode}", str(stl)]


def _cura(program: str, stl: Path, gcode: Path, wanted: SlicingWanted) -> list[str]:
    if wanted.profile and not wanted.profile.name.endswith(".def.json"):
        raise SettingsError(f"{wanted.profile} is no profile for CuraEngine", "give a machine's .def.json")
    machine = wanted.profile or _cura_machine()
    bed = wanted.model_bed
    is_centred = bed.centre_mm == (0.0, 0.0)
    if not is_centred and bed.origin_mm != (0.0, 0.0):
        raise SettingsError(
            "CuraEngine knows an origin in a corner or in the middle of the bed only",
            "give --slicer prusa, or the bed with @centre",
        )
    x, y, z = (f"{length:g}" for length in bed.size_mm)
    machine_bed = {"machine_width": x, "machine_depth": y, "machine_height": z}
    machine_bed["machine_center_is_zero"] = "true" if is_centred else "false"
    machine_bed["machine_shape"] = "elliptic" if bed.is_round else "rectangular"
    values = {**({} if wanted.profile else _USUAL_CURA), **machine_bed, "center_object": "true"}
    told = [word for name, value in values.items() for word in ("-s", f"{name}={value}")]
    return [program, "slice", "-j", str(machine), *told, "-l", str(stl), "-o", str(gcode)]


def _cura_folders() -> list[Path]:
    return [root / part for root in _CURA_RESOURCES for part in ("definitions", "extruders") if (root / part).is_dir()]


def _cura_machine() -> Path:
    """Return Cura's description of any printer, which its program needs and does not bring along.

    Raises:
        UnavailableError: it is not there.
    """
    named = [Path(each) for each in os.environ.get(_CURA_PATH, "").split(os.pathsep) if each]
    found = next((path for each in (*named, *_cura_folders()) if (path := each / _CURA_MACHINE).is_file()), None)
    if found is None:
        raise UnavailableError(
            f"CuraEngine has no {_CURA_MACHINE}", f"sudo apt install cura, or set {_CURA_PATH} to the folder with it"
        )
    return found


def facts_of(gcode: Path, most_characters: int = MOST_FOR_LINES) -> GcodeFacts:
    """Read a file of G-code.

    Args:
        gcode: the file.
        most_characters: that its lines may have.

    Raises:
        DataError: it is none, or cannot be read.
    """
    try:
        if kind_of(gcode) in {Kind.PIPE, Kind.DEVICE, Kind.SOCKET}:  # it would be waited for, and is read twice
            raise DataError(f"{gcode} is not a plain file", "give the file that a slicer wrote")
        with gcode.open(encoding="utf-8-sig", errors="replace") as file:
            return examine(file, str(gcode), most_characters)
    except OSError as error:
        raise DataError(f"{gcode} cannot be read ({error.strerror})", "give the file that a slicer wrote") from None


def require_inside(gcode: Path, facts: GcodeFacts, given: Bed | None) -> None:
    """Refuse a print that leaves the bed. A slicer does not: it writes such a file without a word.

    The printer's own code (prime lines, purges) may lie beyond it: that is the business of its profile. In G-code that does
    not mark it, it must stay near.

    Args:
        gcode: the file.
        facts: of it.
        given: the bed; None: the one that the slicer states, else the usual one.

    Raises:
        DataError: it does, or extrudes nothing.
    """
    if not facts.extruding:
        raise DataError(f"{gcode} extrudes nothing", "slice the model again; see what the slicer says of it")
    bed = given or facts.bed or USUAL_BED
    near = replace(
        bed,
        size_mm=(bed.size_mm[0] + 2 * _NEAR_MM, bed.size_mm[1] + 2 * _NEAR_MM, bed.size_mm[2]),
        origin_mm=(bed.origin_mm[0] - _NEAR_MM, bed.origin_mm[1] - _NEAR_MM),
    )
    if not facts.is_marked and not _holds(near, facts.prime_low_mm, facts.prime_high_mm):
        low, high = facts.prime_low_mm, facts.prime_high_mm
        raise _OutsideError(
            f"{gcode} begins with lines from X {low[0]:.1f} to {high[0]:.1f}, Y {low[1]:.1f} to {high[1]:.1f} mm; the bed {bed.words}",
            _OTHER_BED,
        )
    if _holds(bed, facts.low_mm, facts.high_mm):
        return
    with gcode.open(encoding="utf-8-sig", errors="replace") as file:
        found = first_outside(file, str(gcode), facts, bed)
    if found is not None:
        line, (x, y, z) = found
        raise _OutsideError(
            f"{gcode} leaves the bed: line {line.number} extrudes at X {x:.1f}, Y {y:.1f}, Z {z:.1f} mm; the bed {bed.words}",
            _OTHER_BED,
        )


def _holds(bed: Bed, low: tuple[float, float, float], high: tuple[float, float, float]) -> bool:
    """Return whether a box lies on a bed: its eight corners do. So does no box at all (NaN)."""
    return any(map(math.isnan, low)) or all(bed.holds(*corner) for corner in product(*zip(low, high, strict=True)))
