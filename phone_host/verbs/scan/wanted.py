"""Reads how a model is to be made: --voxel, --box and --memory."""

import argparse
import math
import re
from typing import Final

from common.errors import SettingsError
from common.program.quantities import decimal_number
from phone_host.scan.box import Box
from phone_host.scan.scan import ScanWanted
from phone_host.stereo.match_tandem import matching_threads
from phone_host.verbs.units import length_mm

_LEAST_VOXEL_MM, _MOST_VOXEL_MM = 0.2, 200.0
_LEAST_BYTES: Final = 10_000_000
_BOX: Final = re.compile(r"([^x@]+)x([^x@]+)x([^x@]+)@([^,@]+),([^,@]+),([^,@]+)")
_BOX_REMEDY: Final = "give sides and middle in mm, such as 400x300x400@0,100,900"


def scan_wanted(options: argparse.Namespace) -> ScanWanted:
    """Read them.

    Args:
        options: options as `add_model_arguments` declares them.

    Raises:
        SettingsError: one of them is invalid.
    """
    if options.memory < _LEAST_BYTES:
        raise SettingsError(f"--memory is {options.memory / 1e6:g} MB", "give at least 10MB")
    return ScanWanted(
        voxel_m=math.nan if options.voxel is None else _voxel_mm(options.voxel) / 1000,
        most_bytes=int(options.memory),
        box=None if options.box is None else box_of(options.box),
        threads=matching_threads(),
    )


def _voxel_mm(text: str) -> float:
    value = length_mm(text, "--voxel", "2mm")
    if not _LEAST_VOXEL_MM <= value <= _MOST_VOXEL_MM:
        raise SettingsError(f"--voxel is {value:g} mm", f"give {_LEAST_VOXEL_MM:g} to {_MOST_VOXEL_MM:g} mm")
    return value


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
