"""What the stated error of a surface covers. Pure."""

from enum import Enum


class ErrorScope(Enum):
    """What the stated error of a surface covers.

    NOISE: the noise of single pairs; the drift of the camera's path comes on top. DRIFT: noise, matching errors that pairs share, and drift.
    """

    NOISE = "drift not included"
    DRIFT = "drift included"
