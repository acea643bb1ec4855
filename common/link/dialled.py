"""One connection that this side dials over ZeroMQ: what becomes of it, and when it is dialled again.

ZeroMQ itself redials whenever a connection breaks, but stops once the peer has turned it away. Then this module redials, slowly: keys change,
and a link that was left open or secured by mistake may be corrected while we run.
"""

import logging
import struct
from contextlib import suppress
from typing import Final

import zmq

from common.errors import UnavailableError
from common.link.waiter import Inbox
from common.program.logs import event

_LOG = logging.getLogger(__name__)

REDIAL_NS: Final = 15_000_000_000
"""Each refusal is a line in the board's log (curve.py writes one every ten seconds at most). A host that has just been paired does not wait long."""

_NEVER: Final = 2**63 - 1
_NOW: Final = int(zmq.DONTWAIT)

_WATCHED: Final = int(
    zmq.EVENT_DISCONNECTED
    | zmq.EVENT_HANDSHAKE_SUCCEEDED
    | zmq.EVENT_HANDSHAKE_FAILED_AUTH
    | zmq.EVENT_HANDSHAKE_FAILED_PROTOCOL
    | zmq.EVENT_HANDSHAKE_FAILED_NO_DETAIL
)
_NEWS: Final = struct.Struct("=HI")
"""A monitor's event and its value, zmq_socket_monitor(3). pyzmq's own reader would pull in asyncio."""

_MECHANISM_MISMATCH: Final = 0x11000002
"""ZMQ_PROTOCOL_ERROR_ZMTP_MECHANISM_MISMATCH in zmq.h: one side requires keys, the other does not."""

_HANG_UPS: Final = 5
"""Handshakes that the peer may break off before this is reported: a restarting board, or a forwarded port with nothing behind it yet."""


class Dialled:
    """A socket that connects to one address.

    Args:
        sock: a socket with its options set, not connected yet.
        address: `tcp://HOST:PORT` or `ipc://PATH`.
        peer: name of the peer that must answer; empty on an open link.
        lane: its lane, for the log.

    Raises:
        zmq.ZMQError: the address makes no sense.
    """

    def __init__(self, sock: "zmq.Socket[bytes]", address: str, peer: str, lane: str) -> None:
        self.inbox = Inbox(sock)
        self.news = Inbox(sock.get_monitor_socket(_WATCHED))
        self.news.has_news()  # the descriptor signals news only after a look that found none
        self.due_ns = _NEVER
        self._address, self._peer, self._lane = address, peer, lane
        self._hang_ups = 0
        sock.connect(address)

    def redial(self) -> None:
        """Dial again; call this when it is due."""
        self.due_ns, self.inbox.may_have = _NEVER, True
        with suppress(zmq.ZMQError):  # it may have forgotten the address with the refusal
            self.inbox.socket.disconnect(self._address)
        self.inbox.socket.connect(self._address)

    def hang_up(self, now_ns: int) -> None:
        """Drop the peer that answered; redial later, when it may be a different one."""
        self.due_ns, self.inbox.may_have = now_ns + REDIAL_NS, True
        with suppress(zmq.ZMQError):
            self.inbox.socket.disconnect(self._address)

    def broke(self, now_ns: int) -> bool:
        """Handle one monitor event; return whether it says that the connection broke.

        Raises:
            UnavailableError: the peer has turned us away; it will be redialled later.
        """
        kind, value = _NEWS.unpack(self.news.socket.recv_multipart(_NOW)[0])
        match kind:
            case zmq.EVENT_DISCONNECTED:
                return True
            case zmq.EVENT_HANDSHAKE_SUCCEEDED:
                self._hang_ups = 0
            case zmq.EVENT_HANDSHAKE_FAILED_AUTH:
                self.due_ns = now_ns + REDIAL_NS
                raise UnavailableError(
                    f"{self._address} does not know this machine's key",
                    f"pair them: phone-host pair --link {self._address}",
                )
            case zmq.EVENT_HANDSHAKE_FAILED_PROTOCOL if value == _MECHANISM_MISMATCH:
                self.due_ns = now_ns + REDIAL_NS
                raise self._mismatch()
            case _:
                self._hang_ups += 1
                if self._hang_ups == _HANG_UPS:
                    expected = self._peer or "none"
                    _LOG.warning(event("peer_hangs_up", address=self._address, expected=expected, lane=self._lane))
        return False

    def _mismatch(self) -> UnavailableError:
        if not self._peer:
            return UnavailableError(
                f"{self._address} lets in only hosts with a key",
                f"pair with it: phone-host pair --link {self._address}",
            )
        return UnavailableError(
            f"{self._address} has no keys and is open to everybody",
            "secure it on the board, or add ?insecure=1 to --link here, too",
        )
