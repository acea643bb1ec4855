"""What is being printed, on disk, so that the next start can say what became of a print whose program was killed."""

import json
import os
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final

from common.places import make_folder
from phone_host.output.atomic import write_text

_MOST_BYTES: Final = 10_000


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


class Journal:
    """Keeps the entry of the print that goes on.

    Args:
        path: of its file.
    """

    def __init__(self, path: Path) -> None:
        self._path = path

    def left(self) -> Entry | None:
        """Return the print that a program has left unfinished, killed or with its machine; None: there is none."""
        try:
            with self._path.open() as file:
                values = json.loads(file.read(_MOST_BYTES))
        except (OSError, ValueError, RecursionError):
            return None
        entry = _entry(values)
        return entry if entry is not None and not _is_alive(entry.pid) else None

    def note(self, entry: Entry) -> None:
        """Keep how far a print is. A disk that is full does not end a print."""
        with suppress(OSError):
            make_folder(self._path.parent)
            write_text(self._path, json.dumps(asdict(entry)) + "\n")

    def forget(self) -> None:
        """The print has ended, and whoever started it was told how."""
        with suppress(OSError):
            self._path.unlink()


def _entry(values: object) -> Entry | None:
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
