"""Sees when OpenCV decodes an image, with OpenCV left as it is: the interpreter reports its calls into C (sys.setprofile)."""

import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from types import FrameType

import cv2
import pytest

from phone_host.stereo import two_threads


@contextmanager
def watched_decoder(on_decoding: Callable[[], None]) -> Iterator[None]:
    """Call `on_decoding` whenever this thread, or one started meanwhile, is about to enter `cv2.imdecode`, for the length of a block."""

    def watch(_frame: FrameType, event: str, called: object) -> None:
        if event == "c_call" and called is cv2.imdecode:
            on_decoding()

    before, before_in_threads = sys.getprofile(), threading.getprofile()
    # Threads that are kept from earlier decodings would not be seen: others take their place meanwhile.
    with ThreadPoolExecutor(2) as helpers, pytest.MonkeyPatch.context() as patch:
        patch.setattr(two_threads, "HELPERS", helpers)
        sys.setprofile(watch)
        threading.setprofile(watch)
        try:
            yield
        finally:
            threading.setprofile(before_in_threads)
            sys.setprofile(before)
