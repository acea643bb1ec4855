"""What is done with a model: checked, saved for other programs, printed. The verbs, the API and the page do it by these functions."""

import math
from collections.abc import Callable, Iterable, Sequence
from contextlib import ExitStack, closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from common.errors import DataError, SettingsError, TandemError
from phone_host.geometry.unseen_surface import apply_unseen, unseen_share
from phone_host.model import UnseenSurface
from phone_host.output.atomic import replacing
from phone_host.output.data_folder import data_folder
from phone_host.output.meshes.decimated import NoLibraryError, decimated
from phone_host.output.meshes.formats import FORMATS, mesh_bytes
from phone_host.output.meshes.printable import Printer, Problem, problems
from phone_host.output.meshes.solid import Solid, used_points
from phone_host.output.model_file import Model, read_model
from phone_host.output.upright import upright_model
from phone_host.printers.bed import Bed
from phone_host.printers.door import Ended, Job, Progress, Wishes
from phone_host.printers.doors import configured_door, door_to
from phone_host.printers.journal import Journal
from phone_host.printers.preparing import Wanted, job_of, require_input
from phone_host.printers.printer_uri import FileUri, read_uri
from phone_host.printers.printing import Place, RunningPrint, watched
from phone_host.printers.slicing import SlicingWanted
from phone_host.report.scan_report import unseen_sentence
from phone_host.settings import printer_keys

_SHARE_OF_VOXEL: Final = 0.1
"""How far the surface may move when triangles are left out; with twice that it intersects itself in places (decision 0070)."""

_NO_FLAGS: Final = "--unseen changes nothing: the model does not say which part of its surface was in view"


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
    if fewer.solid is solid:
        return solid, [
            "every triangle is written, because fewer would cross, or enclose nothing: give a smaller --tolerance"
        ]
    return fewer.solid, []


@dataclass(frozen=True, slots=True, eq=False)
class UnseenResult:
    """A mesh after the choice for the surface that no view measured.

    Attributes:
        solid: the mesh to write.
        choice: what became of that surface; None: the model does not say where it is.
        share: of the model's area, 0..1; NaN: as above.
        notes: what is to be said of it.
    """

    solid: Solid
    choice: UnseenSurface | None = None
    share: float = math.nan
    notes: tuple[str, ...] = ()


def with_unseen(model: Model, choice: UnseenSurface | None) -> UnseenResult:
    """Fill, paint or cut the surface that no view measured.

    Args:
        model: that was read.
        choice: what becomes of that surface; None: as the scan was told, else it is filled in.

    Raises:
        DataError: it is to be cut, and nothing else is there.
    """
    solid = model.solid
    if not len(solid.seen):
        is_told = choice is not None and choice is not model.unseen
        return UnseenResult(solid, notes=(_NO_FLAGS,) if is_told else ())
    choice = choice or model.unseen or UnseenSurface.FILL
    share = unseen_share(solid.points_m, solid.triangles, solid.seen)
    notes = (unseen_sentence(share, choice),) if share > 0 else ()
    return UnseenResult(_treated(model, choice), choice, share, notes)


