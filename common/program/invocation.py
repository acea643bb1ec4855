"""How our programs are called from the user's shell, so that a printed command can be pasted. Light: every start may use it.

A program may have been started by its path (`.venv/bin/phone-host`) or as a module: its bare name would then not be found, or would be another
installation's.
"""

import os
import re
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Final

PROGRAMS: Final = ("phone-host", "board-agent", "delay-bench")

_SUDO_FOLDERS: Final = ("/usr/local/sbin", "/usr/local/bin", "/usr/sbin", "/usr/bin", "/sbin", "/bin")
"""Where sudo looks for programs, whatever PATH says (secure_path of Debian's /etc/sudoers)."""

_EXAMPLE: Final = re.compile(rf"^( +(?:[A-Z][A-Z_]*=\S+ )*)(sudo )?({'|'.join(PROGRAMS)})(?= |$)", re.MULTILINE)
"""A program's name at the start of an indented line, possibly after variables and sudo."""


def program_name(program: str) -> str:
    """Return what to type for a program of this installation.

    Args:
        program: its name, for example `phone-host`.

    Returns:
        The bare name if the shell finds this installation's program by it, or if this installation has none of that name;
        otherwise the program's path, quoted for a shell and relative where it lies below the current folder.
    """
    own = _own(program)
    if own is None or _is_found(own, os.environ.get("PATH", "").split(os.pathsep)):
        return program
    try:
        short = own.relative_to(Path.cwd())
        return shlex.quote(str(short) if len(short.parts) > 1 else f"./{short}")
    except (ValueError, OSError):  # it lies elsewhere; or the current folder is gone
        return shlex.quote(str(own))


def sudo_name(program: str) -> str:
    """Return what to type for a program of this installation after `sudo `, which does not look in a virtual environment."""
    own = _own(program)
    return program if own is None or _is_found(own, _SUDO_FOLDERS) else shlex.quote(str(own))


def command_line(program: str, *arguments: str | Path) -> str:
    """Return a command of this installation with its arguments, quoted for a shell."""
    return " ".join([program_name(program), *(shell_word(str(argument)) for argument in arguments)])


def shell_word(word: str) -> str:
    """Return a word quoted for a shell; one that cannot be printed becomes $'...' with codes for its bytes (POSIX.1-2024, 2.2.4)."""
    if word.isprintable():
        return shlex.quote(word)
    # 32 to 126 are the printable characters of ASCII.
    letters = (chr(byte) if 32 <= byte < 127 else f"\\{byte:03o}" for byte in os.fsencode(word))
    return "$'" + "".join(f"\\{letter}" if letter in {"'", "\\"} else letter for letter in letters) + "'"


def as_found(examples: str) -> str:
    """Return example lines with each program as the user's shell finds it.

    Args:
        examples: text with commands on indented lines of their own; the rest stays as it is.
    """
    names = {program: program_name(program) for program in PROGRAMS}

    def found(line: re.Match[str]) -> str:
        before, sudo, program = line[1], line[2] or "", line[3]
        return f"{before}{sudo}{sudo_name(program) if sudo else names[program]}"

    return _EXAMPLE.sub(found, examples)


def _own(program: str) -> Path | None:
    """Return the path of a program of this installation; None if there is none."""
    for folder in (Path(sys.argv[0]).parent, Path(sys.executable).parent):
        path = folder.absolute() / program
        if os.access(path, os.X_OK) and path.is_file():
            return path
    return None


def _is_found(own: Path, folders: Sequence[str]) -> bool:
    """Whether a search in the folders finds this very file first, possibly by a link to it."""
    for folder in folders:
        path = Path(folder) / own.name
        if os.access(path, os.X_OK) and path.is_file():
            return path.samefile(own)
    return False
