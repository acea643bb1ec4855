"""A link is a packet pipe: headers with payloads go in at one end; at the other they come out whole and in order, or not at all.

A link has named byte paths (connections). The dialling side opens one for each lane; the listening side learns of a connection when its
first packet arrives. A link never blocks and never interprets a packet. Only one thread uses it, except for `Link.close`.

An accepted packet may still be lost: with its connection, with bytes that a wire drops silently, or, on a link that paces itself, when nobody
acknowledges it for a second. Then all of it is lost and the next one arrives whole. A lost frame shows as a gap in `sent_index`; anything
else that must be heard is repeated until it is answered.

Rule: a link may be refused because its peer does not know this side's key. If another link remains, the session goes on without the refused
one, which is reported once. It redials by itself, and once a packet comes over it, it counts again like the others. If all links are
refused, the last refusal is raised for all of them.
"""

import logging
from collections.abc import Iterator, Sequence
from enum import Enum
from typing import Any, Protocol, runtime_checkable

from common.errors import UnavailableError
from common.frame import Buffer
from common.keys import KeyFolder
from common.program.logs import event
from common.protocol.message import Lane
from common.value import value


@value()
class Packet:
    """A packet received over a connection.

    Attributes:
        connection: the byte path, opaque.
        header: the message's header.
        payload: its payload, often empty; a view of the transport's own memory, not a copy.
    """

    connection: bytes
    header: Buffer
    payload: Buffer


@value()
class Broken:
    """A connection that this side had dialled broke. The link redials by itself.

    What was under way on it is lost. So may be what had arrived but was not yet received, and what is sent at that very moment. Anything that must
    be heard is therefore repeated until it is answered.
    """

    connection: bytes


@value()
class Garbage:
    """Something arrived that is not a packet, and was thrown away."""

    connection: bytes


Incoming = Packet | Broken | Garbage


class SendResult(Enum):
    """What became of a packet handed to `send`."""

    SENT = 0
    FULL = 1
    UNREACHABLE = 2


class Link(Protocol):
    """What every transport offers."""

    @property
    def kind(self) -> str:
        """The transport's name as it appears in delays.jsonl, for example `tcp`."""

    @property
    def dialled(self) -> dict[Lane, bytes]:
        """The connections that this side opened; empty on the side that listens."""

    @property
    def pollables(self) -> Sequence[Any]:
        """What to wait on with a Waiter, which also tells `receive` where to look; readable means that `receive` may have something."""

    @property
    def due_ns(self) -> int:
        """When `receive` must be called next even if nothing is readable, by this machine's steady clock, ns; 2^63 - 1: never."""

    @property
    def self_paced(self) -> bool:
        """Whether `ready` is false until the previous frame has left. Then credit may run one frame ahead, and the line is never idle."""

    def ready(self, connection: bytes) -> bool:
        """Whether a frame would be accepted now, as far as can be known without trying."""

    def receive(self) -> Iterator[Incoming]:
        """Return everything that has arrived, without waiting. Comes after a Waiter's `wait`, be it for no time at all."""

    def send(self, connection: bytes, header: bytes, payload: Buffer) -> SendResult:
        """Hand a packet over, without waiting."""

    def close(self) -> None:
        """Give accepted packets a moment to leave, then release everything."""


@runtime_checkable
class TakesNewHosts(Protocol):
    """The additional interface of a link that can let in new hosts by a code."""

    @property
    def endpoint(self) -> str:
        """Where it listens."""

    def open_door(self, links: Sequence[str], keys: KeyFolder) -> None:
        """Let in new hosts by a code, for all secured links of this board."""


_LOG = logging.getLogger(__name__)


class SeveralLinks:
    """Receives from several links, in their order.

    Args:
        links: open links; closed by their owner.
    """

    def __init__(self, links: Sequence[Link]) -> None:
        self._links = tuple(links)
        self._refused: set[int] = set()

    def receive(self) -> Iterator[tuple[int, Incoming]]:
        """Return everything that has arrived, without waiting, each item with its link's number.

        Raises:
            UnavailableError: every link has been refused.
        """
        for number, link in enumerate(self._links):
            try:
                for incoming in link.receive():
                    if self._refused and isinstance(incoming, Packet):
                        self._refused.discard(number)
                    yield number, incoming
            except UnavailableError as error:
                is_news = number not in self._refused
                self._refused.add(number)
                if len(self._refused) == len(self._links):
                    raise
                if is_news:  # each lane of a link is refused separately
                    _LOG.warning(event("link_refused", link=link.kind, problem=error.problem, remedy=error.remedy))
                for connection in link.dialled.values():
                    yield number, Broken(connection)