def _treated(model: Model, choice: UnseenSurface) -> Solid:
    """Return the mesh of a model that says where it was seen, with its unseen part filled, painted or cut."""
    solid = model.solid
    colours, remains = apply_unseen(solid.colours, solid.triangles, solid.seen, choice)
    if remains.all():
        return replace(solid, colours=colours)
    if not remains.any():
        raise DataError(f"no part of {model.path} was in view", "leave out --unseen cut, or scan again")
    used, triangles = used_points(solid.triangles[remains], len(solid.points_m))
    return Solid(solid.points_m[used], triangles, colours[used] if solid.has_colours else colours, solid.seen[used])


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
        DataError: the model cannot be read, or is none.
    """
    upright = upright_model(Path(model), unit, up)
    return problems(upright.points_mm, upright.model.solid.triangles, printer or Printer(), lambda _: None)


def spare_model(model: Model, paths: Iterable[Path]) -> None:
    """Refuse to replace a model by what is made of it.

    Raises:
        SettingsError: one of them is the model's own.
    """
    if model.path.resolve() in {path.resolve() for path in paths}:
        raise SettingsError(f"{model.path} would be replaced by its own export", "give another folder")


def export_model(
    model: str | Path,
    to: Sequence[str],
    out: str | Path,
    *,
    unit: str | None = None,
    tolerance_mm: float | None = None,
    unseen: UnseenSurface | None = None,
) -> list[Path]:
    """Save a model for other programs, as `phone-host export` does. Files of the same names are replaced.

    Args:
        model: the folder of a scan, or a mesh file.
        to: formats: stl, obj, 3ds, ply, 3mf, glb.
        out: folder for the files; it exists.
        unit: of a mesh file, m or mm; None: as the file says, else m.
        tolerance_mm: triangles are left out where the surface stays as near as this, mm; None: a tenth of the scan's voxel.
        unseen: what becomes of the surface that no view measured; None: as the scan was told, else it is filled in.

    Returns:
        The files, in the order of the formats.

    Raises:
        SettingsError: there is no such format, or the model itself would be replaced.
        DataError: the model cannot be read, or is none, or none of it is left.
        OSError: a file cannot be written.
    """
    if unknown := set(to) - set(FORMATS):
        raise SettingsError(f"{min(unknown)!r} is no format", f"give some of {', '.join(FORMATS)}")
    read = read_model(Path(model), unit)
    whole = with_unseen(read, unseen).solid
    solid, _ = fewer_triangles(whole, usual_tolerance_m(read) if tolerance_mm is None else tolerance_mm / 1000)
    paths = {Path(out) / f"{read.stem}.{kind}": kind for kind in to}
    spare_model(read, paths)
    with ExitStack() as files:  # each takes its place when all are written
        for path, kind in paths.items():
            files.enter_context(replacing(path, durable=True)).write(mesh_bytes(solid, kind, read.axes))
    return list(paths)


def print_model(
    what: str | Path,
    printer: str,
    *,
    bed_mm: tuple[float, float, float] | None = None,
    bed: Bed | None = None,
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
        bed_mm: what it holds, mm, for a printer whose coordinates begin in the front left corner.
        bed: its bed in place of `bed_mm`; None for both: what G-code states, else 220 x 220 x 250 mm.
        unit: of a mesh file, m or mm; None: as the file says, else m.
        up: the axis of a model that points up: z, y or -y; None: as its axes say, else z.
        profile: settings of the slicer; None: PLA, layers of 0.2 mm.
        config: settings file with the keys of servers; None: the usual one.
        wishes: another thread pauses and cancels by it; None: nobody does.
        tell: called several times a second with how far it is, in this thread; what it raises cancels the print. None: nobody listens.

    Returns:
        How it ended: `phase` is DONE, CANCELLED or FAILED, the last with `problem` and `remedy`.

    Raises:
        TandemError: it cannot be printed, or the printer is gone, or another print of this machine goes to it.
    """
    slicing = SlicingWanted(bed or (Bed(bed_mm) if bed_mm else None), None if profile is None else Path(profile))
    file = None if config is None else Path(config)
    with closing(prepare_print(Path(what), printer, Wanted(slicing, unit, up), config=file)) as prepared:
        return watched(RunningPrint(prepared.place, prepared.job, wishes), tell or (lambda _: None))


class PreparedPrint:
    """A print that only has to be confirmed: sliced, checked, and its printer ready.

    Attributes:
        place: where it is printed.
        job: what is printed, with what it asks of the printer.

    Args:
        place: see there.
        job: see there.
        kept: what is kept until it is closed: the sliced file.
    """

    def __init__(self, place: Place, job: Job, kept: ExitStack) -> None:
        self.place, self.job = place, job
        self._kept = kept

    def start(
        self, tell: Callable[[Progress], None] | None = None, over: Callable[[Ended | TandemError], None] | None = None
    ) -> RunningPrint:
        """Begin to print, in a thread of its own; the user has confirmed it.

        Args:
            tell: called several times a second, in that thread, with how far it is.
            over: called once, in that thread, when it has ended; close this then.
        """
        running = RunningPrint(self.place, self.job, tell=tell, over=over)
        running.start()
        return running

    def close(self) -> None:
        """Remove the sliced file. Not while it is printed."""
        self._kept.close()


def prepare_print(
    what: Path,
    printer: str,
    wanted: Wanted,
    *,
    config: Path | None = None,
    tell: Callable[[str], None] = lambda _: None,
) -> PreparedPrint:
    """Do all that comes before a print: find the file, ask the printer, check and slice the model. Nothing is heated or moved; it may take minutes.

    Args:
        what: the folder of a scan, a mesh file, or G-code.
        printer: its address.
        wanted: how.
        config: settings file with the keys of servers; None: the usual one.
        tell: is told what is done next.

    Raises:
        TandemError: it cannot be printed, or the printer is not ready.
    """
    uri = read_uri(printer)
    require_input(what)
    door = door_to(uri) if isinstance(uri, FileUri) else configured_door(uri, *printer_keys(config))
    door.require_ready()
    with ExitStack() as kept:
        job = kept.enter_context(job_of(what, wanted, uri, tell))
        journal = None if isinstance(uri, FileUri) else Journal(data_folder() / "printing")
        return PreparedPrint(Place(door, printer, str(what.absolute()), journal), job, kept.pop_all())
