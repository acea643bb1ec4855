"""Turns a recording into folders of images with their times, and folders of other data sets into a recording.

Written are left/ and right/ with one file for each image, named by its exposure in ns since 1970, beside data.csv as EuRoC and times.txt as TUM
have it. Read are these folders, KITTI's (image_0, image_1 or image_2, image_3 with times.txt), EuRoC's (cam0, cam1 with data.csv) and any two
folders with a file of times.
"""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import starmap
from pathlib import Path
from typing import Final

from common.appearing import new_folder
from common.camera.imagefile import load
from common.errors import DataError, SettingsError, UnavailableError
from common.frame import PixelFormat, SpoiledImageError
from common.imagesize.head import size_text
from common.places import make_folder
from common.recording.layout import ABOUT, About, image_topic
from common.recording.opened import open_recorded
from common.recording.recorded import Recorded, Shown, retimed, size_px
from common.recording.recording_file import written
from common.recording.ros_messages import RecordedImage, image_message, image_type
from common.versions import all_versions
from common.words import counted, listed
from phone_host.output.atomic import write_bytes, write_text
from phone_host.output.preview import write_png
from phone_host.recording.both_sides import encoded, topics_of
from phone_host.recording.import_rules import ImportAccount, Size, at_rate, usual_size
from phone_host.recording.timed_images import TimedImage, TimeOptions, timed_images
from phone_host.stereo.raw_images import decode_frame

_SIDES: Final = ("left", "right")
_SUFFIX: Final = {PixelFormat.MJPEG: ".jpg", PixelFormat.PNG: ".png"}
_LONGEST_NAME_BYTES: Final = 255
_PAIRS: Final = (("image_0", "image_1"), ("image_2", "image_3"), ("cam0/data", "cam1/data"), ("left", "right"))


def export_folders(recorded: Recorded, out: Path) -> dict[str, int]:
    """Write the images of both sides. The folder appears whole or not at all.

    Args:
        recorded: the recording.
        out: the folder; it must not exist.

    Raises:
        SpoiledImageError: every image of a side is spoiled.
        UnavailableError: the folder is there already, or cannot be written.
    """
    counts = {}
    try:
        make_folder(out.parent)
        with new_folder(out) as folder:
            for side in _SIDES:
                topic = recorded.topic_of(side)
                counts[side] = _export(recorded, topic, folder / side) if topic else 0
            for name, data in recorded.attachments.items():
                if _is_plain(name):
                    write_bytes(folder / name, bytes(data))
    except FileExistsError:
        raise UnavailableError(f"{out} exists already", "name another folder") from None
    except OSError as error:
        raise UnavailableError(
            f"{out} cannot be written ({error.strerror})", "make room, or name another folder"
        ) from None
    return counts


def _is_plain(name: str) -> bool:
    """Return whether a file of this name lies in its folder, on any system, and beside ours."""
    is_name = Path(name).name == name and name not in {*_SIDES, "..", "."} and "\\" not in name
    return is_name and name.isprintable() and len(name.encode("utf-8", "replace")) <= _LONGEST_NAME_BYTES


def _export(recorded: Recorded, topic: str, folder: Path) -> int:
    camera = recorded.camera(topic)
    folder.mkdir()
    rows: list[tuple[int, str]] = []
    taken: dict[int, int] = {}
    for shown in recorded.images[topic]:
        image = shown.image
        suffix = _SUFFIX.get(image.pixel_format)
        again = taken[image.stamp_ns] = taken.get(image.stamp_ns, -1) + 1
        name = f"{image.stamp_ns}{f'-{again}' if again else ''}{suffix or '.png'}"
        if suffix is None:
            write_png(folder / name, decode_frame(encoded(shown, camera, name)))
        else:
            write_bytes(folder / name, memoryview(image.payload))
        rows.append((image.stamp_ns, name))
    write_text(folder / "data.csv", "".join(["#timestamp [ns],filename\n", *(f"{at},{name}\n" for at, name in rows)]))
    write_text(folder / "times.txt", "".join(f"{at / 1e9:.9f} {name}\n" for at, name in rows))
    return len(rows)


def import_folders(paths: Sequence[Path], options: TimeOptions, out: Path) -> ImportAccount:
    """Write a recording from folders of images.

    Args:
        paths: one folder of a data set, or the left and the right folder.
        options: what is given about the times of the images.
        out: the recording; it must not exist.

    Raises:
        SettingsError: the folders are none of those known.
        DataError: a folder is missing, images have no times, or none that can be true, or one has another size than the others of its folder.
        UnavailableError: a folder cannot be read, or the file not be made.
    """
    folders, times = _folders(paths, options.times)
    sides = timed_images(folders, replace(options, times=times))
    sizes_px: dict[str, dict[Path, Size]] = {side: {} for side in _SIDES}
    with written(out) as file:
        file.tell(ABOUT, About(versions=all_versions()).values())
        for side, sequence, timed in _in_order(sides):
            image = load(timed.path)
            size = sizes_px[side][timed.path] = (image.width_px, image.height_px)
            recorded = RecordedImage(timed.stamp_ns, side, image.pixel_format, size, image.payload)
            topic, at_ns = image_topic(side, image_type(image.pixel_format)), timed.stamp_ns
            file.add(topic, image_message(recorded), sequence=sequence, log_ns=at_ns, publish_ns=at_ns)
        for side in _SIDES:
            _require_one_size(sizes_px[side])
    remarks = (f"the images are taken for {options.fps:g} a second",) if options.fps else ()
    return ImportAccount(dict(zip(_SIDES, map(len, sides), strict=True)), remarks)


