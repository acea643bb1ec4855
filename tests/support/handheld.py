"""What a hand does to two cameras on one rig, and the images that each of them then takes: with known times."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from common.frame import PixelFormat
from common.recording.recorded import Shown
from common.recording.ros_messages import RecordedImage

Floats = NDArray[np.float64]
RATE_HZ = 400
ZERO_NS = 1_700_000_000 * 10**9


def hand(chance: np.random.Generator, seconds: float) -> Floats:
    """Return positions, (M, 2), RATE_HZ times a second: their rates have a spread of 1, and little above 2 Hz."""
    count = int(seconds * RATE_HZ)
    hertz = np.fft.rfftfreq(count, 1 / RATE_HZ)
    rates = []
    for _ in range(2):
        spectrum = np.fft.rfft(chance.standard_normal(count)) / (1 + hertz**2) * (hertz > 0.1)
        rate = np.fft.irfft(spectrum, count)
        rates.append(rate / rate.std())
    return np.cumsum(np.stack(rates, axis=1), axis=0) / RATE_HZ


def at(positions: Floats, moments_s: Floats) -> Floats:
    """Return positions at any moments, (N, 2)."""
    ticks = np.arange(len(positions)) / RATE_HZ
    return np.column_stack([np.interp(moments_s, ticks, one) for one in positions.T])


@dataclass(frozen=True, slots=True, kw_only=True)
class Eye:
    """A camera: from when to when it films, its rate, and what its clock shows more than the true time."""

    begin_s: float
    end_s: float
    rate_hz: float = 30.0
    offset_s: float = 0.0
    missing: float = 0.01

    def moments(self, chance: np.random.Generator) -> Floats:
        """Return when it exposes, true time, s."""
        moments = np.arange(self.begin_s + chance.uniform(0, 1 / self.rate_hz), self.end_s, 1 / self.rate_hz)
        return moments[chance.random(len(moments)) >= self.missing]

    def clock(self, moments_s: Floats) -> Floats:
        """Return what its clock shows."""
        return moments_s + self.offset_s


def panned(chance: np.random.Generator, positions: Floats, eye: Eye) -> list[Shown]:
    """Return 96x72 JPEG images of a wall, over which a hand moves a camera by 20 px/s; what it shows at time 0 is stamped ZERO_NS."""
    wall = cv2.resize(
        np.random.default_rng(5).integers(0, 255, (40, 60), np.uint8), (600, 400), interpolation=cv2.INTER_CUBIC
    )
    moments = eye.moments(chance)
    shown = []
    for number, (moment, place) in enumerate(zip(moments, at(positions, moments), strict=True)):
        moved = np.array([[1.0, 0, 20 * place[0] - 250], [0, 1, 20 * place[1] - 160]])
        done, jpeg = cv2.imencode(".jpg", cv2.warpAffine(wall, moved, (96, 72), borderMode=cv2.BORDER_REFLECT))
        assert done
        stamp_ns = ZERO_NS + round(float(eye.clock(np.array([moment]))[0]) * 1e9)
        image = RecordedImage(stamp_ns, "left", PixelFormat.MJPEG, (0, 0), jpeg.tobytes())
        shown.append(Shown(image, number, stamp_ns + 2_000_000, stamp_ns + 2_000_000, stamp_ns + 2_000_000))
    return shown
