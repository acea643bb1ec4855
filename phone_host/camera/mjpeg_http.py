"""An MJPEG server, such as a phone's camera app, as a camera.

A thread reads everything that comes; the newest image waits for the reader. The stamp is the arrival of an image's
first byte minus the calibrated latency. It is the first byte of the image, not of its part's header, because some
servers write the next boundary together with the image before it, a period early. A slow reader never builds up a
backlog: an image that a newer one replaces before it was read is reported as skipped. `common/camera/life.py` decides
when to connect, give up and try again; the thread carries it out.
"""

import logging
import threading
from typing import Final

from common import now
from common.camera.base import CameraHealth, Grab, Spoiled
from common.camera.life import Life, Loss, Standing, Step
from common.camera.v4l2_stamps import RateMeter
from common.errors import TandemError, UnavailableError
from common.frame import Frame, FrameFault, PixelFormat
from common.imagesize.head import size_text
from common.program.logs import event
from common.protocol.message import CameraDescription, Pacing
from common.stamp import Stamp
from phone_host.camera.far import LIFE, MEASURE_FRAMES, MEASURE_NS, SECOND_NS, FarCamera
from phone_host.camera.http_client import Connection
from phone_host.camera.jpegs import Arrivals, JpegStream, Whole
from phone_host.camera.uris import HttpSettings

_LOG = logging.getLogger(__name__)

_PATIENCE_S: Final = 5.0
_LONGEST_WAIT_S: Final = 3600.0
"""A lock's timeout has a limit, and the far future is beyond it."""


