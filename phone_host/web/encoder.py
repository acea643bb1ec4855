"""Encodes what viewers want, once for all of them, in one thread that never takes more than half a core.

Rules: everything that costs more than a fraction of a ms is made here, not in the thread of the event loop. Only the newest
result is encoded, and only what somebody waits for.
"""

import asyncio
import os
import threading
from collections.abc import Callable, Hashable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from typing import Final, TypeVar

import cv2

from common import now
from phone_host.model import Processed
from phone_host.output.ply import cloud_ply
from phone_host.output.preview import disparity_picture
from phone_host.report.depth_data import photograph
from phone_host.web.frames import Part, View, disparity, message, picture
from phone_host.web.source import Newest

T = TypeVar("T")

_NICE: Final = 5
"""The pipeline's threads go first where there are few cores."""

_MOST_PICTURE_PX: Final = 16_384


@dataclass(frozen=True, slots=True)
class Wanted:
    """What a viewer wants of each pair.

    Attributes:
        views: parts of the message, in its order.
        width_px: greatest width of pictures and grid, one of `frames.WIDTHS`.
        packed: whether the disparities are deflated.
    """

    views: tuple[View, ...]
    width_px: int
    packed: bool


class Encoder:
    """The thread, and what it has made of the newest result."""

    def __init__(self) -> None:
        self._thread = ThreadPoolExecutor(1, "page encoder", initializer=_be_nice)
        self._rest_until_ns = 0
        self._number = -1
        self._made: dict[Hashable, asyncio.Future[bytes]] = {}
        self._parts_of = -1
        self._parts: dict[Hashable, Part] = {}

    async def run(self, make: Callable[[], T]) -> T:
        """Run something in the thread, after a rest as long as the last thing took."""
        return await asyncio.get_running_loop().run_in_executor(self._thread, self._after_rest, make)

    async def message(self, newest: Newest, wanted: Wanted) -> bytes:
        """Return the message of a pair."""
        return await self._once(newest.number, wanted, lambda: self._message(newest, wanted))

    async def file(self, newest: Newest, name: str) -> bytes:
        """Return a file of a pair, one of `FILES` for which it has data."""
        return await self._once(newest.number, name, lambda: FILES[name](newest.result.processed))

    def close(self) -> None:
        """End the thread when it has done what it is at."""
        self._thread.shutdown(wait=False, cancel_futures=True)

    async def _once(self, number: int, key: Hashable, make: Callable[[], bytes]) -> bytes:
        """Make something of a result, or wait for what another viewer has begun."""
        if number > self._number:
            self._number, self._made = number, {}
        elif number < self._number:
            return await self.run(make)
        begun = self._made.get(key)
        if begun is None or begun.cancelled() or (begun.done() and begun.exception() is not None):
            begun = self._made[key] = asyncio.ensure_future(self.run(make))
        return await asyncio.shield(begun)  # a viewer that leaves does not take it from the others

    def _after_rest(self, make: Callable[[], T]) -> T:
        if (rest_ns := self._rest_until_ns - now.monotonic_ns()) > 0:
            threading.Event().wait(rest_ns / 1e9)
        began_ns = now.monotonic_ns()
        try:
            return make()
        finally:
            self._rest_until_ns = 2 * now.monotonic_ns() - began_ns

    def _message(self, newest: Newest, wanted: Wanted) -> bytes:
        if newest.number != self._parts_of:
            self._parts_of, self._parts = newest.number, {}
        processed = newest.result.processed
        parts = []
        for view in wanted.views:
            if view is View.DISPARITY and processed.disparity is None:
                continue
            key = (view, wanted.width_px, wanted.packed and view is View.DISPARITY)
            if key not in self._parts:
                self._parts[key] = _part(processed, view, wanted)
            parts.append(self._parts[key])
        return message(newest.number, processed, newest.result.ledger, tuple(parts), newest.begun)


def _part(processed: Processed, view: View, wanted: Wanted) -> Part:
    if view is not View.DISPARITY:
        return picture(processed, view, wanted.width_px)
    assert processed.disparity is not None
    return disparity(processed.disparity, wanted.width_px, packed=wanted.packed)


def _coloured(processed: Processed) -> bytes:
    """Return disparity.png as `stereo` writes it."""
    assert processed.disparity is not None
    drawn = disparity_picture(processed.disparity, processed.geometry)
    return cv2.imencode(".png", drawn, [cv2.IMWRITE_PNG_COMPRESSION, 1])[1].tobytes()


def _cloud(processed: Processed) -> bytes:
    assert processed.cloud is not None
    return cloud_ply(processed.cloud, processed.pair.left)


FILES: Final[dict[str, Callable[[Processed], bytes]]] = {
    "cloud.ply": _cloud,
    "disparity.png": _coloured,
    "left.jpg": lambda processed: photograph(processed.pair.left, _MOST_PICTURE_PX),
    "right.jpg": lambda processed: photograph(processed.pair.right, _MOST_PICTURE_PX),
}
"""The newest pair's files, by name."""


def has_data(name: str, processed: Processed) -> bool:
    """Whether a pair has what one of `FILES` is made of."""
    if name == "cloud.ply":
        return processed.cloud is not None
    return name != "disparity.png" or processed.disparity is not None


def _be_nice() -> None:
    """Let others of this process go first; only Linux knows threads here, and it needs no rights to step back."""
    with suppress(OSError, AttributeError):
        os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), _NICE)
