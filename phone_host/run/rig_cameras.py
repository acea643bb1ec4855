"""The two cameras of a run beside those that its rig was calibrated with: refused, restored or doubted, and remembered."""

import logging

from common.camera_identity import UNKNOWN_CAMERA, Lock, RememberedCamera
from common.program.logs import event
from common.protocol.message import BoardHello, CameraDescription, Locks
from phone_host.diagnostics.run_rules import misses, require_camera, state_of
from phone_host.diagnostics.run_snapshot import LockMiss
from phone_host.model import Rig, Side
from phone_host.output.cameras_json import cameras_text
from phone_host.stream.streams import BoardStream, OwnStream

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
