"""Pairs the images of the left and the right camera: by the number in the name, else in name order."""

import glob
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from common.errors import DataError, SettingsError

SUFFIXES: Final = frozenset({".bmp", ".jpeg", ".jpg", ".pgm", ".png", ".pnm", ".ppm", ".tif", ".tiff", ".webp"})
_UNREAD: Final = frozenset({".heic", ".heif", ".avif"})
"""Photographs of phones that are not read."""

_REMEDY: Final = "give an image, a folder of images or a quoted glob such as 'left*.png'"
_MOST_KINDS: Final = 4  # enough to recognise a folder by; the line stays short
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


def pair_files(left: str | Sequence[str], right: str | Sequence[str]) -> ViewFiles:
    """Find the images of both sides and pair them.

    Args:
        left: an image file, a folder or a glob; or several, as a shell makes them of one glob.
        right: the same kind.

    Returns:
        The pairs.

    Raises:
        DataError: one of the two names no image.
        SettingsError: both name the same files, or one is a folder and the other a file.
    """
    lefts, rights = ((given,) if isinstance(given, str) else tuple(given) for given in (left, right))
    both_single = len(lefts) == len(rights) == 1
    if both_single:
        _require_one_kind(lefts[0], rights[0])
    left_files, right_files = _images_of(lefts, "LEFT"), _images_of(rights, "RIGHT")
    _require_two_sides(lefts[0], left_files, right_files)
    if (
        both_single and Path(lefts[0]).is_file() and Path(rights[0]).is_file()
    ):  # whatever their numbers: the user names this pair
        [first], [second] = left_files, right_files
        return ViewFiles(((first.stem, first, second),), (), (), by_number=False)
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


def _require_one_kind(left: str, right: str) -> None:
    """Refuse a folder beside a single file: only one pair could come of it, and hardly the one that is meant."""
    for folder, file, names in ((left, right, ("LEFT", "RIGHT")), (right, left, ("RIGHT", "LEFT"))):
        if Path(folder).is_dir() and Path(file).is_file():
            raise SettingsError(
                f"{names[0]} {folder} is a folder, {names[1]} {file} is a file", "give two files, or two folders"
            )


def _require_two_sides(given: str, left: list[Path], right: list[Path]) -> None:
    """Refuse files that are on both sides."""
    both = {path.resolve() for path in left} & {path.resolve() for path in right}
    if not both:
        return
    if Path(given).is_file():
        remedy = "give the image of the other camera as RIGHT"
    else:
        folder = given if Path(given).is_dir() else str(Path(given).parent)
        remedy = f"give two folders, or one quoted glob for each side, such as '{folder}/left*' '{folder}/right*'"
    raise SettingsError(f"LEFT and RIGHT both name {min(both)}", remedy)


def _images_of(given: Sequence[str], side: str) -> list[Path]:
    """Return the image files of all arguments of a side, each once, in the order of `_images`."""
    found = {path for each in given for path in _images(each, side)}
    if len(given) > 1:  # a shell's glob also catches Thumbs.db
        found = {path for path in found if path.suffix.lower() in SUFFIXES} or found
    return sorted(found, key=_natural)


def _images(given: str, side: str) -> list[Path]:
    """Return the image files of a file's name, a folder or a glob, without hidden ones, sorted with numbers in names as numbers."""
    path = Path(given)
    if path.is_file():
        return [path]
    if path.is_dir():
        inside = [entry for entry in path.iterdir() if entry.is_file() and not entry.name.startswith(".")]
        files = [entry for entry in inside if entry.suffix.lower() in SUFFIXES]
        # A folder of nothing else: whoever opens one says how to convert it.
        files = files or [entry for entry in inside if entry.suffix.lower() in _UNREAD]
        if not files:
            if not inside:
                raise DataError(f"{side} {given!r} names no image", _REMEDY)
            kinds = sorted({entry.suffix.lower() or "no suffix" for entry in inside})
            shown = ", ".join(kinds[:_MOST_KINDS])
            raise DataError(f"{side} {given!r} names no image, only {len(inside)} other files ({shown})", _REMEDY)
    else:
        found = [Path(name) for name in glob.glob(given)]  # noqa: PTH207 - a pattern may be absolute
        files = [entry for entry in found if entry.is_file() and not entry.name.startswith(".")]
        if not files:
            what = "names no image" if glob.has_magic(given) else "does not exist"
            raise DataError(f"{side} {given!r} {what}", _REMEDY)
        # A wide pattern also catches Thumbs.db; one of nothing but unusual names is meant as it is.
        files = [entry for entry in files if entry.suffix.lower() in SUFFIXES] or files
    return sorted(files, key=_natural)


def _natural(path: Path) -> tuple[list[tuple[int, str]], str]:
    """Return a sort key in which digits compare as numbers and the rest as text."""
    parts = re.split(r"(\d+)", path.name)
    return [(int(part), "") if part.isdigit() else (-1, part) for part in parts], str(path)


def _numbered(left: list[Path], right: list[Path]) -> tuple[dict[int, Path], dict[int, Path]] | None:
    """Return the files by the number in their names; None if no number tells each side's files apart and occurs on both sides.

    Names may hold more than one number (`cam0_0012`, `0012_cam1`). The one that counts the views is at the place,
    counted from the end, that pairs most files. Files without a number there stay alone. The folder's name belongs to
    the name, so what a run has saved is paired by the folders' numbers (`pair-000012/left.png`).
    """
    best: tuple[dict[int, Path], dict[int, Path]] | None = None
    most = 0
    for place in range(1, 1 + max(len(_numbers(path)) for path in (*left, *right))):
        sides = _by_number(left, place), _by_number(right, place)
        shared = len(sides[0].keys() & sides[1].keys())
        if shared > most:
            best, most = sides, shared
    return best


def _by_number(files: list[Path], place: int) -> dict[int, Path]:
    """Return the files by the number at a place; empty if two files share one there."""
    numbers = [(path, _numbers(path)) for path in files]
    found = [(int(parts[-place]), path) for path, parts in numbers if len(parts) >= place]
    by_number = dict(found)
    return by_number if len(by_number) == len(found) else {}


def _numbers(path: Path) -> list[str]:
    return _NUMBER.findall(f"{path.absolute().parent.name}/{path.stem}")
