"""The field of a finished scan as bytes, and back, so that another pass can be added to it. Pure.

A head line, then a deflated npz of arrays: nothing in it is code, and whatever the bytes are, they are read or refused in one line.
"""

import io
import zipfile
import zlib
from dataclasses import dataclass
from typing import Final

import numpy as np

from common.errors import DataError
from phone_host.scan.blocks import VOXELS
from phone_host.scan.volume import BlockValues, Volume
from phone_host.scan.volume_settings import VolumeSettings

_HEAD: Final = b"tandemscan field 1\n"
_LEVEL: Final = 1
_MOST_BYTES: Final = 4 << 30


@dataclass(frozen=True, slots=True, eq=False)
class KeptField:
    """The field of a finished scan: how it was made, and its blocks."""

    settings: VolumeSettings
    blocks: BlockValues

    def volume(self, threads: int) -> Volume:
        """Return it as a volume.

        Args:
            threads: that work on it.
        """
        made = Volume(self.settings, threads)
        made.put(self.blocks)
        return made


def field_bytes(volume: Volume) -> bytes:
    """Return a volume's field as bytes.

    Args:
        volume: any.
    """
    file, of, blocks = io.BytesIO(), volume.settings, volume.changed_blocks(every=True)
    np.savez(
        file,
        model=np.array([of.voxel_m, of.far_m, of.most_bytes, of.truncation_voxels], np.float64),
        places=blocks.places,
        field=blocks.field,
        weights=blocks.weights,
        colours=blocks.colours,
    )
    return _HEAD + zlib.compress(file.getvalue(), _LEVEL)


def field_of(content: bytes, name: str) -> KeptField:
    """Read a field.

    Args:
        content: what `field_bytes` gave.
        name: of the file, for the error.

    Raises:
        DataError: it is damaged, or no field.
    """
    try:
        return _read(content)
    except (ValueError, KeyError, IndexError, EOFError, OSError, zlib.error, zipfile.BadZipFile) as error:
        raise DataError(
            f"{name} is damaged, or no field of this version", "scan the first pass again, with --turntable"
        ) from error


def _read(content: bytes) -> KeptField:
    if not content.startswith(_HEAD):
        raise ValueError("another head")
    inflater = zlib.decompressobj()
    plain = inflater.decompress(content[len(_HEAD) :], _MOST_BYTES)
    if not inflater.eof:
        raise EOFError
    with np.load(io.BytesIO(plain), allow_pickle=False) as found:
        held = dict(found)
    voxel_m, far_m, most_bytes, truncation_voxels = held["model"].astype(np.float64).tolist()
    if not (0 < voxel_m < 1 and far_m > 0 and 0 < most_bytes < 1e15 and 1 <= truncation_voxels < 100):
        raise ValueError("impossible settings")
    settings = VolumeSettings(
        voxel_m=voxel_m, far_m=far_m, most_bytes=int(most_bytes), truncation_voxels=truncation_voxels
    )
    count = len(held["places"])
    blocks = BlockValues(
        held["places"].astype(np.int32).reshape(count, 3),
        held["field"].astype(np.int16).reshape(count, VOXELS),
        held["weights"].astype(np.uint16).reshape(count, VOXELS),
        held["colours"].astype(np.uint8).reshape(count, VOXELS, 3),
    )
    return KeptField(settings, blocks)
