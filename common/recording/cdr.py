"""The Common Data Representation, as ROS 2 writes messages: little endian, and read in either order. Pure: values in, bytes out, and back.

Each value is aligned to its size, counted from behind the header of four bytes.
Source: OMG DDSI-RTPS 2.5, section 10.5 (the header); CORBA 3.4 part 2, section 9.3 (alignment, strings, sequences).
"""

import struct
from collections.abc import Sequence
from typing import Final

from common.frame import Buffer

HEADER: Final = b"\x00\x01\x00\x00"
"""CDR_LE, no options."""

_ORDERS: Final = {b"\x00\x00": ">", HEADER[:2]: "<"}
"""Order of the bytes by the header: CDR_BE, which other programs may write, and CDR_LE."""


class BrokenMessageError(ValueError):
    """Raised for bytes that are not the message that they should be."""


class CdrWriter:
    """Puts a message together, value by value."""

    def __init__(self) -> None:
        self._data = bytearray(HEADER)

    def done(self) -> bytes:
        """Return the message so far."""
        return bytes(self._data)

    def number(self, kind: str, value: float) -> None:
        """Add a number.

        Args:
            kind: as `struct` names it: B, i, I, d.
            value: the number.

        Raises:
            struct.error: it does not fit.
        """
        self._align(struct.calcsize(kind))
        self._data += struct.pack(f"<{kind}", value)

    def text(self, value: str) -> None:
        """Add a string."""
        data = value.encode() + b"\0"
        self.number("I", len(data))
        self._data += data

    def doubles(self, values: Sequence[float], *, counted: bool) -> None:
        """Add 64-bit numbers: a sequence, which is counted, or an array, whose length everybody knows."""
        if counted:
            self.number("I", len(values))
        if values:
            self._align(8)
            self._data += struct.pack(f"<{len(values)}d", *values)

    def data(self, value: Buffer) -> None:
        """Add a sequence of bytes."""
        self.number("I", len(value))
        self._data += value

    def _align(self, size: int) -> None:
        self._data += b"\0" * (-(len(self._data) - len(HEADER)) % size)


class CdrReader:
    """Takes a message apart, value by value, in their order.

    Raises:
        BrokenMessageError: it has another header.
    """

    def __init__(self, data: "bytes | memoryview") -> None:
        self._data = memoryview(data)
        order = _ORDERS.get(bytes(self._data[:2]))
        if order is None:
            raise BrokenMessageError("the message is not plain CDR")
        self._order = order
        self._at = len(HEADER)

    def number(self, kind: str) -> "int | float":
        """Return a number; `kind` as in `CdrWriter.number`."""
        size = struct.calcsize(kind)
        self._at += -(self._at - len(HEADER)) % size
        found: int | float = struct.unpack(f"{self._order}{kind}", self._take(size))[0]
        return found

    def text(self) -> str:
        """Return a string."""
        raw = bytes(self.data())
        try:
            return raw.removesuffix(b"\0").decode()
        except UnicodeDecodeError as error:
            raise BrokenMessageError("a text is not UTF-8") from error

    def data(self) -> memoryview:
        """Return a sequence of bytes, as a view of the message."""
        return self._take(int(self.number("I")))

    def _take(self, size: int) -> memoryview:
        taken = self._data[self._at : self._at + size]
        if len(taken) < size:
            raise BrokenMessageError("the message is cut short")
        self._at += size
        return taken
