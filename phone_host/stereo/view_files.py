"""Pairs the images of the left and the right camera: by the number in the name, else in name order."""

import glob
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from common.errors import DataError, SettingsError
from common.name_order import DIGITS, name_order
from common.places import Kind, kind_of, resolved
from common.words import counted

SUFFIXES: Final = frozenset({".bmp", ".jpeg", ".jpg", ".pgm", ".png", ".pnm", ".ppm", ".tif", ".tiff", ".webp"})
_UNREAD: Final = frozenset({".heic", ".heif", ".avif"})
"""Photographs of phones that are not read."""

_OTHERS: Final = frozenset({"", ".db", ".html", ".ini", ".json", ".md", ".txt", ".xml", ".yaml", ".yml"})
"""Files beside images that nobody takes for some; folders, too, have no suffix."""

_FILMS: Final = frozenset({".mp4", ".m4v", ".mov", ".avi", ".mkv", ".webm", ".3gp"})
_FROM_FILMS: Final = (
    "take pictures of the same moments out of both films first, such as: ffmpeg -i left.mp4 -vf fps=1 left/%03d.png"
)

_REMEDY: Final = "give an image, a folder of images or a quoted glob such as 'left*.png'"
_MOST_KINDS: Final = 4  # enough to recognise a folder by; the line stays short
_SHOWN: Final = 40  # of a pattern with hundreds of folders


@dataclass(frozen=True, slots=True)
class ViewFiles:
    """Files of the two sides.

    Attributes:
        pairs: (name, left file, right file), in order.
        left_alone: files of the left side without a partner.
        right_alone: files of the right side without a partner.
        by_number: whether files were paired by the numbers in their names.
        by_name: whether they were paired by equal names; if neither, by order.
    """

    pairs: tuple[tuple[str, Path, Path], ...]
    left_alone: tuple[Path, ...]
    right_alone: tuple[Path, ...]
    by_number: bool
    by_name: bool = False


def pair_files(left: str | Sequence[str], right: str | Sequence[str]) -> ViewFiles:
    """Find the images of both sides and pair them.

    Args:
        left: an image file, a folder or a glob; or several, as a shell makes them of one glob.
        right: the same kind.

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
    # Whatever their numbers: the user names this pair.
    if both_single and _kind(lefts[0], "LEFT") is _kind(rights[0], "RIGHT") is Kind.FILE:
        [first], [second] = left_files, right_files
        return ViewFiles(((first.stem, first, second),), (), (), by_number=False)
    numbered = _numbered(left_files, right_files)
    if numbered is None and (named := _named(left_files, right_files)) is not None:
        return named
    if numbered is None:
        count = min(len(left_files), len(right_files))
        pairs = tuple((a.stem, a, b) for a, b in zip(left_files, right_files, strict=False))
        return ViewFiles(pairs, tuple(left_files[count:]), tuple(right_files[count:]), by_number=False)
    left_numbers, right_numbers = numbered
    shared = sorted(left_numbers.keys() & right_numbers.keys())
    return ViewFiles(
        pairs=tuple((str(number), left_numbers[number], right_numbers[number]) for number in shared),
        left_alone=_others(left_files, {left_numbers[n] for n in shared}),
        right_alone=_others(right_files, {right_numbers[n] for n in shared}),
        by_number=True,
    )


def _others(files: list[Path], paired: set[Path]) -> tuple[Path, ...]:
    return tuple(path for path in files if path not in paired)


def _named(left: list[Path], right: list[Path]) -> ViewFiles | None:
    """Pair files of equal names, or files in folders of equal names; None if no name is on both sides.

    By their order alone the pairs would shift after a missing one.
    """
    for name_of in (_stem, _folder):
        lefts, rights = ({name_of(path): path for path in side} for side in (left, right))
        shared = [name for name in lefts if name in rights]
        if shared and len(lefts) == len(left) and len(rights) == len(right):
            return ViewFiles(
                pairs=tuple((name, lefts[name], rights[name]) for name in shared),
                left_alone=_others(left, {lefts[name] for name in shared}),
                right_alone=_others(right, {rights[name] for name in shared}),
                by_number=False,
                by_name=True,
            )
    return None


def _stem(path: Path) -> str:
    return path.stem


def _folder(path: Path) -> str:
    return path.absolute().parent.name


def _require_one_kind(left: str, right: str) -> None:
    """Refuse a folder beside a single file: only one pair could come of it, and hardly the one that is meant."""
    kinds = {left: _kind(left, "LEFT"), right: _kind(right, "RIGHT")}
    for folder, file, names in ((left, right, ("LEFT", "RIGHT")), (right, left, ("RIGHT", "LEFT"))):
        if kinds[folder] is Kind.FOLDER and kinds[file] is Kind.FILE:
            raise SettingsError(
                f"{names[0]} {folder} is a folder, {names[1]} {file} is a file", "give two files, or two folders"
            )


def _require_two_sides(given: str, left: list[Path], right: list[Path]) -> None:
    """Refuse files that are on both sides."""
    both = set(map(resolved, left)) & set(map(resolved, right))
    if not both:
        return
    kind = _kind(given, "LEFT")
    if kind is Kind.FILE:
        remedy = "give the image of the other camera as RIGHT"
    else:
        folder = given if kind is Kind.FOLDER else str(Path(given).parent)
        remedy = f"give two folders, or one quoted glob for each side, such as '{folder}/left*' '{folder}/right*'"
    raise SettingsError(f"LEFT and RIGHT both name {min(both)}", remedy)


def _images_of(given: Sequence[str], side: str) -> list[Path]:
    """Return the image files of all arguments of a side, each once, in the order of `_images`."""
    found = {path for each in given for path in _images(each, side)}
    if len(given) > 1:  # a shell's glob also catches Thumbs.db
        found = {path for path in found if path.suffix.lower() in SUFFIXES} or found
    return sorted(found, key=name_order)


def _kind(given: str | Path, side: str) -> Kind:
    """Return what a path is.

    Raises:
        DataError: that cannot be told.
    """
    try:
        return kind_of(given)
    except OSError as error:
        raise _unreadable(str(given), side, error) from None


def _unreadable(given: str, side: str, error: OSError) -> DataError:
    return DataError(f"{side} {given!r} cannot be read ({error.strerror})", "check its name and your permissions")


def _images(given: str, side: str) -> list[Path]:
    """Return the image files of a file's name, a folder or a glob, without hidden ones, sorted with numbers in names as numbers."""
    match kind := _kind(given, side):
        case Kind.FILE:
            return [Path(given)]
        case Kind.FOLDER:
            files = _inside(given, side)
        case Kind.MISSING:
            files = _matching(given, side)
        case _:
            raise DataError(f"{side} {given!r} is {kind.value}, no file of an image", _REMEDY)
    return sorted(files, key=name_order)


