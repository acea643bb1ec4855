"""What this process has begun to write, so that leaving at once leaves nothing half written behind.

A process has one end, so this list is the process's, not an object's. Whoever writes under a temporary name wraps it
in `unfinished`. Only `remove_unfinished` reads the list, just before the process ends.
"""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Final
from weakref import WeakMethod

from common.errors import TandemError

_BEGUN: dict[object, Callable[[], str | None]] = {}
_LOCK: Final = threading.RLock()  # what is removed may be replaced by a last file, whose block ends as well
_PATIENCE_S: Final = 0.2
"""The thread that leaves may have been interrupted while it held the lock itself."""


@dataclass(frozen=True, slots=True)
class Removed:
    """What remains to be said once everything is removed.

    Attributes:
        words: on one line; empty: nothing.
        exit_code: of the process; 0: as its signal says.
    """

    words: str = ""
    exit_code: int = 0


def weakly(method: Callable[[], str | None]) -> Callable[[], str | None]:
    """Return what calls a method as long as its object lives: the list of what is unfinished must not keep an object alive that nobody else holds."""
    reference = WeakMethod(method)

    def call() -> str | None:
        alive = reference()
        return None if alive is None else alive()

    return call


@contextmanager
def unfinished(remove: Callable[[], str | None]) -> Iterator[None]:
    """Something lies under a temporary name while the block runs.

    Args:
        remove: removes it, or writes what is left to say; called from any thread, and only if the process is about to end. What it returns,
            and any of our errors that it raises, is the process's last line.
    """
    key = object()
    _BEGUN[key] = remove
    try:
        yield
    finally:
        with _LOCK:  # taken for good once the process leaves: then nothing half removed gets its final name
            del _BEGUN[key]


def remove_unfinished() -> Removed:
    """Remove everything that is not finished; return what is to be said. Call it only when the process ends next; what cannot be removed stays.

    From now on no block of `unfinished` ends: another thread that comes to its end waits there for the process's.
    """
    _LOCK.acquire(timeout=_PATIENCE_S)
    words, exit_code = list[str](), 0
    for remove in reversed(list(_BEGUN.values())):  # what was begun last lies within what was begun before
        try:
            words.append(remove() or "")
        except TandemError as error:
            words.append(str(error))
            exit_code = error.exit_code
        except Exception:  # noqa: BLE001, S112 - whatever fails, the process has to end
            continue
    return Removed("; ".join(filter(None, words)), exit_code)
