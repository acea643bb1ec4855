"""A board that starts before its camera is plugged in waits for it."""

import logging
import socket
from typing import Final

from board_agent.sd_notify import Notifier
from common import now
from common.camera.base import Camera
from common.camera.factory import open_camera
from common.errors import UnavailableError
from common.link.waiter import Waiter
from common.program.logs import event

_LOG = logging.getLogger(__name__)

_CAMERA_RETRY_MS: Final = 500
"""A camera that was missing at the start is found within this time, half of the time allowed for recovery. A look at /dev costs a board 7 ms."""


def wait_for_camera(uri: str, clock: str, wake: socket.socket, notifier: Notifier) -> Camera | None:
    """Open a camera; wait for it as long as necessary.

    Args:
        uri: the camera.
        clock: name of this machine's clock, for the stamps.
        wake: readable end of a socket that signals write to.
        notifier: is told what is missing.

    Returns:
        The open camera; None if a signal came first.

    Raises:
        SettingsError: the URI makes no sense.
        DataError: a replay's images are bad.
    """
    waiter = Waiter([wake])
    known = ""
    while True:
        now_ns = now.monotonic_ns()
        try:
            return open_camera(uri, clock, now_ns)
        except UnavailableError as error:
            if error.problem != known:
                known = error.problem
                _LOG.warning(event("camera_missing", problem=known))
            if notifier.due(now_ns):
                notifier.alive(now_ns, f"waiting for the camera: {known}")
        if waiter.wait(_CAMERA_RETRY_MS):
            return None
