"""Checks where a verb's results go. Impossible targets are refused before the work; write errors carry a remedy."""

import errno
import os
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final

from common.errors import SettingsError, UnavailableError
from common.places import Kind, kind_of, nearest, resolved
from phone_host.output.folder_lock import lock_for_command
from phone_host.output.listed import ListedFolder
from phone_host.output.report_owner import PAGE, report_owner
from phone_host.output.result_files import claim, replacing_results

_NOTHING: Final = "(?!)"


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
def written_together(out: Path, *names: str, command: str = "", replaces: Sequence[str] = ()) -> Iterator[Path]:
    """Write files that take the place of an earlier command's if the block ends without an error; else those stay as they are.

    Args:
        out: the folder that the user gave; created if missing.
        names: names of the files.
        command: the verb whose report is among them; empty: it has none. Another verb's report stays under another name.
        replaces: names of what goes without a new one.

    Yields:
        Where to write them, and further files beside them, such as a rig.yaml, which need not be from an earlier command.

    Raises:
        UnavailableError: such a file is not from an earlier command, another program writes there, or it cannot be written.
    """
    try:
        with replacing_results(out, "|".join(map(re.escape, (*names, *replaces))), names, command=command) as place:
            yield place
    except OSError as error:
        raise unwritable(out, error) from error


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


def announce_other_report(folder: Path, command: str, tell: Callable[[str], None]) -> None:
    """Tell under which names another command's report and page stay when this one's take their places. Until then nothing changes.

    Args:
        folder: folder for the results.
        command: the verb whose results go there.
        tell: takes a line that the user should know.

    Raises:
        UnavailableError: they are not ours to rename, or the folder cannot be written to.
    """
    owner = report_owner(folder)
    if owner in {"", command}:
        return
    try:
        with ListedFolder(folder, _NOTHING, command=command) as listed:
            names = " and ".join(listed.renamed.values())
    except OSError as error:
        raise unwritable(folder, error) from error
    tell(f"what {owner} has written in {folder} stays there as {names}")


def stale_page(folder: Path, command: str) -> tuple[str, ...]:
    """Return the name of the page that a command wrote earlier, where it now writes a report without one; the user's own is not meant.

    Args:
        folder: folder for the results.
        command: the verb whose results go there.

    Raises:
        UnavailableError: the folder cannot be written to.
    """
    if report_owner(folder) != command or kind_of(folder / PAGE) is Kind.MISSING:
        return ()
    try:
        with suppress(UnavailableError), ListedFolder(folder, re.escape(PAGE)):
            return (PAGE,)
    except OSError as error:
        raise unwritable(folder, error) from error
    return ()


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


@contextmanager
def writing(out: Path) -> Iterator[None]:
    """Name the folder and --out where a block cannot write its results.

    Args:
        out: the path that the user gave.

    Raises:
        UnavailableError: they cannot be written.
    """
    try:
        yield
    except OSError as error:
        raise unwritable(out, error) from error


def require_writable(out: Path) -> None:
    """Check before the work that a folder can be made or written to.

    Args:
        out: the folder; it need not exist.

    Raises:
        UnavailableError: it cannot.
    """
    require_folder(out)
    with writing(out):
        there, _ = nearest(out)
        if not os.access(there, os.W_OK | os.X_OK):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(there))


def _require_folder(folder: Path, out: Path, option: str) -> None:
    try:
        there, kind = nearest(folder)
    except OSError as error:
        raise unwritable(out, error, option) from None
    if kind is not Kind.FOLDER:
        raise UnavailableError(f"{there} is {kind.value}, not a folder", f"name another {option}")
