"""Turns a recording into folders of images with their times, and folders of other data sets into a recording.

Written are left/ and right/ with one file for each image, named by its exposure in ns since 1970, beside data.csv as EuRoC and times.txt as TUM
have it. Read are these folders, KITTI's (image_0, image_1 or image_2, image_3 with times.txt), EuRoC's (cam0, cam1 with data.csv) and any two
folders with a file of times.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from common.camera.image_numbers import numbers_of
from common.camera.imagefile import load
from common.camera.replay import find_images
from common.errors import DataError, SettingsError, UnavailableError
from common.files import read_whole
from common.frame import PixelFormat
from common.recording.layout import ABOUT, About, image_topic
from common.recording.recorded import Recorded
from common.recording.recording_file import written
from common.recording.ros_messages import RecordedImage, image_message, image_type
from common.versions import all_versions
from common.words import counted
from phone_host.output.atomic import write_bytes, write_text
from phone_host.output.preview import write_png
from phone_host.recording.both_sides import encoded
from phone_host.stereo.raw_images import decode_frame

_SIDES: Final = ("left", "right")
_SUFFIX: Final = {PixelFormat.MJPEG: ".jpg", PixelFormat.PNG: ".png"}
_MOST_TIMES_BYTES: Final = 64 << 20
_LEAST_NS: Final = 10**12
"""Larger numbers are nanoseconds: as seconds they would lie thirty thousand years ahead."""

_PAIRS: Final = (("image_0", "image_1"), ("image_2", "image_3"), ("cam0/data", "cam1/data"), ("left", "right"))


def export_folders(recorded: Recorded, out: Path) -> dict[str, int]:
    """Write the images of both sides.

    Args:
        recorded: the recording.
        out: the folder; it must not exist.

    Returns:
        How many images each side has.

    Raises:
        UnavailableError: the folder is there already, or cannot be written.
    """
    counts = {}
    try:
        out.mkdir(parents=True)
        for side in _SIDES:
            topic = recorded.topic_of(side)
            counts[side] = _export(recorded, topic, out / side) if topic else 0
        for name, data in recorded.attachments.items():
            if Path(name).name == name and name not in _SIDES:
                write_bytes(out / name, data)
    except FileExistsError:
        raise UnavailableError(f"{out} exists already", "name another folder") from None
    except OSError as error:
        raise UnavailableError(
            f"{out} cannot be written ({error.strerror})", "make room, or name another folder"
        ) from None
    return counts


def _export(recorded: Recorded, topic: str, folder: Path) -> int:
    folder.mkdir()
    rows = []
    for shown in recorded.images[topic]:
        image = shown.image
        suffix = _SUFFIX.get(image.pixel_format)
        name = f"{image.stamp_ns}{suffix or '.png'}"
        if suffix is None:
            write_png(folder / name, decode_frame(encoded(shown, recorded.camera(topic), name)))
        else:
            write_bytes(folder / name, memoryview(image.payload))
        rows.append((image.stamp_ns, name))
    write_text(folder / "data.csv", "".join(["#timestamp [ns],filename\n", *(f"{at},{name}\n" for at, name in rows)]))
    write_text(folder / "times.txt", "".join(f"{at / 1e9:.9f} {name}\n" for at, name in rows))
    return len(rows)


@dataclass(frozen=True, slots=True)
class _Timed:
    """An image in a file, and when it was exposed, ns."""

    path: Path
    stamp_ns: int


def import_folders(paths: Sequence[Path], times: Path | None, out: Path) -> dict[str, int]:
    """Write a recording from folders of images.

    Args:
        paths: one folder of a data set, or the left and the right folder.
        times: file with the time of each image, one a line; None: the data set has one, or the names are times in ns.
        out: the recording; it must not exist.

    Returns:
        How many images each side has.

    Raises:
        SettingsError: the folders are none of those known.
        DataError: a folder is missing, or images have no times.
        UnavailableError: a folder cannot be read, or the file not be made.
    """
    folders, times = _folders(paths, times)
    sides = [_timed(folder, times) for folder in folders]
    with written(out) as file:
        file.tell(ABOUT, About(versions=all_versions()).values())
        for side, sequence, timed in _in_order(sides):
            image = load(timed.path)
            size = (image.width_px, image.height_px)
            recorded = RecordedImage(timed.stamp_ns, side, image.pixel_format, size, image.payload)
            topic, at_ns = image_topic(side, image_type(image.pixel_format)), timed.stamp_ns
            file.add(topic, image_message(recorded), sequence=sequence, log_ns=at_ns, publish_ns=at_ns)
    return dict(zip(_SIDES, map(len, sides), strict=True))


def _in_order(sides: Sequence[list[_Timed]]) -> Iterator[tuple[str, int, _Timed]]:
    every = [
        (timed.stamp_ns, side, at, timed) for side, of in zip(_SIDES, sides, strict=True) for at, timed in enumerate(of)
    ]
    for _, side, at, timed in sorted(every, key=lambda item: item[:3]):
        yield side, at, timed


def _folders(paths: Sequence[Path], times: Path | None) -> tuple[tuple[Path, Path], Path | None]:
    """Return the left and the right folder, and the file with their times, if there is one."""
    if len(paths) > 2:
        raise SettingsError(f"{len(paths)} folders", "give the folder of a data set, or the left and the right one")
    for path in paths:
        if not path.is_dir():
            raise DataError(
                f"{path} is no folder", "give the folder of a data set, two folders, or a recording, FILE.mcap"
            )
    if len(paths) == 2:
        return (paths[0], paths[1]), times
    for left, right in _PAIRS:
        if (paths[0] / left).is_dir() and (paths[0] / right).is_dir():
            usual = paths[0] / "times.txt"
            return (paths[0] / left, paths[0] / right), times or (usual if usual.is_file() else None)
    looked = ", ".join(f"{left} and {right}" for left, right in _PAIRS)
    raise SettingsError(f"{paths[0]} holds none of {looked}", "give the left and the right folder, and --times FILE")


def _timed(folder: Path, times: Path | None) -> list[_Timed]:
    listed = next((each for each in (folder / "data.csv", folder.parent / "data.csv") if each.is_file()), None)
    if times is None and listed is not None:
        images = folder / "data" if (folder / "data").is_dir() else folder
        rows = [line.split(",") for line in _lines(listed)]
        found = [_Timed(images / row[1].strip(), _time_ns(row[0], listed)) for row in rows if len(row) > 1]
    else:
        paths = find_images(str(folder))
        found = [_Timed(path, at) for path, at in zip(paths, _times(paths, times, folder), strict=True)]
    return sorted(found, key=lambda timed: timed.stamp_ns)


def _times(paths: Sequence[Path], times: Path | None, folder: Path) -> list[int]:
    if times is None:
        numbers = list(numbers_of([path.stem for path in paths]))
        if not numbers or min(numbers) < _LEAST_NS:
            raise DataError(f"the images in {folder} have no times", "give --times FILE, one time a line")
        return numbers
    found = [_time_ns(line.split()[0], times) for line in _lines(times)]
    if len(found) != len(paths):
        raise DataError(
            f"{times} has {counted(len(found), 'time')}, {folder} has {counted(len(paths), 'image')}",
            "give one time for each image",
        )
    return found


def _lines(path: Path) -> list[str]:
    try:
        text = read_whole(path, _MOST_TIMES_BYTES).decode("utf-8", "replace")
    except OSError as error:
        raise DataError(f"{path} cannot be read ({error.strerror})", "check its name") from None
    return [line.strip() for line in text.splitlines() if line.strip() and not line.startswith("#")]


def _time_ns(text: str, path: Path) -> int:
    """Read a time: seconds, or whole nanoseconds."""
    whole, dot, rest = text.strip().partition(".")
    if whole.isdecimal() and not dot and int(whole) >= _LEAST_NS:
        return int(whole)
    try:
        if whole.isdecimal() and (not dot or rest.isdecimal()):
            return int(whole) * 10**9 + int((rest + "0" * 9)[:9])
        return round(float(text) * 1e9)
    except (ValueError, OverflowError):
        raise DataError(f"{path}: {text[:40]!r} is no time", "give seconds, or whole nanoseconds") from None
