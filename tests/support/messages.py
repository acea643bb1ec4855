"""Strategies for every message of the protocol, each field over its whole allowed range; and how headers are spoiled."""

import random

from hypothesis import strategies as st

from common.frame import PixelFormat
from common.ledger import BoardMarks
from common.protocol.message import (
    BoardCounts,
    BoardHello,
    Bye,
    CameraDescription,
    Credit,
    DropReason,
    End,
    FrameMessage,
    HostHello,
    Knock,
    Lane,
    Message,
    Pacing,
    Ping,
    Pong,
    Refusal,
    RefusalReason,
    Rung,
    Status,
    Steer,
    Steering,
)

NUMBERS = st.integers(0, 2**53)
TIMES_NS = st.integers(-(2**62), 2**62)
SIZES_PX = st.integers(1, 16384)
PERIODS_NS = st.integers(1, 3600 * 10**9)
TEXTS = st.text(st.characters(exclude_categories=["Cs"]), max_size=96)

COUNTS = st.builds(
    BoardCounts,
    NUMBERS,
    NUMBERS,
    st.lists(st.tuples(st.sampled_from(DropReason), NUMBERS), unique_by=lambda drop: drop[0]).map(tuple),
)
CAMERAS = st.builds(
    CameraDescription,
    TEXTS,
    SIZES_PX,
    SIZES_PX,
    st.sampled_from(PixelFormat),
    PERIODS_NS,
    st.sampled_from(Pacing),
    st.sampled_from(Steering),
)
FRAMES = st.builds(
    FrameMessage,
    TEXTS,
    NUMBERS,
    NUMBERS,
    SIZES_PX,
    SIZES_PX,
    st.sampled_from(PixelFormat),
    st.none() | st.integers(0, 2**62),
    st.builds(BoardMarks, TIMES_NS, TIMES_NS, TIMES_NS),
    st.binary(max_size=40),
)
LANES = st.sampled_from(Lane)
RUNGS = st.builds(Rung, NUMBERS, NUMBERS, NUMBERS, PERIODS_NS, NUMBERS, st.integers(0, 16384), st.integers(0, 16384))

MESSAGES: st.SearchStrategy[Message] = st.one_of(
    st.builds(HostHello, TEXTS, LANES),
    st.builds(BoardHello, TEXTS, TEXTS, CAMERAS, COUNTS, RUNGS),
    st.builds(Knock, LANES, TEXTS),
    st.builds(Refusal, st.sampled_from(RefusalReason)),
    st.builds(Credit, NUMBERS),
    FRAMES,
    st.builds(Ping, NUMBERS, TIMES_NS),
    st.builds(Pong, NUMBERS, TIMES_NS, TIMES_NS, TIMES_NS),
    st.builds(Status, TEXTS, COUNTS, RUNGS),
    st.builds(End, TEXTS, COUNTS),
    st.builds(Bye, COUNTS),
    st.builds(Steer, st.integers(0, 2**62)),
)


def mutated(header: bytes, chance: random.Random) -> bytes:
    """A header with some bytes changed, left out, put in, doubled or cut off."""
    data = bytearray(header)
    for _ in range(chance.randint(1, 4)):
        at = chance.randrange(len(data) + 1)
        match chance.randrange(6):
            case 0:
                data[at : at + 1] = bytes([chance.randrange(256)])
            case 1:
                del data[at : at + chance.randint(1, 3)]
            case 2:
                data[at:at] = chance.randbytes(chance.randint(1, 5))
            case 3:
                data[at:at] = data[: chance.randint(1, 20)]
            case 4 if data:
                data[at % len(data)] ^= 1 << chance.randrange(8)
            case _:
                del data[at:]
    return bytes(data)
