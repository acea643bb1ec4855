"""A V4L2 camera for months of use: opened once, kept through unplugging, driver failures and stalls, resting while nobody listens.

`life.py` decides when it is opened, given up and tried again; this module does it.

`pollable` is the device's own descriptor, so it changes with the device. An epoll set that stays the same was tried, but v4l2loopback, and vb2
before Linux 5.11, do not report a frame to an epoll set if one was already waiting when the device joined it.
"""

import contextlib
import errno
import logging
from dataclasses import replace
from typing import Final

from common.camera.base import CameraHealth, Grab, Mode, Offers
from common.camera.life import NEVER_NS, Life, LifeSettings, Loss, Standing, Step, Unwanted
from common.camera.v4l2_controls import to_axis, to_locks
from common.camera.v4l2_device import find_camera
from common.camera.v4l2_formats import Wanted
from common.camera.v4l2_ring import RING_BUFFERS
from common.camera.v4l2_stamps import RateMeter, RestartTiming, Tally, rate_remedy
from common.camera.v4l2_stream import Stream, V4l2Settings
from common.errors import TandemError, UnavailableError
from common.frame import Frame
from common.program.logs import event
from common.protocol.message import CameraDescription, Locks, Pacing, Steering

_LOG = logging.getLogger(__name__)

_FIRST_FRAME_NS: Final = 3_000_000_000
"""Webcams take up to 2 s to start: exposure search, power-up."""

_LIFE: Final = LifeSettings(
    start_ns=_FIRST_FRAME_NS,
    first_frame_ns=_FIRST_FRAME_NS,
    # After that, a second without any frame, or ten periods, is a stall.
    silence_ns=1_000_000_000,
    silence_periods=10,
    # A device that failed is often usable again at once.
    lost_rest_ns=0,
    # A missing camera is looked for five times a second: a stat() of its name takes 10 us. This is a fifth of the second allowed for recovery.
    rest_ns=200_000_000,
    longest_rest_ns=200_000_000,
    # The device stays open, so it keeps its controls and the first frame comes soon. Without a stream no driver reports that it was unplugged.
    unwanted=Unwanted.STAYS_OPEN,
    look_ns=1_000_000_000,
)

_SETTLE_NS: Final = 2_000_000_000
"""A webcam's automatic exposure and white balance settle within one to two seconds of the first frame."""

_REST_NS: Final = 20_000_000
"""Least time between a stream's end and its restart: switching off takes this long."""

_AUTO_EXPOSURE_NS: Final = 1_000_000_000
"""The exposure time is read once a second if the camera changes it by itself, or if the driver does not report its changes."""


