"""Just enough of D-Bus to ask a daemon something: values to bytes and back, and a blocking conversation over a Unix socket.

Source: D-Bus Specification 0.41, "Marshaling (Wire Format)", "Message Format", "Authentication Protocol". A value is what Python has for it: int, str,
bool, list (also for a struct), dict; a variant is a `Variant`. Floats and passed descriptors are not spoken here.
"""

import os
import socket
import struct
from dataclasses import dataclass
from enum import Enum
from typing import Any, Final

from common.errors import UnavailableError

_SYSTEM_BUS: Final = "/run/dbus/system_bus_socket"
_MOST_BYTES: Final = 1 << 27
"""The specification's limit of a message (128 MB)."""

_FIXED: Final = {"y": "B", "n": "h", "q": "H", "i": "i", "u": "I", "x": "q", "t": "Q", "d": "d", "b": "I", "h": "I"}
_ALIGN: Final = {
    **{code: struct.calcsize(form) for code, form in _FIXED.items()},
    "s": 4,
    "o": 4,
    "a": 4,
    "(": 8,
    "{": 8,
}
_HEADER: Final = struct.Struct("<BBBBIII")


@dataclass(frozen=True, slots=True)
class Variant:
    """A value that brings its type along.

    Attributes:
        signature: one complete type.
        value: what it says.
    """

    signature: str
    value: Any


class Kind(Enum):
    """What a message is."""

    CALL = 1
    RETURN = 2
    ERROR = 3
    SIGNAL = 4


class Field(Enum):
    """A header field."""

    PATH = 1
    INTERFACE = 2
    MEMBER = 3
    ERROR_NAME = 4
    REPLY_SERIAL = 5
    DESTINATION = 6
    SENDER = 7
    SIGNATURE = 8


_FIELD_TYPES: Final = dict.fromkeys(Field, "s") | {Field.PATH: "o", Field.REPLY_SERIAL: "u", Field.SIGNATURE: "g"}


@dataclass(frozen=True, slots=True)
class Call:
    """A method to call.

    Attributes:
        destination: bus name.
        path: object.
        interface, member: method.
        signature: types of the arguments.
        arguments: their values.
    """

    destination: str
    path: str
    interface: str
    member: str
    signature: str = ""
    arguments: tuple[Any, ...] = ()


@dataclass(frozen=True, slots=True)
class Message:
    """What came in.

    Attributes:
        kind: what it is.
        reply_serial: of the call that it answers; 0: of none.
        member: of a signal.
        error: name of an error.
        arguments: its values.
    """

    kind: Kind
    reply_serial: int
    member: str
    error: str
    arguments: tuple[Any, ...]


def complete_types(signature: str) -> list[str]:
    """Split a signature into its complete types."""
    types: list[str] = []
    while signature:
        length = _type_length(signature)
        types.append(signature[:length])
        signature = signature[length:]
    return types


def _type_length(signature: str) -> int:
    if signature[0] == "a":
        return 1 + _type_length(signature[1:])
    if signature[0] not in "({":
        return 1
    depth = 0
    for at, code in enumerate(signature):
        depth += (code in "({") - (code in ")}")
        if not depth:
            return at + 1
    raise ValueError(signature)


def encode_call(call: Call, serial: int) -> bytes:
    """Give a call's bytes."""
    body = bytearray()
    for kind, value in zip(complete_types(call.signature), call.arguments, strict=True):
        _put(body, kind, value)
    named = {
        Field.PATH: call.path,
        Field.INTERFACE: call.interface,
        Field.MEMBER: call.member,
        Field.DESTINATION: call.destination,
    }
    if call.signature:
        named[Field.SIGNATURE] = call.signature
    head = bytearray(struct.pack("<BBBBII", ord("l"), Kind.CALL.value, 0, 1, len(body), serial))
    _put(head, "a(yv)", [[field.value, Variant(_FIELD_TYPES[field], value)] for field, value in named.items()])
    head.extend(bytes(-len(head) % 8))
    return bytes(head + body)


