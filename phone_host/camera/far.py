"""What cameras have in common that push images over a network: no modes, no grid that could be moved, and a way that breaks now and then.

A slow reader never builds up a backlog: a frame that a newer one replaces before it was read is reported as skipped. The
caller's lock protects it.
"""

import logging
import os
from contextlib import suppress
from typing import Final

from common.camera.base import Grab, Mode, Offers, Skipped
from common.camera.life import NEVER_NS, LifeSettings, Unwanted
from common.camera.v4l2_stamps import RateMeter
from common.frame import Frame
from common.program.logs import event

_MOST: Final = 64


class WaitingGrabs:
    """The grabs that wait, and a file descriptor that is readable while there are any."""

    def __init__(self) -> None:
        self._grabs: list[Grab] = []
        self._read_fd, self._write_fd = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)
        self._is_open = True

    @property
    def pollable(self) -> int:
        """Readable when something has come, or `tell` was called."""
        return self._read_fd

    def add(self, grab: Grab, next_sequence: int) -> None:
        """Take a grab.

        Args:
            grab: the grab; a frame replaces the one that waits.
            next_sequence: number of the grab that would follow.
        """
        if isinstance(grab, Frame):
            self._skip_waiting()
        self._grabs.append(grab)
        if len(self._grabs) > _MOST:  # nobody reads: merge the old grabs into one Skipped
            *old, newest = self._grabs
            passed = sum(item.frames if isinstance(item, Skipped) else 1 for item in old)
            self._grabs = [Skipped(next_sequence - 1 - passed, passed), newest]
        self.tell()

    def take(self) -> list[Grab]:
        """Return everything that waits."""
        with suppress(BlockingIOError):
            os.read(self._read_fd, 4096)
        grabs, self._grabs = self._grabs, []
        return grabs

    def clear(self) -> None:
        """Forget everything that waits."""
        self._grabs.clear()

    def tell(self) -> None:
        """Wake the reader."""
        if self._is_open:
            with suppress(BlockingIOError):
                os.write(self._write_fd, b"\0")

    def close(self) -> None:
        """Release the file descriptors. May be called again."""
        if self._is_open:
            self._is_open = False
            os.close(self._read_fd)
            os.close(self._write_fd)

    def _skip_waiting(self) -> None:
        """Turn the frame that waits into Skipped, merged with any Skipped just before it."""
        if not (self._grabs and isinstance(waiting := self._grabs[-1], Frame)):
            return
        self._grabs.pop()
        skipped = Skipped(waiting.sequence)
        if self._grabs and isinstance(before := self._grabs[-1], Skipped):
            self._grabs.pop()
            skipped = Skipped(before.sequence, before.frames + 1)
        self._grabs.append(skipped)


_LOG = logging.getLogger(__name__)

SECOND_NS: Final = 1_000_000_000
MEASURE_FRAMES: Final = 9
MEASURE_NS: Final = 3 * SECOND_NS
"""The period is the median of eight intervals. If these take longer, the images that came until then are used."""

LIFE: Final = LifeSettings(
    # If a phone's camera must wake up, or is opened anew for another size, the first image takes some seconds.
    start_ns=10 * SECOND_NS,
    # Wi-Fi occasionally delays packets by a second. Without an image for ten periods, at least two seconds, it is lost.
    first_frame_ns=2 * SECOND_NS,
    silence_ns=2 * SECOND_NS,
    silence_periods=10,
    # Between two attempts, doubled each time: a phone that is back is found within a second (DESIGN, section 7).
    lost_rest_ns=SECOND_NS // 10,
    rest_ns=SECOND_NS // 10,
    longest_rest_ns=SECOND_NS,
    # The phone may rest, too.
    unwanted=Unwanted.IS_CLOSED,
)


class FarCamera:
    """The common half of such a camera."""

    def __init__(self) -> None:
        self._waiting = WaitingGrabs()
        self._rate = RateMeter()
        self._is_told_lost = False

    @property
    def pollable(self) -> int | None:
        """Readable when something has come."""
        return self._waiting.pollable

    @property
    def offers(self) -> Offers:
        """No modes: what is not wanted is not asked for, or dropped."""
        return Offers()

    def due_ns(self, now_ns: int) -> int:
        """Return NEVER_NS: nothing is due by time alone."""
        del now_ns
        return NEVER_NS

    def anchor(self, exposed_ns: int, index: int) -> None:
        """Do nothing: it has its own clock."""

    def steer(self, later_ns: int, now_ns: int) -> None:
        """Do nothing: it cannot be steered."""

    def adapt(self, mode: Mode, now_ns: int) -> None:
        """Do nothing: it offers no modes."""

    def _log_lost(self, camera: str, problem: str) -> None:
        """Say once that the camera is lost."""
        if not self._is_told_lost:
            self._is_told_lost = True
            _LOG.warning(event("camera_lost", camera=camera, problem=problem))

    def _log_back(self, camera: str) -> None:
        """Say that it is back, if it was said to be lost."""
        if self._is_told_lost:
            self._is_told_lost = False
            _LOG.info(event("camera_back", camera=camera))
