"""What a scan is asked for: its cameras or pictures, and how the model is made."""

import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from common.errors import SettingsError, UnavailableError
from common.program.quantities import decimal_number, file_size, seconds
from common.program.request import Request, option, part
from common.words import counted
from phone_host.jobs.depth import LimitedDepthOptions
from phone_host.jobs.options import PAIRED, ImageOptions, PairOptions
from phone_host.jobs.units import length_mm
from phone_host.model import Side
from phone_host.model.quality import UNSEEN_HELP, UnseenSurface
from phone_host.output.axes import Axes
from phone_host.run.kept_submaps import read_submaps, require_no_submaps
from phone_host.run.scan_job import read_field
from phone_host.run.scan_result import own_axes
from phone_host.scan.blocks import Box
from phone_host.scan.field_bytes import KeptField
from phone_host.scan.mat import USUAL_MAT, Mat, parse_mat
from phone_host.scan.scan_wanted import ScanWanted
from phone_host.scan.scanned import Submap
from phone_host.stereo.match_tandem import matching_threads

_LEAST_VOXEL_MM, _MOST_VOXEL_MM = 0.2, 250.0
_USUAL: Final = "usual"
"""What `--mat` without a value is."""

_LEAST_BYTES: Final = 10_000_000
_BOX: Final = re.compile(r"([^x@]+)x([^x@]+)x([^x@]+)@([^,@]+),([^,@]+),([^,@]+)")
_BOX_REMEDY: Final = "give sides and middle in mm, such as 400x300x400@0,100,900"


def _mat_of(text: str, option: str) -> Mat:
    if text == _USUAL:
        return parse_mat(USUAL_MAT)
    if Path(text).exists():
        raise SettingsError(
            f"{option} takes {text!r} for the name of a sheet",
            "write --mat behind LEFT and RIGHT, or before another option",
        )
    return parse_mat(text)


def voxel_of(text: str, option: str = "--voxel") -> float:
    """Read how fine a model is, m.

    Args:
        text: what the user wrote, mm unless it names a unit.
        option: the option, for errors.

    Raises:
        SettingsError: it is none.
    """
    value = length_mm(text, option, "2mm")
    if not _LEAST_VOXEL_MM <= value <= _MOST_VOXEL_MM:
        raise SettingsError(f"{option} is {value:g} mm", f"give {_LEAST_VOXEL_MM:g} to {_MOST_VOXEL_MM:g} mm")
    return value / 1000