def _require_one_size(sizes_px: Mapping[Path, Size]) -> None:
    """Refuse the images of one camera if one of them has another size than most."""
    usual = usual_size(tuple(sizes_px.values()))
    for path, size in sorted(sizes_px.items()):
        if usual is not None and size != usual:
            count = sum(each == usual for each in sizes_px.values())
            raise DataError(
                f"{path} is {size_text(size)}, but {count} of the {len(sizes_px)} images beside it"
                f" are {size_text(usual)}",
                "remove it from the folder, or give images of one size",
            )


def _in_order(sides: Sequence[list[TimedImage]]) -> Iterator[tuple[str, int, TimedImage]]:
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


@dataclass(frozen=True, slots=True)
class ImportOptions:
    """What is taken from a recording, and when it was.

    Attributes:
        topics: those of the left and of the right images; None: those whose names say so, else the first two.
        fps: images per second, instead of all times in it; None: its own times.
    """

    topics: Sequence[str] | None = None
    fps: float | None = None


def import_topics(source: Path, options: ImportOptions, out: Path) -> ImportAccount:
    """Write a recording with the images of two topics.

    Args:
        source: the MCAP file.
        options: what is taken from it.
        out: the recording; it must not exist.

    Raises:
        DataError: the source cannot be read, every image of a topic is spoiled, there are no such topics, or no two at all, or no time can be true.
        UnavailableError: the file cannot be made, or the disk is full.
    """
    found = open_recorded(source, needs_times=options.fps is None)
    chosen = list(options.topics or topics_of(found, source).values())
    if not set(chosen) <= set(found.images) or len(set(chosen)) < len(_SIDES):
        raise DataError(
            f"{source} holds no two such image topics, but {listed(sorted(found.images))}",
            "give two of them as --topics LEFT RIGHT",
        )
    for topic in chosen:
        found.camera(topic)  # refuses a stream all of whose images are spoiled
    remarks = [f"the images are taken for {options.fps:g} a second"] if options.fps else found.remarks
    streams = [_timed(_of_one_size(found.images[topic], topic, remarks), options.fps) for topic in chosen]
    every = [(shown, side) for side, stream in zip(_SIDES, streams, strict=True) for shown in stream]
    with written(out) as file:
        file.tell(ABOUT, About(versions=all_versions()).values())
        for shown, side in sorted(every, key=lambda item: item[0].log_ns):
            image = shown.image
            moved = replace(image.loaded(), frame_id=side)
            topic = image_topic(side, image_type(image.pixel_format))
            times = {"log_ns": shown.log_ns, "publish_ns": shown.publish_ns}
            file.add(topic, image_message(moved), sequence=shown.sequence, **times)
    counts = dict(zip(_SIDES, map(len, streams), strict=True))
    return ImportAccount(counts, tuple(remarks), _unused(found, chosen), tuple(found.damages))


def _of_one_size(stream: Sequence[Shown], topic: str, remarks: list[str]) -> list[Shown]:
    """Return the images that have the size which most of a topic's images have.

    Args:
        stream: the images.
        topic: whose they are.
        remarks: takes how many are left out, for each other size.
    """
    sizes_px = [_size(shown) for shown in stream]
    usual = usual_size(sizes_px)
    others = Counter(size for size in sizes_px if size is not None and size != usual)
    for size, count in others.items():
        assert usual is not None
        words = f"{counted(count, 'image')} of {topic} left out: {size_text(size)} instead of {size_text(usual)}"
        remarks.append(words)
    return [shown for shown, size in zip(stream, sizes_px, strict=True) if size not in others]


def _size(shown: Shown) -> Size | None:
    """Return an image's width and height, px; None: it is spoiled, which whoever decodes it reports."""
    try:
        return size_px(shown.image)
    except SpoiledImageError:
        return None


def _timed(shown: Sequence[Shown], fps: float | None) -> list[Shown]:
    if fps is None:
        return list(shown)
    return list(starmap(retimed, zip(shown, at_rate(range(len(shown)), fps), strict=True)))


def _unused(found: Recorded, chosen: Sequence[str]) -> dict[str, str]:
    """Return why each topic is not used."""
    reasons = {topic: each.reason for topic, each in found.unused.items()}
    others = dict.fromkeys(set(found.images) - set(chosen), "another camera; --topics names the two that are taken")
    return dict(sorted((reasons | others).items()))
