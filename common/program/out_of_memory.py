"""Recognises that memory ran out, whoever says so. Pure, and light: OpenCV is not imported for it.

Python and numpy raise MemoryError. OpenCV raises cv2.error with the code of its own table (modules/core/include/opencv2/core/base.hpp,
Error::StsNoMem), and passes on what C++ throws (std::bad_alloc) in words. The system says ENOMEM. A thread that gets no stack is a
RuntimeError of Python's (Modules/_threadmodule.c).
"""

import errno
from collections.abc import Container, Iterator
from contextlib import contextmanager
from typing import Final

_OPENCV_MODULE: Final = "cv2"
_OPENCV_NO_MEMORY: Final = -4
_CPP_NO_MEMORY: Final = "bad_alloc"
_NO_THREAD: Final = "can't start new thread"
_MAX_WORDS: Final = 120

_OF_IMAGES: Final = ("scale", "disparities", "max_megapixels", "camera")
"""Options of commands that read images."""


def is_out_of_memory(error: BaseException) -> bool:
    """Return whether an exception says that memory ran out."""
    if isinstance(error, MemoryError):
        return True
    if isinstance(error, OSError):
        return error.errno == errno.ENOMEM
    if isinstance(error, RuntimeError):
        return str(error) == _NO_THREAD
    is_opencv = type(error).__module__.partition(".")[0] == _OPENCV_MODULE
    return is_opencv and (getattr(error, "code", 0) == _OPENCV_NO_MEMORY or _CPP_NO_MEMORY in str(error))


@contextmanager
def noted_if_out_of_memory(what: str) -> Iterator[None]:
    """Note on the exception, if memory runs out in the block, what was being computed.

    Args:
        what: the files or the pair, as people know them.
    """
    try:
        yield
    except Exception as error:
        if is_out_of_memory(error):
            error.add_note(what)
        raise


def words_of(error: BaseException) -> str:
    """Say what was too large, as far as the exception tells: its notes and its own words on one line, or nothing."""
    notes = getattr(error, "__notes__", ())
    words = " ".join(str(getattr(error, "err", "") or error).split())
    return (f" for {notes[0]}" if notes else "") + (f" ({words[:_MAX_WORDS]})" if words else "")


def remedy_of(options: Container[str]) -> str:
    """Say what helps."""
    scale = " (--scale 0.5)" if "scale" in options else ""
    fewer = " or fewer --disparities" if "disparities" in options else ""
    has_images = any(name in options for name in _OF_IMAGES)
    first = f"give smaller images{scale}{fewer}" if has_images else "close other programs"
    return f"{first}, or use a machine with more memory"
