"""What was computed so far is kept when Ctrl-C ends a long work."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

from common.unfinished import unfinished


@contextmanager
def kept_if_interrupted(write: Callable[[], None]) -> Iterator[None]:
    """Write what there is if Ctrl-C ends the block, in Python or out of native code.

    Args:
        write: writes it; what cannot be written (OSError) is left out.
    """
    try:
        with unfinished(write):
            yield
    except KeyboardInterrupt:
        with suppress(OSError):
            write()
        raise
