"""Units in a byte stream that may lose, add or corrupt bytes: marker, length, header CRC, body, CRC-32. Sans-I/O: bytes in, units out.

Layout (little endian): marker u8, head u16 (kind 2 bits, first 1, last 1, body length 12), number u16, header check u16, body, CRC-32 u32.
The header check is the lower half of the CRC-32 over the first five bytes; it keeps a corrupted length from being believed. The CRC-32
covers these five bytes and the body. Rules: only whole, unaltered units are returned. After anything else the search resumes one byte
behind the misleading marker, so no good unit is skipped. At most one unit's bytes are kept. Each side has its own marker, so whatever a
line echoes back is garbage to its sender. Both markers have the top bit set, which the text of a login prompt has not.
"""

import struct
from dataclasses import dataclass
from enum import Enum
from typing import Final
from zlib import crc32

from common.frame import Buffer

MAX_BODY_BYTES: Final = 4085
"""With its 11 bytes of framing a unit has at most 4096 bytes. This limits how long a corrupted length can hold up the line; a pty gives no
more at a time."""

_START: Final = struct.Struct("<BHH")
_CHECK: Final = struct.Struct("<H")
_CRC: Final = struct.Struct("<I")
_HEADER: Final = struct.Struct("<BHHH")

UNIT_OVERHEAD_BYTES: Final = _HEADER.size + _CRC.size

_FIRST: Final = 1 << 13
_LAST: Final = 1 << 12
_KIND_SHIFT: Final = 14
_LENGTH_MASK: Final = 0xFFF


class LinkEnd(Enum):
    """Who wrote a unit. The value is the marker that the unit begins with."""

    DIALLER = 0xA5
    LISTENER = 0xC6

    @property
    def peer(self) -> "LinkEnd":
        """The other end."""
        return LinkEnd.LISTENER if self is LinkEnd.DIALLER else LinkEnd.DIALLER


class UnitKind(Enum):
    """What a unit carries: a chunk of a packet on one of the lanes, an acknowledgement of chunks, or a contact word."""

    FRAMES = 0
    CONTROL = 1
    ACK = 2
    CONTACT = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class Unit:
    """The bytes written in one go.

    Attributes:
        kind: what it carries.
        first: whether it begins a packet.
        last: whether it ends a packet.
        number: counts the units of a kind, modulo 65536. In an ACK: the newest FRAMES unit received.
        body: at most MAX_BODY_BYTES.
    """

    kind: UnitKind
    first: bool
    last: bool
    number: int
    body: Buffer


_KINDS: Final = tuple(UnitKind)


def unit_parts(side: LinkEnd, unit: Unit) -> tuple[bytes, Buffer, bytes]:
    """Return a unit's bytes on the wire in three parts, so that a large body need not be copied here.

    Args:
        side: who writes it.
        unit: what to write.

    Returns:
        Header, body, CRC-32.
    """
    length = len(unit.body)
    assert length <= MAX_BODY_BYTES
    head = unit.kind.value << _KIND_SHIFT | (_FIRST if unit.first else 0) | (_LAST if unit.last else 0) | length
    start = _START.pack(side.value, head, unit.number)
    crc = crc32(start)
    return start + _CHECK.pack(crc & 0xFFFF), unit.body, _CRC.pack(crc32(unit.body, crc))


class Deframer:
    """Finds the peer's units.

    Attributes:
        rest: bytes of a unit that is not complete yet.
    """

    def __init__(self, peer: LinkEnd) -> None:
        self._marker = bytes((peer.value,))
        self.rest = b""
        self._garbage_bytes = 0

    @property
    def garbage_bytes(self) -> int:
        """Bytes that belonged to no unit, so far."""
        return self._garbage_bytes

    @property
    def partial(self) -> bool:
        """Whether a unit has begun that is not yet complete."""
        return bool(self.rest)

    def feed(self, data: bytes) -> list[Unit]:
        """Take bytes in chunks of any size.

        Returns:
            The units completed by these bytes. Their bodies are views, not copies.
        """
        if self.rest:
            data = self.rest + data
        units: list[Unit] = []
        at = self._scan(data, units)
        self.rest = data[at:]
        return units

    def give_up(self) -> list[Unit]:
        """Stop waiting for the rest of a unit: the line fell silent in the middle of it, so bytes were lost.

        Returns:
            Whole units that had been taken for its body.
        """
        data, self.rest = self.rest, b""
        units: list[Unit] = []
        at = 0
        while at < len(data):
            self._garbage_bytes += 1
            data = data[at + 1 :]
            at = self._scan(data, units)
        return units

    def reset(self) -> None:
        """Forget an incomplete unit because a new stream begins."""
        self._garbage_bytes += len(self.rest)
        self.rest = b""

    def _scan(self, data: bytes, units: list[Unit]) -> int:
        """Collect whole units; return the position of the first byte that still needs more bytes behind it."""
        view = memoryview(data)
        end, at = len(data), 0
        while True:
            found = data.find(self._marker, at)
            if found < 0:
                self._garbage_bytes += end - at
                return end
            self._garbage_bytes += found - at
            at = found
            if end - at < _HEADER.size:
                return at
            _, head, number, check = _HEADER.unpack_from(data, at)
            crc = crc32(view[at : at + _START.size])
            length = head & _LENGTH_MASK
            if crc & 0xFFFF != check or length > MAX_BODY_BYTES:
                self._garbage_bytes += 1
                at += 1
                continue
            body = at + _HEADER.size
            tail = body + length
            if tail + _CRC.size > end:
                return at
            if crc32(view[body:tail], crc) != _CRC.unpack_from(data, tail)[0]:
                self._garbage_bytes += 1
                at += 1
                continue
            kind = _KINDS[head >> _KIND_SHIFT]
            units.append(
                Unit(kind=kind, first=bool(head & _FIRST), last=bool(head & _LAST), number=number, body=view[body:tail])
            )
            at = tail + _CRC.size
