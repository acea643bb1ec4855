"""The host camera in its own thread. Frames are delivered as they come, or as the demand clock asks for them."""

import threading
from collections.abc import Callable
from typing import Final

import zmq

from common import now
from common.camera.base import Camera, CameraHealth, Ended, Grab, Skipped, Spoiled, held_locks, lockable
from common.frame import Frame
from common.protocol.message import Locks, Steering
from phone_host.stream.corrections import Corrections
from phone_host.stream.demand_clock import DemandClock

_LONGEST_WAIT_MS: Final = 100
"""Longest time that the end of a run waits for this thread, and by which a stall may be noticed late."""


class OwnCamera:
    """Reads the host camera.

    Args:
        camera: the open camera; this class closes it.
        deliver: takes each frame.
        demand: says when a demand-paced camera shows an image. It must have been created for this camera's pacing.
        missing: called when the image that was asked for is spoiled.
    """

    def __init__(
        self,
        camera: Camera,
        deliver: Callable[[Frame], None],
        demand: DemandClock,
        missing: Callable[[], None] = lambda: None,
    ) -> None:
        self._missing = missing
        self._camera = camera
        self._deliver = deliver
        self._demand = demand
        self._stop = threading.Event()
        self._corrections = Corrections()
        self._thread = threading.Thread(target=self._run, name="camera", daemon=True)
        self._last_health: CameraHealth | None = None
        self._last_held: Locks | None = None
        self._wanted: Locks = ()
        self._asked: Locks = ()
        self.spoiled = 0
        self.skipped = 0
        self.from_the_future = 0
        self.ended = False
        self.failure: Exception | None = None

    @property
    def health(self) -> CameraHealth:
        """The camera's health; after `stop`, as it was just before closing."""
        return self._last_health or self._camera.health

    @property
    def held(self) -> Locks:
        """The controls that the camera is held at; after `stop`, as they were just before closing."""
        return held_locks(self._camera) if self._last_held is None else self._last_held

    @property
    def has_held(self) -> bool:
        """Whether the camera has been told everything that it is to be held at."""
        return self._asked == self._wanted

    def hold(self, locks: Locks) -> None:
        """Hold controls of the camera from its next read on. Safe from any thread."""
        self._wanted = locks

    def start(self) -> None:
        """Start to read."""
        self._thread.start()

    @property
    def steering(self) -> Steering:
        """How the camera's phase can be moved."""
        return self._camera.description.steering

    def steer(self, later_ns: int) -> None:
        """Let the camera expose later from its next read on. Safe from any thread."""
        self._corrections.add(later_ns)

    def stop(self) -> None:
        """End the thread and close the camera."""
        self._stop.set()
        self._demand.wake()
        self._thread.join()
        self._last_health, self._last_held = self._camera.health, held_locks(self._camera)
        self._camera.close()

    def _run(self) -> None:
        try:
            while not self._stop.is_set() and not self.ended:
                if self._demand.paces_own_camera:
                    self._demand.show_next(self._camera.anchor, self._read)
                else:
                    self._wait()
                    self._read()
        except Exception as error:  # noqa: BLE001 - a thread's root: the run's root reports it once
            self.failure = error

    def _read(self) -> None:
        if later_ns := self._corrections.take():
            self._camera.steer(later_ns % self._camera.description.period_ns, now.monotonic_ns())
        if not self.has_held:
            wanted = self._wanted
            if (holder := lockable(self._camera)) is not None:
                holder.hold(wanted, now.monotonic_ns())
            self._asked = wanted
        for grab in self._camera.read(now.monotonic_ns()):
            if not self._stop.is_set():
                self._take(grab)

    def _wait(self) -> None:
        wait_ns = self._camera.due_ns(now.monotonic_ns()) - now.monotonic_ns()
        if self._camera.pollable is None:
            self._stop.wait(min(max(0, wait_ns) / 1e9, _LONGEST_WAIT_MS / 1e3))
            return
        poller = zmq.Poller()
        poller.register(self._camera.pollable, zmq.POLLIN | zmq.POLLPRI)
        poller.poll(_LONGEST_WAIT_MS)

    def _take(self, grab: Grab) -> None:
        match grab:
            case Frame() if grab.exposed.ns > now.monotonic_ns() and not self._demand.paces_own_camera:
                self.from_the_future += 1  # later frames could not be paired after it; on demand, stamps are labels
            case Frame():
                self._deliver(grab)
            case Spoiled():
                self.spoiled += 1
                self._missing()
            case Skipped(_, frames):
                self.skipped += frames
            case Ended():
                self.ended = True
