"""Who is trusted on a link: names, public keys and addresses as values. Pure.

Keys are Curve25519 in Z85, as in CurveZMQ (RFC 26, RFC 32).
"""

from collections.abc import Sequence
from functools import reduce
from typing import Final

from common.value import value

MAX_NAME: Final = 64
"""Longest host name on Linux (HOST_NAME_MAX)."""

_Z85_CHARACTERS: Final = 40
_Z85_ALPHABET: Final = b"0123456789abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ.-:+=^!/*?&<>()[]{}@%$#"
"""RFC 32. A text of 40 such letters may still not be 256 bits (each five must stand for less than 2^32): see is_key."""


@value(kw_only=True)
class Peer:
    """A machine that this one trusts.

    Attributes:
        name: the name that people know it by; unique in a folder.
        key: its public key, Z85.
        added: local wall time, ISO 8601.
        address: link on which a host reaches it; empty for a host.
    """

    name: str
    key: str
    added: str
    address: str = ""


def peer_at(peers: Sequence[Peer], address: str) -> Peer | None:
    """Find the peer at an address: the one last paired there, else the one with that name, else the only one there is.

    Args:
        peers: all known peers.
        address: `tcp://HOST:PORT`.

    Returns:
        The peer; its key decides whether it is the right one. None if there are several and none fits.
    """
    host = address.partition("://")[2].rpartition(":")[0].lower().removesuffix(".").removesuffix(".local")
    there = [peer for peer in peers if peer.address == address] or [peer for peer in peers if peer.name.lower() == host]
    return there[-1] if there else peers[0] if len(peers) == 1 else None


def is_key(text: str) -> bool:
    """Whether a text has the form of a key in Z85."""
    digits = [_Z85_ALPHABET.find(c) for c in text.encode()]
    if len(digits) != _Z85_CHARACTERS or -1 in digits:
        return False
    groups = (digits[at : at + 5] for at in range(0, len(digits), 5))
    return all(reduce(lambda value, digit: 85 * value + digit, group, 0) < 2**32 for group in groups)


def clean_name(name: str) -> str:
    """Turn a peer's own name into one of letters, digits, dots and hyphens, at most 64 in all; anything else becomes a hyphen."""
    kept = "".join(c if c.isascii() and (c.isalnum() or c in "._-") else "-" for c in name[:MAX_NAME])
    return kept.strip(".-") or "unnamed"
