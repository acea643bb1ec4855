"""The two cameras of a run: compared with those that its rig was calibrated with, restored and remembered; steered until both expose together."""

import logging

from common.camera_identity import UNKNOWN_CAMERA, Lock, RememberedCamera
from common.program.logs import event
from common.protocol.message import BoardHello, CameraDescription, Locks, Steering
from phone_host.diagnostics.run_rules import misses, require_camera, state_of
from phone_host.diagnostics.run_snapshot import LockMiss
from phone_host.model import Rig, Side
from phone_host.output.cameras_json import cameras_text
from phone_host.stream.pair_queue import PairQueue
from phone_host.stream.streams import BoardStream, OwnStream
from phone_host.sync.phase import Alignment, PhaseController, Whose

_LOG = logging.getLogger(__name__)


class RigCameras:
    """Watches over the cameras of one run. Used by the run's own thread.

    Args:
        rig: the rig; None: there is none, so nothing is compared.
        board_side: which view the board's camera is.
        camera: what the host camera says of itself.
        own: the host camera.
        receiver: the way to the board's.
    """

    def __init__(
        self, rig: Rig | None, board_side: Side, camera: CameraDescription, own: OwnStream, receiver: BoardStream
    ) -> None:
        states = {Side.LEFT: rig.left_camera, Side.RIGHT: rig.right_camera} if rig is not None else {}
        self._side = board_side
        self._of_board, self._of_host = states.get(board_side), states.get(board_side.other)
        self._camera, self._own, self._receiver = camera, own, receiver
        self._checked_host = False
        self._checked_session = ""

    def look(self) -> None:
        """Compare a camera that has just become known with the rig's, and have its controls set as they were.

        Raises:
            DataError: it is another camera, or mounted otherwise.
        """
        if not self._checked_host:
            self._checked_host = True
            self._own.hold(self._take(self._side.other, "this machine's camera", self._camera))
        hello = self._receiver.hello
        if hello is not None and hello.session != self._checked_session:
            self._checked_session = hello.session
            self._receiver.hold(self._take(self._side, "the board's camera", hello.camera))
            self._warn_of_an_old_board(hello)

    @property
    def missed(self) -> tuple[LockMiss, ...]:
        """The rig's locks that could not be restored, as far as the cameras have answered."""
        found: tuple[LockMiss, ...] = ()
        if self._of_host is not None and self._camera.identity.is_known and self._own.has_held:
            found += misses(self._side.other, self._of_host, self._own.held)
        hello, state = self._receiver.hello, self._receiver.locks
        if self._of_board is not None and hello is not None and hello.camera.identity.is_known and state is not None:
            asked = {lock.value: value for lock, value in state.asked}
            if asked == dict(_known(self._of_board)):
                found += misses(self._side, self._of_board, state.held)
        return found

    def text(self) -> str:
        """Return the content of cameras.json; empty if no board has said hello."""
        hello, state = self._receiver.hello, self._receiver.locks
        if hello is None:
            return ""
        board = state_of(hello.camera, () if state is None else state.held)
        own = state_of(self._camera, self._own.held)
        return cameras_text(*((board, own) if self._side is Side.LEFT else (own, board)))

    def _take(self, side: Side, whose: str, camera: CameraDescription) -> Locks:
        """Check a camera; return the controls that it shall be held at."""
        rig, other = (self._of_board, self._of_host) if side is self._side else (self._of_host, self._of_board)
        if rig is None:
            return ()
        require_camera(side, whose, rig, camera, UNKNOWN_CAMERA if other is None else other.identity)
        return tuple((Lock(name), value) for name, value in _known(rig)) if camera.identity.is_known else ()

    def _warn_of_an_old_board(self, hello: BoardHello) -> None:
        if self._of_board is not None and not hello.is_long:
            remedy = "update the board's tandemscan"
            _LOG.warning(event("board_camera_unchecked", camera=hello.camera.name, remedy=remedy))


def _known(camera: RememberedCamera) -> tuple[tuple[str, int], ...]:
    """Return the locks that this version can restore."""
    names = {lock.value for lock in Lock}
    return tuple((name, value) for name, value in camera.locks if name in names)


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
