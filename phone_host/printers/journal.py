"""What is being printed, on disk: one entry for each print, so that the next start can say what became of one whose program was killed.

- A print has an entry of its own (`ID.json`), and holds the lock of its printer (`PRINTER.lock`) until it ends. The kernel lets go of a lock
  when its process dies, whatever kills it: a print whose printer is not locked by its process has been left.
- Two prints of this machine never go to one printer.
"""

import fcntl
import hashlib
import json
import os
import secrets
import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final, assert_never

from common.errors import SettingsError, TakenError
from common.places import make_folder
from phone_host.printers.printer_uri import FileUri, LineKind, LineUri, ServerUri, read_uri

_MOST_BYTES: Final = 10_000
_MAX_ENTRIES: Final = 100
_TRIES: Final = 4
_AGAIN_S: Final = 0.05


@dataclass(frozen=True, slots=True)
class Entry:
    """A print that goes on, or did when its program ended.

    Attributes:
        file: what is printed.
        printer: where.
        done: lines that were taken.
        lines: of the print.
        pid: of the program that sends it.
    """

    file: str
    printer: str
    done: int
    lines: int
    pid: int


class JournalEntry:
    """The entry of one print. Close it when the print has ended.

    Args:
        path: of its file; there is none before the first note.
        lock: descriptor that holds the printer's lock; -1: there is none.
    """

    def __init__(self, path: Path, lock: int) -> None:
        self._path, self._lock = path, lock

    def note(self, entry: Entry) -> None:
        """Keep how far the print is. A disk that is full does not end a print."""
        part = self._path.with_suffix(".part")
        with suppress(OSError):
            # Not by `replacing`: where the process leaves at once, that waits for its end, and a print has to be cooled first.
            with part.open("w", encoding="utf-8") as file:
                fcntl.flock(file, fcntl.LOCK_EX)  # it is being written: see `_remove_parts`
                file.write(json.dumps(asdict(entry)) + "\n")
                file.flush()
                os.fsync(file.fileno())
            part.replace(self._path)

    def close(self, *, is_reported: bool = True) -> None:
        """Let the printer go.

        Args:
            is_reported: whether whoever started the print knows how it ended: then the entry is removed, else the next start tells.
        """
        for path in (self._path, self._path.with_suffix(".part")) if is_reported else ():
            with suppress(OSError):
                path.unlink()
        if self._lock >= 0:
            os.close(self._lock)
            self._lock = -1


class Journal:
    """The entries of all prints of this machine."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def begin(self, printer: str) -> JournalEntry:
        """Begin the entry of a print.

        Raises:
            TakenError: another print of this machine goes to that printer.
        """
        path = self._folder / f"{secrets.token_hex(8)}.json"
        for _ in range(_TRIES):  # another start may look at the lock just now
            try:
                make_folder(self._folder)
                self._remove_parts()
                lock = self._locked(printer)
            except OSError:  # a folder that cannot be written keeps nobody from printing
                return JournalEntry(path, -1)
            if lock >= 0:
                return JournalEntry(path, lock)
            time.sleep(_AGAIN_S)
        raise TakenError(f"another print goes to {printer}", "wait until it has ended, or cancel it")

    def take_left(self) -> list[Entry]:
        """Return the prints that programs have left unfinished, killed or with the machine, and forget them."""
        left = []
        with suppress(OSError):
            for path in sorted(self._folder.glob("*.json"))[:_MAX_ENTRIES]:
                entry = _read(path)
                if entry is not None and not self._goes_on(entry):
                    left.append(entry)
                    path.unlink(missing_ok=True)
        return left

    def _remove_parts(self) -> None:
        """Remove what programs had begun to write when they were killed. A file that is locked is being written."""
        for path in self._folder.glob("*.part"):
            with suppress(OSError), path.open("rb") as file:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                path.unlink()

    def _goes_on(self, entry: Entry) -> bool:
        lock = self._locked(entry.printer)
        if lock >= 0:
            os.close(lock)
        return lock < 0 and _is_alive(entry.pid)

    def _locked(self, printer: str) -> int:
        """Return a descriptor that holds a printer's lock until it is closed; -1: another one has it.

        Raises:
            OSError: the folder cannot be written.
        """
        name = hashlib.sha256(_same(printer).encode()).hexdigest()[:32]
        descriptor = os.open(
            self._folder / f"{name}.lock", os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW, 0o600
        )
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(descriptor)
            return -1
        except OSError:
            os.close(descriptor)
            raise
        return descriptor


def _same(printer: str) -> str:
    """Return one name for a printer, however its address is written: a port has several names (/dev/serial/by-id)."""
    try:
        uri = read_uri(printer)
    except SettingsError:
        return printer
    match uri:
        case LineUri():
            place = os.path.realpath(uri.place) if uri.kind is LineKind.SERIAL else uri.place.lower()
            return f"{uri.kind.value} {place} {uri.port}"
        case ServerUri():
            return f"{uri.kind.value} {uri.host.lower()} {uri.port}"
        case FileUri():
            return f"file {os.path.realpath(uri.path)}"
        case _:
            assert_never(uri)


def _read(path: Path) -> Entry | None:
    try:
        with path.open() as file:
            values = json.loads(file.read(_MOST_BYTES))
    except (OSError, ValueError, RecursionError):
        return None
    if not isinstance(values, Mapping) or set(values) != {"file", "printer", "done", "lines", "pid"}:
        return None
    texts, numbers = [values["file"], values["printer"]], [values["done"], values["lines"], values["pid"]]
    if not all(isinstance(each, str) for each in texts) or not all(type(each) is int for each in numbers):
        return None
    return Entry(*texts, *numbers)


def _is_alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:
        return True
    return pid > 0
