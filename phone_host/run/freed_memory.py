"""Keeps freed memory for the next pair, until the run is over.

The images, costs and clouds of a pair are some 50 MB that are freed and asked for again with every pair. glibc gives such memory back to
the system as soon as twice the largest block is free, so that each pair pays for clearing all its pages again: at 640x480 2 ms of the 6.5 ms
around the matcher, at 1280x720 3 ms of 14.
Each thread has an arena of its own, and each run its own threads: what a run has freed is of no use to the next one.
Source: mallopt(3), malloc_trim(3).
"""

import ctypes
import platform
from typing import Final

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
