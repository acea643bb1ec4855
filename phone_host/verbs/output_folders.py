"""Where a verb's results go: what cannot be is said before the work, what fails while writing with its remedy."""

import re
from collections.abc import Mapping
from pathlib import Path

from common.errors import SettingsError, UnavailableError
from phone_host.output.listed import claim


def require_folder(out: Path) -> None:
    """Refuse an --out that is there and is no folder.

    Raises:
        UnavailableError: it is something else, or lies in something else.
    """
    _require_folder(out, out, "--out")


def claim_names(folder: Path, out: Path, *names: str) -> None:
    """Have the names that a verb will write in a folder, or say now that somebody else's files bear them.

    Args:
        folder: where they will be.
        out: what the user gave.
        names: of the files.

    Raises:
        UnavailableError: such a file is not from an earlier run, or the folder cannot be written to.
    """
    try:
        claim(folder, *names)
    except OSError as error:
        raise unwritable(out, error) from error


def spare_inputs(out: Path, names: str, inputs: Mapping[str, Path]) -> None:
    """Refuse results that would take the place of what is read.

    Args:
        out: folder for the results.
        names: which names in it are replaced, as a pattern.
        inputs: what is read, by the words that name it in an error.

    Raises:
        SettingsError: one of them lies under such a name.
    """
    folder = out.resolve()
    for what, path in inputs.items():
        inside = path.resolve()
        if folder in inside.parents and re.fullmatch(names, inside.relative_to(folder).parts[0]):
            raise SettingsError(
                f"{what} {path} lies inside --out {out}, which is replaced", "give another folder with --out"
            )


def require_file(out: Path, option: str = "--out") -> None:
    """Refuse an output that is there and is no regular file: replacing it would take a folder, a device or a pipe away.

    Args:
        out: what the user gave.
        option: with which it was given.

    Raises:
        UnavailableError: it is something else, or lies in something that is no folder.
    """
    _require_folder(out.parent, out, option)
    if out.exists() and not out.is_file():
        raise UnavailableError(f"{out} is not a file", f"name another {option}")


def unwritable(out: Path, error: OSError, option: str = "--out") -> UnavailableError:
    """What to say when results cannot be written.

    Args:
        out: what the user gave.
        error: what the operating system said.
        option: with which it was given.

    Returns:
        The error to raise.
    """
    return UnavailableError(
        f"{out} cannot be written ({error.strerror})",
        f"check that the folder exists, that you may write to it and that the disk has room, or name another {option}",
    )


def _require_folder(folder: Path, out: Path, option: str) -> None:
    try:
        there = next(path for path in (folder, *folder.absolute().parents) if path.exists())
    except OSError as error:
        raise unwritable(out, error, option) from None
    if not there.is_dir():
        raise UnavailableError(f"{there} is not a folder", f"name another {option}")
