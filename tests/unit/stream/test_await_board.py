"""A program that waits for a board is told why there is none, with an error for each reason, and waits only as long as it helps."""

import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from common import now
from common.errors import AbsentBoardError, BusyBoardError, OtherVersionError, UnavailableError
from common.link.factory import open_link, parse_link
from common.protocol.message import RefusalReason
from phone_host.stream.await_board import BoardPatience, await_board
from phone_host.stream.frame_sink import NoFrames
from phone_host.stream.receiver import Receiver
from phone_host.stream.refusals import BoardRefusal, Refusals

S = 1_000_000_000
LOOKS = 200_000


def ends_after(patience_ns: int | None, refused: RefusalReason | None) -> tuple[int, UnavailableError] | None:
    """The second in which patience with a board that was never there ends, and the error; None: not within a minute."""
    patience = BoardPatience(patience_ns, 0)
    for second in range(61):
        try:
            patience.look(second * S, None if refused is None else BoardRefusal(refused), present=False)
        except UnavailableError as error:
            return second, error
    return None


@pytest.mark.parametrize(
    ("patience_s", "refused", "ends_s", "kind"),
    [
        (3, None, 4, AbsentBoardError),
        (0, None, 1, AbsentBoardError),
        # For a moment a board may take a crashed host to be alive: busy is not believed for 4 s.
        (0, RefusalReason.BUSY, 5, BusyBoardError),
        (10, RefusalReason.BUSY, 11, BusyBoardError),
        (None, RefusalReason.BUSY, 5, BusyBoardError),
        # Waiting does not cure a different version.
        (10, RefusalReason.VERSION, 1, OtherVersionError),
        (None, RefusalReason.VERSION, 1, OtherVersionError),
    ],
)
def test_patience_ends_by_the_reason(
    patience_s: int | None, refused: RefusalReason | None, ends_s: int, kind: type[UnavailableError]
) -> None:
    """The host waits as long as was asked for an absent board, at least 4 s for a busy one, and not at all for one of another version."""
    ended = ends_after(None if patience_s is None else patience_s * S, refused)
    assert ended is not None
    second, error = ended
    assert (second, type(error)) == (ends_s, kind)
    assert error.problem
    assert error.remedy


def test_without_a_limit_an_absent_board_is_waited_for() -> None:
    """Without a limit the host waits for a silent board forever."""
    assert ends_after(None, None) is None


def test_a_refusal_heard_a_moment_ago_is_still_the_reason() -> None:
    """The machine was too busy to hear the board's last second of refusals: the board is busy, not absent. After 5 s it is absent."""
    for heard_s, kind in ((2, BusyBoardError), (0, AbsentBoardError)):
        patience = BoardPatience(5 * S, 0)
        patience.look(heard_s * S, BoardRefusal(RefusalReason.BUSY), present=False)
        patience.look(heard_s * S + 1, None, present=False)
        assert patience.refused == BoardRefusal(RefusalReason.BUSY)
        with pytest.raises(kind):
            patience.look(5 * S + 1, None, present=False)
    accepted = BoardPatience(5 * S, 0)
    accepted.look(S, BoardRefusal(RefusalReason.BUSY), present=False)
    accepted.look(2 * S, None, present=True)
    assert accepted.refused is None


def test_patience_begins_anew_when_a_board_goes() -> None:
    """The time in which the board was there does not count."""
    patience = BoardPatience(3 * S, 0)
    for second in range(20):
        patience.look(second * S, None, present=True)
    patience.look(22 * S, None, present=False)
    with pytest.raises(AbsentBoardError, match="no board within 3 s"):
        patience.look(23 * S, None, present=False)


@contextmanager
def receiver_at(folder: Path) -> Iterator[Receiver]:
    """A receiver with a link that has nobody at its other end."""
    receiver = Receiver([open_link(parse_link(f"ipc://{folder}/board", listens_by_default=False))], "host", NoFrames())
    receiver.start()
    try:
        yield receiver
    finally:
        receiver.stop()


def test_the_wait_ends_in_each_of_its_ways(tmp_path: Path) -> None:
    """The wait ends when the board has given what is needed, when it is stopped, when time is up, or by the caller's own error."""
    with receiver_at(tmp_path) as receiver:
        answers = iter((False, False, True))
        assert await_board(receiver, BoardPatience(None, 0), lambda: next(answers))
        assert not await_board(receiver, BoardPatience(None, 0), lambda: False, lambda: True)
        nowhere = BoardPatience(0, now.monotonic_ns() - 1, where="ipc://nowhere", remedy="look elsewhere")
        with pytest.raises(AbsentBoardError, match="no board at ipc://nowhere within 0 s: look elsewhere"):
            await_board(receiver, nowhere, lambda: False)
        with pytest.raises(ZeroDivisionError):
            await_board(receiver, BoardPatience(None, 0), lambda: bool(1 // 0))


def test_a_receivers_failure_ends_the_wait(tmp_path: Path) -> None:
    """A failure in the receiver's thread is raised where the board is waited for."""
    with receiver_at(tmp_path) as receiver:
        receiver.failure = OSError("gone")
        with pytest.raises(OSError, match="gone"):
            await_board(receiver, BoardPatience(None, 0), lambda: False)


def test_a_refusal_that_ends_while_it_is_told_is_a_refusal() -> None:
    """The receiver's thread may withdraw a refusal at any moment: the waiting thread sees a whole refusal or none."""
    refusals = Refusals()
    done, seen = threading.Event(), {True: 0, False: 0}

    def flicker() -> None:
        while not done.is_set():
            refusals.note(BoardRefusal(RefusalReason.VERSION, protocol=4), now.monotonic_ns())
            sum(range(200))  # neither state may be so short that the threads never meet in it
            refusals.accepted()  # as when a board accepts
            sum(range(200))

    usual_s = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    thread = threading.Thread(target=flicker)
    thread.start()
    try:
        for _ in range(LOOKS):
            try:
                BoardPatience(None, 0).look(now.monotonic_ns(), refusals.last(now.monotonic_ns()), present=False)
            except OtherVersionError:
                seen[True] += 1
            else:
                seen[False] += 1
            if min(seen.values()) > 500:
                break
    finally:
        done.set()
        thread.join(60)
        sys.setswitchinterval(usual_s)
    assert min(seen.values()) > 500, f"the threads never met: {seen}"
