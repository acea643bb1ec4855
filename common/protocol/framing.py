"""Units in a byte stream that may lose, add and spoil bytes: marker, length, header CRC, body, CRC-32. Sans-I/O: bytes in, units out.

Layout (little endian): marker u8, head u16 (kind 2 bits, first 1, last 1, body length 12), number u16, header check u16, body, CRC-32 u32. The
header check is the lower half of the CRC-32 over the first five bytes, so that a spoiled length is not believed; the CRC-32 runs over these
and the body. Rules: a unit is given only whole and unaltered; after anything that is none the search goes on one byte behind the marker
that misled, so that no good unit is passed over; never more than one unit's bytes are kept. Each side has a marker of its own: what a
line echoes back is garbage to its sender. Both markers have the upper bit set, which a login prompt's text has not.
"""

import struct
from dataclasses import dataclass
from enum import Enum
from typing import Final
from zlib import crc32

from common.frame import Buffer

MAX_BODY_BYTES: Final = 4085
"""With its 11 bytes of frame a unit is 4096 bytes at most: bounds what a spoiled length can hold up; a pty gives no more at a time."""

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
    """Who wrote a unit; the value is the marker that it begins with."""

    DIALLER = 0xA5
    LISTENER = 0xC6

    @property
    def peer(self) -> "LinkEnd":
        """The other one."""
        return LinkEnd.LISTENER if self is LinkEnd.DIALLER else LinkEnd.DIALLER


class UnitKind(Enum):
    """What a unit carries: a chunk of a packet on one of the lanes, word of the chunks that came, or word of who is there."""

    FRAMES = 0
    CONTROL = 1
    ACK = 2
    CONTACT = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class Unit:
    """What was written at one go.

    Attributes:
        kind: what it carries.
        first: whether a packet begins with it.
        last: whether a packet ends with it.
        number: counts the units of a kind, modulo 65536; of an ACK: the newest FRAMES unit that came.
        body: at most MAX_BODY_BYTES.
    """

    kind: UnitKind
    first: bool
    last: bool
    number: int
    body: Buffer


_KINDS: Final = tuple(UnitKind)


def unit_parts(side: LinkEnd, unit: Unit) -> tuple[bytes, Buffer, bytes]:
    """Give a unit's bytes on the wire in three parts, so that a large body need not be copied here.

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

    Args:
        peer: who writes them.
    """

    def __init__(self, peer: LinkEnd) -> None:
        self._marker = bytes((peer.value,))
        self._rest = b""
        self._garbage_bytes = 0

    @property
    def garbage_bytes(self) -> int:
        """Bytes that belonged to no unit, so far."""
        return self._garbage_bytes

    @property
    def partial(self) -> bool:
        """Whether a unit has begun that is not whole yet."""
        return bool(self._rest)

    def feed(self, data: bytes) -> list[Unit]:
        """Take bytes as they come, chopped in any way.

        Args:
            data: what was read.

        Returns:
            The units that are whole now; their bodies are views, no copies.
        """
        if self._rest:
            data = self._rest + data
        units: list[Unit] = []
        at = self._scan(data, units)
        self._rest = data[at:]
        return units

    def give_up(self) -> list[Unit]:
        """Stop waiting for the rest of a unit, because the line has been silent in the middle of it: bytes of it were lost.

        Returns:
            Whole units that had been taken for its body.
        """
        data, self._rest = self._rest, b""
        units: list[Unit] = []
        at = 0
        while at < len(data):
            self._garbage_bytes += 1
            data = data[at + 1 :]
            at = self._scan(data, units)
        return units

    def reset(self) -> None:
        """Forget a unit that is not whole: another stream begins."""
        self._garbage_bytes += len(self._rest)
        self._rest = b""

    def _scan(self, data: bytes, units: list[Unit]) -> int:
        """Collect whole units; gives where the first byte stands that more bytes must come for."""
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
