"""How long a board that is absent, or does not talk to this host, is put up with; one set of errors for all who wait for one.

`BoardPatience` judges and has no clock; `await_board` waits with it in the caller's thread. Boards that are only looked for, with no
receiver, are `boards/discovery`'s.
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
"""A board may take a host that crashed for alive for a moment; only after this long `busy` is believed."""

_REMEDY: Final = "start board-agent there, check --link, or give --wait more seconds"


class BoardPatience:
    """Whether a board has been away for too long.

    Another protocol version is put up with not at all: no waiting mends it.

    Args:
        patience_ns: an absent board is waited for this long; None for ever.
        began_ns: since when, ns.
        where: where it should be, for the error; empty: that is known.
        remedy: what to do about an absent board.
    """

    def __init__(self, patience_ns: int | None, began_ns: int, *, where: str = "", remedy: str = _REMEDY) -> None:
        self._patience_ns = patience_ns
        self._seen_ns = began_ns
        self._absent = f"no board at {where}" if where else "no board"
        self._remedy = remedy

    def look(self, now_ns: int, refused: BoardRefusal | None, *, present: bool) -> None:
        """See whether there is still reason to wait.

        Args:
            now_ns: now, ns.
            refused: why the board that was last heard does not talk to this host; None when it does, or is silent.
            present: whether it is there; patience begins anew when it goes.

        Raises:
            AbsentBoardError: it has been away for too long.
            BusyBoardError: it talks to another host.
            OtherVersionError: it speaks another protocol version.
        """
        if present:
            self._seen_ns = now_ns
        patience_ns = self._patience_ns
        if refused is not None:
            patience_ns = max(patience_ns or 0, _BUSY_NS) if refused.reason is RefusalReason.BUSY else 0
        if patience_ns is None or now_ns - self._seen_ns <= patience_ns:
            return
        if refused is not None:
            raise _refusal(refused)
        raise AbsentBoardError(f"{self._absent} within {patience_ns / 1e9:g} s", self._remedy)


def await_board(
    receiver: Receiver,
    patience: BoardPatience,
    ready: Callable[[], bool],
    stop: Callable[[], bool] = lambda: False,
) -> bool:
    """Wait until a board has given what the caller needs of it.

    Args:
        receiver: has been started.
        patience: for how long.
        ready: whether it has; asked several times a second.
        stop: asked as often; ends the wait.

    Returns:
        Whether it has; False: `stop` ended the wait.

    Raises:
        AbsentBoardError: there is no board, or it does not give it in time.
        BusyBoardError: it talks to another host.
        OtherVersionError: it speaks another protocol version.
        Exception: the receiver's failure, or what `ready` raises.
    """
    pause = threading.Event()
    while not stop():
        if receiver.failure is not None:
            raise receiver.failure
        if ready():
            return True
        refused = None if receiver.connected else receiver.refused  # a second link's refusal ends nothing
        patience.look(now.monotonic_ns(), refused, present=False)
        pause.wait(_STEP_S)
    return False


def _refusal(refusal: BoardRefusal) -> UnavailableError:
    match refusal.reason:
        case RefusalReason.BUSY:
            return BusyBoardError(*refusal_text(refusal))
        case RefusalReason.VERSION:
            return OtherVersionError(*refusal_text(refusal))
