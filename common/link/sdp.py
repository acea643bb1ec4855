"""The service's record in Bluetooth's service directory (SDP): its content, and how a host queries it. Sans-I/O.

Source: Bluetooth Core Specification 5.3, volume 3, part B: data elements (3), ServiceSearchAttribute transaction (4.7).
"""

import struct
from itertools import pairwise
from typing import Final
from uuid import UUID

SERVICE_UUID: Final = UUID("958f2ccd-1c03-4718-99d0-a289a96d3de9")
"""Ours: drawn at random once and for ever. Boards and hosts of all versions recognise each other by it."""

PSM: Final = 1
"""Where every Bluetooth device answers such queries (L2CAP)."""

_RFCOMM: Final = 0x0003
_PROTOCOL_DESCRIPTORS: Final = 0x0004
_HEADER: Final = struct.Struct(">BHH")
_REQUEST, _RESPONSE = 6, 7
_UINT, _UUID, _SEQUENCE = 1, 3, 6
_MAX_CHANNEL: Final = 30


def record_xml(channel: int) -> str:
    """Return the record of a service on an RFCOMM channel in BlueZ's format: class, protocols, public, name."""
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<record>
<attribute id="0x0001"><sequence><uuid value="{SERVICE_UUID}"/></sequence></attribute>
<attribute id="0x0004"><sequence>
<sequence><uuid value="0x0100"/></sequence>
<sequence><uuid value="0x0003"/><uint8 value="0x{channel:02x}"/></sequence>
</sequence></attribute>
<attribute id="0x0005"><sequence><uuid value="0x1002"/></sequence></attribute>
<attribute id="0x0100"><text value="tandemscan"/></attribute>
</record>"""


def query() -> bytes:
    """Return the query for the protocols of every record of our class."""
    search = b"\x35\x11\x1c" + SERVICE_UUID.bytes  # a sequence of 17 bytes: one UUID of 128 bits
    wanted = b"\x35\x03\x09" + struct.pack(">H", _PROTOCOL_DESCRIPTORS)  # a sequence of 3 bytes: one attribute id
    parameters = search + struct.pack(">H", 0xFFFF) + wanted + b"\0"  # an answer of any length, from the beginning
    return _HEADER.pack(_REQUEST, 1, len(parameters)) + parameters


def channel_in(answer: bytes) -> int:
    """Find the RFCOMM channel in the answer.

    Args:
        answer: the raw answer; a peer may send anything.

    Returns:
        The channel; 0 if the peer has no such service.
    """
    if len(answer) < _HEADER.size + 2 or answer[0] != _RESPONSE:
        return 0
    (length,) = struct.unpack_from(">H", answer, _HEADER.size)
    lists = answer[_HEADER.size + 2 :][:length]
    try:
        return _find(lists, depth=0)
    except (struct.error, IndexError):
        return 0


def _find(data: bytes, depth: int) -> int:
    """Search nested sequences for one that holds the UUID of RFCOMM and a number."""
    elements = _elements(data)
    for (kind, value), (next_kind, following) in pairwise(elements):
        if kind == _UUID and next_kind == _UINT and int.from_bytes(value[:4], "big") == _RFCOMM:
            channel = int.from_bytes(following, "big")
            return channel if 1 <= channel <= _MAX_CHANNEL else 0
    if depth < 8:  # ours are four deep
        for kind, value in elements:
            if kind == _SEQUENCE and (channel := _find(value, depth + 1)):
                return channel
    return 0


def _elements(data: bytes) -> list[tuple[int, bytes]]:
    """Split data elements: descriptor (type 5 bits, size index 3 bits), size, value (3.2, 3.3)."""
    found = []
    at = 0
    while at < len(data):
        kind, index = data[at] >> 3, data[at] & 7
        at += 1
        if index >= 5:
            width = 1 << (index - 5)
            size = int.from_bytes(data[at : at + width], "big")
            at += width
        else:
            size = (1 << index) if kind else 0
        found.append((kind, data[at : at + size]))
        at += size
    return found
