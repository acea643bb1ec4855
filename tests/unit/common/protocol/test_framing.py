"""Units in a byte stream arrive whole and unaltered or not at all, whatever happens to the bytes."""

import random
import tracemalloc
from zlib import crc32

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.protocol.framing import MAX_BODY_BYTES, UNIT_OVERHEAD_BYTES, Deframer, LinkEnd, Unit, UnitKind, unit_parts

SIDE = LinkEnd.LISTENER
MARKER = bytes((SIDE.value,))

UNITS = st.builds(
    Unit,
    kind=st.sampled_from(UnitKind),
    first=st.booleans(),
    last=st.booleans(),
    number=st.integers(0, 65535),
    body=st.one_of(
        st.binary(max_size=40),
        st.lists(st.sampled_from([MARKER, b"\0", b"\xff"]), max_size=60).map(b"".join),
        st.builds(
            lambda size, seed: random.Random(seed).randbytes(size), st.integers(0, MAX_BODY_BYTES), st.integers()
        ),
    ),
)


def wire(unit: Unit) -> bytes:
    """A unit's bytes."""
    return b"".join(unit_parts(SIDE, unit))


def found(deframer: Deframer, data: bytes) -> list[Unit]:
    """Units in these bytes, with bodies as bytes."""
    return [plain(unit) for unit in deframer.feed(data)]


def plain(unit: Unit) -> Unit:
    """The same unit with a comparable body."""
    return Unit(kind=unit.kind, first=unit.first, last=unit.last, number=unit.number, body=bytes(unit.body))


def everything(data: bytes) -> list[Unit]:
    """All units in a stream that then falls silent."""
    deframer = Deframer(SIDE)
    return found(deframer, data) + [plain(unit) for unit in deframer.give_up()]


def numbered(count: int, chance: random.Random, most_bytes: int = MAX_BODY_BYTES) -> list[Unit]:
    """Units with random bodies."""
    return [
        Unit(
            kind=UnitKind.FRAMES,
            first=i % 7 == 0,
            last=i % 7 == 6,
            number=i % 65536,
            body=chance.randbytes(chance.randrange(most_bytes + 1)),
        )
        for i in range(count)
    ]


def test_the_bytes_of_a_unit_are_fixed() -> None:
    """A unit is marker, head, number, half a CRC over these, body, and CRC-32 over all except that half; little endian."""
    head = b"\xc6" + (0b01_1_0_000000000011).to_bytes(2, "little") + (0x1234).to_bytes(2, "little")
    crc = crc32(head)
    expected = head + (crc & 0xFFFF).to_bytes(2, "little") + b"abc" + crc32(head + b"abc").to_bytes(4, "little")
    assert wire(Unit(kind=UnitKind.CONTROL, first=True, last=False, number=0x1234, body=b"abc")) == expected
    assert len(expected) == UNIT_OVERHEAD_BYTES + 3


@given(units=st.lists(UNITS, max_size=8), data=st.data())
@settings(deadline=None)
def test_any_chopping_gives_the_same_units(units: list[Unit], data: st.DataObject) -> None:
    """However a stream of units is cut up, exactly these units come out, and no byte is garbage."""
    stream = b"".join(map(wire, units))
    cuts = sorted(data.draw(st.lists(st.integers(0, len(stream)), max_size=12)))
    deframer = Deframer(SIDE)
    parts = [stream[a:b] for a, b in zip([0, *cuts], [*cuts, len(stream)], strict=True)]
    assert [unit for part in parts for unit in found(deframer, part)] == units
    assert deframer.garbage_bytes == 0
    assert not deframer.partial


@given(units=st.lists(UNITS, max_size=3))
@settings(deadline=None, max_examples=30)
def test_byte_by_byte(units: list[Unit]) -> None:
    """A stream that arrives byte by byte gives the same units."""
    deframer = Deframer(SIDE)
    stream = b"".join(map(wire, units))
    assert [unit for i in range(len(stream)) for unit in found(deframer, stream[i : i + 1])] == units


