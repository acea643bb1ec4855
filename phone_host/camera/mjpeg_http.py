"""An MJPEG server, such as a phone's camera app, as a camera: a thread reads all that comes, the newest image waits for whoever reads.

Stamp: the arrival of an image's first byte minus the calibrated latency. The first byte of the image, not of its part's header: some servers write
the next boundary together with the image before it, a period early. A slow consumer never builds up a backlog: an image that a newer one replaces
before it was read is told of as skipped.
"""

import logging
import os
import threading
from contextlib import suppress
from typing import Final

from common import now
from common.camera.base import CameraHealth, CameraState, Grab, Mode, Offers, Skipped, Spoiled
from common.camera.v4l2_stamps import RateMeter
from common.errors import TandemError, UnavailableError
from common.frame import Frame, FrameFault, PixelFormat
from common.imagesize import size_text
from common.program.logs import event
from common.protocol.message import CameraDescription, Pacing
from common.stamp import Stamp
from phone_host.camera.arrivals import Arrivals
from phone_host.camera.http_client import Connection
from phone_host.camera.http_uri import HttpSettings
from phone_host.camera.jpegs import JpegStream, Whole

_LOG = logging.getLogger(__name__)

_FAR_FUTURE: Final = 2**63 - 1
_S: Final = 1_000_000_000

_OPEN_NS: Final = 10 * _S
"""A phone whose camera has to wake up takes some seconds until its first image."""

_MEASURE_FRAMES: Final = 9
_MEASURE_NS: Final = 3 * _S
"""The period is the median of eight distances; a camera so slow that these take longer is measured by what came until then."""

_PATIENCE_S: Final = 5.0
_STALL_PERIODS: Final = 10
_LEAST_STALL_NS: Final = 2 * _S
"""Wi-Fi holds packets up for a second now and then; after ten periods, two seconds at least, without an image the connection is made anew."""

_FIRST_PAUSE_S: Final = 0.1
_LONGEST_PAUSE_S: Final = 1.0
"""Between two attempts: doubled each time; a phone that is back is found within a second (DESIGN, section 7)."""

_MOST_PENDING: Final = 64


