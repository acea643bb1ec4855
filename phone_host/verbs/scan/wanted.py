"""Reads how a model is to be made: --mat, --object, --voxel, --box, --unseen and --memory."""

import argparse
import math
import re
import sys
from pathlib import Path
from typing import Final

from common.errors import SettingsError, UnavailableError
from common.program.quantities import decimal_number
from common.program.terminal import say
from common.words import counted
from phone_host.jobs.units import length_mm
from phone_host.model.unseen import UnseenSurface
from phone_host.output.axes import Axes
from phone_host.run.kept_submaps import read_submaps, require_no_submaps
from phone_host.run.scan_files import read_field
from phone_host.run.scan_result import own_axes
from phone_host.scan.box import Box
from phone_host.scan.field_bytes import KeptField
from phone_host.scan.mat import USUAL_MAT, Mat, parse_mat
from phone_host.scan.scan_wanted import ScanWanted
from phone_host.scan.scanned import Submap
from phone_host.stereo.match_tandem import matching_threads
from phone_host.verbs.stereo_options import output_options

_LEAST_VOXEL_MM, _MOST_VOXEL_MM = 0.2, 250.0
_USUAL: Final = "usual"
"""What `--mat` without a value is."""

_LEAST_BYTES: Final = 10_000_000
_BOX: Final = re.compile(r"([^x@]+)x([^x@]+)x([^x@]+)@([^,@]+),([^,@]+),([^,@]+)")
_BOX_REMEDY: Final = "give sides and middle in mm, such as 400x300x400@0,100,900"


def scan_wanted(options: argparse.Namespace) -> ScanWanted:
    """Read them.

    Args:
        options: options as `add_model_arguments` and `add_turntable_arguments` declare them.

    Raises:
        SettingsError: one of them is invalid.
    """
    if options.memory < _LEAST_BYTES:
        raise SettingsError(f"--memory is {options.memory / 1e6:g} MB", "give at least 10MB")
    if options.mat is not None and options.turntable:
        raise SettingsError("--turntable beside --mat", "leave --turntable out: the mat tells how it turns")
    if options.object and (options.mat is not None or options.turntable):
        raise SettingsError(
            f"--object beside {'--turntable' if options.mat is None else '--mat'}",
            "leave --object out: it is for a table without a mat, around which the cameras go",
        )
    onto = _onto_of(options)
    usual_m = math.nan if onto is None else onto.settings.voxel_m
    return ScanWanted(
        voxel_m=usual_m if options.voxel is None else voxel_of(options.voxel),
        most_bytes=int(options.memory),
        box=None if options.box is None else box_of(options.box),
        threads=matching_threads(),
        mat=None if options.mat is None else _mat_of(options.mat),
        turntable=options.turntable,
        on_table=options.object,
        onto=onto,
        unseen=UnseenSurface(options.unseen),
    )


def _mat_of(text: str) -> Mat:
    if text == _USUAL:
        return parse_mat(USUAL_MAT)
    if Path(text).exists():
        raise SettingsError(
            f"--mat takes {text!r} for the name of a sheet",
            "write --mat behind LEFT and RIGHT, or before another option",
        )
    return parse_mat(text)


def _onto_of(options: argparse.Namespace) -> KeptField | None:
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
    if options.onto.resolve() == options.out.resolve():
        raise SettingsError("--onto and --out are the same folder", "give the results another folder")
    try:
        return read_field(options.onto)
    except OSError as error:
        raise UnavailableError(f"--onto {options.onto}: {error.strerror}", "give a folder that can be read") from error


def resumed_of(options: argparse.Namespace) -> tuple[Submap, ...]:
    """Read the submaps that --resume names, and say what goes on.

    Args:
        options: options as `scan` declares them.

    Raises:
        DataError: there are none, or they are damaged.
        SettingsError: they were made with another --voxel; or others lie in --out and --restart is not given.
        UnavailableError: they cannot be read.
    """
    if options.resume is None:
        if not options.restart:
            require_no_submaps(options.out)
        return ()
    if options.restart:
        raise SettingsError("--resume beside --restart", "leave one of them out")
    if options.resume.resolve() != options.out.resolve():
        require_no_submaps(options.out)
    if options.turntable:
        raise SettingsError(
            "--resume beside --turntable: the end needs all of its pairs", "scan the pictures or the recording again"
        )
    try:
        submaps = read_submaps(options.resume)
    except OSError as error:
        raise UnavailableError(
            f"--resume {options.resume}: {error.strerror}", "give a folder that can be read"
        ) from error
    voxel_m = submaps[-1].settings.voxel_m
    if options.voxel is not None and not math.isclose(voxel_of(options.voxel), voxel_m):
        raise SettingsError(
            f"--voxel is {options.voxel}, the scan in {options.resume} has {voxel_m * 1000:g} mm", "leave --voxel out"
        )
    pairs = [pair for submap in submaps for pair in submap.pairs]
    say(
        f"phone-host: going on after pair {pairs[-1].name}, with {counted(len(pairs), 'pair')};"
        " what was taken into the model after it is lost, and is taken again where it is given again",
        sys.stderr,
    )
    return submaps


def axes_of(options: argparse.Namespace, wanted: ScanWanted) -> Axes:
    """Return the axes of the files, as `axes_beside` does."""
    return axes_beside(output_options(options).axes, wanted)


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


def voxel_of(text: str) -> float:
    """Read how fine a model is, m.

    Args:
        text: what the user wrote, mm unless it names a unit.

    Raises:
        SettingsError: it is none.
    """
    value = length_mm(text, "--voxel", "2mm")
    if not _LEAST_VOXEL_MM <= value <= _MOST_VOXEL_MM:
        raise SettingsError(f"--voxel is {value:g} mm", f"give {_LEAST_VOXEL_MM:g} to {_MOST_VOXEL_MM:g} mm")
    return value / 1000


def box_of(text: str) -> Box:
    """Read a box: WxHxD@X,Y,Z, mm.

    Args:
        text: what the user wrote.

    Raises:
        SettingsError: it is none.
    """
    found = _BOX.fullmatch(text.replace(" ", ""))
    try:
        values = [decimal_number(part) / 1000 for part in found.groups()] if found else []
    except ValueError:
        values = []
    if not values or min(values[:3]) <= 0:
        raise SettingsError(f"--box is {text!r}", _BOX_REMEDY)
    width, height, depth, x, y, z = values
    return Box(
        (x - width / 2, y - height / 2, z - depth / 2),
        (x + width / 2, y + height / 2, z + depth / 2),
    )
