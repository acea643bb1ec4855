"""Waits without sleeping for what a link delivers: poll its sockets until a condition holds."""

import os
import socket
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from common.link.base import Broken, Garbage, Link, Packet, SendResult
from common.link.stream import StreamLink
from common.link.waiter import Waiter
from common.protocol.message import Lane

PATIENCE_S = float(os.environ.get("TEST_PATIENCE_S", "60"))
"""Longer in a guest, whose processor is emulated: 16 MB over its Bluetooth take 35 s on an idle machine."""


@dataclass(slots=True)
class End:
    """One end of a link, with everything it has received."""

    link: Link
    packets: list[tuple[bytes, bytes, bytes]] = field(default_factory=list)
    broken: list[bytes] = field(default_factory=list)
    garbage: int = 0

    def take(self) -> None:
        """Take what has arrived."""
        for incoming in self.link.receive():
            match incoming:
                case Packet(connection, header, payload):
                    self.packets.append((connection, bytes(header), bytes(payload)))
                case Broken(connection):
                    self.broken.append(connection)
                case Garbage():
                    self.garbage += 1

    @property
    def headers(self) -> list[bytes]:
        """The received headers, in order."""
        return [header for _, header, _ in self.packets]


def wait_until(condition: Callable[[], bool], *ends: End) -> None:
    """Take what arrives at these ends until the condition holds; check it at least every 20 ms.

    An accepted packet leaves only while its sender is among them: a link moves when it is called.
    """
    waiter = Waiter(pollable for end in ends for pollable in end.link.pollables)
    deadline = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < deadline, f"the condition was not met in {PATIENCE_S:.0f} s: {_told(ends)}"
        waiter.wait(20)
        for end in ends:
            end.take()


def _told(ends: Sequence[End]) -> str:
    """What each end has seen, to help find out why nothing more came."""
    seen = []
    for end in ends:
        lost = f", {end.link.counts}" if isinstance(end.link, StreamLink) else ""
        seen.append(f"{len(end.packets)} packets, {len(end.broken)} breaks, garbage {end.garbage} times{lost}")
    return "; ".join(seen)


def send_until_sent(end: End, connection: bytes, header: bytes, payload: bytes, *others: End) -> None:
    """Send a packet as soon as the link accepts it."""
    wait_until(lambda: end.link.send(connection, header, payload) is SendResult.SENT, end, *others)


def meet(listener: End, dialler: End, greeting: bytes = b"hello") -> dict[Lane, bytes]:
    """Let the listener learn the dialler's connections; returns its names for them. A greeting not heard within a second is repeated."""
    names: dict[Lane, bytes] = {}
    for lane, connection in dialler.link.dialled.items():
        _greet(listener, dialler, connection, greeting + lane.name.encode())
        names[lane] = next(
            name for name, said, _ in reversed(listener.packets) if said == greeting + lane.name.encode()
        )
    return names


def _greet(listener: End, dialler: End, connection: bytes, header: bytes) -> None:
    said_at = -1.0

    def heard() -> bool:
        nonlocal said_at
        if header in listener.headers:
            return True
        unheard = time.monotonic() - said_at > 1
        if unheard and dialler.link.send(connection, header, b"") is SendResult.SENT:
            said_at = time.monotonic()
        return False

    wait_until(heard, listener, dialler)


def free_port() -> int:
    """A TCP port of the loopback interface that nobody listens on."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
    return port
