"""A line at its limits: as much as fits into one write, a new round trip measured, units nobody acknowledges, half a unit, a stranger's goodbye."""

import struct

import pytest

from common.protocol.chunking import Cutter, Joiner
from common.protocol.contact import Contact, News
from common.protocol.duplex import GAP_NS, Change, Duplex
from common.protocol.framing import MAX_BODY_BYTES, Deframer, LinkEnd, Unit, UnitKind, unit_parts
from common.protocol.message import Lane
from common.protocol.pacing import Window

MS = 1_000_000
S = 1000 * MS
BOARD, HOST = LinkEnd.LISTENER, LinkEnd.DIALLER


def test_one_writing_is_what_a_tty_takes_at_once() -> None:
    """On a line of gigabytes a second a large frame leaves in pieces of 64 KB, never more than one unit beyond that at once, and all of it leaves."""
    cutter, deframer = Cutter(BOARD), Deframer(BOARD)
    frame = bytes(2_000_000)
    assert cutter.put(Lane.FRAMES, b"head", frame)
    sizes, bodies, now_ns = [], 0, 0
    while data := cutter.take(now_ns):
        now_ns += MS // 10
        units = deframer.feed(data)
        bodies += sum(len(unit.body) for unit in units)
        cutter.acknowledged(units[-1].number, now_ns)
        sizes.append(len(data))
    assert bodies >= len(frame) + len(b"head")
    assert 64 * 1024 <= max(sizes) < 64 * 1024 + MAX_BODY_BYTES + 11
    assert cutter.is_idle


def test_the_round_trip_is_measured_anew_with_the_line_let_run_empty() -> None:
    """Ten seconds after the least round trip was measured, no second unit may be under way until one alone has been acknowledged."""
    window = Window()
    window.sent(0, 300, 0)
    assert window.acknowledged(0, 2 * MS)
    now_ns = 2 * MS
    window.sent(1, 300, now_ns)
    room = []
    # A unit of 300 bytes every 11 ms; the next one is always written before the last one is acknowledged.
    for number in range(2, 1001):
        now_ns += 11 * MS
        window.tick(now_ns)
        room.append(window.has_room(200))
        window.sent(number, 300, now_ns)
        assert window.acknowledged(number - 1, now_ns)
    assert room == [True] * 909 + [False] * 90  # 909 units take ten seconds
    window.acknowledged(1000, now_ns + 11 * MS)
    window.sent(1001, 300, now_ns + 11 * MS)
    window.acknowledged(1001, now_ns + 16 * MS)  # alone: its 5 ms are now the line's round trip
    window.sent(1002, 300, now_ns + 17 * MS)
    assert window.has_room(200)


def test_units_that_nobody_acknowledges_are_forgotten_at_last() -> None:
    """Of 4100 unanswered units the oldest four are forgotten, so that a mute peer fills no memory; an acknowledgement of the fifth is still understood."""
    window = Window()
    for number in range(4100):
        window.sent(number, 300, number * MS)
    assert not window.acknowledged(3, 5 * S)
    assert window.acknowledged(4, 5 * S)


@pytest.mark.parametrize(
    ("announced", "bodies"), [(10, [b"1234", b"5678901"]), (10, [b"1234", b"56789"]), (3, [b"1234"]), (5, [b"1234"])]
)
def test_a_packet_of_another_length_than_it_announced_is_none(announced: int, bodies: list[bytes]) -> None:
    """Chunks whose total differs from what the first one announces make no packet. The error is counted, and the next packet comes whole."""
    joiner = Joiner()

    def units(announced: int, bodies: list[bytes], number: int) -> list[Unit]:
        lengths = struct.pack("<HI", 0, announced)
        whole = [lengths + bodies[0], *bodies[1:]]
        last = len(whole) - 1
        return [
            Unit(kind=UnitKind.FRAMES, first=at == 0, last=at == last, number=number + at, body=body)
            for at, body in enumerate(whole)
        ]

    assert [joiner.add(unit) for unit in units(announced, bodies, 7)] == [None] * len(bodies)
    assert joiner.broken == 1
    sound = [joiner.add(unit) for unit in units(8, [b"1234", b"5678"], 20)]
    assert sound[0] is None
    assert sound[1] is not None
    assert (bytes(sound[1].payload), joiner.broken) == (b"12345678", 1)


def test_a_unit_whose_rest_was_lost_holds_nothing_up() -> None:
    """If the rest of a unit was lost, the bytes that follow are taken for its body. After some silence on the line they are passed on after all, and the loss is reported."""
    board, host = Duplex(BOARD, 1), Duplex(HOST, 2)
    events = []
    for now_ns in range(0, 10 * MS, MS):
        board.feed(host.take(now_ns), now_ns)
        events += host.feed(board.take(now_ns), now_ns)
    assert events == [Change.MET]
    cut = b"".join(unit_parts(BOARD, Unit(kind=UnitKind.FRAMES, first=True, last=False, number=9, body=bytes(4000))))[
        :1000
    ]
    assert board.put(Lane.CONTROL, b"account", b"")
    assert host.feed(cut + board.take(20 * MS), 20 * MS) == []
    assert host.due_ns <= 20 * MS + GAP_NS
    assert host.silence(20 * MS + GAP_NS - 1) == []
    found = host.silence(20 * MS + GAP_NS)
    assert [bytes(event.header) for event in found if not isinstance(event, Change)] == [b"account"]
    assert Change.GARBAGE in found
    assert host.counts.garbage_bytes == 1000


def test_a_strangers_goodbye_ends_no_contact() -> None:
    """A listener parts only from the dialler that it has met, by that dialler's number: a goodbye from another one, or from an earlier life, has no effect."""
    listener, met, stranger = Contact(BOARD, 0), Contact(HOST, 7), Contact(HOST, 8)
    other_listener = Contact(BOARD, 0)
    for dialler, heard_by in ((met, listener), (stranger, other_listener)):
        [opening] = dialler.words(0)
        assert heard_by.hear(bytes(opening.body)) is News.MET
        for unit in heard_by.words(0):
            dialler.hear(bytes(unit.body))
        assert dialler.is_up
        dialler.leave()
    goodbye, strangers = (dialler.words(0)[0] for dialler in (met, stranger))
    told = [(listener.hear(bytes(word.body)), listener.is_up) for word in (strangers, goodbye, goodbye)]
    assert told == [(News.NONE, True), (News.PARTED, False), (News.NONE, False)]
