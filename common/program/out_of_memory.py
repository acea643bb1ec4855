"""Recognises that memory ran out, whoever says so. Pure, and light: OpenCV is not imported for it.

Python and numpy raise MemoryError. OpenCV raises cv2.error with the code of its own table (modules/core/include/opencv2/core/base.hpp,
Error::StsNoMem), and passes on what C++ throws (std::bad_alloc) in words. The system says ENOMEM.
"""

import errno
from typing import Final

_OPENCV_MODULE: Final = "cv2"
_OPENCV_NO_MEMORY: Final = -4
_CPP_NO_MEMORY: Final = "bad_alloc"
_MAX_WORDS: Final = 120

REMEDY: Final = "give smaller images (--scale 0.5) or fewer --disparities, or use a machine with more memory"


def is_out_of_memory(error: BaseException) -> bool:
    """Return whether an exception says that memory ran out."""
    if isinstance(error, MemoryError):
        return True
    if isinstance(error, OSError):
        return error.errno == errno.ENOMEM
    is_opencv = type(error).__module__.partition(".")[0] == _OPENCV_MODULE
    return is_opencv and (getattr(error, "code", 0) == _OPENCV_NO_MEMORY or _CPP_NO_MEMORY in str(error))


def words_of(error: BaseException) -> str:
    """Say what was too large, as far as the exception tells: its own words on one line, or nothing."""
    words = " ".join(str(getattr(error, "err", "") or error).split())
    return f" ({words[:_MAX_WORDS]})" if words else ""
