"""What a long work keeps: what was computed so far, when memory runs out, or when Ctrl-C, SIGTERM, SIGHUP or SIGQUIT ends it; freed memory, for its next pair.

The images, costs and clouds of a pair are some 50 MB that are freed and asked for again with every pair. glibc gives such memory back to
the system as soon as twice the largest block is free, so that each pair pays for clearing all its pages again: at 640x480 2 ms of the 6.5 ms
around the matcher, at 1280x720 3 ms of 14.
Each thread has an arena of its own, and each run its own threads: what a run has freed is of no use to the next one.
Source: mallopt(3), malloc_trim(3).
"""

import ctypes
import platform
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from traceback import clear_frames
from typing import Final

from common.program.interrupts import answering, is_heard, terminable
from common.program.out_of_memory import is_out_of_memory
from common.unfinished import unfinished

_M_TRIM_THRESHOLD: Final = -1
_M_MMAP_THRESHOLD: Final = -3
_KEPT_BYTES: Final = 256 << 20  # what a pair of 1920 x 1080 frees, twice
_LARGEST_BLOCK_BYTES: Final = 32 << 20  # the most that mallopt takes; larger blocks always go back to the system


def keep_freed_memory() -> None:
    """Tell the C library to keep freed memory, up to 256 MB, until the process ends. Other libraries than glibc are left as they are."""
    if platform.libc_ver()[0] != "glibc":
        return
    mallopt = ctypes.CDLL(None).mallopt
    mallopt.argtypes, mallopt.restype = [ctypes.c_int, ctypes.c_int], ctypes.c_int
    mallopt(_M_MMAP_THRESHOLD, _LARGEST_BLOCK_BYTES)
    mallopt(_M_TRIM_THRESHOLD, _KEPT_BYTES)


def give_back_freed_memory() -> None:
    """Give the system back what a run has freed. Other libraries than glibc are left as they are."""
    if platform.libc_ver()[0] == "glibc":
        ctypes.CDLL(None).malloc_trim(0)


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
