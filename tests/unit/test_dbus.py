"""D-Bus messages: bytes as the specification has them, any value there and back, answers of a bus over a real socket."""

import socket
import struct
import threading
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.errors import UnavailableError
from common.link.dbus import Call, Kind, SystemBus, Variant, complete_types, decode, encode_call, message_bytes

_HELLO = Call("org.freedesktop.DBus", "/org/freedesktop/DBus", "org.freedesktop.DBus", "Hello")


def test_a_call_as_the_specification_has_it() -> None:
    """A call without arguments has these bytes: fixed header, then path, interface, member and destination, each at a multiple of 8."""
    # By hand after "Message Format" and "Marshaling": little endian, call, no flags, version 1, no body, serial 1, then the fields.
    fields = b"\1\1o\0" + struct.pack("<I", 21) + b"/org/freedesktop/DBus\0" + bytes(2)
    fields += b"\2\1s\0" + struct.pack("<I", 20) + b"org.freedesktop.DBus\0" + bytes(3)
    fields += b"\3\1s\0" + struct.pack("<I", 5) + b"Hello\0" + bytes(2)
    fields += b"\6\1s\0" + struct.pack("<I", 20) + b"org.freedesktop.DBus\0"
    expected = b"l\1\0\1" + struct.pack("<III", 0, 1, len(fields)) + fields
    expected += bytes(-len(expected) % 8)
    assert encode_call(_HELLO, 1) == expected


_text = st.text(st.characters(codec="utf-8", exclude_characters="\0"), max_size=20)
_values = st.one_of(
    st.tuples(st.just("y"), st.integers(0, 255)),
    st.tuples(st.just("q"), st.integers(0, 2**16 - 1)),
    st.tuples(st.just("i"), st.integers(-(2**31), 2**31 - 1)),
    st.tuples(st.just("t"), st.integers(0, 2**64 - 1)),
    st.tuples(st.just("b"), st.booleans()),
    st.tuples(st.just("s"), _text),
    st.tuples(st.just("as"), st.lists(_text, max_size=4)),
    st.tuples(st.just("a(ys)"), st.lists(st.tuples(st.integers(0, 255), _text).map(list), max_size=3)),
    st.tuples(
        st.just("a{sv}"),
        st.dictionaries(_text, st.integers(0, 255).map(lambda number: Variant("y", number)), max_size=3),
    ),
    st.tuples(st.just("v"), _text.map(lambda text: Variant("s", text))),
)


@given(st.lists(_values, max_size=5))
def test_values_come_back_as_they_went(values: list[tuple[str, Any]]) -> None:
    """Arguments of any types that are spoken here are read as they were written, and the length is told by the first 16 bytes."""
    signature = "".join(kind for kind, _ in values)
    data = encode_call(Call("a.b", "/c", "d.e", "f", signature, tuple(value for _, value in values)), 7)
    assert message_bytes(data[:16]) == len(data)
    assert decode(data).arguments == tuple(value for _, value in values)
    assert complete_types(signature) == [kind for kind, _ in values]


@pytest.mark.parametrize("head", [b"B" + bytes(15), b"l\1\0\1" + struct.pack("<III", 2**31, 1, 8)])
def test_what_no_bus_would_send_is_refused(head: bytes) -> None:
    """A message in the other byte order (a bus sends what it was sent) or above the specification's limit is not waited for."""
    with pytest.raises(ValueError, match=r".*"):
        message_bytes(head)


def _answer(serial: int, kind: Kind, signature: str, *arguments: object) -> bytes:
    """A reply, made from a call's bytes: the kind, and the serial of the call in place of the member."""
    call = encode_call(Call("a.b", "/c", "d.e", "f", signature, arguments), 9)
    (fields_bytes,) = struct.unpack_from("<I", call, 12)
    body = call[16 + -(-fields_bytes // 8) * 8 :]
    fields = b"\5\1u\0" + struct.pack("<I", serial)
    if signature:
        fields += b"\x08\1g\0" + bytes((len(signature),)) + signature.encode() + b"\0"
    if kind is Kind.ERROR:
        fields += bytes(-len(fields) % 8) + b"\4\1s\0" + struct.pack("<I", 3) + b"x.y\0"
    head = b"l" + bytes((kind.value, 0, 1)) + struct.pack("<III", len(body), 9, len(fields)) + fields
    return head + bytes(-len(head) % 8) + body


def _serve(listening: socket.socket, replies: list[bytes]) -> None:
    """Play a bus: agree to the authentication, then answer every call with the next reply, a byte at a time."""
    served, _ = listening.accept()
    with served:
        served.recv(4096)
        served.sendall(b"OK 0123\r\n")
        for reply in replies:
            served.recv(65536)
            for at in range(len(reply)):
                served.send(reply[at : at + 1])
        served.recv(65536)


def test_a_conversation(tmp_path: Path) -> None:
    """Answers are told from what comes in between, an error becomes one line, and a bus that hangs up is told."""
    replies = [
        _answer(1, Kind.RETURN, "s", ":1.7"),
        _answer(99, Kind.RETURN, "s", "another's") + _answer(2, Kind.RETURN, "as", ["a", "b"]),
        _answer(3, Kind.ERROR, "s", "no such thing"),
    ]
    with socket.socket(socket.AF_UNIX) as listening:
        listening.bind(str(tmp_path / "bus"))
        listening.listen()
        bus_thread = threading.Thread(target=_serve, args=(listening, replies))
        bus_thread.start()
        bus = SystemBus(str(tmp_path / "bus"), patience_s=60)
        assert bus.call(_HELLO) == (["a", "b"],)
        with pytest.raises(UnavailableError, match="no such thing"):
            bus.call(_HELLO)
        bus.interrupt()
        bus_thread.join()
        with pytest.raises(UnavailableError, match="gone"):
            bus.next_message()
        bus.close()


def test_no_bus_is_told_in_one_line(tmp_path: Path) -> None:
    """Where no bus is, the path and the remedy are named."""
    with pytest.raises(UnavailableError, match=r"nobus.*start dbus"):
        SystemBus(str(tmp_path / "nobus"))
