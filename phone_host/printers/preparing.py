"""From what the user names to G-code that is safe to print: a model is checked and sliced, and G-code is read whole."""

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
from phone_host.printers.binary_gcode import require_readable, text_gcode
from phone_host.printers.door import Job
from phone_host.printers.gcode import MOST_FOR_LINES, MOST_FOR_SERVERS
from phone_host.printers.printer_uri import LineUri, PrinterUri
from phone_host.printers.slicing import SlicingWanted, facts_of, find_slicer, require_inside, sliced

_SUFFIXES: Final = frozenset({".gcode", ".gco", ".g", ".bgcode", ".bgc", ".ufp"})
_ARCHIVES: Final = (".gcode.gz", ".gcode.zip", ".gcode.3mf")


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
    return what.suffix.lower() in _SUFFIXES or what.name.lower().endswith(_ARCHIVES)


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
