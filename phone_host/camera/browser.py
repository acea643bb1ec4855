"""The camera of a browser that has the page open, such as a phone's.

The browser comes to us, and may leave at any time: it sleeps, its tab is closed, its Wi-Fi is lost. Then the camera is
unplugged, and it is back when a browser with the same camera has come. `BrowserFeed` holds the browser, `BrowserBorder`
decides what is believed, `common/camera/life.py` when the camera is given up and tried again.
"""

import logging
from collections import Counter
from dataclasses import replace
from typing import Final

from common import now
from common.camera.base import CameraHealth, Grab, Spoiled, StampOrigin
from common.camera.life import Life, Loss, Standing, Step
from common.errors import UnavailableError
from common.frame import Frame, FrameFault
from common.imagesize.head import size_text
from common.program.logs import event
from common.protocol.message import CameraDescription, Locks, Pacing
from common.stamp import Stamp
from phone_host.camera.browser_border import Believed, BrowserBorder
from phone_host.camera.browser_clock import Epoch
from phone_host.camera.browser_feed import BrowserFeed, Seat
from phone_host.camera.browser_locks import locks_of
from phone_host.camera.browser_wire import Hello
from phone_host.camera.far import LIFE, MEASURE_FRAMES, MEASURE_NS, SECOND_NS, FarCamera
from phone_host.camera.uris import BrowserSettings

_LOG = logging.getLogger(__name__)

_STEP_S: Final = 0.05
_LIFE: Final = replace(LIFE, first_frame_ns=3 * SECOND_NS)  # it opens its camera only now

_TURNED: Final = "turned after the first image: nothing is used until it is turned back"


