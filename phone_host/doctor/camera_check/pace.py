"""How frames come: rate, gaps, jitter of the stamps, delay, and whether any of it grows worse. Pure."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.model.capture import Pace

_GAP: Final = 1.5
"""An interval of this many usual ones misses a frame."""

_FEW: Final = 8
"""Frames below which quarters tell nothing."""


@dataclass(frozen=True, slots=True)
class Shot:
    """When one frame was taken, and how.

    Attributes:
        captured_ns: its stamp, on the host's clock.
        arrived_ns: when the host had it, on the same clock.
        exposure_ns: exposure time; None: the camera does not say.
        brightness: mean grey level.
    """

    captured_ns: int
    arrived_ns: int
    exposure_ns: int | None
    brightness: float


def pace_of(shots: list[Shot], asked_hz: float) -> Pace:
    """Judge when frames came.

    Args:
        shots: in the order of their arrival.
        asked_hz: rate that was asked for; NaN: none was.
    """
    exposures = [shot.exposure_ns / 1e6 for shot in shots if shot.exposure_ns is not None]
    brightness = float(np.mean([shot.brightness for shot in shots])) if shots else math.nan
    exposure_ms, longest_ms = (float(np.median(exposures)), max(exposures)) if exposures else (math.nan, math.nan)
    if len(shots) < 2:
        return Pace(
            frames=len(shots),
            asked_hz=asked_hz,
            exposure_ms=exposure_ms,
            longest_exposure_ms=longest_ms,
            brightness=brightness,
        )
    zero = shots[0].captured_ns
    captured = np.array([(shot.captured_ns - zero) / 1e6 for shot in shots])
    delay = np.array([(shot.arrived_ns - shot.captured_ns) / 1e6 for shot in shots])
    steps = np.diff(captured)
    forward = steps[steps > 0]
    usual = float(np.median(forward)) if forward.size else math.nan
    first, last = _quarters(captured)
    return Pace(
        frames=len(shots),
        seconds=float(captured.max() - captured.min()) / 1e3,
        asked_hz=asked_hz,
        rate_hz=_rate(captured),
        usual_hz=1e3 / usual,
        first_hz=_rate(captured[first]),
        last_hz=_rate(captured[last]),
        missing=int(sum(round(step / usual) - 1 for step in forward if step > _GAP * usual)),
        backwards=int((steps <= 0).sum()),
        jitter_ms=_jitter(captured),
        delay_ms=float(np.median(delay)),
        delay_jitter_ms=float(np.percentile(delay, 95) - delay.min()),
        first_delay_ms=float(np.median(delay[first])),
        last_delay_ms=float(np.median(delay[last])),
        exposure_ms=exposure_ms,
        longest_exposure_ms=longest_ms,
        brightness=brightness,
    )


def _quarters(captured_ms: NDArray[np.float64]) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return which frames lie in the first and in the last quarter of the time; all of them if they are few."""
    if len(captured_ms) < _FEW:
        return (np.ones(len(captured_ms), bool),) * 2
    low, high = np.percentile(captured_ms, [0, 100])
    return captured_ms <= low + (high - low) / 4, captured_ms >= high - (high - low) / 4


def _rate(captured_ms: NDArray[np.float64]) -> float:
    span = float(captured_ms.max() - captured_ms.min()) if len(captured_ms) > 1 else 0.0
    return 1e3 * (len(captured_ms) - 1) / span if span > 0 else math.nan


def _jitter(captured_ms: NDArray[np.float64]) -> float:
    """Return how far a stamp lies from the middle of its neighbours, 95th percentile, as one stamp's error; NaN: fewer than five stamps.

    Gaps are left out: they are no jitter.
    """
    steps = np.diff(captured_ms)
    if len(steps) < 4:
        return math.nan
    even = np.maximum(steps[1:], steps[:-1]) < _GAP * np.median(steps)
    off = np.abs(steps[1:] - steps[:-1])[even] / 2
    return float(np.percentile(off, 95) / math.sqrt(1.5)) if off.size else math.nan
