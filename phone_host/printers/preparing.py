"""From what the user names to G-code that is safe to print: a model is checked and sliced, and G-code is read whole.

What a file is, its first bytes say. Binary G-code (Prusa's .bgcode) is converted by the program `bgcode` where one is installed, archives are named. That
program (libbgcode) is AGPL, so it is run, never imported. `bgcode NAME.bgcode` writes NAME.gcode beside it.
Source: https://github.com/prusa3d/libbgcode, doc/specifications.md: a file begins with "GCDE".
"""

import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from common.errors import DataError, SettingsError, UnavailableError
from common.places import Kind, kind_of
from phone_host.output.atomic import write_bytes
from phone_host.output.meshes.formats import mesh_bytes
from phone_host.output.meshes.printable import Printer, problems
from phone_host.output.meshes.solid import Solid
from phone_host.output.model_file import mesh_file
from phone_host.output.upright import Upright, upright_model
from phone_host.printers.door import Job
from phone_host.printers.gcode import MOST_FOR_LINES, MOST_FOR_SERVERS
from phone_host.printers.printer_uri import LineUri, PrinterUri
from phone_host.printers.slicing import SlicingWanted, facts_of, find_slicer, require_inside, sliced

_MAGIC: Final = b"GCDE"
_ARCHIVES: Final = {
    b"\x1f\x8b": "compressed (gzip)",
    b"PK\x03\x04": "a ZIP archive",
    b"\xff\xfe": "UTF-16",
    b"\xfe\xff": "UTF-16",
}
"""How the files begin that Cura (.gcode.gz, .ufp), Bambu Studio and OrcaSlicer (.gcode.3mf), and Windows' editors write."""

_PROGRAM: Final = "bgcode"
_PATIENCE_S: Final = 600
_REMEDY: Final = 'switch "Supports binary G-code" off in the slicer (printer settings, general) and slice again, or install the program bgcode'

_PLAIN_REMEDY: Final = "unpack it, or save it as UTF-8, and give the .gcode file; Bambu Studio and OrcaSlicer have it in Metadata/plate_1.gcode"


def is_binary(gcode: Path) -> bool:
    """Return whether a file is binary G-code, whatever its name is; False also for one that cannot be read."""
    return _first_bytes(gcode) == _MAGIC


def _first_bytes(path: Path) -> bytes:
    try:
        if kind_of(path) is not Kind.FILE:
            return b""
        with path.open("rb") as file:
            return file.read(len(_MAGIC))
    except OSError:
        return b""


def require_readable(gcode: Path) -> None:
    """Refuse archives, and binary G-code where there is no program that converts it.

    Raises:
        DataError: it is one.
    """
    first = _first_bytes(gcode)
    for begin, what in _ARCHIVES.items():
        if first.startswith(begin):
            raise DataError(f"{gcode} is {what}, no plain G-code", _PLAIN_REMEDY)
    if is_binary(gcode):
        _converter(gcode)


def _converter(gcode: Path) -> str:
    program = shutil.which(_PROGRAM)
    if program is None:
        raise DataError(f"{gcode} is binary G-code (it begins with GCDE), which is not read here", _REMEDY)
    return program


@contextmanager
def text_gcode(gcode: Path) -> Iterator[Path]:
    """Give G-code as text, for as long as the block runs: the file itself, or what `bgcode` makes of a binary one.

    Raises:
        DataError: it is binary, and there is no `bgcode`, or it cannot convert it.
    """
    if not is_binary(gcode):
        yield gcode
        return
    program = _converter(gcode)
    with tempfile.TemporaryDirectory(prefix="tandemscan-", ignore_cleanup_errors=True) as folder:
        given = Path(folder) / f"{gcode.stem}.bgcode"
        given.symlink_to(gcode.absolute())
        try:
            done = subprocess.run(
                [program, str(given)], stdin=subprocess.DEVNULL, capture_output=True, text=True, errors="replace",
                timeout=_PATIENCE_S, check=False,
            )  # fmt: skip
        except (OSError, subprocess.TimeoutExpired) as error:
            raise DataError(f"{gcode} is binary G-code, and {program} does not convert it ({error})", _REMEDY) from None
        made = given.with_suffix(".gcode")
        if done.returncode or not made.is_file():
            lines = (done.stdout + done.stderr).strip().splitlines()
            reason = lines[-1][:200] if lines else f"exit code {done.returncode}"
            raise DataError(f"{gcode} is binary G-code, and {program} does not convert it ({reason})", _REMEDY)
        yield made


