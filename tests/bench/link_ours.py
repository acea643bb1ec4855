"""Our own link and protocol as transports of the link benchmark: board-agent's complete agent and phone-host's complete receiver."""

import os
import socket
import time
from fractions import Fraction
from pathlib import Path

from board_agent.agent import Agent
from common import now
from common.camera.base import Ended, Grab
from common.camera.replay import ReplayCamera, ReplaySettings
from common.keys import KeyFolder
from common.link.base import Link
from common.link.factory import open_link, parse_link
from common.link.stream import StreamLink
from common.protocol.framing import LinkEnd
from common.protocol.message import FrameMessage, Message, Pacing
from phone_host.stream.receiver import Receiver
from phone_host.stream.reception import Reception
from tests.bench.link_job import Job, Tally
from tests.support.unkept import Unkept

_SLOTS = 8
"""Free slots that the host grants when frames go as fast as they can: more than one, so that the link is never idle."""


class OpenLine:
    """The end of an already open pseudo terminal, as a line."""

    def __init__(self, descriptor: int) -> None:
        os.set_blocking(descriptor, False)
        self._descriptor = descriptor

    def fileno(self) -> int:
        """The descriptor."""
        return self._descriptor

    def is_drained(self) -> bool:
        """Unknown here."""
        return True

    def discard_output(self) -> None:
        """Not possible here."""

    def close(self) -> None:
        """Close it."""
        os.close(self._descriptor)


def send_tandemscan(job: Job) -> Tally:
    """Our board: the whole agent with a replay camera, as `board-agent run` puts it together."""
    tally = job.tally()

    class Metered(ReplayCamera):
        """Reads the meter where the other senders do, and stops after the last frame."""

        _shown = -1

        def read(self, now_ns: int) -> list[Grab]:
            if self._shown >= job.frames - 1:
                tally.passed(self._shown)
                return [Ended()]
            grabs = super().read(now_ns)
            for _ in grabs:
                tally.passed(self._shown)
                self._shown += 1
            return grabs

    pacing = Pacing.CLOCK if job.fps else Pacing.DEMAND
    settings = ReplaySettings(path=str(job.folder), fps=Fraction(job.fps or 30), loop=True, pacing=pacing)
    camera = Metered(settings, now.monotonic_ns())
    link = _open_tcp(job.address, listens=True)
    reader, writer = socket.socketpair()
    with reader, writer:
        Agent(camera, [link], now.random_id(), now.boot_id(), reader).run()
    link.close()
    return tally


def receive_tandemscan(job: Job) -> Tally:
    """Our host: the receiver with session, clock and credit."""
    tally = job.tally()

    sink = Unkept(None if job.fps else _SLOTS)
    receiver = Receiver([_open(job.address)], now.random_id(), sink)
    take_in = Reception.receive

    def stamped(reception: Reception, connection: bytes, message: Message, now_ns: int) -> None:
        """Stamp a frame once it is decoded, before the host decides whether to believe it."""
        if isinstance(message, FrameMessage):
            tally.arrived(message.sequence, message.marks.sent_ns, len(message.payload))
        take_in(reception, connection, message, now_ns)

    Reception.receive = stamped  # type: ignore[assignment]
    receiver.start()
    while not receiver.ended and receiver.failure is None:
        time.sleep(1)  # its wake-ups are no part of the link
    receiver.stop()
    if receiver.failure is not None:
        raise receiver.failure
    return tally


def _open(address: str) -> Link:
    """Open the host's end: an address, or `fd:N` for the end of a pseudo terminal."""
    if address.startswith("fd:"):
        descriptor = int(address.removeprefix("fd:"))
        return StreamLink("serial", LinkEnd.DIALLER, lambda: OpenLine(descriptor))
    return _open_tcp(address, listens=False)


def _open_tcp(address: str, *, listens: bool) -> Link:
    """Open a URI; a `#` may introduce the folder of keys."""
    uri, _, keys = address.partition("#")
    return open_link(
        parse_link(uri, listens_by_default=listens), KeyFolder(Path(keys)) if keys else None, board=listens
    )
