"""G-code that is no text. Binary one (Prusa's .bgcode) is converted by the program `bgcode` where one is installed, archives are named.

What a file is, its first bytes say.

That program (libbgcode) is AGPL, so it is run, never imported. `bgcode NAME.bgcode` writes NAME.gcode beside it.
Source: https://github.com/prusa3d/libbgcode, doc/specifications.md: a file begins with "GCDE".
"""

import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from common.errors import DataError
from common.places import Kind, kind_of

_MAGIC: Final = b"GCDE"
_ARCHIVES: Final = {
    b"\x1f\x8b": "compressed (gzip)",
    b"PK\x03\x04": "a ZIP archive",
    b"\xff\xfe": "UTF-16",
    b"\xfe\xff": "UTF-16",
}
"""How the files begin that Cura (.gcode.gz, .ufp), Bambu Studio and OrcaSlicer (.gcode.3mf), and Windows' editors write."""

_PROGRAM: Final = "bgcode"
_PATIENCE_S: Final = 600
_REMEDY: Final = 'switch "Supports binary G-code" off in the slicer (printer settings, general) and slice again, or install the program bgcode'

_PLAIN_REMEDY: Final = "unpack it, or save it as UTF-8, and give the .gcode file; Bambu Studio and OrcaSlicer have it in Metadata/plate_1.gcode"


def is_binary(gcode: Path) -> bool:
    """Return whether a file is binary G-code, whatever its name is; False also for one that cannot be read."""
    return _first_bytes(gcode) == _MAGIC


def _first_bytes(path: Path) -> bytes:
    try:
        if kind_of(path) is not Kind.FILE:
            return b""
        with path.open("rb") as file:
            return file.read(len(_MAGIC))
    except OSError:
        return b""


def require_readable(gcode: Path) -> None:
    """Refuse archives, and binary G-code where there is no program that converts it.

    Raises:
        DataError: it is one.
    """
    first = _first_bytes(gcode)
    for begin, what in _ARCHIVES.items():
        if first.startswith(begin):
            raise DataError(f"{gcode} is {what}, no plain G-code", _PLAIN_REMEDY)
    if is_binary(gcode):
        _converter(gcode)


def _converter(gcode: Path) -> str:
    program = shutil.which(_PROGRAM)
    if program is None:
        raise DataError(f"{gcode} is binary G-code (it begins with GCDE), which is not read here", _REMEDY)
    return program


@contextmanager
def text_gcode(gcode: Path) -> Iterator[Path]:
    """Give G-code as text, for as long as the block runs: the file itself, or what `bgcode` makes of a binary one.

    Raises:
        DataError: it is binary, and there is no `bgcode`, or it cannot convert it.
    """
    if not is_binary(gcode):
        yield gcode
        return
    program = _converter(gcode)
    with tempfile.TemporaryDirectory(prefix="tandemscan-", ignore_cleanup_errors=True) as folder:
        given = Path(folder) / f"{gcode.stem}.bgcode"
        given.symlink_to(gcode.absolute())
        try:
            done = subprocess.run(
                [program, str(given)], stdin=subprocess.DEVNULL, capture_output=True, text=True, errors="replace",
                timeout=_PATIENCE_S, check=False,
            )  # fmt: skip
        except (OSError, subprocess.TimeoutExpired) as error:
            raise DataError(f"{gcode} is binary G-code, and {program} does not convert it ({error})", _REMEDY) from None
        made = given.with_suffix(".gcode")
        if done.returncode or not made.is_file():
            lines = (done.stdout + done.stderr).strip().splitlines()
            reason = lines[-1][:200] if lines else f"exit code {done.returncode}"
            raise DataError(f"{gcode} is binary G-code, and {program} does not convert it ({reason})", _REMEDY)
        yield made
