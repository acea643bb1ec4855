"""Checks a camera while it films: hold it still, move it a little, then leave it. Pure: frames in, what to do next and verdicts out.

A look at a stretch of film takes seconds. So this hands the stretches out, no more at a time than it needs, and takes what was
seen in them; whoever drives it looks in another thread, or frames would seem to be missing.
"""

import math
from dataclasses import dataclass, replace
from enum import Enum
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.doctor.camera_check.look import FRAMES, Reading, Window, may_tell
from phone_host.model import CameraModel, Image, Side
from phone_host.model.capture import CaptureReport, CaptureSource, Pace, Rigidity, Unseen, Warping
from phone_host.stereo.scaled_rig import scaled_camera

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


_WIDTH_PX: Final = 640
"""Wider images are reduced: points are followed to a thirtieth of a pixel, and a stabiliser's warp is larger than one."""

_FASTEST_HZ: Final = 40.0
"""Of faster films every second frame, or fewer, is used: in two thirds of a second a hand trembles, in a third hardly."""

ENOUGH: Final = 6
"""Stretches that tell something, after which no more is asked for."""

_FEWEST: Final = 3
_WARPED_SHARE: Final = 0.5
_RIGID_SHARE: Final = 0.75
_CERTAIN: Final = 0.8
"""Excess that no rigid camera leaves, not even before a wall, whose film fits many cameras: rendered posters leave 0.47 at most."""

_CERTAINLY: Final = 2
"""So many such stretches before a wall tell, however many others do not."""

_BRIGHTNESS_STEP: Final = 8

_LEAST_READOUT_MS: Final = 2.0
"""No sensor of a phone that we know is read within less. Rows of one moment are the work of a stabiliser, which turns each row back by its own
time."""


class Stage(Enum):
    """What the user shall do."""

    STILL = "still"
    MOVE = "move"
    WATCH = "watch"
    DONE = "done"


@dataclass(frozen=True, slots=True)
class Plan:
    """How long a check takes.

    Attributes:
        whole_s: all of it.
        still_s: of that, held still at first.
        move_s: no longer than this the user is asked to move it.
    """

    whole_s: float = 60.0
    still_s: float = 8.0
    move_s: float = 40.0


@dataclass(frozen=True, slots=True)
class Progress:
    """How far a check is.

    Attributes:
        stage: what the user shall do.
        share: of the whole that is done, 0 to 1.
        told: stretches that told something.
        last: why the last one did not; None: it did, or there was none.
    """

    stage: Stage
    share: float
    told: int
    last: Unseen | None


class CaptureCheck:
    """Checks one camera.

    Args:
        source: whose images they are.
        asked_hz: rate that was asked for; NaN: none was.
        lens: the calibrated lens, for images of the source's size; None: not calibrated.
        plan: how long it takes.
    """

    def __init__(self, source: CaptureSource, asked_hz: float, lens: CameraModel | None, plan: Plan) -> None:
        self._source, self._asked_hz, self._plan = source, asked_hz, plan
        self._by = min(1.0, _WIDTH_PX / source.width_px)
        self._size = (round(source.width_px * self._by), round(source.height_px * self._by))
        self._lens = None if lens is None else scaled_camera(lens, self._size, Side.RIGHT)
        self._shots: list[Shot] = []
        self._frames: list[Image] = []
        self._skipped = 0
        self._readings: list[Reading] = []
        self._looks = 0

    def add(self, luma: Image, captured_ns: int, arrived_ns: int, exposure_ns: int | None) -> Window | None:
        """Take a frame.

        Args:
            luma: (H, W) uint8, grey.
            captured_ns: its stamp, on the host's clock.
            arrived_ns: when the host had it, on the same clock.
            exposure_ns: exposure time; None: the camera does not say.

        Returns:
            A stretch of film to look at, whose reading `take` must be given.
        """
        brightness = float(luma[::_BRIGHTNESS_STEP, ::_BRIGHTNESS_STEP].mean())
        before = self._shots[-1].captured_ns if self._shots else None
        self._shots.append(Shot(captured_ns, arrived_ns, exposure_ns, brightness))
        is_usual = luma.shape == (self._source.height_px, self._source.width_px)
        if self.progress.stage is not Stage.MOVE or before is None or not is_usual:
            self._frames.clear()
            return None
        return self._collected(luma, captured_ns - before)

    def take(self, reading: Reading) -> None:
        """Take what was seen in the last stretch."""
        self._looks -= 1
        self._readings.append(reading)

    @property
    def progress(self) -> Progress:
        """How far it is."""
        told = sum(each.unseen is None for each in self._readings)
        last = self._readings[-1].unseen if self._readings else None
        if not self._shots:
            return Progress(Stage.STILL, 0.0, told, last)
        plan, at_s = self._plan, (self._shots[-1].captured_ns - self._shots[0].captured_ns) / 1e9
        share = min(max(at_s / plan.whole_s, 0.0), 1.0)
        is_enough = told + self._looks >= ENOUGH
        if at_s >= plan.whole_s:
            stage = Stage.DONE
        elif at_s < plan.still_s:
            stage = Stage.STILL
        else:
            stage = Stage.WATCH if is_enough or at_s >= plan.still_s + plan.move_s else Stage.MOVE
        return Progress(stage, share, told, last)

    @property
    def report(self) -> CaptureReport:
        """What was found so far."""
        found = rigidity_of(self._readings, by_phone=self._source.is_of_phone)
        rigidity = replace(found, knows_lens=self._lens is not None)
        return CaptureReport(source=self._source, pace=pace_of(self._shots, self._asked_hz), rigidity=rigidity)

    def _collected(self, luma: Image, step_ns: int) -> Window | None:
        """Add a frame to the stretch; return it when it is complete."""
        usual_ns = self._usual_ns
        if not 0 < step_ns < _GAP * usual_ns:
            self._frames.clear()
        stride = max(1, math.ceil(1e9 / usual_ns / _FASTEST_HZ))
        self._skipped = (self._skipped + 1) % stride if self._frames else 0
        if self._skipped:
            return None
        small = luma if self._by == 1.0 else cv2.resize(luma, self._size, interpolation=cv2.INTER_AREA)
        self._frames.append(np.asarray(small, np.uint8))
        if len(self._frames) < FRAMES:
            return None
        window = Window(tuple(self._frames), stride * usual_ns / 1e6, self._lens)
        self._frames.clear()
        self._looks += 1
        if may_tell(window):
            return window
        self.take(Reading(Unseen.STILL))
        return None

    @property
    def _usual_ns(self) -> float:
        """The usual interval, by the newest frames."""
        newest = [shot.captured_ns for shot in self._shots[-2 * FRAMES :]]
        return max(float(np.median(np.diff(newest))), 1.0)


