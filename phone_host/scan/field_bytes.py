"""A field as bytes, and back: that of a finished scan, to which another pass is added, and the part of it that a submap holds. Pure.

A head line, then a deflated npz of arrays: nothing in it is code, and whatever the bytes are, they are read or refused in one line.
"""

import io
import struct
import zipfile
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from common.errors import DataError
from phone_host.scan.blocks import VOXELS, Cells
from phone_host.scan.carving import Carved
from phone_host.scan.volume import BlockValues, Volume
from phone_host.scan.volume_settings import VolumeSettings

_HEAD: Final = b"tandemscan field 3\n"
_LEVEL: Final = 1
"""Ten times as fast as the usual 6, for a tenth more bytes."""

_MOST_RATIO: Final = 64
_ALWAYS_BYTES: Final = 64 << 20
"""The arrays may take this much memory, or so many times the bytes of the file. Fields and submaps of real scans are 3 to 6 times as large as theirs."""

_FINEST_M: Final = 1e-5
_FARTHEST_M: Final = 1000.0
_MOST_PLACE: Final = 1 << 24
"""Limits of what a scan with cameras can be: voxels of 10 um, depths of 1 km, and blocks that the native library can count."""

_BROKEN: Final = (
    ValueError,
    KeyError,
    IndexError,
    TypeError,
    AttributeError,
    ArithmeticError,
    EOFError,
    OSError,
    MemoryError,
    RuntimeError,
    struct.error,
    zlib.error,
    zipfile.BadZipFile,
)
"""What reading arrays raises for bytes that hold none."""

Arrays = dict[str, NDArray[Any]]
Read = TypeVar("Read")
Kind = TypeVar("Kind", bound=np.generic)


@dataclass(frozen=True, slots=True, eq=False)
class KeptField:
    """A field: how it was made, its blocks, and what the views told of the box around the thing; None: there was no box."""

    settings: VolumeSettings
    blocks: BlockValues
    carved: Carved | None

    def volume(self, threads: int) -> Volume:
        """Return it as a volume."""
        made = Volume(self.settings, threads)
        made.put(self.blocks)
        return made


def field_bytes(volume: Volume, carved: Carved | None = None) -> bytes:
    """Return a volume's field as bytes.

    Args:
        volume: any.
        carved: what the views told of the box around the thing; None: there was no box.
    """
    return packed(_HEAD, arrays_of(KeptField(volume.settings, volume.changed_blocks(every=True), carved)))


def field_of(content: bytes, name: str) -> KeptField:
    """Read a field.

    Args:
        content: what `field_bytes` gave.
        name: of the file, for the error.

    Raises:
        DataError: it is damaged, or no field.
    """
    refusal = DataError(
        f"{name} is damaged, or no field of this version", "scan the first pass again, with --turntable"
    )
    return unpacked(content, _HEAD, field_in, refusal)


def packed(head: bytes, arrays: Arrays) -> bytes:
    """Return arrays as bytes."""
    file = io.BytesIO()
    np.savez(file, **arrays)  # type: ignore[arg-type]  # none has the name of an argument
    return head + zlib.compress(file.getvalue(), _LEVEL)


def unpacked(content: bytes, head: bytes, read: Callable[[Arrays], Read], refusal: DataError) -> Read:
    """Read arrays.

    Args:
        content: what `packed` gave.
        head: that it was given.
        read: makes something of them; what is missing, or cannot be, raises one of ValueError, KeyError, IndexError.
        refusal: raised where that is not possible.

    Raises:
        DataError: the refusal.
    """
    try:
        return read(_arrays(content, head))
    except _BROKEN as error:
        raise refusal from error


