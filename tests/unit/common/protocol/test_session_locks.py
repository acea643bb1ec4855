"""A long hello and the locks of the board's camera, between programs of today and with older ones. Everything passes through the wire."""

from dataclasses import replace
from typing import Any

import msgpack
import pytest

from common.camera_identity import CameraIdentity, Lock
from common.errors import ProtocolError
from common.orientation import Flip, Orientation
from common.protocol.board_session import LOCK_REST_NS, BoardSession
from common.protocol.host_session import HostSession
from common.protocol.message import (
    BoardCounts,
    BoardHello,
    HostHello,
    Lane,
    Locks,
    LockState,
    Message,
    SetLocks,
    Status,
)
from common.protocol.session import MS, STATUS_NS, Accepted, LocksTold, Outgoing, connection_name
from common.protocol.wire import MAX_HEADER_BYTES, decode, encode
from common.versions import PROTOCOL_VERSION
from phone_host.stream.refusals import LockAsking
from tests.support.samples import CAMERA

NOW_NS = 10**12
NONE = BoardCounts()
LANES = {lane: connection_name(0, lane.name.encode()) for lane in Lane}
FOUND: Locks = ((Lock.FOCUS, 20), (Lock.ZOOM, 100))
TURNED = replace(
    CAMERA,
    orientation=Orientation(270, Flip.V),
    identity=CameraIdentity("uvcvideo", "HD Pro Webcam C920", "A1B2"),
    controls=FOUND,
)


def wired(message: Message) -> Message:
    """The message as the other side reads it."""
    return decode(*encode(message))


def fields(message: Message) -> list[Any]:
    """A header as msgpack."""
    found: list[Any] = msgpack.unpackb(encode(message)[0])
    return found


def greeted(*, reads_long: bool) -> tuple[BoardSession, list[Message]]:
    """A board that a host has greeted on both lanes, and its answers."""
    board = BoardSession("life", "boot", TURNED)
    said = [
        board.receive(LANES[lane], wired(HostHello("host", lane, reads_long)), NOW_NS, NONE)[0].message
        for lane in (Lane.CONTROL, Lane.FRAMES)
    ]
    return board, said


def told(board: BoardSession, now_ns: int) -> list[Message]:
    """What the board says of itself at a time."""
    return [outgoing.message for outgoing in board.tick(now_ns, NONE)]


def test_a_host_that_asks_for_it_is_told_everything() -> None:
    """Orientation, identity and controls come with the hello, on both lanes."""
    _, said = greeted(reads_long=True)
    for hello in map(wired, said):
        assert isinstance(hello, BoardHello)
        assert hello.is_long
        assert hello.camera == TURNED


def test_an_older_host_gets_the_hello_that_it_can_read() -> None:
    """It has exactly the fields of 0.1: a field more would be refused."""
    board, said = greeted(reads_long=False)
    plain = BoardSession("life", "boot", CAMERA)
    for hello, lane in zip(said, (Lane.CONTROL, Lane.FRAMES), strict=True):
        (expected,) = plain.receive(LANES[lane], HostHello("host", lane), NOW_NS, NONE)
        assert encode(hello) == encode(expected.message)
        assert len(fields(hello)) == 2 + 2 + 7 + 3 + 7  # version, kind; ids; camera; counts; rung
    assert board.cannot_turn


def test_an_older_host_never_hears_of_locks() -> None:
    """Its accounts come as ever, whatever becomes of the camera's controls."""
    board, _ = greeted(reads_long=False)
    board.hold(FOUND)
    assert told(board, NOW_NS) == []
    assert all(isinstance(message, Status) for message in told(board, NOW_NS + STATUS_NS))


def test_a_later_version_may_tell_more() -> None:
    """What a hello's last list has beyond today's fields, and controls that are not known, are ignored."""
    later = fields(greeted(reads_long=True)[1][0])
    later[-1] = [*later[-1][:-1], [*later[-1][-1], 77, 5], "more", [1, 2]]
    hello = decode(msgpack.packb(later))
    assert isinstance(hello, BoardHello)
    assert hello.camera == TURNED


@pytest.mark.parametrize(
    "more",
    [
        7,
        [],
        [4, 0, "", "", "", []],
        [0, 3, "", "", "", []],
        [0, 0, "x" * 49, "", "", []],
        [0, 0, "", "", ""],
        [0, 0, "", "", "", [0]],
        [0, 0, "", "", "", [0, 2**31]],
        [0, 0, "", "", "", ["focus", 1]],
    ],
)
def test_a_long_hello_is_checked_field_by_field(more: Any) -> None:
    """Whatever stands in place of the list, nothing of it is believed unless all of it can be."""
    hello = fields(greeted(reads_long=False)[1][0])
    with pytest.raises(ProtocolError):
        decode(msgpack.packb([*hello, more]))


