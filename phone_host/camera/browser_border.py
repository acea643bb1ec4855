"""Decides which images of a browser's camera are believed, and when they were exposed. Pure.

An image is believed no more than a board's: its bytes must be a whole image of the size that it claims, that size and the
way it is turned must be those of the first image, its number must grow, and its stamp must be possible and fit the pace of
those before it. What is not believed is dropped by its name.

A camera exposes at its own even pace, and whole images may be missing. So an interval is a multiple of the period. A stamp
that was taken late, because the machine was busy, fits none: its image would be paired with one of another moment.
"""

from collections import deque
from dataclasses import dataclass
from statistics import median
from typing import Final

from common.frame import FrameFault
from phone_host.camera.browser_clock import BrowserClock, Epoch, Handed, Stamps
from phone_host.camera.browser_wire import BrowserFrame, Hello, read_frame
from phone_host.sync.clock import HostTime

_RECENT: Final = 9
"""The period is the median of so many intervals: it follows a camera that slows down in dim light within ten images."""

_LEAST: Final = 3
EVEN: Final = 0.25
"""Share of a period by which an interval may differ from a multiple of it. Pairs are up to half a period apart."""

COARSE: Final = 0.45
"""The same for stamps that count in coarse steps: Firefox's go in steps of 11.6 ms (blocks of its audio clock)."""

_INSIST: Final = 3
"""So many stamps in a row that fit none before them, but each other, are the camera's new pace."""


