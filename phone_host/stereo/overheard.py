"""Captures what image libraries print while they decode: libjpeg and libpng write to the C library's `stderr` and report it nowhere else.

When its data run out or make no sense, a decoder fills the rest of the image with something, prints one line and
reports success; OpenCV does not check. That line is the only sign of a spoiled image, and it must go to the log, not to
the terminal.

`stderr` is a variable of the C library that holds a stream, not descriptor 2: "normal variables which you can set just
like any others" (GNU C Library manual, Standard Streams); Android's Bionic declares it the same way. While an image is
decoded, the variable holds a stream in memory. Descriptor 2 does not change, so Python's own stderr, the log, progress
bars, child processes, faulthandler and C++'s std::cerr are not affected. OpenCV's own log is silenced meanwhile: OpenCV
reports by an exception or by returning no image.

Rules: one decoding at a time (a lock), because the variable belongs to the process. With any other C library nothing is
captured and the lines go where they went before.
"""

import ctypes
import platform
import threading
from collections.abc import Callable
from functools import cache
from typing import Final

import cv2

from common.android import is_android

_LOCK: Final = threading.Lock()
"""Guards the process's `stderr`; there is only one."""

_FROM_START: Final = 0
_SILENT: Final = 0
"""LOG_LEVEL_SILENT of opencv2/core/utils/logger.defines.hpp."""


class _Ear:
    """A stream in memory that can replace `stderr`: open_memstream of POSIX.1-2008. Lives as long as the process, because a library may still hold it."""

    def __init__(self, c_library: ctypes.CDLL) -> None:
        self._flush, self._seek = c_library.fflush, c_library.fseek
        self._flush.argtypes, self._flush.restype = [ctypes.c_void_p], ctypes.c_int
        self._seek.argtypes, self._seek.restype = [ctypes.c_void_p, ctypes.c_long, ctypes.c_int], ctypes.c_int
        make = c_library.open_memstream
        make.argtypes = [ctypes.POINTER(ctypes.c_void_p), ctypes.POINTER(ctypes.c_size_t)]
        make.restype = ctypes.c_void_p
        self._text, self._length = ctypes.c_void_p(), ctypes.c_size_t()
        self._stream = make(ctypes.byref(self._text), ctypes.byref(self._length))
        self._stderr = ctypes.c_void_p.in_dll(c_library, "stderr")

    def listen(self, work: Callable[[], object]) -> str:
        """Do some work; return what was printed to `stderr` meanwhile."""
        usual = self._stderr.value
        self._stderr.value = self._stream
        try:
            work()
        finally:
            self._stderr.value = usual
            said = self._take()
        return said

    def _take(self) -> str:
        self._flush(self._stream)
        if not self._length.value or not self._text.value:
            return ""
        said = ctypes.string_at(self._text.value, self._length.value)
        self._seek(self._stream, 0, _FROM_START)
        self._flush(self._stream)
        return said.decode("utf-8", "replace")


def overhear(work: Callable[[], object]) -> str:
    """Do some work, one thread at a time.

    Returns:
        What C libraries printed to their `stderr` meanwhile; empty where it cannot be captured.

    Raises:
        Exception: whatever the work raises.
    """
    with _LOCK:
        log_level = _log_level(_SILENT)
        try:
            ear = _ear()
            if ear is not None:
                return ear.listen(work)
            work()
            return ""
        finally:
            _log_level(log_level)


def _log_level(level: int) -> int:
    """Set the level of OpenCV's own log; return the one before. Its wheels and the packages of Termux and Debian put it in different places."""
    if hasattr(cv2.utils, "logging"):
        return cv2.utils.logging.setLogLevel(level)
    reading, setting = getattr(cv2, "getLogLevel", None), getattr(cv2, "setLogLevel", None)
    before = reading() if reading else level
    if setting:
        setting(level)
    return int(before)


@cache
def _ear() -> _Ear | None:
    """Return None where `stderr` may be a constant, as in musl: setting it would crash the process."""
    if platform.libc_ver()[0] != "glibc" and not is_android():
        return None
    return _Ear(ctypes.CDLL(None))
