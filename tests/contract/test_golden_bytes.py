"""Neighbouring versions on byte streams: recorded serial and Bluetooth streams, and the words of an enrolment (tests/golden)."""

from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.protocol.chunking import Joiner, Whole
from common.protocol.duplex import Change, Duplex
from common.protocol.enrolment_code import Asking, Desk, Enrolled, Failed, Say
from common.protocol.enrolment_wire import WordReader, frame_word
from common.protocol.enrolment_words import Begin, Denial, Identity, Refuse, Shown, Word
from common.protocol.framing import Deframer, LinkEnd, UnitKind
from common.protocol.message import Lane
from tests.golden.record_bytes import MS, NUMBERS, START_NS, TRAVEL_NS, chance_of
from tests.support.golden import RECORDED, read

Packet = tuple[Lane, bytes, bytes]

KINDS = ("serial", "rfcomm")
SIDES = {"host": LinkEnd.DIALLER, "board": LinkEnd.LISTENER}
HOST = Identity(bytes(range(100, 132)), "Téléphone")
BOARD = Identity(bytes(range(32)), "board")


def put(steps: list[dict[str, Any]], who: str) -> list[Packet]:
    """The packets that one side sent."""
    told = [step["puts"] for step in steps if step["who"] == who and "puts" in step]
    return [(Lane[lane], bytes.fromhex(header), bytes.fromhex(payload)) for lane, header, payload in told]


def written(steps: list[dict[str, Any]], who: str) -> bytes:
    """All the bytes that one side wrote."""
    return bytes.fromhex("".join(step["writes"] for step in steps if step["who"] == who and "writes" in step))


def by_lane(packets: list[Packet]) -> dict[Lane, list[Packet]]:
    """Packets in the order of their lane; control overtakes images."""
    return {lane: [packet for packet in packets if packet[0] is lane] for lane in Lane}


def packet_of(whole: Whole) -> Packet:
    return whole.lane, bytes(whole.header), bytes(whole.payload)


@pytest.mark.parametrize("version", RECORDED)
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("who", SIDES)
@given(data=st.data())
@settings(deadline=None, max_examples=20)
def test_the_bytes_of_then_are_the_same_packets_in_pieces_of_any_size(
    version: str, kind: str, who: str, data: st.DataObject
) -> None:
    """However the recorded stream is chopped, no byte is garbage, and the packets that went in come out."""
    _, steps = read(version, kind)
    stream = written(steps, who)
    cuts = sorted(data.draw(st.lists(st.integers(0, len(stream)), max_size=300)))
    deframer, joiner = Deframer(SIDES[who]), Joiner()
    units = [
        unit
        for start, end in zip([0, *cuts], [*cuts, len(stream)], strict=True)
        for unit in deframer.feed(stream[start:end])
        if unit.kind in {UnitKind.FRAMES, UnitKind.CONTROL}
    ]
    packets = [packet_of(whole) for unit in units if (whole := joiner.add(unit)) is not None]
    assert by_lane(packets) == by_lane(put(steps, who))
    assert len(packets) > 3
    assert (deframer.garbage_bytes, deframer.partial, joiner.broken) == (0, False, 0)


@pytest.mark.parametrize("version", RECORDED)
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("who", SIDES)
def test_an_end_of_today_writes_what_the_end_of_then_wrote(version: str, kind: str, who: str) -> None:
    """Given the same input at the same times, it meets the other end, hears its packets and writes the same bytes."""
    head, steps = read(version, kind)
    other = "board" if who == "host" else "host"
    end = Duplex(SIDES[who], NUMBERS[who], head["frame_bytes"])
    arrivals = [(step["ns"] + TRAVEL_NS, step["writes"]) for step in steps if step["who"] == other and "writes" in step]
    puts = [(step["ns"], step["puts"]) for step in steps if step["who"] == who and "puts" in step]
    said: list[tuple[int, str]] = []
    heard: list[Whole | Change] = []
    leaves_ns = {step["ns"] for step in steps if step["who"] == who and "leaves" in step}
    for now_ns in range(START_NS, steps[-1]["ns"] + 1, MS):
        while arrivals and arrivals[0][0] <= now_ns:
            heard += end.feed(bytes.fromhex(arrivals.pop(0)[1]), now_ns)
        while puts and puts[0][0] <= now_ns:
            lane, header, payload = puts.pop(0)[1]
            assert end.put(Lane[lane], bytes.fromhex(header), bytes.fromhex(payload))
        if now_ns in leaves_ns:
            end.leave()
        if data := end.take(now_ns):
            said.append((now_ns, data.hex()))
    then = [(step["ns"], step["writes"]) for step in steps if step["who"] == who and "writes" in step]
    assert said == then
    packets = [packet_of(event) for event in heard if isinstance(event, Whole)]
    assert by_lane(packets) == by_lane(put(steps, other))
    assert Change.MET in heard
    assert Change.GARBAGE not in heard


def words(steps: list[dict[str, Any]], who: str) -> list[Word]:
    """What one side said, read by today's reader one byte at a time."""
    reader = WordReader()
    stream = b"".join(bytes.fromhex(step["says"]) for step in steps if step.get("who") == who)
    read_words = [word for at in range(len(stream)) for word in reader.feed(stream[at : at + 1])]
    assert reader.unread_bytes == 0
    assert b"".join(map(frame_word, read_words)) == stream
    return read_words


@pytest.mark.parametrize("version", RECORDED)
@pytest.mark.parametrize(("name", "proves"), [("enrolment", True), ("enrolment-wrong-code", False)])
def test_a_board_of_today_enrols_a_host_of_then(version: str, name: str, *, proves: bool) -> None:
    """It answers each recorded word with the recorded answer, and trusts the host if and only if the code was right."""
    _, steps = read(version, name)
    desk = Desk(BOARD, chance_of("board"))
    outputs = [output for word in words(steps, "host") for output in desk.receive(b"host", word, START_NS)]
    assert [output.word for output in outputs if isinstance(output, Say)] == words(steps, "board")
    assert (Enrolled(HOST) in outputs) is proves
    assert any(isinstance(output, Failed) for output in outputs) is not proves


@pytest.mark.parametrize("version", RECORDED)
@pytest.mark.parametrize(("name", "proves"), [("enrolment", True), ("enrolment-wrong-code", False)])
def test_a_host_of_today_enrols_with_a_board_of_then(version: str, name: str, *, proves: bool) -> None:
    """It says the recorded words, and accepts the board as proved if and only if the code was right."""
    _, steps = read(version, name)
    code = Desk(BOARD, chance_of("board")).code(START_NS)
    asking = Asking(HOST, chance_of("host"))
    said: list[Word] = [asking.ask()]
    for word in words(steps, "board"):
        if isinstance(word, Refuse):
            assert word == Refuse(Denial.WRONG)
            continue
        answer = asking.receive(word)
        if isinstance(word, Shown):
            answer = asking.begin(code ^ (0 if proves else 1))
        said += [] if answer is None else [answer]
    assert said == words(steps, "host")
    assert asking.proved is proves is steps[-1]["proved"]
    assert asking.board == BOARD
    assert isinstance(said[1], Begin)