def rigidity_of(readings: list[Reading], *, by_phone: bool = False) -> Rigidity:
    """Judge what all stretches of film tell.

    Args:
        readings: in their order.
        by_phone: whether a phone's program, such as its browser, stands between the sensor and the images.
    """
    told = [each for each in readings if each.unseen is None or _is_certain(each)]
    if not told:
        return Rigidity(unseen=_usual([each.unseen for each in readings if each.unseen is not None]))
    warped = [each for each in told if each.is_warped]
    share = len(warped) / len(told)
    found, unseen = Warping.UNKNOWN, None
    flat = sum(each.unseen is Unseen.FLAT for each in readings if not _is_certain(each))
    is_certain = sum(_is_certain(each) for each in told) >= _CERTAINLY
    if len(told) >= _FEWEST and (is_certain or len(told) > flat):
        if share >= _WARPED_SHARE:
            found = Warping.STABILISED
        elif share <= 1 - _RIGID_SHARE:
            found = Warping.GOOD
        else:
            unseen = Unseen.VAGUE
    else:
        unseen = _usual([each.unseen for each in readings if each.unseen is not None] or [Unseen.STILL])
    rigid = [each for each in told if not each.is_warped]
    readout_ms, readout_sigma_ms = _readout(rigid) if found is Warping.GOOD else (math.nan, math.nan)
    if by_phone and readout_ms < _LEAST_READOUT_MS:
        found = Warping.STABILISED
    return Rigidity(
        warping=found,
        unseen=unseen,
        windows=len(told),
        warped=len(warped),
        excess=float(np.median([each.excess for each in told])),
        noise_px=float(np.median([each.noise_px for each in told])),
        readout_ms=readout_ms,
        readout_sigma_ms=readout_sigma_ms,
    )


def _is_certain(reading: Reading) -> bool:
    """Whether a stretch before a flat scene tells all the same."""
    return reading.unseen is Unseen.FLAT and reading.excess >= _CERTAIN


def _usual(reasons: list[Unseen]) -> Unseen:
    """Return the most frequent reason, the earlier one of two that are as frequent; without any, that nothing moved."""
    return max(Unseen, key=reasons.count)


def _readout(rigid: list[Reading]) -> tuple[float, float]:
    """Return the readout and its uncertainty, ms: the median of the stretches, and how far they scatter."""
    found = np.array([each.readout_ms for each in rigid])
    middle = float(np.median(found))
    scatter = 1.48 * float(np.median(np.abs(found - middle))) / math.sqrt(len(found))
    return middle, max(scatter, float(np.median([each.readout_sigma_ms for each in rigid])))
