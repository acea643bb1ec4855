"""CURVE on ZeroMQ links: the listener lets in the keys that it knows; the dialler knows the key that must answer.

The listener's guard answers ZeroMQ's questions (ZAP) in its owner's poll loop: no thread, no asyncio. A peer that is not let in costs one
handshake and at most one log line every ten seconds.
"""

import logging
from dataclasses import dataclass
from typing import Final

import zmq
from zmq.utils import z85

from common import now
from common.errors import TandemError
from common.keys import KeyFolder, OwnKey
from common.link.waiter import Inbox
from common.peers import Peer
from common.program.logs import event
from common.protocol import zap

_LOG = logging.getLogger(__name__)

_NOW: Final = int(zmq.DONTWAIT)
_QUIET_NS: Final = 10_000_000_000
"""Time between two log lines about strangers: a person at the log sees them come, but a flood does not fill a disk."""

_DOMAIN: Final = b"tandemscan"

_AT_ONCE: Final = 64
"""Answers per round of the poll loop. Many strangers must not hold up frames."""

_ENVELOPE_BYTES: Final = 33
"""What CURVE adds to each part: command name 8, nonce 8, authenticator 16, flags 1 (RFC 26, "MESSAGE")."""


@dataclass(slots=True)
class Seldom:
    """Decides when to write a log line that strangers can cause."""

    count: int = 0
    _due_ns: int = 0

    def now(self, now_ns: int) -> bool:
        """Count one more event; return whether to log it."""
        self.count += 1
        if now_ns < self._due_ns:
            return False
        self._due_ns = now_ns + _QUIET_NS
        return True


class Guard:
    """Lets peers in by their keys. Make it before the first bind of the context's sockets.

    Args:
        context: context of the sockets that it guards.
        keys: folder with the known keys; read again whenever the file has changed.

    Raises:
        DataError: the key files are bad.
        UnavailableError: they cannot be read.
    """

    def __init__(self, context: "zmq.Context[zmq.Socket[bytes]]", keys: KeyFolder) -> None:
        self._keys = keys
        self._state = keys.peers_state
        self._names = _names(keys)
        self._users = _users(self._names)
        self._is_sound = True
        self._denied = Seldom()
        self._let_in = ""
        self.inbox = Inbox(context.socket(zmq.REP))
        self.inbox.socket.bind(zap.ENDPOINT)

    def knows_nobody(self) -> bool:
        """Read the keys; return whether no peer is known at all. False if the file is bad, since it says nothing."""
        self._refresh()
        return self._is_sound and not self._names

    def knows(self, part: zmq.Frame) -> bool:
        """Whether the sender of a message is still known. It may have been forgotten since it was let in."""
        return part.get("User-Id") in self._users

    def answer(self) -> None:
        """Answer everyone who asks to be let in."""
        for _ in range(_AT_ONCE):
            if not (self.inbox.may_have and self.inbox.has_news()):
                return
            request = zap.read_request(self.inbox.socket.recv_multipart(_NOW))
            self._refresh()
            name = self._names.get(request.key)
            if name is None:
                if self._denied.now(now.monotonic_ns()):
                    key = z85.encode(request.key).decode() if request.key else "none"
                    _LOG.warning(event("key_denied", address=request.address, key=key, count=self._denied.count))
            elif name != self._let_in:
                self._let_in = name
                _LOG.info(event("key_known", peer=name, address=request.address))
            self.inbox.socket.send_multipart(
                zap.deny(request) if name is None else zap.allow(request, _user(request.key))
            )

    def _refresh(self) -> None:
        """Read the known keys if their file has changed. While it is bad, nobody is let in."""
        state = self._keys.peers_state
        if state == self._state:
            return
        self._state = state
        try:
            self._names, self._is_sound = _names(self._keys), True
        except TandemError as error:
            self._names, self._is_sound = {}, False
            _LOG.error(event("peers_unreadable", problem=error))
        self._users = _users(self._names)


def secure_listener(sock: "zmq.Socket[bytes]", own: OwnKey) -> None:
    """Make a socket that is not bound yet accept only keys that the context's guard knows."""
    _allow_envelope(sock)
    sock.setsockopt(zmq.ZAP_DOMAIN, _DOMAIN)
    sock.setsockopt(zmq.ZAP_ENFORCE_DOMAIN, 1)  # without a guard nobody gets in, rather than everybody
    sock.setsockopt(zmq.CURVE_SERVER, 1)
    sock.setsockopt(zmq.CURVE_SECRETKEY, own.secret.encode())


def secure_dialler(sock: "zmq.Socket[bytes]", own: OwnKey, peer: Peer) -> None:
    """Make a socket that is not connected yet talk only to the holder of one key."""
    _allow_envelope(sock)
    sock.setsockopt(zmq.CURVE_SERVERKEY, peer.key.encode())
    sock.setsockopt(zmq.CURVE_PUBLICKEY, own.public.encode())
    sock.setsockopt(zmq.CURVE_SECRETKEY, own.secret.encode())


def _allow_envelope(sock: "zmq.Socket[bytes]") -> None:
    """Raise the message size limit, set before, by what CURVE adds, so that it means the same as without keys."""
    limit_bytes = int(sock.getsockopt(zmq.MAXMSGSIZE))
    if limit_bytes >= 0:  # -1: there is none
        sock.setsockopt(zmq.MAXMSGSIZE, limit_bytes + _ENVELOPE_BYTES)


def _names(keys: KeyFolder) -> dict[bytes, str]:
    return {z85.decode(peer.key.encode()): peer.name for peer in keys.peers()}


def _user(key: bytes) -> str:
    """Identifies a peer in ZeroMQ's user ids. A name could pass to another key."""
    return z85.encode(key).decode()


def _users(names: dict[bytes, str]) -> frozenset[str]:
    return frozenset(_user(key) for key in names)