class V4l2Camera:
    """A camera of this machine's kernel.

    Raises:
        UnavailableError: there is no such camera, it may not be opened, or another program has it.
        SettingsError: it lacks what is asked for.
    """

    def __init__(self, settings: V4l2Settings, now_ns: int) -> None:
        self._path = find_camera(settings.path)
        self._settings = settings
        self._wishes = settings.wishes
        self._tally = Tally()
        self._life = Life(_LIFE, now_ns)
        self._stream: Stream | None = None
        self._settle_ns: int | None = None
        self._locked = not settings.wishes.lock
        self._exposure_due_ns = NEVER_NS
        self._known_problem = ""
        self._rate = RateWatch()
        self._is_told_lost = False
        self._timing = RestartTiming()
        try:
            self._life.due(now_ns)
            stream = self._stream = self._open()
            # From now on exactly this is requested, whatever a camera plugged in later may prefer.
            width_px, height_px = stream.choice.size_px
            wanted = Wanted(stream.choice.size_px, settings.wanted.fps, stream.choice.pixel_format)
            self._settings = replace(settings, wanted=wanted)
            self.description = CameraDescription(
                name=stream.name,
                width_px=width_px,
                height_px=height_px,
                pixel_format=stream.pixel_format,
                period_ns=stream.period_ns,
                pacing=Pacing.CLOCK,
                steering=Steering.RESTART,
                identity=stream.identity,
                controls=to_locks(stream.controls.lockable()),
            )
            self._rates_hz = {stream.period_ns: settings.wanted.fps}
            self._rates_hz |= {int(1_000_000_000 / rate_hz): rate_hz for rate_hz in stream.slower_hz}
            self.offers = Offers(tuple(self._rates_hz), stream.qualities(), stream.sizes_px())
            self._switch_on(stream, now_ns)
            self._life.opened(now_ns, stream.period_ns)
            self._life.accept()
        except OSError as error:
            self.close()
            raise UnavailableError(
                f"camera {self._path} failed ({error.strerror})", "plug it in again, or into another port"
            ) from None
        except BaseException:
            self.close()
            raise
        if stream.buffers < RING_BUFFERS:
            _LOG.warning(event("few_buffers", camera=self._path, buffers=stream.buffers, wanted=RING_BUFFERS))
        readout_ms = round(stream.readout_ns / 1e6, 1)
        _LOG.info(
            event(
                "camera_open",
                camera=self._path,
                card=stream.name,
                size=f"{width_px}x{height_px}",
                format=stream.pixel_format.value,
                period_ms=round(stream.period_ns / 1e6, 1),
                readout_ms=readout_ms,
            )
        )

    @property
    def pollable(self) -> int | None:
        """The device while it streams: readable for a frame, urgent for a changed control, in error when it is lost."""
        return self._stream.fd if self._stream is not None and self._life.phase is Standing.STREAMING else None

    @property
    def health(self) -> CameraHealth:
        """How the camera has fared since it was opened first."""
        tally, counts = self._tally, self._life.counts
        return CameraHealth(
            state=self._life.state,
            missed=tally.missed,
            faults=tuple(tally.faults.items()),
            stalls=counts.lost[Loss.STALLED],
            failures=counts.lost[Loss.FAILED],
            unplugged=counts.lost[Loss.UNPLUGGED],
            returned=counts.returned,
            distrusted_stamps=tally.distrusted,
            refused_controls=tally.refused,
            held=tuple((axis.value, value) for axis, value in self._wishes.held),
            period_ns=tally.rate.period_ns,
        )

    @property
    def held_locks(self) -> Locks:
        """See LockableCamera."""
        return () if self._stream is None else to_locks(self._stream.controls.held)

    def hold(self, locks: Locks, now_ns: int) -> None:
        """See LockableCamera. A camera that is away is held when it is back."""
        held = tuple(to_axis(lock, value) for lock, value in locks)
        self._wishes = self._wishes.with_held(held)
        if self._stream is None:
            return
        try:
            self._stream.controls.hold(held)
        except OSError as error:
            self._lose(error, now_ns)
            return
        told = {lock.value: value for lock, value in self.held_locks}
        _LOG.info(event("camera_locked", camera=self._path, **told))

    def due_ns(self, now_ns: int) -> int:
        """When something is to be done that no descriptor reports: a stall, a retry, controls to be held."""
        del now_ns
        if self._life.phase is not Standing.STREAMING:
            return self._life.due_ns
        return min(self._life.due_ns, self._settle_ns or NEVER_NS, self._exposure_due_ns)

    def anchor(self, exposed_ns: int, index: int) -> None:
        """Ignore the call: this camera has a clock of its own."""

    def steer(self, later_ns: int, now_ns: int) -> None:
        """Switch the stream off, and on again such that its exposures come `later_ns` later within their period.

        A sensor that runs all the time is unaffected.
        """
        if self._stream is None:
            return
        period_ns = self._tally.rate.period_ns or self._stream.period_ns
        start_ns = self._timing.start_for(later_ns, now_ns + _REST_NS, period_ns)
        if start_ns is None or self._life.steer(start_ns) is not Step.STOP:
            return
        try:
            self._stream.stop()
        except OSError as error:
            self._lose(error, now_ns)
            return
        _LOG.info(event("camera_steered", camera=self._path, later_ms=round(later_ns / 1e6, 1)))

    def adapt(self, mode: Mode, now_ns: int) -> None:
        """Set the quality while streaming. For another rate or size, reopen the device: few drivers change those while they have buffers."""
        if mode.quality != self._wishes.quality:
            self._wishes = replace(self._wishes, quality=mode.quality)
            try:
                if self._stream is not None:
                    self._stream.controls.set_quality(mode.quality)
            except OSError as error:
                self._lose(error, now_ns)
        self.description = replace(self.description, period_ns=mode.period_ns)
        fps, size_px = (
            self._rates_hz[mode.period_ns],
            mode.size_px if any(mode.size_px) else self._settings.wanted.size_px,
        )
        wanted = replace(self._settings.wanted, fps=fps, size_px=size_px)
        if wanted == self._settings.wanted:
            return
        self._settings = replace(self._settings, wanted=wanted)
        self._timing = RestartTiming()  # another mode starts with another latency
        if self._life.renew(now_ns) is Step.CLOSE:
            self._let_go()
            self._carry_out(self._life.due(now_ns), now_ns)

    def read(self, now_ns: int) -> list[Grab]:
        """Return what has come. A device that fails is closed here and reopened, now or later."""
        grabs: list[Grab] = []
        if self._stream is not None and self._life.phase is Standing.STREAMING:
            try:
                grabs = self._take(self._stream, now_ns)
            except OSError as error:
                self._lose(error, now_ns)
                return []
        self._carry_out(self._life.due(now_ns), now_ns)
        return grabs

    def pause(self) -> None:
        """Switch the stream off; the device stays open."""
        if self._life.pause() is Step.STOP and self._stream is not None:
            with contextlib.suppress(OSError):  # the next check will notice a camera that has just vanished
                self._stream.stop()
            _LOG.info(event("camera_paused", camera=self._path))

    def resume(self, now_ns: int) -> None:
        """Switch the stream on again."""
        if self._life.resume(now_ns) is not Step.START:
            return
        if self._start(now_ns):
            _LOG.info(event("camera_resumed", camera=self._path))
        else:
            self._carry_out(self._life.due(now_ns), now_ns)

    def close(self) -> None:
        """Release the device."""
        self._life.end()
        self._let_go()

    def _carry_out(self, step: Step, now_ns: int) -> None:
        """Carry out what is due."""
        match step:
            case Step.OPEN:
                self._try_again(now_ns)
            case Step.START:
                self._start(now_ns)
            case Step.LOOK:
                if not self._path.exists():
                    self._lose(OSError(errno.ENODEV, "unplugged"), now_ns)
            case Step.CLOSE:
                self._drop("stalled")
            case Step.NONE | Step.STOP:
                pass

    def _open(self) -> Stream:
        return Stream(self._path, self._settings, self._wishes, self._tally)

    def _start(self, now_ns: int) -> bool:
        """Switch the open stream on; return whether that succeeded."""
        assert self._stream is not None
        try:
            self._switch_on(self._stream, now_ns)
        except OSError as error:
            self._lose(error, now_ns)
            return False
        return True

    def _switch_on(self, stream: Stream, now_ns: int) -> None:
        """Start a stream and make it the current one."""
        self._stream = stream
        self._settle_ns = None
        stream.start()
        self._timing.started(stream.started_ns)
        self._exposure_due_ns = now_ns + _AUTO_EXPOSURE_NS

    def _take(self, stream: Stream, now_ns: int) -> list[Grab]:
        grabs = stream.take()
        if now_ns >= self._exposure_due_ns:
            stream.controls.read_exposure()
            still_changes = not stream.controls.tells_exposure or not self._wishes.lock
            self._exposure_due_ns = now_ns + _AUTO_EXPOSURE_NS if still_changes else NEVER_NS
        elif (
            not grabs and stream.controls.has_events()
        ):  # woken for something else: fetching events with each frame costs an ioctl
            stream.controls.read_exposure()
        self._timing.exposed(grab.exposed.ns for grab in grabs if isinstance(grab, Frame))
        if grabs:
            self._life.heard(now_ns, stream.period_ns)
            self._note_back()
            self._settle(stream, now_ns)
            if self._tally.grabs % 32 == 0:
                self._rate.watch(self._tally.rate, self.description.period_ns, stream.controls.exposure_ns)
        return grabs

    def _note_back(self) -> None:
        """Report once that a lost camera is back: with its first frame or, if no frame is wanted, when it is there."""
        if self._is_told_lost and not self._life.is_lost:
            self._is_told_lost = False
            _LOG.info(event("camera_back", camera=self._path))

    def _settle(self, stream: Stream, now_ns: int) -> None:
        """Hold the controls at their current values, some time after the first frame."""
        if self._locked:
            return
        if self._settle_ns is None:
            self._settle_ns = now_ns + _SETTLE_NS
        elif now_ns >= self._settle_ns:
            self._wishes = self._wishes.with_found(stream.controls.lock(self._wishes))
            self._locked, self._settle_ns = True, None

    def _lose(self, error: OSError, now_ns: int) -> None:
        if error.errno in {errno.ENODEV, errno.ENXIO}:
            loss, reason = Loss.UNPLUGGED, "unplugged"
        else:
            loss, reason = Loss.FAILED, errno.errorcode.get(error.errno or 0, str(error))
        if self._life.lost(loss, now_ns) is Step.CLOSE:
            self._drop(reason)

    def _drop(self, reason: str) -> None:
        """Close a device that is lost."""
        # A camera that is reopened again and again without a frame stays lost: that is not news.
        level = logging.DEBUG if self._is_told_lost else logging.WARNING
        _LOG.log(level, event("camera_lost", camera=self._path, reason=reason))
        self._let_go()
        self._is_told_lost = True
        self._locked = not self._wishes.lock

    def _let_go(self) -> None:
        """Close the device if it is open, and log that."""
        if self._stream is not None:
            self._stream.close()
            self._stream = None
        if self._life.phase is Standing.CLOSING:
            self._life.closed()

    def _try_again(self, now_ns: int) -> None:
        """Check whether the camera is back. Open it exactly as it was, or not at all."""
        if not self._path.exists():
            self._life.refused(now_ns)
            return
        try:
            stream = self._stream = self._open()
            if self._life.is_wanted:
                self._switch_on(stream, now_ns)
        except (TandemError, OSError) as error:
            self._let_go()
            self._life.refused(now_ns)
            if str(error) != self._known_problem:
                self._known_problem = str(error)
                _LOG.warning(event("camera_refuses", camera=self._path, problem=self._known_problem))
        else:
            self._known_problem = ""
            self._life.opened(now_ns, stream.period_ns)
            self._note_back()


class RateWatch:
    """Remembers whether the rate was off, so that each change is told once."""

    def __init__(self) -> None:
        self._is_off = False

    def watch(self, rate: RateMeter, nominal_ns: int, exposure_ns: int | None) -> None:
        """Report once when the rate differs from the nominal one, and once when it no longer does.

        Args:
            rate: the measured rate.
            nominal_ns: period that the camera was asked for, ns.
            exposure_ns: exposure time now, ns; None: not known.
        """
        if rate.differs_from(nominal_ns) is self._is_off:
            return
        self._is_off = not self._is_off
        period_ns = rate.period_ns or 1
        figures = {"period_ms": round(period_ns / 1e6, 2), "nominal_ms": round(nominal_ns / 1e6, 2)}
        if self._is_off:
            _LOG.warning(event("rate_differs", **figures, remedy=rate_remedy(period_ns, nominal_ns, exposure_ns)))
        else:
            _LOG.info(event("rate_nominal", **figures))
