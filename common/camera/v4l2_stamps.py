"""From a kernel stamp to the exposure mid-point, the measured frame rate, and restarts at a wanted phase. Values only: no device or clock is read here.

Two flags of a stamp say which clock it is on and which moment it means (V4L2 specification, "Buffer flags"). uvcvideo sets "start of exposure" but
stamps the arrival of the frame's first packet, which comes after the sensor has been read out. So its flag is not believed.

A webcam whose sensor runs only while it streams takes its first exposure a fixed time after the start. On a loaded board
single stamps and single starts are tens of ms late, so no figure here rests on one of them.
"""

import math
from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from enum import Enum, auto
from statistics import median
from typing import Final

from common.camera import v4l2_abi as abi
from common.frame import FrameFault
from common.value import value

_PLAUSIBLE_AGE_NS: Final = 2_000_000_000
"""A stamp of an unnamed clock is taken for CLOCK_MONOTONIC if its frame was dequeued at most this much later. A full ring at 5 fps is
0.8 s old. Other clocks (wall time, time since the driver was loaded) differ by far more, except in a machine's first seconds."""

_RATE_WINDOW: Final = 31
_RATE_MINIMUM: Final = 8
_RATE_TOLERANCE: Final = 0.1


class StampClock(Enum):
    """What a driver says about the clock of its stamps."""

    MONOTONIC = auto()
    UNKNOWN = auto()
    COPY = auto()


class StampSource(Enum):
    """Which moment of the frame a stamp means."""

    END_OF_FRAME = auto()
    START_OF_EXPOSURE = auto()
    FIRST_PACKET = auto()


@value()
class Timing:
    """What is known about a camera besides each stamp.

    Attributes:
        driver: the kernel driver's name.
        readout_ns: time in which the sensor's rows are read one after another, ns.
        latency_ns: this camera's constant from the end of the readout to the stamp, ns; 0 until measured.
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
        clock: the clock that the driver names.
        dequeued_ns: CLOCK_MONOTONIC after the frame was dequeued.

    Returns:
        False for a stamp later than the dequeuing, whatever its flags say (vivid does that), and for a stamp of an unnamed clock that is
        too old.
    """
    age_ns = dequeued_ns - stamp_ns
    return age_ns >= 0 and (clock is StampClock.MONOTONIC or age_ns <= _PLAUSIBLE_AGE_NS)


def exposure_midpoint_ns(stamp_ns: int, source: StampSource, timing: Timing, exposure_ns: int | None) -> int:
    """Return when the middle row of the image was half exposed.

    With a rolling shutter of readout time R and exposure time E, the first row is exposed from 0 to E, the middle row from R/2 to R/2 + E,
    and the readout ends at R + E.

    Args:
        stamp_ns: a trusted stamp.
        source: which moment it means.
        timing: what is known of the camera.
        exposure_ns: exposure time, ns; None counts as 0, for lack of a better value.

    Returns:
        CLOCK_MONOTONIC, ns. First packet and end of frame: stamp - E/2 - R/2 - the camera's constant; start of exposure: stamp + E/2 + R/2.
    """
    half_ns = ((exposure_ns or 0) + timing.readout_ns) // 2
    if source is StampSource.START_OF_EXPOSURE:
        return stamp_ns + half_ns
    return stamp_ns - half_ns - timing.latency_ns


def estimated_readout_ns(shortest_period_ns: int) -> int:
    """Estimate the readout time of a sensor that does not report it: half of the shortest frame period that the camera offers at that size.

    A sensor reads its rows within one frame at that rate too, so R lies between 0 (global shutter) and that period. Half of it is therefore wrong by
    at most half the period, and the mid-point by at most a quarter. Webcams with 30 frames a second have 15 to 30 ms.
    """
    return shortest_period_ns // 2


