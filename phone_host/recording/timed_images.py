"""The images of a data set's two folders, each with its time: of data.csv, a file of times, its name, or a rate that is given."""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path
from typing import Final

from common.camera.image_numbers import MOST_SPAN, numbers_of
from common.camera.replay import find_images
from common.errors import DataError
from common.files import read_input
from common.words import counted
from phone_host.recording.import_rules import Unit, at_rate, dated_unit, numbers_in, times_ns, usual_step

_MOST_TIMES_BYTES: Final = 64 << 20
_SECONDS: Final = re.compile(r"[0-9]{1,12}\.[0-9]{1,9}")
"""A name that is a time in seconds, as TUM's data sets have it."""

_LEAST_STEP_OF_TIMES: Final = 1000
"""Numbers with a larger step are times: who counts images does not leave out a thousand each time."""


@dataclass(frozen=True, slots=True)
class TimeOptions:
    """What is given about the times of images.

    Attributes:
        times: file with the time of each image, one a line; None: the data set has one, or the names are times.
        fps: images per second, instead of all that; None: the times count.
        unit: of the times; None: what is plausible.
    """

    times: Path | None = None
    fps: float | None = None
    unit: Unit | None = None


@dataclass(frozen=True, slots=True)
class TimedImage:
    """An image in a file, and when it was exposed, ns."""

    path: Path
    stamp_ns: int


def timed_images(folders: tuple[Path, Path], options: TimeOptions) -> tuple[list[TimedImage], list[TimedImage]]:
    """Return the images of both folders in the order of their times.

    Raises:
        DataError: there are no images, or their times are not known or cannot be true.
        UnavailableError: a folder cannot be read.
    """
    if options.fps is not None:
        return _at_rate(folders, options.fps)
    left, right = (_timed(folder, options) for folder in folders)
    for folder, found in zip(folders, (left, right), strict=True):
        if not found:
            raise DataError(f"{folder} holds no images", "give a folder with images")
    return left, right


def _at_rate(folders: tuple[Path, Path], fps: float) -> tuple[list[TimedImage], list[TimedImage]]:
    """Return images that came at a rate, by the numbers in their names: one that is missing leaves its time free."""
    paths = [find_images(str(folder)) for folder in folders]
    places = _places([_numbers_in_names(each) for each in paths]) or [list(range(len(each))) for each in paths]
    sides = []
    for each, of in zip(paths, places, strict=True):
        stamps = at_rate(of, fps)
        sides.append(_sorted([TimedImage(path, at) for path, at in zip(each, stamps, strict=True)]))
    return sides[0], sides[1]


def _places(sides: Sequence[Sequence[Decimal]]) -> list[list[int]]:
    """Return which image of both films each one is, from 0; empty if the numbers in their names do not tell."""
    if not all(sides):
        return []
    first = min(number for each in sides for number in each)
    step = min(usual_step(sorted(each)) for each in sides)
    if step < _LEAST_STEP_OF_TIMES and not all(dated_unit(each) for each in sides):
        step = Decimal(1)  # counted, not timed: a number that is missing is an image that is missing
    places = [[math.floor((number - first) / step + Decimal("0.5")) for number in each] for each in sides]
    is_told = all(len(set(each)) == len(each) and max(each) < MOST_SPAN for each in places)
    return places if is_told else []


def _timed(folder: Path, options: TimeOptions) -> list[TimedImage]:
    listed = next((each for each in (folder / "data.csv", folder.parent / "data.csv") if each.is_file()), None)
    if options.times is None and listed is not None:
        return _listed(folder, listed, options.unit)
    paths = find_images(str(folder))
    if options.times is None:
        stamps = _named(paths, options.unit, folder)
    else:
        numbers = numbers_in([line.split()[0] for line in _lines(options.times)], str(options.times))
        if len(numbers) != len(paths):
            raise DataError(
                f"{options.times} has {counted(len(numbers), 'time')}, {folder} has {counted(len(paths), 'image')}",
                "give one time for each image",
            )
        stamps = times_ns(numbers, options.unit, str(options.times))
    return _sorted([TimedImage(path, at) for path, at in zip(paths, stamps, strict=True)])


def _listed(folder: Path, listed: Path, unit: Unit | None) -> list[TimedImage]:
    """Return the images that a table names, as EuRoC has it: time, name. A first line without a number is its head."""
    images = folder / "data" if (folder / "data").is_dir() else folder
    rows = [[part.strip() for part in line.split(",")] for line in _lines(listed)]
    rows = [row for row in rows if len(row) > 1]
    if rows and not rows[0][0][:1].isdigit():
        del rows[0]
    numbers = numbers_in([row[0] for row in rows], str(listed))
    ordered = sorted(zip(numbers, (row[1] for row in rows), strict=True), key=lambda each: each[0])
    stamps = times_ns([number for number, _ in ordered], unit, str(listed))
    if any("\0" in name for _, name in ordered):
        raise DataError(f"{listed} names an image that cannot be", "write it again")
    return [TimedImage(images / name, at) for (_, name), at in zip(ordered, stamps, strict=True)]


def _named(paths: Sequence[Path], unit: Unit | None, folder: Path) -> list[int]:
    """Return the times that are the images' names."""
    numbers = _numbers_in_names(paths)
    if not numbers:
        raise DataError(
            f"the images in {folder} have no times", "give --times FILE, one time a line, or the rate as --fps N"
        )
    order = sorted(range(len(numbers)), key=numbers.__getitem__)
    stamps = times_ns([numbers[place] for place in order], unit, str(folder), are_times=False)
    by_place = dict(zip(order, stamps, strict=True))
    return [by_place[place] for place in range(len(numbers))]


def _numbers_in_names(paths: Sequence[Path]) -> list[Decimal]:
    """Return the number or the seconds in each image's name; empty if the names are not numbered."""
    stems = [path.stem for path in paths]
    if len(stems) > 1 and all(_SECONDS.fullmatch(stem) for stem in stems):
        return [Decimal(stem) for stem in stems]
    return [Decimal(number) for number in numbers_of(stems)]


def _sorted(images: list[TimedImage]) -> list[TimedImage]:
    return sorted(images, key=lambda each: each.stamp_ns)


def _lines(path: Path) -> list[str]:
    text = read_input(path, _MOST_TIMES_BYTES, "check its name").decode("utf-8-sig", "replace")
    return [line.strip() for line in text.splitlines() if line.strip() and not line.startswith("#")]