def _inside(folder: str, side: str) -> list[Path]:
    try:
        entries = [entry for entry in Path(folder).iterdir() if not entry.name.startswith(".")]
    except OSError as error:
        raise _unreadable(folder, side, error) from None
    kinds_of = {entry: _kind_or_error(entry) for entry in entries}
    failure = next((kind for kind in kinds_of.values() if isinstance(kind, OSError)), None)
    inside = [entry for entry, kind in kinds_of.items() if kind is Kind.FILE]
    if not inside and failure is not None:  # a folder that may be listed, and not searched
        raise _unreadable(folder, side, failure)
    files = [entry for entry in inside if entry.suffix.lower() in SUFFIXES]
    # A folder of nothing else: whoever opens one says how to convert it.
    files = files or [entry for entry in inside if entry.suffix.lower() in _UNREAD]
    if files:
        return files
    if not entries:
        raise DataError(f"{side} {folder!r} is empty", _REMEDY)
    if not inside:
        folders = sorted(entry.name for entry, kind in kinds_of.items() if kind is Kind.FOLDER)
        if not folders:
            raise DataError(f"{side} {folder!r} names no image", _REMEDY)
        some = " and ".join(folders[:2]) + (" ..." if folders[2:] else "")
        raise DataError(f"{side} {folder!r} holds only folders ({some})", "give the folder of one camera's images")
    kinds = sorted({entry.suffix.lower() or "no suffix" for entry in inside})
    shown = ", ".join(kinds[:_MOST_KINDS])
    remedy = _REMEDY if _FILMS.isdisjoint(kinds) else _FROM_FILMS
    raise DataError(f"{side} {folder!r} names no image, only {counted(len(inside), 'other file')} ({shown})", remedy)


def _kind_or_error(path: Path) -> Kind | OSError:
    try:
        return kind_of(path)
    except OSError as error:
        return error


def passed_over(given: Sequence[str]) -> tuple[Path, ...]:
    """Return what lies in folders among the images, could be one by its name, and is not read.

    Args:
        given: as `pair_files` takes a side; folders count.
    """
    found = []
    for folder in map(Path, given):
        if _kind_or_error(folder) is not Kind.FOLDER:
            continue
        with suppress(OSError):
            for entry in folder.iterdir():
                is_file = _kind_or_error(entry) is Kind.FILE
                is_image = entry.suffix.lower() in SUFFIXES
                if not entry.name.startswith(".") and (is_image != is_file) and entry.suffix.lower() not in _OTHERS:
                    found.append(entry)
    return tuple(sorted(found, key=name_order))


def is_unread_photograph(path: Path) -> bool:
    """Return whether a name is that of a photograph of a kind that is not read."""
    return path.suffix.lower() in _UNREAD


def _matching(pattern: str, side: str) -> list[Path]:
    try:
        found = [Path(name) for name in glob.glob(pattern)]  # noqa: PTH207 - a pattern may be absolute
    except RecursionError:
        raise DataError(f"{side} {pattern[:_SHOWN]!r} ... has too many folders", _REMEDY) from None
    files = [entry for entry in found if not entry.name.startswith(".") and _kind(entry, side) is Kind.FILE]
    if not files:
        what = "names no image" if glob.has_magic(pattern) else "does not exist"
        raise DataError(f"{side} {pattern!r} {what}", _REMEDY)
    # A wide pattern also catches Thumbs.db; one of nothing but unusual names is meant as it is.
    return [entry for entry in files if entry.suffix.lower() in SUFFIXES] or files


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
    return DIGITS.findall(f"{path.absolute().parent.name}/{path.stem}")
