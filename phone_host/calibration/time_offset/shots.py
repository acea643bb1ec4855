"""The inputs and outputs of all measurements of a time offset.

The time offset is the stamp of the host's camera minus the stamp of the board's camera for one and the same moment,
both on the host's clock. It is added to the board's stamps before frames are paired. A stamp means the exposure
mid-point of the middle row: with a rolling shutter a row at y is exposed (y / height - 1/2) readouts later.
"""

from dataclasses import dataclass
from enum import Enum
from typing import Final

import numpy as np
from numpy.typing import NDArray

from common.errors import DataError
from common.words import counted
from phone_host.model import TimeOffset
from phone_host.stereo.raw_images import EncodedImage

Times = NDArray[np.float64]
"""(N,) float64, s, from the first shot of either camera on: ns as float64 would lose digits on a clock that counts days."""

SIGMAS: Final = 3.3
"""Half-width that holds 99.9 % of a normal distribution."""

LEAST_SHOTS: Final = 30
"""Less than a second of video is not enough to measure anything."""


class Method(Enum):
    """What is filmed."""

    SCREEN = "screen"
    SCENE = "scene"


@dataclass(frozen=True, slots=True)
class Shot:
    """One frame of one camera, still encoded.

    Attributes:
        exposed_ns: its exposure mid-point on the host's clock.
        image: the frame.
    """

    exposed_ns: int
    image: EncodedImage


@dataclass(frozen=True, slots=True, eq=False)
class Measured:
    """A time offset, and how well each other offset would fit.

    Attributes:
        offset: with its uncertainty (99.9 %).
        method: how it was measured.
        samples: number of decoded frames or features behind it.
        offsets_s: (M,) offsets that were tried.
        misfits: (M,) how badly each fits, in the measure that `misfit` names.
        misfit: name and unit of that measure.
    """

    offset: TimeOffset
    method: Method
    samples: int
    offsets_s: Times
    misfits: NDArray[np.float64]
    misfit: str


def require_shots(board: int, host: int) -> None:
    """Refuse recordings that are too short.

    Raises:
        DataError: a recording is too short; names the camera.
    """
    for whose, count in (("board", board), ("host", host)):
        if count < LEAST_SHOTS:
            raise DataError(
                f"too short: {counted(count, 'frame')} of the {whose}'s camera, at least {LEAST_SHOTS} are needed",
                "film longer with --seconds, or check that the camera delivers frames",
            )


def to_seconds(board_ns: list[int], host_ns: list[int]) -> tuple[Times, Times, int]:
    """Convert stamps to seconds from the first one on; also return the first one, ns."""
    start_ns = min(board_ns[0], host_ns[0])
    board, host = (np.array([ns - start_ns for ns in stamps]) / 1e9 for stamps in (board_ns, host_ns))
    return board, host, start_ns


def period_s(times: Times) -> float:
    """Return the median time between shots."""
    return float(np.median(np.diff(times)))


def rolling_s(row: float, period: float) -> float:
    """Return how much later than the middle row another row may have been exposed. The readout time is unknown; cameras are taken to have half a period.

    Args:
        row: 0 at the top, 1 at the bottom.
        period: time between frames, s.
    """
    return abs(row - 0.5) * period / 2
