"""What cameras have in common that push images over a network: no modes, no grid that could be moved, and a way that breaks now and then."""

import logging
from typing import Final

from common.camera.base import Mode, Offers
from common.camera.life import NEVER_NS, LifeSettings, Unwanted
from common.camera.v4l2_stamps import RateMeter
from common.program.logs import event
from phone_host.camera.waiting_grabs import WaitingGrabs

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