class HttpCamera:
    """The images of one server.

    Args:
        settings: which server.

    Raises:
        UnavailableError: it cannot be reached, refuses, or sends no JPEG images.
    """

    def __init__(self, settings: HttpSettings) -> None:
        self._settings = settings
        self._lock = threading.Condition()
        self._pending: list[Grab] = []
        self._connection: Connection | None = None
        self._closing = self._resting = self._answered = False
        self._problem: TandemError | None = None
        self._failure: Exception | None = None
        self._sequence = 0
        self._first_ns = self._heard_ns = 0
        self._size_px = self._asked_px = (0, 0)
        self._rate, self._arrivals = RateMeter(), Arrivals()
        self._faults: dict[FrameFault, int] = {}
        self._stalls = self._failures = self._returned = self._turns = 0
        self._state = CameraState.GONE
        self._wake_read, self._wake_write = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)
        self._thread = threading.Thread(target=self._run, name="mjpeg", daemon=True)
        self._thread.start()
        try:
            period_ns = self._measure()
        except BaseException:
            self.close()
            raise
        self.description = CameraDescription(
            f"mjpeg {settings.host}", *self._asked_px, PixelFormat.MJPEG, period_ns, Pacing.CLOCK
        )
        size = size_text(self._asked_px)
        latency = "unknown" if settings.latency_ns is None else f"{settings.latency_ns / 1e6:g}"
        _LOG.info(
            event(
                "camera_open", camera=settings.shown, size=size, period_ms=round(period_ns / 1e6, 1), latency_ms=latency
            )
        )

    @property
    def pollable(self) -> int | None:
        """Readable when something has come."""
        return self._wake_read

    @property
    def offers(self) -> Offers:
        """None: a server gives what it gives."""
        return Offers()

    def due_ns(self, now_ns: int) -> int:
        """Never by time alone."""
        del now_ns
        return _FAR_FUTURE

    def read(self, now_ns: int) -> list[Grab]:
        """Give what has come: at most one frame, the newest."""
        del now_ns  # an image is grabbed when its last byte has come
        with self._lock:
            with suppress(BlockingIOError):
                os.read(self._wake_read, 4096)
            if self._failure is not None:
                raise self._failure
            grabs, self._pending = self._pending, []
        return grabs

    def anchor(self, exposed_ns: int, index: int) -> None:
        """Takes no notice: a server has a clock of its own."""

    def steer(self, later_ns: int, now_ns: int) -> None:
        """Takes no notice: a server cannot be steered."""

    def adapt(self, mode: Mode, now_ns: int) -> None:
        """Takes no notice: it offers none."""

    @property
    def health(self) -> CameraHealth:
        """How it has fared; `failures`: connections that broke, were refused or held no stream."""
        with self._lock:
            return CameraHealth(
                state=CameraState.PAUSED if self._resting else self._state,
                faults=tuple(self._faults.items()),
                stalls=self._stalls,
                failures=self._failures,
                returned=self._returned,
                period_ns=self._rate.period_ns,
                latency_ns=self._settings.latency_ns,
                latency_uncertainty_ns=self._settings.latency_uncertainty_ns,
                jitter_ns=self._arrivals.jitter_ns,
            )

    @property
    def newest_sequence(self) -> int:
        """Number of the newest grab; -1 before one."""
        with self._lock:
            return self._sequence - 1

    def pause(self) -> None:
        """Close the connection: the phone may rest."""
        with self._lock:
            self._resting = True
            self._drop()

    def resume(self, now_ns: int) -> None:
        """Connect again."""
        del now_ns
        with self._lock:
            self._resting = False
            self._lock.notify_all()

    def close(self) -> None:
        """Close the connection and end the thread; again is harmless."""
        with self._lock:
            was_open, self._closing = not self._closing, True
            self._drop()
            self._lock.notify_all()
        # Looking up a name cannot be cut short: then the thread ends by itself later, and touches nothing that was closed.
        self._thread.join(1.0)
        if was_open:
            with self._lock:
                os.close(self._wake_read)
                os.close(self._wake_write)

    def _drop(self) -> None:
        if self._connection is not None:
            self._connection.interrupt()

    def _measure(self) -> int:
        """Wait for the first images; gives their period, ns. What came meanwhile is forgotten."""
        until_ns = now.monotonic_ns() + _OPEN_NS
        with self._lock:
            while True:
                now_ns = now.monotonic_ns()
                if (failure := self._failure or self._problem) is not None:
                    raise failure
                slow = self._sequence >= 2 and now_ns - self._first_ns >= _MEASURE_NS
                if self._sequence >= _MEASURE_FRAMES or slow:
                    period_ns = self._rate.period_ns or (self._heard_ns - self._first_ns) // (self._sequence - 1)
                    self._asked_px = self._size_px
                    self._sequence = 0
                    self._pending.clear()
                    self._faults.clear()
                    self._rate, self._arrivals = RateMeter(), Arrivals()
                    return max(1, period_ns)
                if now_ns >= until_ns:
                    raise self._no_images()
                self._lock.wait(0.05)

    def _no_images(self) -> UnavailableError:
        shown, patience_s = self._settings.shown, _OPEN_NS // _S
        if self._sequence:
            return UnavailableError(f"camera {shown} sent one image in {patience_s} s", "give the video's own address")
        if not self._answered:
            return UnavailableError(f"camera {shown} does not answer", "check that both are in one network")
        return UnavailableError(
            f"camera {shown} sent no JPEG image within {patience_s} s", "give the address of an MJPEG stream"
        )

    # The thread.

    def _run(self) -> None:
        try:
            pause_s = _FIRST_PAUSE_S
            while not self._is_closing():
                came, problem = self._visit()
                pause_s = _FIRST_PAUSE_S if came else min(_LONGEST_PAUSE_S, 2 * pause_s)
                self._lost(problem)
                with self._lock:
                    if not self._closing:
                        self._lock.wait(pause_s)
        except Exception as error:  # noqa: BLE001 - a thread's root: whoever reads is told
            with self._lock:
                self._failure = error
                self._tell()

    def _visit(self) -> tuple[bool, str]:
        """One connection from its beginning to its end; gives whether an image came, and why it ended."""
        try:
            connection = Connection(self._settings, _PATIENCE_S)
        except TandemError as error:
            with self._lock:
                self._problem = error
            return False, str(error)
        try:
            if not self._take_over(connection):
                return False, "nobody listens"
            return self._stream(connection)
        finally:
            with self._lock:
                self._connection = None
            connection.close()

    def _is_closing(self) -> bool:
        """Whether to end; waits here while nobody listens."""
        with self._lock:
            while self._resting and not self._closing:
                self._lock.wait()
            return self._closing

    def _take_over(self, connection: Connection) -> bool:
        with self._lock:
            if self._closing or self._resting:
                return False
            self._connection, self._answered = connection, True
            self._rate.restart()
            self._arrivals.restart()
            return True

    def _stream(self, connection: Connection) -> tuple[bool, str]:
        """Read one connection; gives whether an image came, and why it ended."""
        stream, came, latest_ns = JpegStream(), False, now.monotonic_ns()
        while (now_ns := now.monotonic_ns()) - latest_ns <= self._stall_ns():
            try:
                data = connection.read(self._stall_ns() / _S)
            except TimeoutError:
                break
            except OSError as error:
                return came, f"the connection broke ({error.strerror or error})"
            if not data:
                return came, "the stream ended"
            now_ns = now.monotonic_ns()
            for found in stream.feed(data, now_ns):
                if isinstance(found, Whole):
                    came, latest_ns = True, now_ns
                    self._deliver(found)
                else:
                    self._spoil(found.fault)
        with self._lock:
            self._stalls += 1
        return came, "no image came any more"

    def _stall_ns(self) -> int:
        return max(_LEAST_STALL_NS if self._heard_ns else _OPEN_NS, _STALL_PERIODS * (self._rate.period_ns or 0))

    def _deliver(self, image: Whole) -> None:
        with self._lock:
            if self._closing or self._resting:
                return
            size_px = image.width_px, image.height_px
            self._note_size(size_px)
            if self._asked_px not in {size_px, (0, 0)}:
                self._spoil(FrameFault.OTHER_SIZE)
                return
            sequence, self._sequence = self._sequence, self._sequence + 1
            if self._state is not CameraState.RUNNING:
                self._returned += self._heard_ns > 0
                if self._heard_ns:
                    _LOG.info(event("camera_back", camera=self._settings.shown))
                self._state = CameraState.RUNNING
            self._first_ns, self._heard_ns = self._first_ns or image.began_ns, image.began_ns
            self._rate.add(image.began_ns, sequence)
            self._arrivals.add(sequence, image.began_ns)
            clock = self._settings.clock
            exposed = Stamp(image.began_ns - (self._settings.latency_ns or 0), clock)
            grabbed = Stamp(image.ended_ns, clock)
            frame = Frame(sequence, exposed, grabbed, *size_px, PixelFormat.MJPEG, None, image.payload)
            self._replace_waiting()
            self._add(frame)

    def _note_size(self, size_px: tuple[int, int]) -> None:
        """Tell of a phone that was turned: what is paired and calibrated has the size of the beginning, and comes again when it is turned back."""
        self._turns += self._size_px not in {size_px, (0, 0)}
        if self._size_px not in {size_px, (0, 0)} and self._turns.bit_count() == 1:  # the 1st, 2nd, 4th …
            sizes = {"size": size_text(size_px), "first": size_text(self._asked_px)}
            _LOG.warning(event("camera_size_changed", camera=self._settings.shown, **sizes))
        self._size_px = size_px

    def _spoil(self, fault: FrameFault) -> None:
        with self._lock:
            if self._closing or self._resting:
                return
            self._faults[fault] = self._faults.get(fault, 0) + 1
            sequence, self._sequence = self._sequence, self._sequence + 1
            self._add(Spoiled(sequence, fault))

    def _replace_waiting(self) -> None:
        """A newer frame is there: the one that waits becomes word of a skipped one, together with those just before it."""
        if not (self._pending and isinstance(waiting := self._pending[-1], Frame)):
            return
        self._pending.pop()
        skipped = Skipped(waiting.sequence)
        if self._pending and isinstance(before := self._pending[-1], Skipped):
            self._pending.pop()
            skipped = Skipped(before.sequence, before.frames + 1)
        self._pending.append(skipped)

    def _add(self, grab: Grab) -> None:
        self._pending.append(grab)
        if len(self._pending) > _MOST_PENDING:  # nobody reads: what is old becomes one word
            *old, newest = self._pending
            passed = sum(item.frames if isinstance(item, Skipped) else 1 for item in old)
            self._pending = [Skipped(self._sequence - 1 - passed, passed), newest]
        self._tell()

    def _tell(self) -> None:
        if not self._closing:
            with suppress(BlockingIOError):
                os.write(self._wake_write, b"\0")
        self._lock.notify_all()

    def _lost(self, problem: str) -> None:
        with self._lock:
            if self._closing or self._resting:
                return
            self._failures += 1
            if self._state is CameraState.RUNNING:
                _LOG.warning(event("camera_lost", camera=self._settings.shown, problem=problem))
            self._state = CameraState.GONE
