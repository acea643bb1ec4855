"""The host's end of all links, in its own thread: turns bytes into messages for the reception and sends its answers."""

import os
import threading
from collections.abc import Sequence
from contextlib import suppress
from typing import Final

from common import now
from common.errors import ProtocolError
from common.link.base import Broken, Link, Packet, SeveralLinks
from common.link.waiter import Waiter
from common.protocol.message import BoardHello, Locks, LockState, Ping
from common.protocol.session import Outgoing, connection_name
from common.protocol.wire import VersionError, decode, encode_stamped
from phone_host.accounts.link_account import LinkAccount
from phone_host.stream.corrections import Corrections
from phone_host.stream.frame_sink import FrameSink, LinkFacts
from phone_host.stream.reception import Reception
from phone_host.stream.refusals import BoardRefusal
from phone_host.sync.clock import ClockEstimate

_NEVER: Final = 2**63 - 1

_LONGEST_WAIT_MS: Final = 50
"""Longest time between two ticks of the sink."""

_FAREWELL_NS: Final = 300_000_000
"""How long a leaving host waits for the board's last account: a few round trips on any usable link."""


class Receiver:
    """Owns the links and speaks the host's role over them.

    Args:
        links: open links to one board, the preferred one first; this class closes them.
        host_id: random id of this process.
        sink: takes the frames.
    """

    def __init__(self, links: Sequence[Link], host_id: str, sink: FrameSink) -> None:
        self._links = tuple(links)
        self._prefixes = tuple(connection_name(number, b"") for number in range(len(links)))
        self._looked_ns = now.monotonic_ns()
        self._several = SeveralLinks(links)
        facts = [
            LinkFacts(
                link.kind,
                {lane: connection_name(number, path) for lane, path in link.dialled.items()},
                link.self_paced,
            )
            for number, link in enumerate(links)
        ]
        self._reception = Reception(facts, host_id, sink, self._send)
        self._wake_read, self._wake_write = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)
        self._waiter = Waiter([*(item for link in links for item in link.pollables), self._wake_read])
        self._stopping = False
        self._corrections = Corrections()
        self._steered_session = ""
        self._standstill = now.StandstillWatch()
        self._wake_lock = threading.Lock()
        self._thread = threading.Thread(target=self._run, name="receiver", daemon=True)
        self.failure: Exception | None = None

    @property
    def account(self) -> LinkAccount:
        """The links' account so far."""
        return self._reception.account

    @property
    def refused(self) -> BoardRefusal | None:
        """Why the last board heard refuses this host; None if it does not, or is silent now."""
        return self._reception.refused(now.monotonic_ns())

    @property
    def connected(self) -> bool:
        """Whether a board talks to us now."""
        return self._reception.connected

    @property
    def carrier(self) -> str:
        """Name of the link that carries frames now; empty while there is none."""
        return self._reception.carrier

    @property
    def hello(self) -> BoardHello | None:
        """The board's description of itself; None before the first contact."""
        return self._reception.hello

    @property
    def locks(self) -> LockState | None:
        """How the board's camera is held, as it said in this session; None: it has not said."""
        return self._reception.locks

    @property
    def estimate(self) -> ClockEstimate | None:
        """The clock estimate now; None before the first echo, and while it is in doubt."""
        return self._reception.estimate

    @property
    def ended(self) -> bool:
        """Whether the board's camera has reached the end of its images."""
        return self._reception.ended

    def start(self) -> None:
        """Start to look for the board."""
        self._thread.start()

    def wake(self) -> None:
        """Let the thread check the sink's room now. Safe from any thread."""
        with self._wake_lock, suppress(BlockingIOError):  # the pipe is full: the thread will wake anyway
            if self._wake_write >= 0:
                os.write(self._wake_write, b"\0")

    def steer(self, later_ns: int) -> None:
        """Ask the board's camera to expose later, in addition to earlier corrections. Safe from any thread."""
        hello = self._reception.hello
        self._steered_session = "" if hello is None else hello.session
        self._corrections.add(later_ns)
        self.wake()

    def hold(self, locks: Locks) -> None:
        """Have the board's camera held like this. Safe from any thread."""
        self._reception.hold(locks)
        self.wake()

    def stop(self) -> None:
        """Say goodbye and close the links."""
        self._stopping = True
        self.wake()
        self._thread.join()
        os.close(self._wake_read)
        with self._wake_lock:  # a worker that was given up may still come back; its number may be another file's then
            os.close(self._wake_write)
            self._wake_write = -1

    def _run(self) -> None:
        try:
            while not self._stopping:
                self._step()
            self._take_leave()
        except Exception as error:  # noqa: BLE001 - a thread's root: the run's root reports it once
            self.failure = error
        finally:
            self._reception.close()
            for link in self._links:
                link.close()

    def _take_leave(self) -> None:
        """Say goodbye and wait briefly for the board's last account, which follows the last frame."""
        reception = self._reception
        heard = reception.leave(now.monotonic_ns())
        deadline_ns = now.monotonic_ns() + _FAREWELL_NS
        while heard and not reception.tail_known and (left_ns := deadline_ns - now.monotonic_ns()) > 0:
            self._waiter.wait(left_ns // 1_000_000 + 1)
            self._receive()
        if heard and not reception.tail_known:
            reception.lose_tail()

    def _receive(self) -> None:
        """Take everything that has come."""
        for number, incoming in self._several.receive():
            now_ns = now.monotonic_ns()
            connection = self._prefixes[number] + incoming.connection
            if isinstance(incoming, Packet):
                self._take(connection, incoming, now_ns)
            elif isinstance(incoming, Broken):
                self._reception.interrupted(connection, now_ns)
            else:
                self._reception.count_garbage("not a packet")

    def _step(self) -> None:
        """Wait, and do what has come or is due. Runs for each frame, so the clock is read no more often than decides something."""
        links_due_ns = _NEVER
        for link in self._links:
            links_due_ns = min(links_due_ns, link.due_ns)
        wait_ns = min(self._reception.due_ns, links_due_ns) - self._looked_ns
        ready = self._waiter.wait(min(_LONGEST_WAIT_MS, -(-wait_ns // 1_000_000)) if wait_ns > 0 else 0)
        slept_ns, jumped = self._standstill.look()
        if slept_ns or jumped:
            self._note_standstill(slept_ns)
        if ready or now.monotonic_ns() >= links_due_ns:
            self._receive()
            if self._wake_read in ready:
                os.read(self._wake_read, 4096)
        self._looked_ns = now_ns = now.monotonic_ns()
        self._reception.tick(now_ns)
        if self._corrections.is_due:
            self._hand_on_corrections(now_ns)

    def _hand_on_corrections(self, now_ns: int) -> None:
        """Send due corrections to the board once a link is up. Discard corrections for an earlier session."""
        hello = self._reception.hello
        if hello is None or not self._reception.carrier:
            return
        if (later_ns := self._corrections.take()) and self._steered_session in {"", hello.session}:
            self._reception.steer(later_ns, now_ns)

    def _note_standstill(self, slept_ns: int) -> None:
        """Handle that this machine's clock stood still, or may have, before taking anything that came meanwhile."""
        if slept_ns:
            self._reception.slept(slept_ns, now.monotonic_ns())
        else:
            self._reception.doubt_clock(
                "the time of day was set: this machine may have stood still", now.monotonic_ns()
            )

    def _take(self, connection: bytes, packet: Packet, now_ns: int) -> None:
        try:
            message = decode(packet.header, packet.payload)
        except VersionError as error:
            self._reception.refuse_version(connection, error.theirs, now_ns)
        except ProtocolError as error:
            self._reception.count_garbage(error.problem)
        else:
            self._reception.receive(connection, message, now_ns)

    def _send(self, outgoing: Outgoing) -> None:
        link = self._links[outgoing.connection[0]]
        link.send(outgoing.connection[1:], *encode_stamped(outgoing.message, now.monotonic_ns))
        if isinstance(outgoing.message, Ping):
            self._waiter.stay_awake()