class BrowserCamera(FarCamera):
    """A browser's camera while one run uses it.

    Raises:
        UnavailableError: no browser gives images in time.
    """

    def __init__(self, settings: BrowserSettings, feed: BrowserFeed, now_ns: int) -> None:
        super().__init__()
        self.settings: Final = settings
        self._feed, self._lock = feed, feed.changed
        self._border = BrowserBorder(settings.size_px)
        self._life = Life(_LIFE, now_ns)
        self._sequence = self._missed = self._believed = self._unplugged_before = 0
        self._faults: Counter[FrameFault] = Counter()
        self._newest: Frame | None = None
        self._first_ns = self._asleep_ns = 0
        self._told = self._software = ""
        self._held: Locks = ()
        self._description: CameraDescription | None = None
        with self._lock:
            feed.attach(self, now_ns)
            try:
                self._description = self._measured()
            except BaseException:
                self.close()
                raise
        _LOG.info(
            event(
                "camera_open",
                camera=self.description.name,
                size=size_text((self.description.width_px, self.description.height_px)),
                period_ms=round(self.description.period_ns / 1e6, 1),
                epoch="unknown" if self._border.epoch is None else self._border.epoch.value,
            )
        )

    @property
    def description(self) -> CameraDescription:
        """See Camera. Its identity is what the browser tells: a label, and an id that belongs to this page in this browser."""
        assert self._description is not None
        return self._description

    @property
    def software(self) -> str:
        """The browser with which the run began: it makes the images, and another version may make others."""
        return self._software

    def read(self, now_ns: int) -> list[Grab]:
        """Return what has come: at most one frame, the newest. Ask for the next ones."""
        with self._lock:
            self._tick(now_ns)
            grabs = self._waiting.take()
            if self._life.phase is Standing.STREAMING:
                self._feed.grant(self._rate.period_ns or 0)
        return grabs

    @property
    def health(self) -> CameraHealth:
        """The camera's health; `missed` counts what the browser dropped because this machine had not asked for more."""
        with self._lock:
            counts, newest, epoch = self._life.counts, self._newest, self._border.epoch
            return CameraHealth(
                state=self._life.state,
                missed=self._missed,
                faults=tuple(self._faults.items()),
                stalls=counts.lost[Loss.STALLED],
                unplugged=counts.lost[Loss.UNPLUGGED] - self._unplugged_before,
                returned=counts.returned,
                held=tuple((lock.value, value) for lock, value in self.held_locks),
                period_ns=self._rate.period_ns,
                jitter_ns=self._border.scatter_ns if epoch is Epoch.FREE else None,
                origin=StampOrigin(
                    "" if epoch is None else epoch.value,
                    None if newest is None else newest.uncertainty_ns,
                    None if newest is None else newest.bound_ns,
                ),
            )

    @property
    def held_locks(self) -> Locks:
        """See LockableCamera."""
        seat = self._feed.seat
        return () if seat is None else locks_of(seat.groups)

    def hold(self, locks: Locks, now_ns: int) -> None:
        """See LockableCamera. Waits a moment for the browser's answer."""
        del now_ns
        with self._lock:
            if locks != self._held:
                self._held = locks
                self._feed.hold(locks)

    def pause(self) -> None:
        """Ask for no more frames."""
        with self._lock:
            if self._life.pause() is Step.CLOSE:
                self._life.closed()
                self._feed.rest()

    def resume(self, now_ns: int) -> None:
        """Ask for frames again."""
        with self._lock:
            self._life.resume(now_ns)
            self._tick(now_ns)

    def close(self) -> None:
        """Leave the browser to the next one. May be called again."""
        with self._lock:
            if self._life.end() is Step.CLOSE:
                self._life.closed()
            self._feed.detach(self)
            self._waiting.close()

    # What the feed tells, with the lock held.

    def takes(self, hello: Hello) -> bool:
        """See User: until the end, the camera with which it began."""
        known = self._description
        return known is None or not known.identity.differs_from(hello.identity)

    def came(self, seat: Seat, now_ns: int) -> None:
        """See User."""
        self._border.begin(seat.hello, is_same_machine=seat.line.is_near)
        self._rate.restart()
        self._tick(now_ns)

    def left(self, now_ns: int) -> None:
        """See User."""
        self._lose(Loss.UNPLUGGED, "the browser has left, or its camera has ended", now_ns)

    def frame(self, seat: Seat, data: bytes, arrived_ns: int, *, is_asked: bool) -> None:
        """See User."""
        if self._life.phase is not Standing.STREAMING:
            return
        if not is_asked:
            self._spoil(FrameFault.UNASKED, arrived_ns)
            return
        self._asleep_ns = max(self._asleep_ns, now.asleep_ns())  # a delay between its two readings makes one too small
        judged = self._border.judge(data, arrived_ns, seat.clock, self._asleep_ns)
        self._missed += judged.missed
        self._sequence += judged.missed
        if isinstance(judged, Believed):
            self._deliver(judged, arrived_ns)
        else:
            self._spoil(judged.fault, arrived_ns)

    # Inside.

    def _measured(self) -> CameraDescription:
        """Wait for the first images; describe the camera by them, and forget them."""
        feed, began_ns = self._feed, now.monotonic_ns()
        while True:
            now_ns = now.monotonic_ns()
            self._tick(now_ns)
            newest, seat = self._newest, feed.seat
            slow = self._believed >= 2 and now_ns - self._first_ns >= MEASURE_NS
            if newest is not None and seat is not None and (self._believed >= MEASURE_FRAMES or slow):
                break
            if feed.has_ended or (feed.patience_ns is not None and now_ns - began_ns > feed.patience_ns):
                raise self._absent()
            self._grant()
            self._lock.wait(_STEP_S)
        self._software = seat.hello.software
        period_ns = self._rate.period_ns or (newest.exposed.ns - self._first_ns) // (self._believed - 1)
        self._sequence = self._missed = 0
        # A browser that opens its camera anew for what is wanted leaves once.
        self._unplugged_before = self._life.counts.lost[Loss.UNPLUGGED]
        self._faults.clear()
        self._waiting.clear()
        self._life.accept()
        return CameraDescription(
            name=f"browser {seat.hello.identity.name}".strip(),
            width_px=newest.width_px,
            height_px=newest.height_px,
            pixel_format=newest.pixel_format,
            period_ns=max(1, period_ns),
            pacing=Pacing.CLOCK,
            identity=seat.hello.identity,
            controls=self.held_locks,
        )

    def _absent(self) -> UnavailableError:
        seat = self._feed.seat
        if self._feed.has_ended:
            return UnavailableError("stopped before a browser gave its camera", "start it on the page first")
        if seat is None:
            return UnavailableError(
                "no browser gives its camera", "open the page on the phone, and start its camera there"
            )
        if not seat.is_live:
            return UnavailableError(f"the browser's camera gives no images{_told(seat)}", "look at the page there")
        if self._faults:
            fault, count = self._faults.most_common(1)[0]
            return UnavailableError(
                f"the browser's images cannot be used: {count} of them {fault.value}{_told(seat)}",
                "give another size, or reload the page there",
            )
        return UnavailableError(f"no image came from the browser{_told(seat)}", "bring its tab to the front")

    def _tick(self, now_ns: int) -> None:
        """Do what is due."""
        seat = self._feed.seat
        if self._life.phase is not Standing.CLOSED:
            if self._life.due(now_ns) is Step.CLOSE:
                self._shut("no image came any more")
            return
        if seat is None or not seat.is_live or self._life.due(now_ns) is not Step.OPEN:
            return
        if self._life.opened(now_ns, self._rate.period_ns or 0) is Step.CLOSE:
            self._life.closed()
        else:
            self._grant()

    def _grant(self) -> None:
        if self._life.phase is Standing.STREAMING:
            self._feed.grant(self._rate.period_ns or 0)

    def _lose(self, loss: Loss, problem: str, now_ns: int) -> None:
        if self._life.lost(loss, now_ns) is Step.CLOSE:
            self._shut(problem)

    def _shut(self, problem: str) -> None:
        self._life.closed()
        self._waiting.tell()
        if self._life.is_lost:
            self._log_lost(self.description.name, problem)

    def _deliver(self, believed: Believed, arrived_ns: int) -> None:
        image, exposed = believed.image, believed.exposed
        self._life.heard(arrived_ns, self._rate.period_ns or 0)
        self._log_back("" if self._description is None else self._description.name)
        self._tell("")
        sequence, self._sequence = self._sequence, self._sequence + 1
        self._first_ns, self._believed = self._first_ns or exposed.ns, self._believed + 1
        self._rate.add(exposed.ns, sequence)
        self._newest = Frame(
            sequence=sequence,
            exposed=Stamp(exposed.ns, self.settings.clock),
            grabbed=Stamp(arrived_ns, self.settings.clock),
            width_px=image.width_px,
            height_px=image.height_px,
            pixel_format=image.pixel_format,
            exposure_ns=image.exposure_ns,
            payload=image.payload,
            uncertainty_ns=exposed.uncertainty_ns,
            bound_ns=exposed.bound_ns,
        )
        self._waiting.add(self._newest, self._sequence)

    def _spoil(self, fault: FrameFault, now_ns: int) -> None:
        self._life.stirred(now_ns)
        self._faults[fault] += 1
        if fault is FrameFault.TURNED:
            self._tell(_TURNED)
        sequence, self._sequence = self._sequence, self._sequence + 1
        self._waiting.add(Spoiled(sequence, fault), self._sequence)

    def _tell(self, words: str) -> None:
        """Tell the browser's user and the log, once."""
        if words == self._told:
            return
        self._told = words
        self._feed.tell(words)
        if words:
            _LOG.warning(event("camera_unusable", problem=words))


def _told(seat: Seat) -> str:
    return f": {seat.words}" if seat.words else ""