def test_the_longest_long_hello_fits() -> None:
    """All texts at full length, in letters of four bytes, leave room in a header for the counts."""
    letters = "\U0001f4f7" * 48
    camera = replace(TURNED, name="\U0001f4f7" * 96, identity=CameraIdentity(letters, letters, letters))
    camera = replace(camera, controls=tuple((lock, -(2**31)) for lock in Lock), width_px=16384, height_px=16384)
    board = BoardSession("f" * 32, "f" * 36, camera)
    (outgoing,) = board.receive(LANES[Lane.CONTROL], HostHello("h", Lane.CONTROL, reads_long=True), NOW_NS, NONE)
    assert len(encode(outgoing.message)[0]) < 1400 - 2 * 9 - 5 * 10 - 7 * 9 < MAX_HEADER_BYTES


def test_a_host_says_that_it_reads_long_hellos_in_its_id() -> None:
    """An older board takes the id as it comes: the same number of fields, of the same types."""
    (outgoing,) = HostSession("host", [{Lane.CONTROL: LANES[Lane.CONTROL]}]).tick(NOW_NS)
    assert isinstance(outgoing, Outgoing)
    assert fields(outgoing.message) == [PROTOCOL_VERSION, 0, "host+long", 1]


def test_locks_are_set_once_and_answered_with_what_the_camera_made_of_them() -> None:
    """The agent is told what is wanted; the answer names that and what is held now. Asking again brings the answer again."""
    board, _ = greeted(reads_long=True)
    asked: Locks = ((Lock.FOCUS, 23), (Lock.EXPOSURE, 10_000))
    board.receive(LANES[Lane.CONTROL], wired(SetLocks(asked)), NOW_NS, NONE)
    assert board.take_locks() == asked
    assert board.take_locks() == ()
    board.hold(FOUND)
    answer = LockState(session="life", asked=asked, held=FOUND)
    assert answer in told(board, NOW_NS)
    assert wired(answer) == answer
    assert answer not in told(board, NOW_NS + STATUS_NS)
    board.receive(LANES[Lane.CONTROL], SetLocks(asked), NOW_NS + STATUS_NS + MS, NONE)
    assert board.take_locks() == ()
    assert answer in told(board, NOW_NS + 2 * STATUS_NS)


def test_controls_are_not_set_more_often_than_a_camera_bears() -> None:
    """Other values that come at once are not taken; the host asks again."""
    board, _ = greeted(reads_long=True)
    for number in range(5):
        board.receive(LANES[Lane.CONTROL], SetLocks(((Lock.FOCUS, number),)), NOW_NS + number, NONE)
    assert board.take_locks() == ((Lock.FOCUS, 0),)
    board.receive(LANES[Lane.CONTROL], SetLocks(((Lock.FOCUS, 4),)), NOW_NS + LOCK_REST_NS, NONE)
    assert board.take_locks() == ((Lock.FOCUS, 4),)


def test_a_host_that_comes_later_is_told_how_the_camera_is_held() -> None:
    """What the camera found while nobody was there is said after the hello."""
    board = BoardSession("life", "boot", TURNED)
    board.hold(FOUND)
    board.receive(LANES[Lane.CONTROL], HostHello("host", Lane.CONTROL, reads_long=True), NOW_NS, NONE)
    assert LockState(session="life", held=FOUND) in told(board, NOW_NS + STATUS_NS)


def met(*, is_long: bool) -> tuple[HostSession, list[Any]]:
    """A host that a board has accepted, and what it noticed."""
    host = HostSession("host", [LANES])
    host.tick(NOW_NS)
    _, (control, frames) = greeted(reads_long=is_long)
    seen = host.receive(LANES[Lane.CONTROL], wired(control), NOW_NS)
    return host, seen + host.receive(LANES[Lane.FRAMES], wired(frames), NOW_NS)


def test_an_older_board_is_asked_for_nothing() -> None:
    """A hello without the list comes from a board that would take `SetLocks` for garbage."""
    host, seen = met(is_long=False)
    assert any(isinstance(output, Accepted) for output in seen)
    assert host.set_locks(FOUND) == []
    assert met(is_long=True)[0].set_locks(FOUND) == [Outgoing(LANES[Lane.CONTROL], SetLocks(FOUND))]


def test_only_the_running_session_is_believed_about_its_camera() -> None:
    """The state of another life of the board is ignored."""
    host, _ = met(is_long=True)
    state = LockState(session="life", held=FOUND)
    assert host.receive(LANES[Lane.CONTROL], state, NOW_NS) == [LocksTold(state)]
    assert host.receive(LANES[Lane.CONTROL], replace(state, session="before"), NOW_NS) == []
    assert host.receive(LANES[Lane.CONTROL], SetLocks(FOUND), NOW_NS) == []  # only hosts say that


def test_a_host_asks_until_it_is_answered_and_anew_in_a_new_session() -> None:
    """An answer to something else is none; nothing wanted is nothing asked."""
    asking = LockAsking()
    assert not asking.is_due(NOW_NS)
    asking.want(FOUND)
    assert [asking.is_due(NOW_NS + ms * MS) for ms in (0, 500, 1000, 1500, 2000)] == [True, False, True, False, True]
    asking.told(LockState(session="life", held=FOUND))  # said unasked
    assert asking.is_due(NOW_NS + 3000 * MS)
    asking.told(LockState(session="life", asked=FOUND))
    assert not asking.is_due(NOW_NS + 9000 * MS)
    asking.begin()
    assert asking.is_due(NOW_NS + 9001 * MS)
