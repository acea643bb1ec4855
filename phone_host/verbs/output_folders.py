"""Checks where a verb's results go. Impossible targets are refused before the work; write errors carry a remedy."""

import os
import re
import sys
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Final

from common.errors import DataError, SettingsError, UnavailableError
from common.files import read_whole
from common.places import Kind, kind_of, nearest, resolved
from common.program.terminal import say
from phone_host.output.json_text import json_value
from phone_host.output.listed import ListedFolder, claim

REPORT: Final = "report.json"
PAGE: Final = "index.html"
_REPLACED: Final = (REPORT, PAGE)
"""What every command calls alike; the other results of two commands have different names or are computed from the same input."""

_MOST_REPORT_BYTES: Final = 16 << 20
"""A longer file is no report of ours."""

_COMMAND: Final = "command"
"""The key under which a report names the verb that wrote it."""

_OWN_KEYS: Final = (
    ("truth", "demo"),
    ("ended", "run"),
    ("matcher", "stereo"),
    ("left_alone", "stereo"),
    ("verdict", "calibrate"),
    ("time_offset_ns", "calibrate-time"),
)
"""For reports before that key: one that only this verb's report has, or only with one of those before it."""

_VERBS: Final = frozenset({"quality", "scan", *(verb for _, verb in _OWN_KEYS)})
"""No other name in a report becomes part of a file's name."""


def require_folder(out: Path) -> None:
    """Refuse an --out that exists and is not a folder.

    Raises:
        UnavailableError: it, or a parent of it, is not a folder.
    """
    _require_folder(out, out, "--out")


def claim_names(folder: Path, out: Path, *names: str) -> None:
    """Claim the names that a verb will write in a folder, or report that other files have them.

    Args:
        folder: folder of the files.
        out: the path that the user gave.
        names: names of the files.

    Raises:
        UnavailableError: such a file is not from an earlier run, or the folder cannot be written to.
    """
    try:
        claim(folder, *names)
    except OSError as error:
        raise unwritable(out, error) from error


def spare_inputs(out: Path, names: str, inputs: Mapping[str, Path]) -> None:
    """Refuse results that would replace the inputs.

    Args:
        out: folder for the results.
        names: pattern of the names in it that are replaced.
        inputs: the inputs, by the words that name them in an error.

    Raises:
        SettingsError: an input lies under such a name.
    """
    folder = resolved(out)
    for what, path in inputs.items():
        inside = resolved(path)
        if folder in inside.parents and re.fullmatch(names, inside.relative_to(folder).parts[0]):
            raise SettingsError(
                f"{what} {path} lies inside --out {out}, which is replaced", "give another folder with --out"
            )


def keep_other_report(folder: Path, command: str) -> None:
    """Move another command's report and page aside, which this one would replace, and say where they are.

    Args:
        folder: folder for the results.
        command: the verb whose results go there.

    Raises:
        UnavailableError: they are not ours to move, or the folder cannot be written to.
    """
    owner = _owner_of(folder / REPORT)
    if owner in {"", command}:
        return
    moves = {
        name: f"{Path(name).stem}-{owner}{Path(name).suffix}"
        for name in _REPLACED
        if kind_of(folder / name) is not Kind.MISSING
    }
    try:
        listed = ListedFolder(folder, "(?!)", kept="|".join(map(re.escape, (*moves, *moves.values()))))
        try:
            listed.add(*moves.values())
            for name, kept in moves.items():
                os.replace(name, kept, src_dir_fd=listed.descriptor, dst_dir_fd=listed.descriptor)
        finally:
            listed.close()
    except OSError as error:
        raise unwritable(folder, error) from error
    names = " and ".join(moves.values())
    say(f"phone-host: kept what {owner} had written in {folder} as {names}", sys.stderr)


def drop_page(folder: Path, command: str) -> None:
    """Remove the page that a command wrote earlier, where it now writes a report without one.

    Args:
        folder: folder for the results.
        command: the verb whose results go there.

    Raises:
        UnavailableError: the folder cannot be written to.
    """
    if _owner_of(folder / REPORT) != command or kind_of(folder / PAGE) is Kind.MISSING:
        return
    try:
        with suppress(UnavailableError):  # the user's own
            ListedFolder(folder, re.escape(PAGE)).close()
    except OSError as error:
        raise unwritable(folder, error) from error


def _owner_of(report: Path) -> str:
    """Return the verb that wrote a report; empty if there is none, or it does not say."""
    try:
        content = json_value(read_whole(report, _MOST_REPORT_BYTES))
    except (OSError, DataError, ValueError):
        return ""
    if not isinstance(content, dict):
        return ""
    named = content.get(_COMMAND)
    if named is not None:
        return named if isinstance(named, str) and named in _VERBS else ""
    return next((command for key, command in _OWN_KEYS if key in content), "")


def require_file(out: Path, option: str = "--out") -> None:
    """Refuse an output that exists and is not a regular file: replacing it would remove a folder, a device or a pipe.

    Args:
        out: the path that the user gave.
        option: the option with which it was given.

    Raises:
        UnavailableError: it is not a regular file, or a parent of it is not a folder.
    """
    _require_folder(out.parent, out, option)
    try:
        kind = kind_of(out)
    except OSError as error:
        raise unwritable(out, error, option) from None
    if kind not in {Kind.MISSING, Kind.FILE}:
        remedy = f"name a file in it with {option}" if kind is Kind.FOLDER else f"name another {option}"
        raise UnavailableError(f"{out} is {kind.value}, not a file", remedy)


def spare_names(out: Path, *names: str, option: str = "--out") -> None:
    """Refuse an output under a name that a verb writes beside it: one of the two would replace the other.

    Args:
        out: the path that the user gave.
        names: of what is written beside it.
        option: the option with which it was given.

    Raises:
        SettingsError: it has one of them.
    """
    if out.name.lower() in {name.lower() for name in names}:
        raise SettingsError(f"{option} {out} has the name of what is written beside it", f"name another {option}")


def unwritable(out: Path, error: OSError, option: str = "--out", *, beside: Path | None = None) -> UnavailableError:
    """Make the error for results that cannot be written.

    Args:
        out: the path that the user gave, or that of one result.
        error: the operating system's error.
        option: the option with which the path was given.
        beside: what was written already.

    Returns:
        The error to raise.
    """
    but = "" if beside is None or kind_of(beside) is Kind.MISSING else f"; {beside} is written"
    return UnavailableError(
        f"{out} cannot be written ({error.strerror}){but}",
        f"check that the folder exists, that you may write to it and that the disk has room, or name another {option}",
    )


def _require_folder(folder: Path, out: Path, option: str) -> None:
    try:
        there, kind = nearest(folder)
    except OSError as error:
        raise unwritable(out, error, option) from None
    if kind is not Kind.FOLDER:
        raise UnavailableError(f"{there} is {kind.value}, not a folder", f"name another {option}")
