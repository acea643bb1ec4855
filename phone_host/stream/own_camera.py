"""The host's own camera in a thread of its own; frames go to the pair queue."""

import queue
import threading
from collections.abc import Callable
from typing import Final

import zmq

from common import now
from common.camera.base import Camera, CameraHealth, Ended, Grab, Skipped, Spoiled
from common.frame import Frame
from common.protocol.message import Pacing, Steering

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
        self._wants: queue.SimpleQueue[tuple[int, int, int | None] | None] = queue.SimpleQueue()
        self._life = 0
        self._expected: int | None = None
        self._later_ns = 0
        self._reading = threading.Lock()
        self._thread = threading.Thread(target=self._run, name="camera", daemon=True)
        self._last_health: CameraHealth | None = None
        self.spoiled = 0
        self.skipped = 0
        self.from_the_future = 0
        self.ended = False
        self.failure: Exception | None = None

    @property
    def health(self) -> CameraHealth:
        """How the camera has fared, up to the moment before it was closed."""
        return self._last_health or self._camera.health

    @property
    def on_demand(self) -> bool:
        """Whether the camera gives an image only when one is wanted."""
        return self._camera.description.pacing is Pacing.DEMAND

    def start(self) -> None:
        """Begin to read."""
        self._thread.start()

    def want(self, exposed_ns: int, index: int | None) -> None:
        """Ask a demand-paced camera for its next image, because a board frame has come.

        Args:
            exposed_ns: exposure of the board's frame on the host's clock.
            index: number of that frame if the board is paced by demand, too: images of one number belong together. None for a board
                with a clock of its own: then the camera counts its stamps from the first frame that asked.
        """
        self._wants.put((self._life, exposed_ns, index))

    @property
    def steering(self) -> Steering:
        """How the camera's phase can be moved."""
        return self._camera.description.steering

    def steer(self, later_ns: int) -> None:
        """Let the camera expose later from its next reading on; safe from any thread."""
        self._later_ns = later_ns

    def forget(self) -> None:
        """Drop what was asked for: another board session begins, whose stamps begin anew. No image asked for before comes after this."""
        with self._reading:
            self._life += 1
            self._expected = None

    def stop(self) -> None:
        """End the thread and let go of the camera."""
        self._stop.set()
        self._wants.put(None)
        self._thread.join()
        self._last_health = self._camera.health
        self._camera.close()

    def _run(self) -> None:
        try:
            while not self._stop.is_set() and not self.ended:
                if self.on_demand:
                    self._answer(self._wants.get())
                else:
                    self._wait()
                    self._read()
        except Exception as error:  # noqa: BLE001 - a thread's root: the run's root reports it once
            self.failure = error

    def _answer(self, want: tuple[int, int, int | None] | None) -> None:
        """Show the image that was asked for; None was only to wake the thread."""
        with self._reading:
            if want is None or want[0] != self._life:
                return
            _, exposed_ns, index = want
            if self._expected is None or index not in {None, self._expected}:
                self._camera.anchor(exposed_ns, index or 0)
            self._expected = 0 if index is None else index + 1
            self._read()

    def _read(self) -> None:
        if self._later_ns:
            later_ns, self._later_ns = self._later_ns, 0
            self._camera.steer(later_ns, now.monotonic_ns())
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
            case Frame() if grab.exposed.ns > now.monotonic_ns() and not self.on_demand:
                self.from_the_future += 1  # no frame after it could be paired; on demand, stamps are labels
            case Frame():
                self._deliver(grab)
            case Spoiled():
                self.spoiled += 1
            case Skipped(_, frames):
                self.skipped += frames
            case Ended():
                self.ended = True
