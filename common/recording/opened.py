"""Opens a recording that is a file. Its bytes stay on the disk until somebody wants them."""

import mmap
from pathlib import Path
from typing import Final

from common.errors import DataError
from common.recording.recorded import Recorded, read_recorded
from common.recording.salvage import is_mcap

SUFFIX: Final = ".mcap"


def is_recording(path: str) -> bool:
    """Return whether a path is to be taken for a recording's: by its name alone."""
    return path.lower().endswith(SUFFIX)


def mapped(path: Path) -> memoryview:
    """Return the bytes of a file.

    Raises:
        DataError: it cannot be read, or is no MCAP file.
    """
    try:
        with path.open("rb") as file:
            data = memoryview(mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ))
    except ValueError:
        raise DataError(f"{path} is empty", "give a recording") from None
    except OSError as error:
        raise DataError(f"{path} cannot be read ({error.strerror})", "name a recording, FILE.mcap") from None
    if not is_mcap(data):
        raise DataError(f"{path} is no MCAP file", "give a recording of phone-host record, or another MCAP file")
    return data


def open_recorded(path: Path) -> Recorded:
    """Read all that is whole in a recording.

    Raises:
        DataError: it cannot be read, is no MCAP file, or holds no images.
    """
    found = read_recorded(mapped(path), inflate)
    if not found.images:
        held = f", only {', '.join(sorted(found.kinds))}" if found.kinds else ", and nothing else"
        spoiled = f" ({found.damages[0].words})" if found.damages else ""
        raise DataError(
            f"{path} holds no images{held}{spoiled}",
            "give a file with sensor_msgs/msg/CompressedImage or Image in it",
        )
    return found


def inflate(compression: str, data: memoryview, size: int) -> memoryview:
    """Undo a chunk's compression, with packages that another program's files need and ours do not.

    Raises:
        ValueError: it cannot be undone.
    """
    try:
        match compression:
            case "zstd":
                import zstandard  # noqa: PLC0415 - not ours to require

                return memoryview(zstandard.ZstdDecompressor().decompress(bytes(data), max_output_size=size))
            case "lz4":
                import lz4.frame  # noqa: PLC0415 - not ours to require

                return memoryview(lz4.frame.decompress(bytes(data)))
    except ImportError as error:
        raise ValueError(f"a chunk is compressed with {compression}: pip install {error.name}") from error
    except Exception as error:
        raise ValueError(f"a chunk cannot be decompressed ({error})") from error
    raise ValueError(f"a chunk is compressed with {compression}, which nobody here knows")
