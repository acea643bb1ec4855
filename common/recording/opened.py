"""Opens a recording that is a file. Its bytes stay on the disk until somebody wants them."""

from pathlib import Path
from typing import Final, NoReturn

from common.errors import DataError
from common.recording.file_bytes import FileBytes
from common.recording.inflate import inflate
from common.recording.recorded import Recorded, read_recorded
from common.recording.ros1 import EXTRA, ROS1_REASON
from common.recording.salvage import is_mcap
from common.words import listed

SUFFIX: Final = ".mcap"


def is_recording(path: str) -> bool:
    """Return whether a path is to be taken for a recording's: by its name alone."""
    return path.lower().endswith(SUFFIX)


def stored_data(path: Path) -> FileBytes:
    """Return the bytes of a file, which stay there.

    Raises:
        DataError: it cannot be read, or is no MCAP file.
    """
    try:
        data = FileBytes.whole(path)
    except OSError as error:
        raise DataError(f"{path} cannot be read ({error.strerror})", "name a recording, FILE.mcap") from None
    if not len(data):
        raise DataError(f"{path} is empty", "give a recording")
    if not is_mcap(data):
        raise DataError(f"{path} is no MCAP file", "give a recording of phone-host record, or another MCAP file")
    return data


def open_recorded(path: Path, *, needs_times: bool = True) -> Recorded:
    """Read all that is whole in a recording.

    Args:
        path: the file.
        needs_times: whether it is refused if none of its times can be true.

    Raises:
        DataError: it cannot be read, is no MCAP file, or holds no images, or none of which the time is known.
    """
    found = read_recorded(stored_data(path), inflate)
    if not found.images:
        _refuse_without_images(path, found)
    if found.time_fault and needs_times:
        raise DataError(
            f"{path}: {found.time_fault}", "give the rate: phone-host sessions import FILE.mcap --fps N --out NEW.mcap"
        )
    return found


def _refuse_without_images(path: Path, found: Recorded) -> NoReturn:
    if any(each.reason == ROS1_REASON for each in found.unused.values()):
        raise DataError(f"{path} holds {ROS1_REASON}", f"install it: {EXTRA}")
    reasons = [f"{topic}: {each.reason}" for topic, each in sorted(found.unused.items())]
    held = f", only {listed(reasons)}" if reasons else "" if found.kinds else ", and nothing else"
    spoiled = f" ({found.damages[0].words})" if found.damages else ""
    raise DataError(
        f"{path} holds no images{held}{spoiled}",
        "give a file with sensor_msgs/msg/CompressedImage or Image in it",
    )
