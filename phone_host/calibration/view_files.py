"""Pairs the images of the left and the right camera: by the number in the name, else in name order."""

import glob
import re
from dataclasses import dataclass
from pathlib import Path

from common.errors import DataError, SettingsError

_SUFFIXES = frozenset({".bmp", ".jpeg", ".jpg", ".pgm", ".png", ".pnm", ".ppm", ".tif", ".tiff", ".webp"})
_NUMBER = re.compile(r"\d+")


@dataclass(frozen=True, slots=True)
class ViewFiles:
    """Files of the two sides.

    Attributes:
        pairs: (name, left file, right file), in order.
        left_alone: files of the left side without a partner.
        right_alone: files of the right side without a partner.
        by_number: whether files were paired by the numbers in their names; otherwise by order.
    """

    pairs: tuple[tuple[str, Path, Path], ...]
    left_alone: tuple[Path, ...]
    right_alone: tuple[Path, ...]
    by_number: bool


def pair_files(left: str, right: str) -> ViewFiles:
    """Find the images of both sides and pair them.

    Args:
        left: a folder or a glob.
        right: a folder or a glob.

    Returns:
        The pairs.

    Raises:
        DataError: one of the two names no image.
        SettingsError: both name the same files.
    """
    left_files, right_files = _images(left, "LEFT"), _images(right, "RIGHT")
    both = {path.resolve() for path in left_files} & {path.resolve() for path in right_files}
    if both:
        folder = left if Path(left).is_dir() else str(Path(left).parent)
        raise SettingsError(
            f"LEFT and RIGHT both name {min(both)}",
            f"give two folders, or one quoted glob for each side, such as '{folder}/left*' '{folder}/right*'",
        )
    numbered = _numbered(left_files, right_files)
    if numbered is None:
        count = min(len(left_files), len(right_files))
        pairs = tuple((a.stem, a, b) for a, b in zip(left_files, right_files, strict=False))
        return ViewFiles(pairs, tuple(left_files[count:]), tuple(right_files[count:]), by_number=False)
    left_numbers, right_numbers = numbered
    shared = sorted(left_numbers.keys() & right_numbers.keys())
    return ViewFiles(
        pairs=tuple((str(number), left_numbers[number], right_numbers[number]) for number in shared),
        left_alone=tuple(path for path in left_files if path not in {left_numbers[n] for n in shared}),
        right_alone=tuple(path for path in right_files if path not in {right_numbers[n] for n in shared}),
        by_number=True,
    )


def _images(given: str, side: str) -> list[Path]:
    """Return the image files of a folder or a glob, without hidden ones, sorted with numbers in names as numbers."""
    if Path(given).is_dir():
        found = [path for path in Path(given).iterdir() if path.suffix.lower() in _SUFFIXES]
    else:
        found = [Path(name) for name in glob.glob(given)]  # noqa: PTH207 - a pattern may be absolute
    files = [path for path in found if path.is_file() and not path.name.startswith(".")]
    if not files:
        raise DataError(
            f"{side} {given!r} names no image", "give a folder of images or a quoted glob such as 'left*.png'"
        )
    return sorted(files, key=_natural)


def _natural(path: Path) -> tuple[list[tuple[int, str]], str]:
    """Return a sort key in which digits compare as numbers and the rest as text."""
    parts = re.split(r"(\d+)", path.name)
    return [(int(part), "") if part.isdigit() else (-1, part) for part in parts], str(path)


def _numbered(left: list[Path], right: list[Path]) -> tuple[dict[int, Path], dict[int, Path]] | None:
    """Return the files by the number in their names; None if no number tells each side's files apart and occurs on both sides.

    Names may hold more than one number (`cam0_0012`, `0012_cam1`). The one that counts the views is at the place,
    counted from the end, that pairs most files. Files without a number there stay alone.
    """
    best: tuple[dict[int, Path], dict[int, Path]] | None = None
    most = 0
    for place in range(1, 1 + max(len(_NUMBER.findall(path.stem)) for path in (*left, *right))):
        sides = _by_number(left, place), _by_number(right, place)
        shared = len(sides[0].keys() & sides[1].keys())
        if shared > most:
            best, most = sides, shared
    return best


def _by_number(files: list[Path], place: int) -> dict[int, Path]:
    """Return the files by the number at a place; empty if two files share one there."""
    numbers = [(path, _NUMBER.findall(path.stem)) for path in files]
    found = [(int(parts[-place]), path) for path, parts in numbers if len(parts) >= place]
    by_number = dict(found)
    return by_number if len(by_number) == len(found) else {}