def rate_remedy(period_ns: int, nominal_ns: int, exposure_ns: int | None) -> str:
    """Say what helps when a camera does not keep its rate. Webcams lengthen their exposure in dim light, and the period with it.

    Args:
        period_ns: measured time between frames, ns.
        nominal_ns: the time that was set, ns.
        exposure_ns: exposure time, ns; None if the camera does not report it.
    """
    given, most_ms = f"fps={1e9 / period_ns:.3g}", max(1, nominal_ns * 9 // 10_000_000)
    if period_ns < nominal_ns:
        return f"ask for the rate that it gives: {given}"
    light = f"more light, or exposure_ms={most_ms}"
    if exposure_ns is not None and exposure_ns >= nominal_ns:
        return f"each exposure takes {exposure_ns / 1e6:.0f} ms: {light}; or ask for {given}"
    return f"{light}; if the bus is full, smaller frames or another port; or ask for {given}"


class RateMeter:
    """The time between frames according to their stamps: running median over 31 frames; gaps are divided by the number of missing frames."""

    def __init__(self) -> None:
        self._periods_ns: deque[int] = deque(maxlen=_RATE_WINDOW)
        self._last: tuple[int, int] | None = None

    def add(self, stamp_ns: int, sequence: int) -> None:
        """Record a frame's stamp and its number in the stream."""
        if self._last is not None and (steps := sequence - self._last[1]) > 0:
            self._periods_ns.append((stamp_ns - self._last[0]) // steps)
        self._last = stamp_ns, sequence

    def restart(self) -> None:
        """Record that the stream restarts: the next frame has no predecessor."""
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


@dataclass(slots=True)
class Tally:
    """Counts that outlive the device. `stamps` is the clock named by the last frame's flags; None before the first frame."""

    grabs: int = 0
    missed: int = 0
    distrusted: int = 0
    refused: int = 0
    faults: dict[FrameFault, int] = field(default_factory=dict)
    stamps: StampClock | None = None
    rate: RateMeter = field(default_factory=RateMeter)

    def number(self) -> int:
        """The sequence number of the next grab."""
        self.grabs += 1
        return self.grabs - 1


_FRAMES: Final = 15
_STARTS: Final = 5
"""Each phase is the median of this many frames, the latency the median of this many starts."""


def typical_phase(moments_ns: Sequence[int], period_ns: int) -> int:
    """Return a moment at the phase that most of the moments share.

    Args:
        moments_ns: at least one, ns; the last is near the result.
        period_ns: time between two exposures, > 0.
    """
    last_ns, half_ns = moments_ns[-1], period_ns // 2
    # The median is taken around the circular mean: around a moment that is half a period off, the others would lie at both ends.
    turns = [math.tau * ((moment_ns - last_ns) % period_ns) / period_ns for moment_ns in moments_ns]
    mean = math.atan2(math.fsum(map(math.sin, turns)), math.fsum(map(math.cos, turns)))
    middle_ns = last_ns + round(mean / math.tau * period_ns)
    offs_ns = ((moment_ns - middle_ns + half_ns) % period_ns - half_ns for moment_ns in moments_ns)
    return middle_ns + round(median(offs_ns))


class RestartTiming:
    """Learns from the stamps of a camera's frames how long after a start it exposes."""

    def __init__(self) -> None:
        self._started_ns = 0
        self._first: list[int] = []
        self._recent: deque[int] = deque(maxlen=_FRAMES)
        self._latencies: deque[int] = deque(maxlen=_STARTS)

    def started(self, now_ns: int) -> None:
        """Take note of a start at `now_ns`."""
        self._started_ns = now_ns
        self._first.clear()
        self._recent.clear()

    def exposed(self, stamps_ns: Iterable[int]) -> None:
        """Take note of the middles of exposures, oldest first, ns on the clock of the start."""
        for stamp_ns in stamps_ns:
            self._recent.append(stamp_ns)
            if len(self._first) < _FRAMES:
                self._first.append(stamp_ns)

    def start_for(self, later_ns: int, earliest_ns: int, period_ns: int) -> int | None:
        """Return when to start the camera again so that it exposes `later_ns` later within its period.

        Call it once for each start: the latency of the stream that ends here is added to those of earlier starts.

        Args:
            later_ns: by how much later, in [0, period_ns).
            earliest_ns: no start before this moment.
            period_ns: time between two exposures, > 0.

        Returns:
            The first such moment; None while this stream has shown no frame.
        """
        if not self._first:
            return None
        self._latencies.append(typical_phase(self._first, period_ns) - self._started_ns)
        latency_ns = typical_phase(self._latencies, period_ns)
        start_ns = typical_phase(self._recent, period_ns) + later_ns - latency_ns
        return earliest_ns + (start_ns - earliest_ns) % period_ns