@given(units=st.lists(UNITS, min_size=1, max_size=8), data=st.data())
@settings(deadline=None)
def test_a_spoiled_place_loses_only_the_units_that_it_touches(units: list[Unit], data: st.DataObject) -> None:
    """Bytes flipped, inserted or deleted anywhere lose at most the units that held them; all others arrive unaltered and in order."""
    pieces = [wire(unit) for unit in units]
    touched = data.draw(st.integers(0, len(units) - 1))
    piece = pieces[touched]
    at = data.draw(st.integers(0, len(piece) - 1))
    count = data.draw(st.integers(1, len(piece) - at))
    match data.draw(st.sampled_from(["flip", "insert", "delete"])):
        case "flip":
            noise = data.draw(st.integers(1, 255))
            pieces[touched] = piece[:at] + bytes((piece[at] ^ noise,)) + piece[at + 1 :]
        case "insert":
            pieces[touched] = piece[:at] + data.draw(st.binary(min_size=1, max_size=300)) + piece[at:]
        case _:
            pieces[touched] = piece[:at] + piece[at + count :]
    stream = b"".join(pieces)
    others = units[:touched] + units[touched + 1 :]
    if stream.startswith(
        b"".join(map(wire, units[: touched + 1]))
    ):  # the next unit's first bytes stand for those deleted: that one is spoiled
        others = units[: touched + 1] + units[touched + 2 :]
    assert everything(stream) in (others, units)  # all of them where something was inserted in front of a unit


@given(garbage=st.binary(max_size=2000), unit=UNITS)
def test_a_good_unit_behind_garbage_is_found(garbage: bytes, unit: Unit) -> None:
    """Whatever comes before a whole unit, the unit is found by the time the line falls silent."""
    assert everything(garbage + wire(unit))[-1] == unit


def test_the_own_echo_is_garbage() -> None:
    """A sender does not take its own bytes, echoed by the line, for units."""
    unit = Unit(kind=UnitKind.CONTROL, first=True, last=True, number=1, body=b"hello")
    deframer = Deframer(SIDE.peer)
    assert deframer.feed(wire(unit)) == []
    assert deframer.garbage_bytes == len(wire(unit))


@pytest.mark.many
def test_ten_million_random_bytes_are_no_unit() -> None:
    """Among 10^7 random bytes no unit is found, memory stays below two megabytes, and the good unit behind them is found."""
    chance = random.Random(1)
    deframer = Deframer(SIDE)
    unit = Unit(kind=UnitKind.FRAMES, first=True, last=True, number=7, body=b"good")
    tracemalloc.start()
    for _ in range(160):
        assert deframer.feed(chance.randbytes(62_500)) == []
    peak_bytes = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak_bytes < 2_000_000
    came = found(deframer, wire(unit)) + [plain(unit) for unit in deframer.give_up()]
    assert came == [unit]
    assert deframer.garbage_bytes == 160 * 62_500


@pytest.mark.many
def test_hostile_headers_cost_no_memory() -> None:
    """Headers with valid checks and the greatest length, back to back, hold no more than one unit's bytes."""
    start = MARKER + (0x0FFF).to_bytes(2, "little") + b"\0\0"
    hostile = start + (crc32(start) & 0xFFFF).to_bytes(2, "little")
    longest = MARKER + MAX_BODY_BYTES.to_bytes(2, "little") + b"\0\0"
    sound = longest + (crc32(longest) & 0xFFFF).to_bytes(2, "little")
    deframer = Deframer(SIDE)
    tracemalloc.start()
    for _ in range(200):
        assert deframer.feed(hostile * 100 + sound * 100) == []
    peak_bytes = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak_bytes < 200_000
    assert deframer.give_up() == []
    assert not deframer.partial


@pytest.mark.long
def test_of_many_units_with_flipped_bits_none_comes_altered() -> None:
    """Of 10^5 units, half of them with one to eight bits flipped anywhere, every sound one arrives and no altered one does."""
    chance = random.Random(2)
    deframer = Deframer(SIDE)
    for block in range(100):
        units = numbered(1000, chance, 60)
        expected, pieces = [], []
        for unit in units:
            piece = bytearray(wire(unit))
            flips = chance.randrange(9) if chance.random() < 0.5 else 0
            for bit in chance.sample(range(8 * len(piece)), flips):
                piece[bit // 8] ^= 1 << bit % 8
            pieces.append(bytes(piece))
            if not flips:
                expected.append(unit)
        came = found(deframer, b"".join(pieces)) + [plain(unit) for unit in deframer.give_up()]
        assert came == expected, f"block {block}"


@pytest.mark.parametrize("hole_bytes", [1, 5, 400, 4000])
def test_a_hole_is_given_up_when_the_line_falls_silent(hole_bytes: int) -> None:
    """A unit that lost its middle swallows what follows only until the line is silent: then the following units come out."""
    long = Unit(kind=UnitKind.FRAMES, first=True, last=True, number=1, body=bytes(MAX_BODY_BYTES))
    short = Unit(kind=UnitKind.CONTROL, first=True, last=True, number=2, body=b"echo")
    stream = wire(long)
    deframer = Deframer(SIDE)
    assert deframer.feed(stream[:50] + stream[50 + hole_bytes :]) == []
    came = found(deframer, wire(short))
    assert came + [plain(unit) for unit in deframer.give_up()] == [short]