def _arrays(content: bytes, head: bytes) -> Arrays:
    """Return the arrays in some bytes. No more memory is taken on the way than they may have."""
    if not content.startswith(head):
        raise ValueError("another head")
    inflater = zlib.decompressobj()
    plain = inflater.decompress(memoryview(content)[len(head) :], _MOST_RATIO * len(content) + _ALWAYS_BYTES)
    if not inflater.eof:
        raise EOFError
    with zipfile.ZipFile(io.BytesIO(plain)) as parts:
        held = parts.infolist()
    # Ours are stored as they are: others could become a thousand times larger, or lie over each other.
    if any(part.compress_type != zipfile.ZIP_STORED or part.file_size != part.compress_size for part in held):
        raise ValueError("compressed twice")
    if sum(part.file_size for part in held) > len(plain):
        raise ValueError("parts lie over each other")
    with np.load(io.BytesIO(plain), allow_pickle=False) as found:
        return dict(found)


def arrays_of(field: KeptField) -> Arrays:
    """Return what `field_in` reads."""
    of, blocks, carved = field.settings, field.blocks, field.carved
    return {
        "model": np.array(
            [of.voxel_m, of.far_m, of.most_bytes, of.truncation_voxels, of.near_m, of.noise_per_m], np.float64
        ),
        "block_places": blocks.places,
        "field": blocks.field,
        "weights": blocks.weights,
        "colours": blocks.colours,
        "carved": np.zeros((3, 0, 0, 0), np.uint8) if carved is None else carved.counts,
        "cells": np.zeros(6)
        if carved is None
        else np.array([*carved.cells.low, carved.cells.voxels, carved.views, carved.cells.voxel_m]),
    }


def field_in(held: Arrays) -> KeptField:
    """Return the field in some arrays.

    Raises:
        ValueError, KeyError: they hold none.
    """
    voxel_m, far_m, most_bytes, truncation_voxels, near_m, noise_per_m = held["model"].astype(np.float64).tolist()
    is_possible = _FINEST_M <= voxel_m < 1 and 0 < far_m <= _FARTHEST_M
    is_possible &= 0 <= near_m <= _FARTHEST_M and 0 <= noise_per_m <= _FARTHEST_M
    if not (is_possible and 0 < most_bytes < 1e15 and 1 <= truncation_voxels < 100):
        raise ValueError("impossible settings")
    settings = VolumeSettings(
        voxel_m=voxel_m,
        far_m=far_m,
        most_bytes=int(most_bytes),
        truncation_voxels=truncation_voxels,
        near_m=near_m,
        noise_per_m=noise_per_m,
    )
    count = len(held["block_places"])
    blocks = BlockValues(
        _whole(held["block_places"], np.int32).reshape(count, 3),
        _whole(held["field"], np.int16).reshape(count, VOXELS),
        _whole(held["weights"], np.uint16).reshape(count, VOXELS),
        _whole(held["colours"], np.uint8).reshape(count, VOXELS, 3),
    )
    if np.any(np.abs(blocks.places.astype(np.int64)) > _MOST_PLACE):
        raise ValueError("blocks beyond all distances")
    if len(np.unique(blocks.places, axis=0)) != count:
        raise ValueError("two blocks in one place")
    return KeptField(settings, blocks, _carved_in(held))


def _carved_in(held: Arrays) -> Carved | None:
    counts = _whole(held["carved"], np.uint8)
    kinds, tall, deep, wide = counts.shape
    if kinds != 3:
        raise ValueError("cells")
    if not counts.size:
        return None
    x, y, z, voxels, views = held["cells"][:5].astype(np.int64).tolist()
    voxel_m = float(held["cells"][5])
    if not (_FINEST_M <= voxel_m < 1 and 0 < voxels < _MOST_PLACE and max(map(abs, (x, y, z))) < _MOST_PLACE):
        raise ValueError("impossible cells")
    return Carved(Cells((x, y, z), (wide, deep, tall), voxels, voxel_m), counts, views)


def _whole(array: NDArray[Any], kind: type[Kind]) -> NDArray[Kind]:
    """Return an array that must be of a kind. One that is converted would take memory twice."""
    if array.dtype != kind:
        raise ValueError("of another kind")
    return array