class HttpCamera(FarCamera):
    """The images of one server.

    Raises:
        UnavailableError: the server cannot be reached, refuses, or sends no JPEG images.
    """

    def __init__(self, settings: HttpSettings) -> None:
        super().__init__()
        self._settings = settings
        self._lock = threading.Condition()
        self._connection: Connection | None = None
        self._life = Life(LIFE, now.monotonic_ns())
        self._problem: TandemError | None = None
        self._failure: Exception | None = None
        self._sequence = self._whole_images = 0
        self._first_ns = self._heard_ns = 0
        self._size_px = self._asked_px = (0, 0)
        self._arrivals = Arrivals()
        self._faults: dict[FrameFault, int] = {}
        self._turns = 0
        self._thread = threading.Thread(target=self._run, name="mjpeg", daemon=True)
        self._thread.start()
        try:
            period_ns = self._measure()
        except BaseException:
            self.close()
            raise
        self.description = CameraDescription(
            name=f"mjpeg {settings.host}",
            width_px=self._asked_px[0],
            height_px=self._asked_px[1],
            pixel_format=PixelFormat.MJPEG,
            period_ns=period_ns,
            pacing=Pacing.CLOCK,
        )
        size = size_text(self._asked_px)
        latency = "unknown" if settings.latency_ns is None else f"{settings.latency_ns / 1e6:g}"
        _LOG.info(
            event(
                "camera_open", camera=settings.shown, size=size, period_ms=round(period_ns / 1e6, 1), latency_ms=latency
            )
        )

    def read(self, now_ns: int) -> list[Grab]:
        """Return what has come: at most one frame, the newest."""
        del now_ns  # an image is grabbed when its last byte arrives
        with self._lock:
            grabs = self._waiting.take()
            if self._failure is not None:
                raise self._failure
        return grabs

    @property
    def health(self) -> CameraHealth:
        """The camera's health; `failures` counts connections that broke, were refused or had no stream."""
        with self._lock:
            counts = self._life.counts
            return CameraHealth(
                state=self._life.state,
                faults=tuple(self._faults.items()),
                stalls=counts.lost[Loss.STALLED],
                failures=counts.refused + sum(counts.lost.values()),
                returned=counts.returned,
                period_ns=self._rate.period_ns,
                latency_ns=self._settings.latency_ns,
                latency_uncertainty_ns=self._settings.latency_uncertainty_ns,
                jitter_ns=self._arrivals.jitter_ns,
            )

    @property
    def newest_sequence(self) -> int:
        """Number of the newest grab; -1 before the first."""
        with self._lock:
            return self._sequence - 1

    def pause(self) -> None:
        """Close the connection, so that the phone may rest."""
        with self._lock:
            if self._life.pause() is Step.CLOSE:
                self._drop()

    def resume(self, now_ns: int) -> None:
        """Connect again."""
        with self._lock:
            self._life.resume(now_ns)
            self._lock.notify_all()

    def close(self) -> None:
        """Close the connection and end the thread. May be called again."""
        with self._lock:
            self._life.end()
            self._drop()
            self._lock.notify_all()
        # A name lookup cannot be interrupted. Then the thread ends later by itself and touches nothing that was closed.
        self._thread.join(1.0)
        with self._lock:
            self._waiting.close()

    def _drop(self) -> None:
        if self._connection is not None:
            self._connection.interrupt()

    def _measure(self) -> int:
        """Wait for the first images and return their period, ns. Forget what came meanwhile."""
        with self._lock:
            while True:
                now_ns = now.monotonic_ns()
                gives_up = self._life.gives_up(now_ns)
                if (failure := self._failure or self._problem) is not None:
                    raise failure
                slow = self._whole_images >= 2 and now_ns - self._first_ns >= MEASURE_NS
                if self._whole_images >= MEASURE_FRAMES or slow:
                    period_ns = self._rate.period_ns or (self._heard_ns - self._first_ns) // (self._whole_images - 1)
                    self._asked_px = self._size_px
                    self._sequence = 0
                    self._waiting.clear()
                    self._faults.clear()
                    self._rate, self._arrivals = RateMeter(), Arrivals()
                    self._life.accept()
                    return max(1, period_ns)
                if gives_up:
                    raise self._no_images()
                self._lock.wait(0.05)

    def _no_images(self) -> UnavailableError:
        shown, patience_s = self._settings.shown, LIFE.start_ns // SECOND_NS
        if self._faults and not self._whole_images:
            often = max(self._faults, key=lambda fault: self._faults[fault])
            return UnavailableError(
                f"camera {shown}: every image is spoiled ({often.value.replace('_', ' ')})",
                "look at it in a browser; choose another quality or size in the server's settings",
            )
        if self._sequence:
            return UnavailableError(f"camera {shown} sent one image in {patience_s} s", "give the video's own address")
        if not self._life.counts.opened:
            return UnavailableError(
                f"camera {shown} does not answer", "check that phone and host are in the same network"
            )
        return UnavailableError(
            f"camera {shown} sent no JPEG image within {patience_s} s", "give the address of an MJPEG stream"
        )

    # The thread.

    def _run(self) -> None:
        try:
            while self._is_to_open():
                self._visit()
        except Exception as error:  # noqa: BLE001 - a thread's root: `read` raises it
            with self._lock:
                self._failure = error
                self._tell()

    def _is_to_open(self) -> bool:
        """Wait until it is time to connect and return True. Return False if the camera's life has ended."""
        with self._lock:
            while not self._life.is_ended:
                now_ns = now.monotonic_ns()
                if self._life.due(now_ns) is Step.OPEN:
                    return True
                self._lock.wait(min(_LONGEST_WAIT_S, max(0, self._life.due_ns - now_ns) / SECOND_NS))
            return False

    def _visit(self) -> None:
        """Handle one connection from beginning to end."""
        try:
            connection = Connection(self._settings, _PATIENCE_S)
        except TandemError as error:
            with self._lock:
                self._problem = error
                self._life.refused(now.monotonic_ns())
                self._tell_lost(str(error))
            return
        try:
            if self._take_over(connection):
                self._stream(connection)
        finally:
            with self._lock:
                self._connection = None
            connection.close()
        with self._lock:
            self._life.closed()

    def _take_over(self, connection: Connection) -> bool:
        """Start to use a connection. Return whether it is still wanted."""
        with self._lock:
            if self._life.opened(now.monotonic_ns(), self._rate.period_ns or 0) is Step.CLOSE:
                return False
            self._connection = connection
            self._rate.restart()
            self._arrivals.restart()
            return True

    def _stream(self, connection: Connection) -> None:
        """Read one connection until it is lost or must be closed."""
        stream = JpegStream()
        while (patience_s := self._patience_s()) > 0:
            try:
                data = connection.read(patience_s)
            except TimeoutError:
                self._lose(Loss.STALLED, "no image came any more")
                return
            except OSError as error:
                self._lose(Loss.FAILED, f"the connection broke ({error.strerror or error})")
                return
            if not data:
                self._lose(Loss.FAILED, "the stream ended")
                return
            for found in stream.feed(data, now.monotonic_ns()):
                if isinstance(found, Whole):
                    self._deliver(found)
                else:
                    self._spoil(found.fault)

    def _patience_s(self) -> float:
        """Return how long the next bytes may take, s; 0: give the connection up."""
        with self._lock:
            now_ns = now.monotonic_ns()
            if self._life.due(now_ns) is Step.CLOSE:
                self._tell_lost("no image came any more")
            return max(0, self._life.due_ns - now_ns) / SECOND_NS if self._life.phase is Standing.STREAMING else 0.0

    def _lose(self, loss: Loss, problem: str) -> None:
        with self._lock:
            if self._life.lost(loss, now.monotonic_ns()) is Step.CLOSE:
                self._tell_lost(problem)

    def _tell_lost(self, problem: str) -> None:
        if self._life.is_lost and self._life.is_wanted:
            self._log_lost(self._settings.shown, problem)

    def _deliver(self, image: Whole) -> None:
        with self._lock:
            if self._life.phase is not Standing.STREAMING:
                return
            size_px = image.width_px, image.height_px
            self._note_size(size_px)
            if self._asked_px not in {size_px, (0, 0)}:
                self._life.stirred(now.monotonic_ns())
                self._spoil(FrameFault.OTHER_SIZE)
                return
            self._life.heard(now.monotonic_ns(), self._rate.period_ns or 0)
            sequence, self._sequence = self._sequence, self._sequence + 1
            self._whole_images += 1
            if not self._life.is_lost:
                self._log_back(self._settings.shown)
            self._first_ns, self._heard_ns = self._first_ns or image.began_ns, image.began_ns
            self._rate.add(image.began_ns, sequence)
            self._arrivals.add(sequence, image.began_ns)
            clock = self._settings.clock
            exposed = Stamp(image.began_ns - (self._settings.latency_ns or 0), clock)
            grabbed = Stamp(image.ended_ns, clock)
            frame = Frame(
                sequence=sequence,
                exposed=exposed,
                grabbed=grabbed,
                width_px=image.width_px,
                height_px=image.height_px,
                pixel_format=PixelFormat.MJPEG,
                exposure_ns=None,
                payload=image.payload,
            )
            self._add(frame)

    def _note_size(self, size_px: tuple[int, int]) -> None:
        """Warn if the phone was turned.

        Pairs and calibration have the first size. Images of that size come again when the phone is turned back.
        """
        self._turns += self._size_px not in {size_px, (0, 0)}
        if self._size_px not in {size_px, (0, 0)} and self._turns.bit_count() == 1:  # the 1st, 2nd, 4th …
            sizes = {"size": size_text(size_px), "first": size_text(self._asked_px)}
            _LOG.warning(event("camera_size_changed", camera=self._settings.shown, **sizes))
        self._size_px = size_px

    def _spoil(self, fault: FrameFault) -> None:
        with self._lock:
            if self._life.phase is not Standing.STREAMING:
                return
            self._faults[fault] = self._faults.get(fault, 0) + 1
            sequence, self._sequence = self._sequence, self._sequence + 1
            self._add(Spoiled(sequence, fault))

    def _add(self, grab: Grab) -> None:
        self._waiting.add(grab, self._sequence)
        self._lock.notify_all()

    def _tell(self) -> None:
        self._waiting.tell()
        self._lock.notify_all()
