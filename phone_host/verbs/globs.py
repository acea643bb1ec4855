"""Sorts what a shell made of two unquoted globs back into the left and the right images. Light."""

import re
from collections.abc import Callable, Sequence
from itertools import groupby
from pathlib import PurePath
from typing import Final

from common.errors import SettingsError

_QUOTE: Final = "put quotes around each glob, such as 'left*.png' 'right*.png'"
_SHOWN: Final = 3


def two_lists(paths: Sequence[str]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Divide a command's positional arguments into those of the left and those of the right side.

    Two arguments are a side each. More come from globs that the shell expanded. They belong together by folder, else by
    name without its digits (left1 left2 right1 right2); else the first half is the left side, if the names are in order
    in each half but not across them, as a shell leaves two globs.

    Args:
        paths: the arguments, in the order given: files, folders or globs.

    Returns:
        Left, right; neither is empty.

    Raises:
        SettingsError: there are fewer than two, or they do not fall into two groups.
    """
    if len(paths) < 2:
        raise SettingsError(
            f"only one side is given{f' ({paths[0]})' if paths else ''}", "give LEFT and RIGHT: files, folders or globs"
        )
    if len(paths) == 2:
        return (paths[0],), (paths[1],)
    for key in (_folder, _without_digits):
        groups = _grouped(paths, key)
        if len(groups) == 2:
            return groups[0], groups[1]
    half = len(paths) // 2
    descents = [index for index in range(1, len(paths)) if paths[index].casefold() < paths[index - 1].casefold()]
    if len(paths) == 2 * half and descents == [half]:
        return tuple(paths[:half]), tuple(paths[half:])
    shown = " ".join(paths[:_SHOWN])
    raise SettingsError(
        f"{len(paths)} images are given ({shown} ...), and it is not clear which of them are LEFT and which RIGHT",
        _QUOTE,
    )


def _folder(path: str) -> str:
    return str(PurePath(path).parent)


def _without_digits(path: str) -> str:
    return re.sub(r"[0-9]+", "#", path)


def _grouped(paths: Sequence[str], key: Callable[[str], str]) -> list[tuple[str, ...]]:
    """Group neighbours that have the same key; what a shell makes of one glob stands together."""
    return [tuple(group) for _, group in groupby(paths, key)]
