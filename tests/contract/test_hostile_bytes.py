"""What every reader of foreign bytes must do: the protocol's limits with fixed seeds, and each fuzz target over its corpus."""

import random
import tracemalloc
from dataclasses import replace
from pathlib import Path

import pytest

from common.errors import ProtocolError
from common.ledger import BoardMarks
from common.protocol.chunking import Whole
from common.protocol.duplex import GAP_NS, Change, Duplex
from common.protocol.framing import LinkEnd
from common.protocol.message import Lane
from common.protocol.wire import decode, encode
from tests.fuzz.protocols import SOUND_MESSAGES
from tests.fuzz.targets import TARGETS
from tests.support.messages import mutated
from tests.support.samples import FRAME

CORPUS = Path(__file__).parents[1] / "fuzz" / "corpus"
S = 1_000_000_000
PATIENCE_NS = 3 * S
"""This long after a unit, nothing of it counts as under way any more, whatever became of it."""


class Pair:
    """Two connected ends and the time; what the board writes may be spoiled before the host reads it."""

    def __init__(self) -> None:
        self.board, self.host = Duplex(LinkEnd.LISTENER, 17), Duplex(LinkEnd.DIALLER, 17)
        self.now_ns = S
        while not (self.board.is_up and self.host.is_up):
            self.now_ns += S
            self.exchange()

    def exchange(self, data: bytes = b"") -> list[Whole | Change]:
        """Let the host read these bytes and then silence; the board gets all answers. Return what the host was told."""
        events = self.host.feed(data + self.board.take(self.now_ns), self.now_ns)
        self.now_ns += GAP_NS
        events += self.host.silence(self.now_ns)
        self.board.feed(self.host.take(self.now_ns), self.now_ns)
        return events

    def written(self, header: bytes, payload: bytes) -> bytes:
        """The bytes of one frame that the host has not seen yet."""
        self.now_ns += PATIENCE_NS
        self.board.take(self.now_ns)  # late packets are written off
        assert self.board.put(Lane.FRAMES, header, payload)
        parts = []
        while data := self.board.take(self.now_ns):
            parts.append(data)
        return b"".join(parts)


def whole(events: list[Whole | Change]) -> list[tuple[bytes, bytes]]:
    """Header and payload of the packets in a list."""
    return [(bytes(event.header), bytes(event.payload)) for event in events if isinstance(event, Whole)]


def test_ten_million_random_bytes_on_a_line() -> None:
    """10^7 random bytes yield no packet at a connected end and occupy less than two megabytes; the good packet after them arrives."""
    chance, pair = random.Random(11), Pair()
    tracemalloc.start()
    for _ in range(100):
        assert whole(pair.exchange(chance.randbytes(100_000))) == []
    peak_bytes = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak_bytes < 2_000_000
    assert pair.host.is_up
    assert whole(pair.exchange(pair.written(b"header", b"payload"))) == [(b"header", b"payload")]


def test_ten_million_random_bytes_as_headers() -> None:
    """10^7 random bytes, cut into headers of every length, are refused with a ProtocolError or are a message that can be written again."""
    chance = random.Random(12)
    left = 10**7
    while left > 0:
        header = chance.randbytes(chance.choice((1, 2, 3, 8, 40, 400, 2048)))
        left -= len(header)
        try:
            message = decode(header)
        except ProtocolError:
            continue
        assert decode(*encode(message)) == message


def test_a_hundred_thousand_mutated_packets() -> None:
    """10^5 spoiled headers of all kinds are refused or read as a valid message; nothing else is raised."""
    chance = random.Random(13)
    headers = [encode(message)[0] for message in SOUND_MESSAGES]
    for number in range(100_000):
        try:
            message = decode(mutated(headers[number % len(headers)], chance), b"")
        except ProtocolError:
            continue
        assert decode(*encode(message)) == message


def test_of_a_hundred_thousand_frames_with_flipped_bits_none_comes_altered() -> None:
    """Of 10^5 frames with one to eight flipped bits none arrives altered, and the sound frame after every tenth of them always arrives."""
    chance, pair = random.Random(14), Pair()
    marks = BoardMarks(exposed_ns=10**12, grabbed_ns=10**12 + 1, sent_ns=10**12 + 2)
    for number in range(100_000):
        payload = chance.randbytes(chance.randrange(1, 200))
        message = replace(
            FRAME,
            session="s",
            sent_index=number,
            sequence=number,
            width_px=640,
            height_px=480,
            marks=marks,
            payload=payload,
        )
        header, _ = encode(message)
        data = bytearray(pair.written(header, payload))
        for bit in chance.sample(range(8 * len(data)), chance.randint(1, 8)):
            data[bit // 8] ^= 1 << bit % 8
        came = whole(pair.exchange(bytes(data)))
        assert came in ([], [(header, payload)]), f"frame {number} came altered"
        if number % 10 == 0:
            assert whole(pair.exchange(pair.written(header, payload))) == [(header, payload)], f"after frame {number}"


@pytest.mark.parametrize("name", TARGETS)
def test_what_fuzzing_has_found_stays_mended(name: str) -> None:
    """No corpus input of a target, and no valid starting input, breaks any of the target's promises."""
    kept = [path.read_bytes() for path in sorted((CORPUS / name).glob("*"))]
    for data in [*TARGETS[name].seeds(), *kept]:
        TARGETS[name].run(data)
