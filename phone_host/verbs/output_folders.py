"""Checks where a verb's results go. Impossible targets are refused before the work; write errors carry a remedy."""

import os
import re
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final

from common.errors import DataError, SettingsError, UnavailableError
from common.files import read_whole
from common.places import Kind, kind_of, nearest, resolved
from common.program.terminal import say
from phone_host.output.folder_lock import lock_for_command
from phone_host.output.json_text import json_value
from phone_host.output.listed import ListedFolder
from phone_host.output.result_files import claim, remove_results, replacing_results

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


def require_alone(folder: Path, file: str = "", option: str = "--out") -> None:
    """Keep other programs from writing into a folder, or to one file in it, until this command ends.

    Args:
        folder: the folder; created if missing, unless only a file in it is meant.
        file: name of the file; empty: the whole folder.
        option: with which the user gave it.

    Raises:
        UnavailableError: another program writes there, or the folder cannot be written to.
    """
    try:
        lock_for_command(folder, file, option)
    except OSError as error:
        raise unwritable(folder / file, error, option) from error


@contextmanager
def written_together(out: Path, *names: str) -> Iterator[Path]:
    """Write files that take the place of an earlier command's if the block ends without an error; else those stay as they are.

    Args:
        out: the folder that the user gave; created if missing.
        names: names of the files.

    Yields:
        Where to write them.

    Raises:
        UnavailableError: such a file is not from an earlier command, another program writes there, or it cannot be written.
    """
    try:
        with replacing_results(out, "|".join(map(re.escape, names)), names) as place:
            yield place
    except OSError as error:
        raise unwritable(out, error) from error


@contextmanager
def written_beside(out: Path, *names: str) -> Iterator[Path]:
    """Write a file that the user named, and others beside it, as `written_together` does. The file need not be from an earlier command.

    Args:
        out: the file that the user named; its folder is created if missing.
        names: names of what is written beside it.

    Yields:
        The folder to write them in.

    Raises:
        UnavailableError: another program writes there, or it cannot be written.
    """
    try:
        with replacing_results(out.parent, "|".join(map(re.escape, names)), names) as place:
            yield place
    except OSError as error:
        raise unwritable(out.parent, error) from error


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
            remove_results(folder, re.escape(PAGE))
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


def unwritable(out: Path, error: OSError, option: str = "--out") -> UnavailableError:
    """Make the error for results that cannot be written.

    Args:
        out: the path that the user gave.
        error: the operating system's error; it may name a file in that path.
        option: the option with which the path was given.

    Returns:
        The error to raise.
    """
    named = Path(os.fsdecode(error.filename)) if isinstance(error.filename, str | bytes) else out
    return UnavailableError(
        f"{named if out in named.parents else out} cannot be written ({error.strerror})",
        f"check that the folder exists, that you may write to it and that the disk has room, or name another {option}",
    )


def _require_folder(folder: Path, out: Path, option: str) -> None:
    try:
        there, kind = nearest(folder)
    except OSError as error:
        raise unwritable(out, error, option) from None
    if kind is not Kind.FOLDER:
        raise UnavailableError(f"{there} is {kind.value}, not a folder", f"name another {option}")
