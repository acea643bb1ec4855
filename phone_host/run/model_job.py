"""What is done with a model: checked, saved for other programs, printed. The verbs, the API and the page do it by these functions."""

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final

from common.errors import SettingsError
from phone_host.output.atomic import write_bytes
from phone_host.output.meshes.decimated import NoLibraryError, decimated
from phone_host.output.meshes.formats import FORMATS, mesh_bytes
from phone_host.output.meshes.printable import Printer, Problem, problems
from phone_host.output.meshes.solid import Solid
from phone_host.output.model_file import Model, read_model
from phone_host.output.upright import upright_model
from phone_host.printers.door import Wishes
from phone_host.printers.doors import door_to, key_of
from phone_host.printers.preparing import Wanted, job_of
from phone_host.printers.printer_uri import read_uri
from phone_host.printers.printing import Place, printed
from phone_host.printers.progress import Ended, Progress
from phone_host.printers.slicing import SlicingWanted
from phone_host.settings import printer_keys

_SHARE_OF_VOXEL: Final = 0.1
"""How far the surface may move when triangles are left out; with twice that it intersects itself in places (decision 0070)."""

_UNITS_M: Final = {"m": 1.0, "mm": 0.001}


def usual_tolerance_m(model: Model) -> float:
    """Return how far the surface may move unless somebody says it, m; 0: not at all."""
    return 0.0 if math.isnan(model.voxel_m) else _SHARE_OF_VOXEL * model.voxel_m


def fewer_triangles(solid: Solid, tolerance_m: float) -> tuple[Solid, list[str]]:
    """Return the mesh to write, and what is to be said of it.

    Args:
        solid: the mesh.
        tolerance_m: the surface stays as near as this, m; 0: every triangle is kept.
    """
    if not tolerance_m:
        return solid, []
    try:
        fewer = decimated(solid, tolerance_m)
    except NoLibraryError:
        return solid, ["every triangle is written: manifold3d is not installed (pip install 'tandemscan[print]')"]
    if not fewer.is_closed:
        return solid, ["the mesh is not closed, so every triangle is written, and printers may refuse it"]
    return fewer.solid, []


def check_model(
    model: str | Path, printer: Printer | None = None, *, unit: str | None = None, up: str | None = None
) -> list[Problem]:
    """Tell whether a model can be printed, as `phone-host printcheck` does.

    Args:
        model: the folder of a scan, or a mesh file.
        printer: what it shall be printed by; None: a bed of 220 x 220 x 250 mm, and a nozzle of 0.4 mm.
        unit: of a mesh file, m or mm; None: as the file says, else m.
        up: the axis that points up: z, y or -y; None: as its axes say, else z.

    Returns:
        What is wrong; those whose `blocks` is true stop a print.

    Raises:
        UnavailableError: the model cannot be read.
        DataError: it is none.
    """
    upright = upright_model(Path(model), unit, up)
    return problems(upright.points_mm, upright.model.solid.triangles, printer or Printer(), lambda _: None)


def export_model(
    model: str | Path,
    to: Sequence[str],
    out: str | Path,
    *,
    unit: str | None = None,
    tolerance_mm: float | None = None,
) -> list[Path]:
    """Save a model for other programs, as `phone-host export` does. Files of the same names are replaced.

    Args:
        model: the folder of a scan, or a mesh file.
        to: formats: stl, obj, 3ds, ply, 3mf, glb.
        out: folder for the files; it exists.
        unit: of a mesh file, m or mm; None: as the file says, else m.
        tolerance_mm: triangles are left out where the surface stays as near as this, mm; None: a tenth of the scan's voxel.

    Returns:
        The files, in the order of the formats.

    Raises:
        SettingsError: there is no such format.
        UnavailableError: the model cannot be read.
        DataError: it is none.
        OSError: a file cannot be written.
    """
    if unknown := set(to) - set(FORMATS):
        raise SettingsError(f"{min(unknown)!r} is no format", f"give some of {', '.join(FORMATS)}")
    read = read_model(Path(model), _UNITS_M.get(unit or "", math.nan))
    solid, _ = fewer_triangles(read.solid, usual_tolerance_m(read) if tolerance_mm is None else tolerance_mm / 1000)
    paths = {Path(out) / f"{read.stem}.{kind}": kind for kind in to}
    for path, kind in paths.items():
        write_bytes(path, mesh_bytes(solid, kind, read.axes))
    return list(paths)


def print_model(
    what: str | Path,
    printer: str,
    *,
    bed_mm: tuple[float, float, float] = (220.0, 220.0, 250.0),
    unit: str | None = None,
    up: str | None = None,
    profile: str | Path | None = None,
    config: str | Path | None = None,
    wishes: Wishes | None = None,
    tell: Callable[[Progress], None] | None = None,
) -> Ended:
    """Print a model or G-code, as `phone-host print --yes` does. It returns when the print has ended: nobody is asked.

    Args:
        what: the folder of a scan or a mesh file, which is sliced, or G-code.
        printer: its address, such as `octoprint://HOST` or `serial:/dev/ttyUSB0`.
        bed_mm: what it holds, mm.
        unit: of a mesh file, m or mm; None: as the file says, else m.
        up: the axis of a model that points up: z, y or -y; None: as its axes say, else z.
        profile: settings of the slicer; None: PLA, layers of 0.2 mm.
        config: settings file with the keys of servers; None: the usual one.
        wishes: another thread pauses and cancels by it; None: nobody does.
        tell: called several times a second with how far it is, in this thread; None: nobody listens.

    Returns:
        How it ended: `phase` is DONE, CANCELLED or FAILED, the last with `problem` and `remedy`.

    Raises:
        TandemError: it cannot be printed, or the printer is gone.
    """
    uri = read_uri(printer)
    table, file = printer_keys(None if config is None else Path(config))
    door = door_to(uri, key_of(uri, table, file))
    door.require_ready()
    slicing = SlicingWanted(bed_mm, None if profile is None else Path(profile))
    with job_of(Path(what), Wanted(slicing, unit, up), uri, lambda _: None) as job:
        place = Place(door, printer, str(what))
        return printed(place, job, wishes or Wishes(), tell or (lambda _: None))
