"""ZeroMQ's authentication protocol, handler's side: who asks to be let in with which key, and the answer. Sans-I/O.

ZeroMQ asks once per connection, over inproc, once the peer has proved that it holds its key. Source: ZeroMQ RFC 27 (ZAP), sections
"The request message" and "The reply message"; RFC 26 (CurveZMQ) for the key.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from common.errors import ProtocolError

ENDPOINT: Final = "inproc://zeromq.zap.01"
"""Where a handler listens (RFC 27)."""

KEY_BYTES: Final = 32
"""A public key of Curve25519."""

_VERSION: Final = b"1.0"
_FIELDS: Final = 6
_CURVE: Final = b"CURVE"


@dataclass(frozen=True, slots=True)
class ZapRequest:
    """A peer that asks to be let in.

    Attributes:
        request_id: echoed in the answer; opaque.
        address: the peer's network address, for people.
        key: the public key that it holds, 32 bytes; empty for a peer without one.
    """

    request_id: bytes
    address: str
    key: bytes


def read_request(parts: Sequence[bytes]) -> ZapRequest:
    """Read ZeroMQ's request.

    Args:
        parts: the message's parts, without the envelope.

    Returns:
        The request; its key is empty unless the mechanism is CURVE.

    Raises:
        ProtocolError: these are not the parts of a request.
    """
    if len(parts) < _FIELDS or parts[0] != _VERSION:
        raise ProtocolError("a request for authentication is not of RFC 27", "update ZeroMQ")
    _, request_id, _, address, _, mechanism, *credentials = parts
    is_key = mechanism == _CURVE and len(credentials) == 1 and len(credentials[0]) == KEY_BYTES
    return ZapRequest(request_id, plain_address(address.decode("ascii", "replace")), credentials[0] if is_key else b"")


def plain_address(address: str) -> str:
    """Return a network address as people know it: IPv4 without the prefix that it has on a dual-stack socket."""
    return address.removeprefix("::ffff:")


def allow(request: ZapRequest, user: str) -> list[bytes]:
    """Return the answer that lets a peer in.

    Args:
        request: the request to answer.
        user: identifies the peer; each of its messages carries this as its user id.
    """
    return [_VERSION, request.request_id, b"200", b"OK", user.encode(), b""]


def deny(request: ZapRequest) -> list[bytes]:
    """Return the answer that turns a peer away; the peer sees the number 400."""
    return [_VERSION, request.request_id, b"400", b"unknown key", b"", b""]
