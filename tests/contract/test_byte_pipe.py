"""Serial and RFCOMM over a byte pipe that chops, delays, corrupts and drops: packets arrive whole, unaltered and in order, or not at all."""

import random
from collections import deque

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.link.rfcomm_socket import FRAME_BYTES
from common.protocol.chunking import Whole
from common.protocol.framing import LinkEnd
from common.protocol.message import Lane
from tests.support.virtual_line import VirtualLine

S = 1_000_000_000
MS = 1_000_000
BYTES_PER_S = 200_000

FRAMES_OF = {"serial": 1, "rfcomm": FRAME_BYTES}
"""Bytes per piece, for each transport."""

Sent = tuple[Lane, bytes, bytes]

PACKETS = st.lists(
    st.one_of(
        st.tuples(st.just(Lane.FRAMES), st.integers(0, 6000)), st.tuples(st.just(Lane.CONTROL), st.integers(0, 100))
    ),
    min_size=1,
    max_size=10,
)


class Pipe:
    """Spoils one direction of the pipe.

    Args:
        seed: of everything that happens in it.
        badness: how often a passing piece is spoiled.
    """

    def __init__(self, seed: int, badness: float) -> None:
        self.badness = badness
        self._chance = random.Random(seed)

    def __call__(self, data: bytes) -> bytes:
        """Return what comes out when a piece goes in."""
        return self._spoiled(data) if self._chance.random() < self.badness else data

    def chop(self) -> int:
        """Return the size of the next piece: often a few bytes, seldom many."""
        return self._chance.choice((1, 2, 7, 16, 61, 300, 5000))

    def _spoiled(self, data: bytes) -> bytes:
        chance, at = self._chance, self._chance.randrange(len(data))
        match chance.randrange(4):
            case 0:
                return data[:at] + bytes((data[at] ^ 1 << chance.randrange(8),)) + data[at + 1 :]
            case 1:
                return data[:at] + data[at + chance.randrange(1, 16) :]
            case 2:
                return data[:at] + chance.randbytes(chance.randrange(1, 40)) + data[at:]
            case _:
                return b""


def _exchange(line: VirtualLine, packets: dict[LinkEnd, list[Sent]], until_ns: int) -> None:
    """Send what each end has as the link takes it; what it has not taken by the end stays unsent."""
    waiting = {side: deque(own) for side, own in packets.items()}

    def act(on: VirtualLine) -> None:
        for side, queue in waiting.items():
            while queue and on.ends[side].put(*queue[0]):
                queue.popleft()

    line.run(until_ns, act)


def _packets(kinds: list[tuple[Lane, int]], seed: int, word: str) -> dict[LinkEnd, list[Sent]]:
    """Packets of these sizes for both ends, no two alike."""
    chance = random.Random(seed)
    return {
        side: [(lane, f"{word} {number}".encode(), chance.randbytes(size)) for number, (lane, size) in enumerate(kinds)]
        for side in LinkEnd
    }


def _came(line: VirtualLine, side: LinkEnd, lane: Lane) -> list[Sent]:
    """The packets that arrived at an end on a lane."""
    came = [event for _, event in line.came[side] if isinstance(event, Whole) and event.lane is lane]
    return [(lane, bytes(whole.header), bytes(whole.payload)) for whole in came]


@pytest.mark.parametrize("transport", FRAMES_OF)
@given(
    kinds=PACKETS,
    delay_ms=st.integers(0, 40),
    badness=st.sampled_from([0.0, 0.002, 0.02, 0.2]),
    seed=st.integers(0, 2**32),
)
@settings(deadline=None, max_examples=150)
def test_whole_unaltered_and_in_order_or_not_at_all(
    transport: str, kinds: list[tuple[Lane, int]], delay_ms: int, badness: float, seed: int
) -> None:
    """Whatever the pipe does, packets that arrive were sent: once, in order, unaltered. If it only chops, all arrive; once it is sound, all arrive again."""
    line = VirtualLine.of(BYTES_PER_S, delay_ms * MS, frame_bytes=FRAMES_OF[transport])
    line.meet()
    pipes = {side: Pipe(seed + side.value, badness) for side in LinkEnd}
    for side, way in line.ways.items():
        way.spoil = pipes[side]
        way.chop = pipes[side].chop
    early = _packets(kinds, seed, "early")
    _exchange(line, early, line.now_ns + 3 * S)
    for pipe in pipes.values():
        pipe.badness = 0.0
    line.run(line.now_ns + 3 * S)  # for this long, packets under way at the last loss may count as lost too
    late = _packets([(Lane.FRAMES, 3000), (Lane.CONTROL, 30), (Lane.FRAMES, 0)], seed + 1, "late")
    _exchange(line, late, line.now_ns + 3 * S)
    for side in LinkEnd:
        for lane in Lane:
            came = _came(line, side.peer, lane)
            sent_early, sent_late = ([one for one in own[side] if one[0] is lane] for own in (early, late))
            first, last = came[: len(came) - len(sent_late)], came[len(came) - len(sent_late) :]
            assert last == sent_late
            left = iter(sent_early)
            assert all(one in left for one in first), "not in order, twice, or altered"
            assert badness or first == sent_early
