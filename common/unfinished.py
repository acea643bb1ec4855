"""What this process has begun to write, so that leaving at once leaves nothing half written behind.

A process has one end, so this list is the process's, not an object's. Whoever writes under a temporary name wraps it
in `unfinished`. Only `remove_unfinished` reads the list, just before the process ends.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

_BEGUN: dict[object, Callable[[], None]] = {}


@contextmanager
def unfinished(remove: Callable[[], None]) -> Iterator[None]:
    """Something lies under a temporary name while the block runs.

    Args:
        remove: removes it; called from any thread, and only if the process is about to end.
    """
    key = object()
    _BEGUN[key] = remove
    try:
        yield
    finally:
        del _BEGUN[key]


def remove_unfinished() -> None:
    """Remove everything that is not finished. Call it only when the process ends next; what cannot be removed stays."""
    for remove in list(_BEGUN.values()):
        with suppress(OSError):
            remove()
