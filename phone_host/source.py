"""The host's own camera in a thread of its own; frames go to the pair queue."""

import threading
from collections.abc import Callable
from typing import Final

import zmq

from common import now
from common.camera.base import Camera, Ended, Grab, Skipped, Spoiled
from common.frame import Frame
from common.protocol.message import Pacing

_LONGEST_WAIT_MS: Final = 100
"""What the end of a run waits for this thread at most, and how late a stall may be noticed."""


class Source:
    """Reads the own camera.

    Args:
        camera: open camera; closed by this.
        deliver: takes each frame.
    """

    def __init__(self, camera: Camera, deliver: Callable[[Frame], None]) -> None:
        self._camera = camera
        self._deliver = deliver
        self._stop = threading.Event()
        self._wanted = threading.Semaphore(0)
        self._thread = threading.Thread(target=self._run, name="camera", daemon=True)
        self.spoiled = 0
        self.skipped = 0
        self.ended = False
        self.failure: Exception | None = None

    @property
    def on_demand(self) -> bool:
        """Whether the camera gives an image only when one is wanted."""
        return self._camera.description.pacing is Pacing.DEMAND

    def start(self) -> None:
        """Begin to read."""
        self._thread.start()

    def want(self, exposed_ns: int) -> None:
        """Ask a demand-paced camera for its next image, because a board frame of that exposure (host's clock, ns) has come.

        A board that is paced by demand, too, counts its stamps from its first image; so both count from the same moment.
        """
        self._camera.anchor(exposed_ns)
        self._wanted.release()

    def stop(self) -> None:
        """End the thread and let go of the camera."""
        self._stop.set()
        self._wanted.release()
        self._thread.join()
        self._camera.close()

    def _run(self) -> None:
        try:
            while not self._stop.is_set() and not self.ended:
                self._wait()
                if not self._stop.is_set():
                    for grab in self._camera.read(now.monotonic_ns()):
                        self._take(grab)
        except Exception as error:  # noqa: BLE001 - a thread's root: the run's root reports it once
            self.failure = error

    def _wait(self) -> None:
        if self.on_demand:
            self._wanted.acquire()
            return
        wait_ns = self._camera.due_ns(now.monotonic_ns()) - now.monotonic_ns()
        if self._camera.pollable is None:
            self._stop.wait(min(max(0, wait_ns) / 1e9, _LONGEST_WAIT_MS / 1e3))
            return
        poller = zmq.Poller()
        poller.register(self._camera.pollable, zmq.POLLIN | zmq.POLLPRI)
        poller.poll(_LONGEST_WAIT_MS)

    def _take(self, grab: Grab) -> None:
        match grab:
            case Frame():
                self._deliver(grab)
            case Spoiled():
                self.spoiled += 1
            case Skipped():
                self.skipped += 1
            case Ended():
                self.ended = True
