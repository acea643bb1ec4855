"""How long to wait for a board that is absent or refuses this host. All callers that wait raise the same errors.

`BoardPatience` decides and has no clock. `await_board` uses it to wait in the caller's thread. `boards/discovery` looks
for boards without a receiver.
"""

import threading
from collections.abc import Callable
from typing import Final

from common import now
from common.errors import AbsentBoardError, BusyBoardError, OtherVersionError, UnavailableError
from common.protocol.message import RefusalReason
from phone_host.stream.receiver import Receiver
from phone_host.stream.refusals import BoardRefusal, refusal_text

_STEP_S: Final = 0.05

_BUSY_NS: Final = 4_000_000_000
"""A board may briefly believe that a crashed host is alive. `busy` is believed only after this long.

A refusal is remembered as long: it repeats five times a second, but a machine may be too busy itself to hear that.
"""

_REMEDY: Final = "start board-agent there, check --link, or give --wait more seconds"


class BoardPatience:
    """Decides whether a board has been away for too long.

    Another protocol version is an error at once, because waiting does not help.

    Attributes:
        refused: why the board refused this host a moment ago; None if it did not, or is there.

    Args:
        patience_ns: how long to wait for an absent board; None for ever.
        began_ns: when the wait began, ns.
        where: where the board should be, for the error; empty: leave it out.
        remedy: what to do about an absent board.
    """

    def __init__(self, patience_ns: int | None, began_ns: int, *, where: str = "", remedy: str = _REMEDY) -> None:
        self._patience_ns = patience_ns
        self._seen_ns = began_ns
        self.refused: BoardRefusal | None = None
        self._refused_ns = 0
        self._absent = f"no board at {where}" if where else "no board"
        self._remedy = remedy

    def look(self, now_ns: int, refused: BoardRefusal | None, *, present: bool) -> None:
        """Check whether to wait any longer.

        Args:
            now_ns: now, ns.
            refused: why the last board heard refuses this host; None if it does not, or is silent.
            present: whether the board is there. The wait starts again when it leaves.

        Raises:
            AbsentBoardError: the board has been away for too long.
            BusyBoardError: the board talks to another host.
            OtherVersionError: the board speaks another protocol version.
        """
        if present:
            self._seen_ns = now_ns
        if refused is not None:
            self.refused, self._refused_ns = refused, now_ns
        elif present or now_ns - self._refused_ns > _BUSY_NS:
            self.refused = None
        patience_ns = self._patience_ns
        if refused is not None:
            patience_ns = max(patience_ns or 0, _BUSY_NS) if refused.reason is RefusalReason.BUSY else 0
        if patience_ns is None or now_ns - self._seen_ns <= patience_ns:
            return
        if self.refused is not None:
            raise refusal_error(self.refused)
        raise AbsentBoardError(f"{self._absent} within {patience_ns / 1e9:g} s", self._remedy)


def await_board(
    receiver: Receiver,
    patience: BoardPatience,
    ready: Callable[[], bool],
    stop: Callable[[], bool] = lambda: False,
) -> bool:
    """Wait until a board has delivered what the caller needs: `ready` is asked several times a second.

    Returns:
        True if the board has delivered, False if `stop` ended the wait.

    Raises:
        AbsentBoardError: there is no board, or it does not deliver in time.
        BusyBoardError: the board talks to another host.
        OtherVersionError: the board speaks another protocol version.
        Exception: the receiver's failure, or what `ready` raises.
    """
    pause = threading.Event()
    while not stop():
        if receiver.failure is not None:
            raise receiver.failure
        if ready():
            return True
        refused = None if receiver.connected else receiver.refused  # a refusal on a second link does not end the wait
        patience.look(now.monotonic_ns(), refused, present=False)
        pause.wait(_STEP_S)
    return False


def refusal_error(refusal: BoardRefusal) -> UnavailableError:
    """Return a refusal as the error that ends a wait."""
    match refusal.reason:
        case RefusalReason.BUSY:
            return BusyBoardError(*refusal_text(refusal))
        case RefusalReason.VERSION:
            return OtherVersionError(*refusal_text(refusal))
