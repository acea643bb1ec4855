"""What was computed so far is kept when memory runs out, or when Ctrl-C, SIGTERM, SIGHUP or SIGQUIT ends a long work."""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from traceback import clear_frames

from common.program.interrupts import answering, is_heard, terminable
from common.program.out_of_memory import is_out_of_memory
from common.unfinished import unfinished


@contextmanager
def kept_if_interrupted(write: Callable[[], None]) -> Iterator[None]:
    """Write what there is if memory runs out in the block, or if Ctrl-C, SIGTERM, SIGHUP or SIGQUIT ends the block, in Python or out of native code.

    Args:
        write: writes it; what cannot be written (OSError) is left out.
    """
    last = _Once(write)
    with terminable(), unfinished(last):
        try:
            yield
        except KeyboardInterrupt as error:
            clear_frames(error.__traceback__)  # what the interrupted work holds is released: folders are written again
            with answering(), suppress(OSError):
                last()
            raise
        except Exception as error:
            if is_out_of_memory(error):
                clear_frames(error.__traceback__)  # and so is its memory
                with suppress(OSError, MemoryError):
                    last()
            raise


def tell_if_heard(tell: Callable[[str], None], line: str) -> None:
    """Tell a line where somebody listens: a pipe that nobody empties must not keep results from being written."""
    if is_heard():
        with suppress(OSError):
            tell(line)


def partial_words(partial: Path, out: Path) -> str:
    """Say where results are that are not whole, and that the earlier ones stay."""
    return f"the results so far are in {partial}, the earlier results stay in {out}"


class _Once:
    """Does something at its first call, from whatever thread. A later one does not wait for it: whoever leaves in a hurry must not."""

    def __init__(self, do: Callable[[], None]) -> None:
        self._do, self._begun = do, threading.Lock()

    def __call__(self) -> None:
        if self._begun.acquire(blocking=False):
            self._do()
