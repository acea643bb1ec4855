"""From a kernel stamp to the exposure mid-point, and the frame rate as measured. Values only: no device, no clock is read here.

The stamp's two flags say which clock it is on and which moment it means (V4L2 specification, "Buffer flags"). uvcvideo sets
"start of exposure" but stamps the arrival of the frame's first packet, which is after the sensor has been read out: its flag is not believed.
"""

from collections import deque
from dataclasses import dataclass
from enum import Enum, auto
from typing import Final

from common.camera import v4l2_abi as abi

_PLAUSIBLE_AGE_NS: Final = 2_000_000_000
"""A stamp of an unnamed clock is taken for CLOCK_MONOTONIC if its frame was dequeued at most this long after it: a full ring at 5 fps is
0.8 s old; another clock (wall time, time since the driver was loaded) is off by far more, save in a machine's first seconds."""

_RATE_WINDOW: Final = 31
_RATE_MINIMUM: Final = 8
_RATE_TOLERANCE: Final = 0.1


class StampClock(Enum):
    """What a driver says of its stamps' clock."""

    MONOTONIC = auto()
    UNKNOWN = auto()
    COPY = auto()


class StampSource(Enum):
    """Which moment of the frame a stamp means."""

    END_OF_FRAME = auto()
    START_OF_EXPOSURE = auto()
    FIRST_PACKET = auto()


@dataclass(frozen=True, slots=True)
class Timing:
    """What is known of a camera beside each stamp.

    Attributes:
        driver: the kernel driver's name.
        readout_ns: time in which the sensor's rows are read one after the other, ns.
        latency_ns: constant of this camera between the end of the readout and the stamp, ns; 0 until measured.
    """

    driver: str
    readout_ns: int
    latency_ns: int = 0


def stamp_clock(flags: int) -> StampClock:
    """The clock that a buffer's flags name."""
    kind = flags & abi.BUF_FLAG_TIMESTAMP_MASK
    if kind == abi.BUF_FLAG_TIMESTAMP_MONOTONIC:
        return StampClock.MONOTONIC
    return StampClock.COPY if kind == abi.BUF_FLAG_TIMESTAMP_COPY else StampClock.UNKNOWN


def stamp_source(flags: int, driver: str) -> StampSource:
    """The moment that a buffer's stamp means."""
    if driver == "uvcvideo":
        return StampSource.FIRST_PACKET
    if flags & abi.BUF_FLAG_TSTAMP_SRC_MASK == abi.BUF_FLAG_TSTAMP_SRC_SOE:
        return StampSource.START_OF_EXPOSURE
    return StampSource.END_OF_FRAME


def is_trusted(stamp_ns: int, clock: StampClock, dequeued_ns: int) -> bool:
    """Whether a stamp is a moment of CLOCK_MONOTONIC at which the frame can have been taken.

    Args:
        stamp_ns: the kernel's stamp.
        clock: what the driver says of it.
        dequeued_ns: CLOCK_MONOTONIC after the frame was dequeued.

    Returns:
        False for a stamp after the frame was in our hands, whatever its flags say (vivid does that), and for one of an unnamed clock that is
        too old.
    """
    age_ns = dequeued_ns - stamp_ns
    return age_ns >= 0 and (clock is StampClock.MONOTONIC or age_ns <= _PLAUSIBLE_AGE_NS)


def exposure_midpoint_ns(stamp_ns: int, source: StampSource, timing: Timing, exposure_ns: int | None) -> int:
    """When the middle row of the image was half exposed.

    With a rolling shutter of readout time R and exposure time E, the first row is exposed from 0 to E, the middle row from R/2 to R/2 + E,
    and the readout ends at R + E.

    Args:
        stamp_ns: a trusted stamp.
        source: which moment it means.
        timing: what is known of the camera.
        exposure_ns: exposure time, ns; None counts as 0, for want of better.

    Returns:
        CLOCK_MONOTONIC, ns. First packet and end of frame: stamp - E/2 - R/2 - the camera's constant; start of exposure: stamp + E/2 + R/2.
    """
    half_ns = ((exposure_ns or 0) + timing.readout_ns) // 2
    if source is StampSource.START_OF_EXPOSURE:
        return stamp_ns + half_ns
    return stamp_ns - half_ns - timing.latency_ns


def estimated_readout_ns(shortest_period_ns: int) -> int:
    """The readout time of a sensor that does not tell: half of the shortest frame period that the camera offers at that size.

    A sensor reads its rows within one frame, at that rate, too, so R lies between 0 (global shutter) and that period; the middle is off by half
    of it at most, and so the mid-point by a quarter. Webcams of 30 frames a second have 15 to 30 ms.

    Args:
        shortest_period_ns: the period, ns.
    """
    return shortest_period_ns // 2


class RateMeter:
    """The time between frames as their stamps tell it: running median over 31 frames, gaps divided by the frames they left out."""

    def __init__(self) -> None:
        self._periods_ns: deque[int] = deque(maxlen=_RATE_WINDOW)
        self._last: tuple[int, int] | None = None

    def add(self, stamp_ns: int, sequence: int) -> None:
        """Take note of a frame with its stamp and its number in the stream."""
        if self._last is not None and (steps := sequence - self._last[1]) > 0:
            self._periods_ns.append((stamp_ns - self._last[0]) // steps)
        self._last = stamp_ns, sequence

    def restart(self) -> None:
        """Take note that the stream begins anew: the next frame has no predecessor."""
        self._last = None

    @property
    def period_ns(self) -> int | None:
        """The median period, ns; None before 8 frames."""
        if len(self._periods_ns) < _RATE_MINIMUM:
            return None
        return sorted(self._periods_ns)[len(self._periods_ns) // 2]

    def differs_from(self, nominal_ns: int) -> bool:
        """Whether the camera's period, over a full window, is more than 10 % off the nominal one."""
        period_ns = self.period_ns if len(self._periods_ns) == _RATE_WINDOW else None
        return period_ns is not None and abs(period_ns - nominal_ns) > _RATE_TOLERANCE * nominal_ns
