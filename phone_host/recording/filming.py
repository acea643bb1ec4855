"""Takes the frames of both cameras for a while, and pairs nothing: the loop of `record` and of `calibrate-time`."""

from collections.abc import Callable, Sequence
from threading import Event
from typing import Final, Protocol

from common import now
from common.camera.base import Camera
from common.errors import DataError, SettingsError
from common.frame import Frame
from common.link.base import Link
from phone_host.recording.clock_messages import boot_of
from phone_host.stream.await_board import BoardPatience, await_board
from phone_host.stream.demand_clock import DemandClock, has_own_time
from phone_host.stream.frame_sink import FrameSink
from phone_host.stream.own_camera import OwnCamera
from phone_host.stream.receiver import Receiver
from phone_host.sync.clock import ClockEstimate

_STEP_S: Final = 0.05


class Taker(FrameSink, Protocol):
    """Takes the frames of both cameras."""

    @property
    def begun_ns(self) -> int | None:
        """When the board's first frame came or was exposed, CLOCK_MONOTONIC; None: none has come."""

    @property
    def is_full(self) -> bool:
        """Whether it takes no more."""

    def add_host(self, frame: Frame) -> None:
        """Take a frame of this machine's camera."""

    def clock(self, estimate: ClockEstimate | None, boot_id: str, at_ns: int) -> None:
        """Take note of what is known of the board's clock, and of which boot it is."""


def take_frames(
    links: Sequence[Link],
    camera: Camera,
    taker: Taker,
    seconds: float,
    wait_ns: int | None,
    *,
    stop: Callable[[], bool],
    advance: Callable[[float], None],
) -> None:
    """Take the frames of both cameras.

    Args:
        links: open links to the board; this function closes them.
        camera: the own camera, open; this function closes it.
        taker: takes the frames.
        seconds: for how long, from the board's first frame on; infinite: until it is stopped.
        wait_ns: how long to wait for an absent board; None means for ever.
        stop: asked repeatedly; True ends it early.
        advance: called with the share that is done, 0 to 1.

    Raises:
        UnavailableError: there is no board, or it does not talk to this host.
        DataError: the board shows images on demand and so has no time stamps.
        SettingsError: the same of the own camera.
    """
    pacing = camera.description.pacing
    if not has_own_time(pacing):
        camera.close()
        for link in links:
            link.close()
        raise SettingsError("--camera has pace=demand, and so no clock", "give it fps= or pace=clock")
    own = OwnCamera(camera, taker.add_host, DemandClock(pacing))
    receiver = Receiver(links, now.random_id(), taker)

    def frames_came() -> bool:
        _check(receiver, own)
        return taker.begun_ns is not None

    receiver.start()
    own.start()
    waiting = Event()
    try:
        has_begun = await_board(receiver, BoardPatience(wait_ns, now.monotonic_ns()), frames_came, stop)
        while has_begun and not stop():
            _check(receiver, own)
            taker.clock(receiver.estimate, boot_of(receiver.hello), now.monotonic_ns())
            done = (now.monotonic_ns() - (taker.begun_ns or 0)) / 1e9 / seconds
            advance(min(1.0, done))
            if done >= 1.0 or receiver.ended or own.ended or taker.is_full:
                break
            waiting.wait(_STEP_S)
    finally:
        own.stop()
        receiver.stop()


def take_alone(
    camera: Camera, taker: Taker, seconds: float, *, stop: Callable[[], bool], advance: Callable[[float], None]
) -> None:
    """Take the frames of the own camera only, while the board records its own.

    Args:
        camera: the own camera, open; this function closes it.
        taker: takes the frames.
        seconds: for how long; infinite: until it is stopped.
        stop: asked repeatedly; True ends it early.
        advance: called with the share that is done, 0 to 1.
    """
    own = OwnCamera(camera, taker.add_host, DemandClock(camera.description.pacing))
    waiting, begun_ns = Event(), now.monotonic_ns()
    own.start()
    try:
        while not (stop() or own.ended or taker.is_full):
            if own.failure is not None:
                raise own.failure
            done = (now.monotonic_ns() - begun_ns) / 1e9 / seconds
            advance(min(1.0, done))
            if done >= 1.0:
                return
            waiting.wait(_STEP_S)
    finally:
        own.stop()


def _check(receiver: Receiver, own: OwnCamera) -> None:
    """Raise a thread's failure, and DataError for a board whose stamps are not times."""
    for failure in (receiver.failure, own.failure):
        if failure is not None:
            raise failure
    hello = receiver.hello
    if hello is not None and not has_own_time(hello.camera.pacing):
        raise DataError("the board's camera has pace=demand and so has no clock", "give it fps= or pace=clock")