def box_of(text: str, option: str = "--box") -> Box:
    """Read a box: WxHxD@X,Y,Z, mm.

    Args:
        text: what the user wrote.
        option: the option, for errors.

    Raises:
        SettingsError: it is none.
    """
    found = _BOX.fullmatch(text.replace(" ", ""))
    try:
        values = [decimal_number(part) / 1000 for part in found.groups()] if found else []
    except ValueError:
        values = []
    if not values or min(values[:3]) <= 0:
        raise SettingsError(f"{option} is {text!r}", _BOX_REMEDY)
    width, height, depth, x, y, z = values
    return Box(
        (x - width / 2, y - height / 2, z - depth / 2),
        (x + width / 2, y + height / 2, z + depth / 2),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelOptions:
    """How the model of a scan is made."""

    mat: Mat | None = option(
        "--mat",
        often=True,
        read=_mat_of,
        nargs="?",
        const="usual",
        metavar="10x8:25mm:18mm:5x5",
        help="scan what lies on a printed mat, whether it is turned or the cameras go around it: the sheet of `phone-host target mat`, or any ChArUco"
        " sheet by its squares, side of a square, side of a mark and family; the model stands on the sheet's middle, z up",
    )
    on_table: bool = option(
        "--object",
        often=True,
        action="store_true",
        help="scan what stands on a table, without a mat, while the cameras go around it: table and background are found and left out, and the model"
        " stands on the table, z up; the first pair must show the object in its middle and the table around it",
    )
    voxel_m: float | None = option(
        "--voxel",
        read=voxel_of,
        metavar="MM",
        help="how fine the model is, such as 2mm (default: half the noise of the near depths of the first pair)",
    )
    box: Box | None = option(
        "--box",
        read=box_of,
        metavar="WxHxD@X,Y,Z",
        help="keep only the surface in this box, mm: its sides, and its middle in the axes of the first left camera (x right, y down, z forward), or of the mat or table",
    )
    unseen: UnseenSurface = option(
        "--unseen",
        read=lambda text, _: UnseenSurface(text),
        choices=tuple(each.value for each in UnseenSurface),
        default="fill",
        help=f"with --box, --mat, --object or --turntable: {UNSEEN_HELP} (default fill)",
    )
    most_bytes: float = option(
        "--memory",
        page=False,
        number=file_size,
        default=300e6,
        metavar="SIZE",
        help="memory of the model at most; when it is full, voxels become twice as wide, or with --voxel what does not fit is left out; the report says so (default 300MB)",
    )
    turntable: bool = option(
        "--turntable",
        often=True,
        action="store_true",
        help="the cameras stand still and an object turns before them, on anything or by hand, about one axis and by 3 to 15 degrees between the"
        " pairs; background and table are left out, and the turn is closed after 360 degrees",
    )
    onto: Path | None = option(
        "--onto",
        page=False,
        type=Path,
        metavar="DIR",
        help="with --turntable: a second pass, the object turned over, is added to the one whose results are in DIR; how it lies is found by its shape",
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class ScanRequest(Request):
    """What a scan can be told."""

    images: tuple[str, ...] = option(
        nargs="*",
        metavar="LEFT RIGHT",
        help=f"images in the order in which they were taken, each pair sharing most of what the last one shows; without them two cameras are"
        f" scanned live: {PAIRED}",
    )
    config: Path | None = option(
        "--config", group="settings", type=Path, metavar="FILE", help="live: settings file (TOML)"
    )
    cameras: PairOptions = part(PairOptions, "live: ", group="cameras and links")
    board_side: Side | None = option(
        "--board-side",
        group="cameras and links",
        read=lambda text, _: Side(text),
        choices=("left", "right"),
        help="live: which view the board's camera gives (default: as in the calibration, else left)",
    )
    replay: str | None = option(
        "--replay",
        group="cameras and links",
        metavar="FILE.mcap",
        help="play a recording in place of --link and --camera: all of its pairs, the same each time; without --calibration the rig.yaml in it counts",
    )
    record: Path | None = option(
        "--record",
        group="output",
        type=Path,
        metavar="FILE.mcap",
        help="live: also keep what both cameras give, to scan it again with --replay: finer, or after a crash",
    )
    pairs: int | None = option(
        "--pairs",
        group="cameras and links",
        type=int,
        metavar="N",
        help="live: end after N pairs (default 0: no limit)",
    )
    duration_s: float = option(
        "--seconds",
        group="cameras and links",
        number=seconds,
        default=0.0,
        metavar="S",
        help="live: end S seconds after the first pair (default: with Ctrl-C or SIGTERM)",
    )
    depth: LimitedDepthOptions = part(LimitedDepthOptions, group="depth")
    pictures: ImageOptions = part(ImageOptions, group="pictures")
    model: ModelOptions = part(ModelOptions, group="model")
    resume: Path | None = option(
        "--resume",
        group="output",
        type=Path,
        metavar="DIR",
        help="go on with a scan that was killed, from the last submap that it has written into its folder, one every 20 pairs of the model;"
        " DIR may be that of --out",
    )
    restart: bool = option(
        "--restart",
        group="output",
        action="store_true",
        help="start again where --out holds what a scan that was killed has written; without it that is refused",
    )
    out: Path = option(
        "--out",
        often=True,
        type=Path,
        required=True,
        metavar="DIR",
        help="folder for model.ply, trajectory.txt, report.json and index.html, not that of the images; it is created if it does not exist",
    )


def model_wanted(options: ModelOptions, out: Path | None) -> ScanWanted:
    """Return how the model is made.

    Args:
        options: about the model.
        out: folder for the results; None: it is another than that of --onto.

    Raises:
        SettingsError: options contradict each other.
        DataError: --onto names no scan, or a damaged one.
        UnavailableError: it cannot be read.
    """
    if options.most_bytes < _LEAST_BYTES:
        raise SettingsError(f"--memory is {options.most_bytes / 1e6:g} MB", "give at least 10MB")
    if options.mat is not None and options.turntable:
        raise SettingsError("--turntable beside --mat", "leave --turntable out: the mat tells how it turns")
    if options.on_table and (options.mat is not None or options.turntable):
        raise SettingsError(
            f"--object beside {'--turntable' if options.mat is None else '--mat'}",
            "leave --object out: it is for a table without a mat, around which the cameras go",
        )
    onto = _onto_of(options, out)
    usual_m = math.nan if onto is None else onto.settings.voxel_m
    return ScanWanted(
        voxel_m=usual_m if options.voxel_m is None else options.voxel_m,
        most_bytes=int(options.most_bytes),
        box=options.box,
        threads=matching_threads(),
        mat=options.mat,
        turntable=options.turntable,
        on_table=options.on_table,
        onto=onto,
        unseen=options.unseen,
    )


def _onto_of(options: ModelOptions, out: Path | None) -> KeptField | None:
    """Read the field that --onto names.

    Raises:
        DataError: there is none, or it is damaged.
        SettingsError: it is given without --turntable, or is the folder of the results.
        UnavailableError: it cannot be read.
    """
    if options.onto is None:
        return None
    if not options.turntable:
        raise SettingsError("--onto without --turntable", "scan both passes with --turntable")
    if out is not None and options.onto.resolve() == out.resolve():
        raise SettingsError("--onto and --out are the same folder", "give the results another folder")
    try:
        return read_field(options.onto)
    except OSError as error:
        raise UnavailableError(f"--onto {options.onto}: {error.strerror}", "give a folder that can be read") from error


def resumed_of(request: ScanRequest, tell: Callable[[str], None]) -> tuple[Submap, ...]:
    """Read the submaps that --resume names, and tell what goes on.

    Args:
        request: of the scan.
        tell: takes a line that the user should know.

    Raises:
        DataError: there are none, or they are damaged.
        SettingsError: they were made with another --voxel; or others lie in --out and --restart is not given.
        UnavailableError: they cannot be read.
    """
    if request.resume is None:
        if not request.restart:
            require_no_submaps(request.out)
        return ()
    if request.restart:
        raise SettingsError("--resume beside --restart", "leave one of them out")
    if request.resume.resolve() != request.out.resolve():
        require_no_submaps(request.out)
    if request.model.turntable:
        raise SettingsError(
            "--resume beside --turntable: the end needs all of its pairs", "scan the pictures or the recording again"
        )
    try:
        submaps = read_submaps(request.resume)
    except OSError as error:
        raise UnavailableError(
            f"--resume {request.resume}: {error.strerror}", "give a folder that can be read"
        ) from error
    voxel_m = submaps[-1].settings.voxel_m
    if request.model.voxel_m is not None and not math.isclose(request.model.voxel_m, voxel_m):
        raise SettingsError(
            f"--voxel is {request.given['voxel']}, the scan in {request.resume} has {voxel_m * 1000:g} mm",
            "leave --voxel out",
        )
    pairs = [pair for submap in submaps for pair in submap.pairs]
    tell(
        f"going on after pair {pairs[-1].name}, with {counted(len(pairs), 'pair')};"
        " what was taken into the model after it is lost, and is taken again where it is given again"
    )
    return submaps


def axes_beside(asked: Axes, wanted: ScanWanted) -> Axes:
    """Return the axes of the files.

    Args:
        asked: the value of --axes.
        wanted: how the model is made.

    Raises:
        SettingsError: --axes beside a mat, or beside an object on a table.
    """
    own = own_axes(wanted)
    if own is None:
        return asked
    option = "--mat" if own is Axes.MAT else "--object"
    if asked is not Axes.CAMERA:
        raise SettingsError(
            f"--axes {asked.value} beside {option}", f"leave --axes out: the model stands on the {own.value}, z up"
        )
    return own
