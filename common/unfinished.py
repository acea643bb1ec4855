"""What this process has begun to write, so that leaving at once leaves nothing half written behind.

A process has one end, so this list is the process's, not an object's. Whoever writes under a temporary name wraps it
in `unfinished`. Only `remove_unfinished` reads the list, just before the process ends.
"""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Final

_BEGUN: dict[object, Callable[[], None]] = {}
_LOCK: Final = threading.RLock()  # what is removed may be replaced by a last file, whose block ends as well
_PATIENCE_S: Final = 0.2
"""The thread that leaves may have been interrupted while it held the lock itself."""


@contextmanager
def unfinished(remove: Callable[[], None]) -> Iterator[None]:
    """Something lies under a temporary name while the block runs.

    Args:
        remove: removes it, or writes what is left to say; called from any thread, and only if the process is about to end.
    """
    key = object()
    _BEGUN[key] = remove
    try:
        yield
    finally:
        with _LOCK:  # taken for good once the process leaves: then nothing half removed gets its final name
            del _BEGUN[key]


def remove_unfinished() -> None:
    """Remove everything that is not finished. Call it only when the process ends next; what cannot be removed stays.

    From now on no block of `unfinished` ends: another thread that comes to its end waits there for the process's.
    """
    _LOCK.acquire(timeout=_PATIENCE_S)
    for remove in reversed(list(_BEGUN.values())):  # what was begun last lies within what was begun before
        with suppress(Exception):  # whatever fails, the process has to end
            remove()
