"""The field of a finished scan in its results folder, to which another pass is added."""

from pathlib import Path
from typing import Final

from common.errors import DataError
from phone_host.scan.field_bytes import KeptField, field_of

FIELD: Final = "field.bin"


def read_field(folder: Path) -> KeptField:
    """Read the field that a scan has left.

    Args:
        folder: its results folder.

    Raises:
        DataError: there is none, or it is damaged.
        OSError: as the operating system reports it.
    """
    path = folder / FIELD
    if not path.is_file():
        raise DataError(
            f"{folder} holds no {FIELD}", "give the --out folder of the first pass, scanned with --turntable"
        )
    return field_of(path.read_bytes(), str(path))