class Intervals:
    """The recent stamps of one camera."""

    def __init__(self) -> None:
        self._steps_ns: deque[int] = deque(maxlen=_RECENT)
        self._newest_ns: int | None = None
        self._trusted_ns: int | None = None
        self._doubted = 0

    @property
    def period_ns(self) -> int | None:
        """Time between two images, ns; None before four of them."""
        return round(median(self._steps_ns)) if len(self._steps_ns) >= _LEAST else None

    @property
    def unevenness_ns(self) -> int:
        """How far recent intervals are from each other, ns."""
        return max(self._steps_ns) - min(self._steps_ns) if self._steps_ns else 0

    def fits(self, stamp_ns: int, off: float = EVEN) -> bool:
        """Take the next stamp.

        Args:
            stamp_ns: when the image was exposed, ns.
            off: share of a period by which an interval may differ from a multiple of it.

        Returns:
            Whether it is plausible.
        """
        trusted_ns, newest_ns, self._newest_ns = self._trusted_ns, self._newest_ns, stamp_ns
        period_ns = self.period_ns
        if newest_ns is not None and stamp_ns > newest_ns:
            missing = 1 if period_ns is None else max(1, round((stamp_ns - newest_ns) / period_ns))
            self._steps_ns.append((stamp_ns - newest_ns) // missing)
        if trusted_ns is None or self._is_multiple(stamp_ns - trusted_ns, period_ns, off):
            self._trusted_ns, self._doubted = stamp_ns, 0
            return True
        self._doubted += 1
        step_ns = 0 if newest_ns is None else stamp_ns - newest_ns
        if self._doubted >= _INSIST and self._is_multiple(step_ns, period_ns, off):
            self._trusted_ns, self._doubted = stamp_ns, 0
            return stamp_ns > trusted_ns
        return False

    @staticmethod
    def _is_multiple(step_ns: int, period_ns: int | None, off: float) -> bool:
        if step_ns <= 0 or period_ns is None:
            return step_ns > 0
        return abs(step_ns - max(1, round(step_ns / period_ns)) * period_ns) <= off * period_ns


@dataclass(frozen=True, slots=True)
class Believed:
    """An image that is believed.

    Attributes:
        image: the image.
        exposed: exposure mid-point as far as it is known, host's clock.
        missed: images between this and the one before it that the browser dropped.
    """

    image: BrowserFrame
    exposed: HostTime
    missed: int


@dataclass(frozen=True, slots=True)
class Disbelieved:
    """An image that is not, and why; `missed` as in Believed."""

    fault: FrameFault
    missed: int = 0


class BrowserBorder:
    """The images of a browser's camera while one run uses it.

    Args:
        size_px: width and height that every image must have, px; None: as the first one.
    """

    def __init__(self, size_px: tuple[int, int] | None) -> None:
        self._size_px = size_px
        self._turn_deg: int | None = None
        self._track: str | None = None
        self._stamps = Stamps(is_same_machine=False)
        self._intervals = Intervals()
        self._is_phone = False
        self._sequence = -1
        self._dropped = 0
        self._changes = 0
        self._newest_ns = -(2**63)

    @property
    def epoch(self) -> Epoch | None:
        """On which clock the stamps count; None: it is being found out."""
        return self._stamps.epoch

    @property
    def scatter_ns(self) -> int:
        """How exact the stamps are if they count on no clock, ns."""
        return self._stamps.scatter_ns

    def begin(self, hello: Hello, *, is_same_machine: bool) -> None:
        """A browser has come. The stamps of a track that is known already go on."""
        if hello.track and hello.track == self._track:
            return
        self._track, self._is_phone = hello.track, hello.is_phone
        self._stamps = Stamps(is_same_machine=is_same_machine)
        self._intervals = Intervals()
        self._sequence, self._dropped, self._changes = -1, 0, 0

    def judge(self, data: bytes, arrived_ns: int, clock: BrowserClock, asleep_ns: int) -> Believed | Disbelieved:
        """Judge an image.

        Args:
            data: the message as it came.
            arrived_ns: when it came, host's clock, ns.
            clock: the browser's.
            asleep_ns: how long the host has slept since it booted, ns.
        """
        image = read_frame(data)
        if isinstance(image, FrameFault):
            return Disbelieved(image)
        if image.sequence <= self._sequence:
            return Disbelieved(FrameFault.STALE)
        missed = min(image.sequence - self._sequence - 1, max(0, image.dropped - self._dropped))
        self._sequence, self._dropped = image.sequence, image.dropped
        if self._turn_deg not in {image.rotation_deg, None}:
            return Disbelieved(FrameFault.TURNED, missed)
        if self._size_px not in {(image.width_px, image.height_px), None}:
            return Disbelieved(FrameFault.OTHER_SIZE, missed)
        exposed = self._exposed(image, arrived_ns, clock, asleep_ns)
        if isinstance(exposed, FrameFault):
            return Disbelieved(exposed, missed)
        self._turn_deg, self._size_px = image.rotation_deg, (image.width_px, image.height_px)
        return Believed(image, exposed, missed)

    def _exposed(
        self, image: BrowserFrame, arrived_ns: int, clock: BrowserClock, asleep_ns: int
    ) -> HostTime | FrameFault:
        handed = clock.to_host(image.callback_ns)
        if handed is None:
            return FrameFault.CLOCK_UNKNOWN
        if handed.ns - handed.bound_ns > arrived_ns:
            return FrameFault.IMPLAUSIBLE_TIME
        captured_ns = handed.ns
        if image.capture_ns is not None and image.capture_ns <= image.callback_ns:
            captured_ns -= image.callback_ns - image.capture_ns
        seen = Handed(
            stamp_ns=image.stamp_ns,
            browser_ns=image.callback_ns,
            host=handed,
            captured_ns=captured_ns,
            asleep_ns=asleep_ns,
        )
        found = self._stamps.exposed(seen)
        if self._changes != self._stamps.changes:
            self._changes, self._intervals = self._stamps.changes, Intervals()
        if found is None:
            return FrameFault.CLOCK_UNKNOWN if self._stamps.epoch is None else FrameFault.IMPLAUSIBLE_TIME
        if self._is_phone and image.exposure_ns is not None:
            found = HostTime(found.ns + image.exposure_ns // 2, found.uncertainty_ns, found.bound_ns)
        is_free = self._stamps.epoch is Epoch.FREE
        fits = self._intervals.fits(found.ns, COARSE if is_free else EVEN)
        if not fits or not self._newest_ns < found.ns <= arrived_ns:
            return FrameFault.IMPLAUSIBLE_TIME
        if is_free:
            coarse_ns = self._intervals.unevenness_ns
            found = HostTime(found.ns, found.uncertainty_ns + coarse_ns, found.bound_ns + coarse_ns)
        self._newest_ns = found.ns
        return found
