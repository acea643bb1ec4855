"""Memory that runs out: recognised whoever says so, with what was too large and what helps."""

import errno

import cv2
import numpy as np
import pytest

from common.program.out_of_memory import is_out_of_memory, noted_if_out_of_memory, remedy_of, words_of


def _raised(what: str) -> Exception:
    """A real error of numpy or OpenCV."""
    try:
        if what == "numpy":
            np.empty(1 << 60, np.uint8)
        else:
            cv2.cvtColor(np.zeros((2, 2), np.uint8), cv2.COLOR_BGR2GRAY)
    except (MemoryError, cv2.error) as error:
        return error
    raise AssertionError("nothing was raised")


class _NoMemoryError(cv2.error):
    """cv2.error as OpenCV raises it where it cannot allocate (Error::StsNoMem)."""

    __module__ = "cv2"
    code = -4
    err = "Failed to allocate 12 bytes"


@pytest.mark.parametrize(
    ("error", "is_so"),
    [
        (_raised("numpy"), True),
        (MemoryError(), True),
        (OSError(errno.ENOMEM, "Cannot allocate memory"), True),
        (RuntimeError("can't start new thread"), True),
        (_NoMemoryError("no memory"), True),
        (cv2.error("Unknown C++ exception: std::bad_alloc"), True),
        (_raised("opencv"), False),
        (OSError(errno.ENOENT, "No such file"), False),
        (RuntimeError("another"), False),
        (ValueError("bad_alloc"), False),
    ],
)
def test_memory_that_runs_out_is_told_from_other_errors(error: Exception, *, is_so: bool) -> None:
    """numpy, OpenCV, C++, threads and the system each say so in their own way."""
    assert is_out_of_memory(error) is is_so


def test_the_words_name_what_was_being_computed() -> None:
    """The first note and the error's own words stand on one line; an error without either adds nothing."""
    with pytest.raises(MemoryError) as caught, noted_if_out_of_memory("pair 7"):
        raise MemoryError("Unable to\nallocate 9 GiB")
    assert words_of(caught.value) == " for pair 7 (Unable to allocate 9 GiB)"
    assert words_of(MemoryError()) == ""
    assert words_of(_NoMemoryError("x")) == " (Failed to allocate 12 bytes)"
    with pytest.raises(ValueError, match="other") as other, noted_if_out_of_memory("pair 8"):
        raise ValueError("other")
    assert not hasattr(other.value, "__notes__")


@pytest.mark.parametrize(
    ("options", "remedy"),
    [
        ({"scale", "disparities"}, "give smaller images (--scale 0.5) or fewer --disparities"),
        ({"disparities"}, "give smaller images or fewer --disparities"),
        ({"camera"}, "give smaller images, "),
        (set[str](), "close other programs"),
    ],
)
def test_the_remedy_names_options_that_the_command_has(options: set[str], remedy: str) -> None:
    """No command is told of an option that it does not have."""
    assert remedy_of(options).startswith(remedy)
    assert remedy_of(options).endswith("a machine with more memory")
