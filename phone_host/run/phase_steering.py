"""Steers one camera of a run until both expose together, if that was asked for."""

import logging

from common.program.logs import event
from common.protocol.message import Steering
from phone_host.stream.pair_queue import PairQueue
from phone_host.stream.streams import BoardStream, OwnStream
from phone_host.sync.phase import Alignment, PhaseController, Whose

_LOG = logging.getLogger(__name__)


class PhaseSteering:
    """The phase alignment of one run.

    Args:
        steered: the cameras that may be steered; empty: the phase stays as it is.
        receiver: knows the board, and steers its camera.
        camera: this machine's camera.
        queue: measures the phase.
    """

    def __init__(self, steered: frozenset[Whose], receiver: BoardStream, camera: OwnStream, queue: PairQueue) -> None:
        self._steered, self._receiver, self._camera, self._queue = steered, receiver, camera, queue
        self._controller: PhaseController | None = None
        self._session = ""

    @property
    def alignment(self) -> Alignment | None:
        """The state of the alignment; None if no camera is being steered."""
        return None if self._controller is None else self._controller.alignment

    def update(self, now_ns: int) -> None:
        """Steer a camera if that is due. A new board session starts the alignment anew."""
        hello = self._receiver.hello
        if not self._steered or hello is None or not self._receiver.connected:
            return
        if self._controller is None or hello.session != self._session:
            self._session = hello.session
            ways = (Whose.BOARD, hello.camera.steering), (Whose.HOST, self._camera.steering)
            board, own = (way if whose in self._steered else Steering.NONE for whose, way in ways)
            self._controller = PhaseController(board, own, has_phase=self._queue.has_phase)
        state = self._controller.alignment.state
        correction = self._controller.update(now_ns, self._queue.phase)
        if correction is not None:
            steer = self._receiver.steer if correction.whose is Whose.BOARD else self._camera.steer
            steer(correction.later_ns)
            self._queue.restart_phase()
        alignment = self._controller.alignment
        if alignment.state is not state or correction is not None:
            _LOG.info(event("phase", state=alignment.state.value, words=alignment.words))
