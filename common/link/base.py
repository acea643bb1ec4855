"""A link is a packet pipe: headers with payloads go in at one end and come out whole, in order, or not at all, at the other.

A link has named byte paths (connections). The side that dials opens one for each lane; the side that listens learns of a connection when
its first packet arrives. A link never blocks, never decides what a packet means, and is used by one thread only, save `Link.close`.

A packet that was taken may be lost: with its connection, with bytes that a wire loses without a word, or when nobody acknowledges it for a second on a
link that paces itself. Then all of it is lost and the next one comes whole; a frame's loss shows as a gap in `sent_index`, and what else must be
heard is said until it is answered.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any, Protocol, runtime_checkable

from common.frame import Buffer
from common.keys import KeyFolder
from common.protocol.message import Lane


@dataclass(frozen=True, slots=True)
class Packet:
    """What came in over a connection.

    Attributes:
        connection: the byte path, opaque.
        header: the message's header.
        payload: its payload, often empty; backed by the transport's own memory, no copy.
    """

    connection: bytes
    header: Buffer
    payload: Buffer


@dataclass(frozen=True, slots=True)
class Broken:
    """A connection that this side had dialled broke. The link dials again by itself.

    What was under way on it is gone, so may be what had come but was not received yet, and what is sent at that very moment: what must be
    heard is said until it is answered.
    """

    connection: bytes


@dataclass(frozen=True, slots=True)
class Garbage:
    """Something that is no packet came in and was thrown away."""

    connection: bytes


Incoming = Packet | Broken | Garbage


class SendResult(Enum):
    """What became of a packet that was to be sent."""

    SENT = 0
    FULL = 1
    UNREACHABLE = 2


class Link(Protocol):
    """What every transport offers."""

    @property
    def kind(self) -> str:
        """The transport's name as it stands in delays.jsonl, for example `tcp`."""

    @property
    def dialled(self) -> dict[Lane, bytes]:
        """The connections that this side opened; empty on the side that listens."""

    @property
    def pollables(self) -> Sequence[Any]:
        """Sockets or file descriptors to wait on with a Waiter; readable means that `receive` has something."""

    @property
    def due_ns(self) -> int:
        """When `receive` wants to be called next even if nothing is readable, by this machine's steady clock, ns; 2^63 - 1: never."""

    @property
    def self_paced(self) -> bool:
        """Whether `ready` is false until the frame before has left: then credit may run one frame ahead, and the line is never idle."""

    def ready(self, connection: bytes) -> bool:
        """Whether a frame would be taken now, as far as is known without trying."""

    def receive(self) -> Iterator[Incoming]:
        """Give all that has come in, without waiting."""

    def send(self, connection: bytes, header: bytes, payload: Buffer) -> SendResult:
        """Hand a packet over, without waiting."""

    def close(self) -> None:
        """Give what was handed over a moment to leave, then let go of everything."""


@runtime_checkable
class TakesNewHosts(Protocol):
    """What a link offers besides that can let in new hosts by a code."""

    @property
    def endpoint(self) -> str:
        """Where it listens."""

    def open_door(self, links: Sequence[str], keys: KeyFolder) -> None:
        """Take in new hosts by a code, for all secured links of this board.

        Args:
            links: the secured links' `endpoint`s.
            keys: the board's.
        """
