"""What a hand does to two cameras on one rig, and what each of them then sees of it: with known times."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from common.frame import PixelFormat
from common.recording.recorded import Shown
from common.recording.ros_messages import RecordedImage
from phone_host.recording.sight import Sight

Floats = NDArray[np.float64]
RATE_HZ = 400
ZERO_NS = 1_700_000_000 * 10**9


def hand(chance: np.random.Generator, seconds: float, quantities: int = 3) -> Floats:
    """Return positions, (M, quantities), RATE_HZ times a second: their rates have a spread of 1, and little above 2 Hz."""
    count = int(seconds * RATE_HZ)
    hertz = np.fft.rfftfreq(count, 1 / RATE_HZ)
    rates = []
    for _ in range(quantities):
        spectrum = np.fft.rfft(chance.standard_normal(count)) / (1 + hertz**2) * (hertz > 0.1)
        rate = np.fft.irfft(spectrum, count)
        rates.append(rate / rate.std())
    return np.cumsum(np.stack(rates, axis=1), axis=0) / RATE_HZ


def at(positions: Floats, moments_s: Floats) -> Floats:
    """Return positions at any moments, (N, quantities)."""
    ticks = np.arange(len(positions)) / RATE_HZ
    return np.column_stack([np.interp(moments_s, ticks, one) for one in positions.T])


@dataclass(frozen=True, slots=True, kw_only=True)
class Eye:
    """A camera: from when to when it films, its rate, the error of each shift, and what its clock shows at true time t: t (1 + drift) + offset."""

    begin_s: float
    end_s: float
    rate_hz: float = 30.0
    noise_px: float = 0.1
    offset_s: float = 0.0
    drift: float = 0.0
    missing: float = 0.01

    def moments(self, chance: np.random.Generator) -> Floats:
        """Return when it exposes, true time, s."""
        moments = np.arange(self.begin_s + chance.uniform(0, 1 / self.rate_hz), self.end_s, 1 / self.rate_hz)
        return moments[chance.random(len(moments)) >= self.missing]

    def clock(self, moments_s: Floats) -> Floats:
        """Return what its clock shows."""
        return moments_s * (1 + self.drift) + self.offset_s


def simulated_sight(chance: np.random.Generator, positions: Floats, eye: Eye, mixing: Floats | None = None) -> Sight:
    """Return what a camera sees of a hand's motion: 10 px/s of shift, 5 %/s of brightness.

    Args:
        chance: for its errors.
        positions: of `hand`.
        eye: the camera.
        mixing: how it is turned, (3, 3).
    """
    moments = eye.moments(chance)
    steps = np.diff(at(positions, moments) @ (np.eye(3) if mixing is None else mixing), axis=0) * [10.0, 10.0, 0.05]
    steps = np.column_stack([steps, np.abs(steps[:, :2]).sum(axis=1)])
    steps += chance.standard_normal(steps.shape) * eye.noise_px * [1.0, 1.0, 0.005, 1.0]
    return Sight(eye.clock(moments), np.vstack([np.zeros(4), np.cumsum(steps, axis=0)]))


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