_SUFFIXES: Final = frozenset({".gcode", ".gco", ".g", ".bgcode", ".bgc", ".ufp"})
_PACKED: Final = (".gcode.gz", ".gcode.zip", ".gcode.3mf")


@dataclass(frozen=True, slots=True)
class Wanted:
    """How something is printed.

    Attributes:
        slicing: the bed, and how a model is sliced.
        unit: of a mesh file of another program, m or mm; None: as the file says, else m.
        up: axis of a model that points up: z, y or -y; None: as its axes say, else z.
    """

    slicing: SlicingWanted
    unit: str | None = None
    up: str | None = None


def is_gcode(what: Path) -> bool:
    """Return whether a name is one of G-code, also in an archive."""
    return what.suffix.lower() in _SUFFIXES or what.name.lower().endswith(_PACKED)


def require_input(what: Path) -> None:
    """Refuse what does not exist, or cannot be read here, before a printer is asked or a slicer is looked for.

    Raises:
        DataError: there is no such file, or no model in the folder; or it is an archive, or binary G-code without a program that converts it.
    """
    if not is_gcode(what):
        mesh_file(what)
    elif kind_of(what) is Kind.MISSING:
        raise DataError(f"{what} does not exist", "give the file that a slicer wrote")
    else:
        require_readable(what)


@contextmanager
def job_of(what: Path, wanted: Wanted, uri: PrinterUri, tell: Callable[[str], None]) -> Iterator[Job]:
    """Give what is to be printed, for as long as the block runs.

    Args:
        what: G-code, a scan's folder or a mesh file.
        wanted: how.
        uri: of the printer.
        tell: is told what is done next, several times a second; what it raises ends the work, and a slicer that runs.

    Raises:
        SettingsError: G-code is given, and what only a model has.
        DataError: it cannot be read or printed, or leaves the bed.
        UnavailableError: there is no slicer.
    """
    most = MOST_FOR_LINES if isinstance(uri, LineUri) else MOST_FOR_SERVERS
    if is_gcode(what):
        if wanted.slicing.profile or wanted.unit or wanted.up:
            raise SettingsError(
                "--profile, --unit and --up are for models", f"leave them out, or give a model, not {what}"
            )
        tell("reading")
        with text_gcode(what) as gcode:
            facts = facts_of(gcode, most)
            require_inside(gcode, facts, wanted.slicing.bed)
            yield Job(gcode, gcode.name, facts)
        return
    find_slicer(wanted.slicing.slicer)
    tell("reading")
    upright = upright_model(what, wanted.unit, wanted.up)
    _require_printable(upright, wanted.slicing.model_bed.size_mm, tell)
    with _folder() as folder:
        gcode = folder / f"{upright.model.stem}.gcode"
        stl = folder / f"{upright.model.stem}.stl"
        _write(upright, stl)
        tell("slicing")
        facts = sliced(stl, gcode, wanted.slicing, most, lambda: tell("slicing"))
        yield Job(gcode, gcode.name, facts)


@contextmanager
def _folder() -> Iterator[Path]:
    try:
        made = tempfile.TemporaryDirectory(prefix="tandemscan-", ignore_cleanup_errors=True)
    except OSError as error:
        raise _full(error) from None
    with made as name:
        yield Path(name)


def _write(upright: Upright, stl: Path) -> None:
    points_m = (upright.points_mm / 1000).astype(np.float32)
    solid = Solid(points_m, upright.model.solid.triangles, np.zeros((0, 3), np.uint8))
    try:
        write_bytes(stl, mesh_bytes(solid, "stl", None))
    except OSError as error:
        raise _full(error) from None


def _full(error: OSError) -> UnavailableError:
    return UnavailableError(
        f"the sliced model cannot be written ({error.strerror})",
        "make room on the disk, or set TMPDIR to another folder",
    )


def _require_printable(upright: Upright, bed_mm: tuple[float, float, float], tell: Callable[[str], None]) -> None:
    found = problems(upright.points_mm, upright.model.solid.triangles, Printer(bed_mm=bed_mm), tell)
    blocking = [problem for problem in found if problem.blocks]
    if blocking:
        raise DataError(
            f"{upright.model.path} cannot be printed: {'; '.join(problem.sentence for problem in blocking)}",
            f"{blocking[0].remedy}; phone-host printcheck shows where",
        )
