"""The submaps of a scan in its results folder, so that another run can go on when this one is killed.

Each is written whole or not at all when it is closed. They are removed once the model is written. Those of an earlier scan are removed when the first
one of this scan is on the disk. A disk without room ends the keeping, not the scan.
"""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from common.diagnostic import Diagnostic, Severity
from common.errors import DataError, SettingsError
from phone_host.output.atomic import replacing
from phone_host.output.listed import ListedFolder
from phone_host.output.result_files import remove_results
from phone_host.scan.scan import Scan
from phone_host.scan.scanned import Submap
from phone_host.scan.submap_bytes import submap_bytes, submap_of

_NAMES: Final = r"submap-\d{4,}\.bin"


def require_no_submaps(folder: Path) -> None:
    """Refuse to begin a scan where the submaps of one that was ended would be lost.

    Raises:
        SettingsError: it holds some.
    """
    if paths := _paths(folder):
        raise SettingsError(
            f"{folder} holds a scan that was ended before its end ({paths[-1].name})",
            f"go on with it with --resume {folder}, or start again with --restart",
        )


def read_submaps(folder: Path) -> tuple[Submap, ...]:
    """Read the submaps that a killed scan has left, from its last whole one on.

    Raises:
        DataError: there is none, or one is damaged or missing.
        OSError: as the operating system reports it.
    """
    paths = _paths(folder)
    if not paths:
        raise DataError(
            f"{folder} holds no submaps of a scan that was ended",
            "give the --out folder of the one that was killed; one that ended by itself has nothing to go on with",
        )
    numbers = [_number(path) for path in paths]
    if numbers != list(range(numbers[0], numbers[0] + len(numbers))):
        raise DataError(f"a submap between {paths[0]} and {paths[-1].name} is missing", "begin a new scan")
    submaps: list[Submap] = []
    for path in paths:
        submap = submap_of(path.read_bytes(), str(path))
        submaps = [submap] if submap.is_whole else [*submaps, submap]
    if not submaps[0].is_whole:
        raise DataError(f"the submaps before {paths[0]} are missing", "begin a new scan")
    return tuple(submaps)


class KeptSubmaps:
    """Writes a scan's submaps as they close.

    Args:
        out: the results folder.
        scan: that is kept.
        resumed: submaps that it goes on from; they are written into the folder again, together.
    """

    def __init__(self, out: Path, scan: Scan, resumed: Sequence[Submap] = ()) -> None:
        self._out, self._scan = out, scan
        self._problem = ""
        self._next = max(map(_number, _paths(out)), default=-1) + 1
        self._must_be_whole = bool(resumed)
        if resumed:
            scan.go_on(resumed)

    @property
    def remarks(self) -> tuple[Diagnostic, ...]:
        """What must be said of it."""
        if not self._problem:
            return ()
        return (
            Diagnostic(
                f"the scan could not have been resumed: {self._problem}",
                "make room on the disk",
                severity=Severity.NOTE,
            ),
        )

    def after_pair(self) -> None:
        """Write a submap if one is due."""
        self._keep_if(self._scan.is_submap_due)

    def before_end(self) -> None:
        """Write what came since the last submap: the scan is stopped before its end, and may be gone on with."""
        self._keep_if(self._scan.is_submap_open)

    def _keep_if(self, is_wanted: bool) -> None:  # noqa: FBT001 - the question itself
        if is_wanted and not self._problem:
            try:
                self._write(self._scan.close_submap(whole=self._must_be_whole))
            except OSError as error:
                self._problem = f"{error.filename or self._out}: {error.strerror}"

    def done(self) -> None:
        """Remove them: the model is written.

        Raises:
            OSError: as the operating system reports it.
        """
        if _paths(self._out):
            remove_results(self._out, _NAMES)

    def _write(self, submap: Submap) -> None:
        name, earlier = f"submap-{self._next:04d}.bin", _paths(self._out)
        with ListedFolder(self._out, "(?!)", kept=_NAMES) as folder:
            folder.add(name)
            with replacing(self._out / name, durable=True) as file:  # earlier ones go when it is on the disk
                file.write(submap_bytes(submap))
        self._next, self._must_be_whole = self._next + 1, False
        if submap.is_whole:  # the others are in it, or of an earlier scan
            for path in earlier:
                path.unlink()


def _paths(folder: Path) -> list[Path]:
    found = folder.iterdir() if folder.is_dir() else []
    return sorted((path for path in found if re.fullmatch(_NAMES, path.name)), key=_number)


def _number(path: Path) -> int:
    return int(path.stem.partition("-")[2])
