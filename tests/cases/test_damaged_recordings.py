"""Recordings in which single bits or fields are wrong: what is whole beside them is read, and what is lost is reported."""

import struct
import zlib

import pytest

from common.recording.inflate import inflate
from common.recording.mcap_records import Damage, Message, Record
from common.recording.salvage import Salvage
from tests.support import foreign_recordings as other
from tests.support.foreign_recordings import COMPRESSED

_COMPRESSIONS = {"zstd": "zstandard", "lz4": "lz4.frame"}
_SIZE_AT = struct.calcsize("<BQQQ")
"""Where a chunk's record states how many bytes its content becomes."""


def _packed_chunk(compression: str, plain: bytes) -> bytes:
    library = pytest.importorskip(_COMPRESSIONS[compression], reason="the extra recordings is not installed")
    packed = library.ZstdCompressor().compress(plain) if compression == "zstd" else library.compress(plain)
    head = struct.pack("<QQQI", 0, 0, len(plain), zlib.crc32(plain))
    return other.record(6, head + other.text(compression) + struct.pack("<Q", len(packed)) + packed)


def _message_chunks(compression: str, count: int, padding: int = 0) -> list[bytes]:
    """Chunks of two messages each; the padding makes the content of each longer."""
    sent = other.stereo(
        lambda side, number, at_ns: other.compressed("jpeg", bytes([side, number]) + bytes(padding), at_ns),
        COMPRESSED,
        count,
    )
    return [_packed_chunk(compression, other.records(sent[2 * at : 2 * at + 2])) for at in range(count)]


def _flipped(data: bytes, bit: int) -> bytes:
    changed = bytearray(data)
    changed[bit // 8] ^= 1 << bit % 8
    return bytes(changed)


def _salvaged(body: bytes) -> list[Record]:
    return list(Salvage(memoryview(other.whole(body)), inflate).records())


def _log_times_ns(records: list[Record]) -> list[int]:
    return [record.log_ns for record in records if isinstance(record, Message)]


@pytest.mark.parametrize("compression", _COMPRESSIONS)
@pytest.mark.parametrize("bit", [*range(0, 64, 7), 26, 60])
def test_a_wrong_size_costs_its_own_chunk_alone(compression: str, bit: int) -> None:
    """Whichever bit of the size that a compressed chunk claims is wrong, the chunks behind it are read."""
    first, *rest = _message_chunks(compression, 3)
    records = _salvaged(_flipped(first, 8 * _SIZE_AT + bit) + b"".join(rest))
    assert _log_times_ns(records) == _log_times_ns(_salvaged(b"".join(rest)))
    assert sum(isinstance(record, Damage) for record in records) == 1


@pytest.mark.parametrize("compression", _COMPRESSIONS)
def test_many_wrong_sizes_cost_their_chunks_alone(compression: str) -> None:
    """Of 40 chunks every other claims a wrong size, from one byte too many to 2^63 too many: the others are read."""
    chunks = _message_chunks(compression, 40, padding=1 << 20)
    flipped = [_flipped(chunk, 8 * _SIZE_AT + at % 64) if at % 2 else chunk for at, chunk in enumerate(chunks)]
    assert _log_times_ns(_salvaged(b"".join(flipped))) == _log_times_ns(_salvaged(b"".join(chunks[::2])))


@pytest.mark.parametrize("bit", range(8))
def test_a_chunk_whose_kind_is_wrong_is_reported(bit: int) -> None:
    """A bit of a chunk's opcode flips: the chunk is lost or read, never passed over in silence."""
    chunks = _message_chunks("zstd", 3)
    records = _salvaged(chunks[0] + _flipped(chunks[1], bit) + chunks[2])
    assert [record.words for record in records if isinstance(record, Damage)]
    assert _log_times_ns(records) == _log_times_ns(_salvaged(chunks[0] + chunks[2]))
