"""Strategies for every message of the protocol, each field over its whole allowed range; and ways to corrupt headers."""

import random
from dataclasses import replace

from hypothesis import strategies as st

from common.camera_identity import LARGEST_LOCK, CameraIdentity, Lock
from common.frame import PixelFormat
from common.ledger import BoardMarks
from common.orientation import Flip, Orientation
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
    LockState,
    Message,
    Pacing,
    Ping,
    Pong,
    Refusal,
    RefusalReason,
    Rung,
    SetLocks,
    Status,
    Steer,
    Steering,
)

NUMBERS = st.integers(0, 2**53)
TIMES_NS = st.integers(-(2**62), 2**62)
SIZES_PX = st.integers(1, 16384)
PERIODS_NS = st.integers(1, 3600 * 10**9)
IDS = st.text("0123456789abcdef", max_size=32)
TEXTS = st.text(st.characters(exclude_categories=["Cs"]), max_size=96)

COUNTS = st.builds(
    BoardCounts,
    NUMBERS,
    NUMBERS,
    st.lists(st.tuples(st.sampled_from(DropReason), NUMBERS), unique_by=lambda drop: drop[0]).map(tuple),
)
CAMERAS = st.builds(
    CameraDescription,
    name=TEXTS,
    width_px=SIZES_PX,
    height_px=SIZES_PX,
    pixel_format=st.sampled_from(PixelFormat),
    period_ns=PERIODS_NS,
    pacing=st.sampled_from(Pacing),
    steering=st.sampled_from(Steering),
)
LETTERS = st.text(st.characters(exclude_categories=["Cs"]), max_size=48)
LOCKS = st.lists(
    st.tuples(st.sampled_from(Lock), st.integers(-LARGEST_LOCK - 1, LARGEST_LOCK)), unique_by=lambda lock: lock[0]
).map(tuple)
LONG_CAMERAS = st.builds(
    replace,
    CAMERAS,
    orientation=st.builds(Orientation, st.sampled_from([0, 90, 180, 270]), st.sampled_from(Flip)),
    identity=st.builds(CameraIdentity, LETTERS, LETTERS, LETTERS),
    controls=LOCKS,
)
HOST_IDS = st.text(st.characters(exclude_categories=["Cs"]), max_size=64).filter(
    lambda text: not text.endswith("+long")
)
FRAMES = st.builds(
    FrameMessage,
    session=TEXTS,
    sent_index=NUMBERS,
    sequence=NUMBERS,
    width_px=SIZES_PX,
    height_px=SIZES_PX,
    pixel_format=st.sampled_from(PixelFormat),
    exposure_ns=st.none() | st.integers(0, 2**62),
    marks=st.builds(BoardMarks, exposed_ns=TIMES_NS, grabbed_ns=TIMES_NS, sent_ns=TIMES_NS),
    payload=st.binary(max_size=40),
)
LANES = st.sampled_from(Lane)
RUNGS = st.builds(
    Rung,
    index=NUMBERS,
    last=NUMBERS,
    changes=NUMBERS,
    period_ns=PERIODS_NS,
    quality=NUMBERS,
    width_px=st.integers(0, 16384),
    height_px=st.integers(0, 16384),
)

MESSAGES: st.SearchStrategy[Message] = st.one_of(
    st.builds(HostHello, HOST_IDS, LANES, st.booleans()),
    st.builds(BoardHello, session=TEXTS, boot_id=TEXTS, camera=CAMERAS, counts=COUNTS, rung=RUNGS),
    st.builds(
        BoardHello,
        session=IDS,
        boot_id=IDS,
        camera=LONG_CAMERAS,
        counts=COUNTS,
        rung=RUNGS,
        is_long=st.sampled_from([True]),
    ),
    st.builds(Knock, LANES, TEXTS),
    st.builds(Refusal, st.sampled_from(RefusalReason)),
    st.builds(Credit, NUMBERS),
    FRAMES,
    st.builds(Ping, NUMBERS, TIMES_NS),
    st.builds(Pong, wave=NUMBERS, t0_ns=TIMES_NS, t1_ns=TIMES_NS, t2_ns=TIMES_NS),
    st.builds(Status, TEXTS, COUNTS, RUNGS),
    st.builds(End, TEXTS, COUNTS),
    st.builds(Bye, COUNTS),
    st.builds(Steer, st.integers(0, 2**62)),
    st.builds(SetLocks, LOCKS),
    st.builds(LockState, session=TEXTS, asked=LOCKS, held=LOCKS),
)


def mutated(header: bytes, chance: random.Random) -> bytes:
    """A header with some bytes changed, removed, inserted, doubled or cut off."""
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