def message_bytes(head: bytes) -> int:
    """How long the message is that begins with these 16 bytes.

    Raises:
        ValueError: they begin none that a bus would send.
    """
    order, _, _, _, body_bytes, _, fields_bytes = _HEADER.unpack(head)
    whole: int = _HEADER.size + -(-fields_bytes // 8) * 8 + body_bytes
    if order != ord("l") or whole > _MOST_BYTES:
        raise ValueError(order)
    return whole


def decode(data: bytes) -> Message:
    """Read a whole message."""
    raw, at = _get(data, 12, "a(yv)")
    known = {field.value: field for field in Field}
    fields = {known[code]: value.value for code, value in raw if code in known}
    at += -at % 8
    arguments = []
    for kind in complete_types(fields.get(Field.SIGNATURE, "")):
        value, at = _get(data, at, kind)
        arguments.append(value)
    return Message(
        Kind(data[1]),
        fields.get(Field.REPLY_SERIAL, 0),
        fields.get(Field.MEMBER, ""),
        fields.get(Field.ERROR_NAME, ""),
        tuple(arguments),
    )


def _put(out: bytearray, kind: str, value: Any) -> None:  # noqa: ANN401 - a signature says at run time what it is
    out.extend(bytes(-len(out) % _ALIGN.get(kind[0], 1)))
    match kind[0]:
        case "s" | "o":
            text = value.encode()
            out += struct.pack("<I", len(text)) + text + b"\0"
        case "g":
            text = value.encode()
            out += bytes((len(text),)) + text + b"\0"
        case "v":
            _put(out, "g", value.signature)
            _put(out, value.signature, value.value)
        case "(" | "{":
            for part, item in zip(complete_types(kind[1:-1]), value, strict=True):
                _put(out, part, item)
        case "a":
            out += bytes(4)
            length_at = len(out) - 4
            out.extend(bytes(-len(out) % _ALIGN.get(kind[1], 1)))
            begin = len(out)
            for item in value.items() if kind[1] == "{" else value:
                _put(out, kind[1:], item)
            struct.pack_into("<I", out, length_at, len(out) - begin)
        case code:
            out += struct.pack("<" + _FIXED[code], value)


def _get(data: bytes, at: int, kind: str) -> tuple[Any, int]:
    at += -at % _ALIGN.get(kind[0], 1)
    match kind[0]:
        case "s" | "o" | "g":
            form = "<B" if kind[0] == "g" else "<I"
            (length,) = struct.unpack_from(form, data, at)
            at += struct.calcsize(form)
            return data[at : at + length].decode(errors="replace"), at + length + 1
        case "v":
            signature, at = _get(data, at, "g")
            value, at = _get(data, at, signature)
            return Variant(signature, value), at
        case "(" | "{":
            values = []
            for part in complete_types(kind[1:-1]):
                value, at = _get(data, at, part)
                values.append(value)
            return values, at
        case "a":
            (length,) = struct.unpack_from("<I", data, at)
            at += 4
            at += -at % _ALIGN.get(kind[1], 1)
            end, items = at + length, []
            while at < end:
                item, at = _get(data, at, kind[1:])
                items.append(item)
            return (dict(items) if kind[1] == "{" else items), at
        case code:
            (number,) = struct.unpack_from("<" + _FIXED[code], data, at)
            return (bool(number) if code == "b" else number), at + _ALIGN[code]


class SystemBus:
    """A conversation with the daemons of this machine. Blocks; for one thread, save `interrupt`.

    Args:
        path: the bus's socket.
        patience_s: how long an answer may take.

    Raises:
        UnavailableError: no bus is there.
    """

    def __init__(self, path: str = _SYSTEM_BUS, patience_s: float = 5.0) -> None:
        self._patience_s = patience_s
        self._serial = 0
        self._rest = b""
        self._socket = socket.socket(socket.AF_UNIX)
        self._socket.settimeout(patience_s)
        try:
            self._socket.connect(path)
            self._socket.sendall(b"\0AUTH EXTERNAL " + str(os.getuid()).encode().hex().encode() + b"\r\n")
            if not self._receive_line().startswith(b"OK "):
                raise UnavailableError(f"D-Bus on {path} refuses this user", "look at the journal of dbus.service")
            self._socket.sendall(b"BEGIN\r\n")
            self.call(Call("org.freedesktop.DBus", "/org/freedesktop/DBus", "org.freedesktop.DBus", "Hello"))
        except OSError as error:
            self._socket.close()
            raise UnavailableError(
                f"D-Bus does not answer on {path} ({error.strerror or error})", "start dbus.service"
            ) from None
        except UnavailableError:
            self._socket.close()
            raise

    def call(self, call: Call) -> tuple[Any, ...]:
        """Call a method and wait for its answer; signals that come before it are dropped.

        Raises:
            UnavailableError: it failed, or the bus is gone.
        """
        self._serial += 1
        serial = self._serial
        self._socket.settimeout(self._patience_s)
        try:
            self._socket.sendall(encode_call(call, serial))
            while (message := self._receive()).reply_serial != serial:
                pass
        except OSError as error:
            raise UnavailableError(f"D-Bus gave no answer to {call.member} ({error})", "start dbus.service") from None
        if message.kind is Kind.ERROR:
            told = message.arguments[0] if message.arguments else message.error
            raise UnavailableError(f"{call.destination} refuses {call.member} ({told})", f"start {call.destination}")
        return message.arguments

    def next_message(self) -> Message:
        """Wait for the next message, however long.

        Raises:
            UnavailableError: the bus is gone, or `interrupt` was called.
        """
        self._socket.settimeout(None)
        try:
            return self._receive()
        except OSError as error:
            raise UnavailableError(f"D-Bus has gone ({error})", "start dbus.service") from None

    def interrupt(self) -> None:
        """Let whoever waits stop waiting; from any thread."""
        try:
            self._socket.shutdown(socket.SHUT_RDWR)
        except OSError:  # it was gone already
            return

    def close(self) -> None:
        """Hang up."""
        self._socket.close()

    def _receive_line(self) -> bytes:
        while b"\r\n" not in self._rest:
            self._more()
        line, _, self._rest = self._rest.partition(b"\r\n")
        return line

    def _receive(self) -> Message:
        while len(self._rest) < _HEADER.size or len(self._rest) < message_bytes(self._rest[: _HEADER.size]):
            self._more()
        size = message_bytes(self._rest[: _HEADER.size])
        data, self._rest = self._rest[:size], self._rest[size:]
        return decode(data)

    def _more(self) -> None:
        data = self._socket.recv(65536)
        if not data:
            raise ConnectionResetError("closed")
        self._rest += data
