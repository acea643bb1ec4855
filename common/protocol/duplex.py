"""One end of a byte stream: received bytes go in and packets come out; packets go in and bytes to write come out. Sans-I/O, `now_ns` passed in.

It joins these parts: units (`framing`), who is there (`contact`), and chunks of both lanes (`chunking`) within what the line holds (`pacing`).
"""

from dataclasses import dataclass
from enum import Enum
from typing import Final, assert_never

from common.frame import Buffer
from common.protocol.chunking import Cutter, Joiner, Whole
from common.protocol.contact import Contact, News
from common.protocol.framing import Deframer, LinkEnd, Unit, UnitKind, unit_parts
from common.protocol.message import Lane

_NEVER: Final = 2**63 - 1

GAP_NS: Final = 1_000_000_000
"""A unit is written in one go. If the line is silent for this long in the middle of one, bytes were lost. A busy machine's stalls are shorter
(100 ms were not enough under a load of 5, nor 250 ms under a load of 17). Any bytes that come meanwhile also end the wait: they fill the unit."""


class Change(Enum):
    """Events other than packets: the peer was met, it has gone, or something came that is not a unit."""

    MET = 0
    PARTED = 1
    GARBAGE = 2


@dataclass(slots=True)
class DuplexCounts:
    """What went wrong so far.

    Attributes:
        garbage_bytes: bytes that belonged to no unit.
        broken: packets that had begun to arrive but lacked a chunk.
        abandoned: packets that were given up half sent.
    """

    garbage_bytes: int = 0
    broken: int = 0
    abandoned: int = 0


class Duplex:
    """One end of a line that may lose, add and spoil bytes.

    Attributes:
        joiner: holds what has come of a packet that is not whole.

    Args:
        side: which end.
        number: random, below 2^32.
        frame_bytes: size of the frames in which the line carries bytes; 1 if it has none.
    """

    def __init__(self, side: LinkEnd, number: int, frame_bytes: int = 1) -> None:
        self._side = side
        self._frame_bytes = frame_bytes
        self._contact = Contact(side, number)
        self._deframer = Deframer(side.peer)
        self._heard_ns = 0
        self._told_garbage_bytes = 0
        self._past = DuplexCounts()
        self._cutter = Cutter(side, frame_bytes)
        self.joiner = Joiner()

    @property
    def is_up(self) -> bool:
        """Whether the two ends have met."""
        return self._contact.is_up

    @property
    def number(self) -> int:
        """Number of the contact; each contact has a different one."""
        return self._contact.number

    @property
    def is_idle(self) -> bool:
        """Whether nothing is left to be written."""
        return self._cutter.is_idle

    @property
    def bytes_per_s(self) -> float:
        """The line's measured rate in the direction of sending; 0 while unknown."""
        return self._cutter.bytes_per_s

    @property
    def counts(self) -> DuplexCounts:
        """What went wrong so far."""
        broken, abandoned = self._past.broken + self.joiner.broken, self._past.abandoned + self._cutter.abandoned
        return DuplexCounts(self._deframer.garbage_bytes, broken, abandoned)

    @property
    def due_ns(self) -> int:
        """When `take` or `silence` must be called next even if nothing has happened; 2^63 - 1: never."""
        silence_ns = self._heard_ns + GAP_NS if self._deframer.partial else _NEVER
        return min(self._cutter.due_ns, self._contact.due_ns, silence_ns)

    def ready(self, lane: Lane) -> bool:
        """Whether a packet with a payload would be accepted now."""
        return self.is_up and self._cutter.ready(lane)

    def put(self, lane: Lane, header: bytes, payload: Buffer) -> bool:
        """Accept a packet for sending; return whether it was accepted."""
        return self.is_up and self._cutter.put(lane, header, payload)

    def feed(self, data: bytes, now_ns: int) -> list[Whole | Change]:
        """Handle received bytes.

        Args:
            data: what was read.
            now_ns: any steady clock, ns.

        Returns:
            Whole packets and changes, in order.
        """
        self._heard_ns = now_ns
        return self._accept(self._deframer.feed(data), now_ns)

    def silence(self, now_ns: int) -> list[Whole | Change]:
        """Record that there is nothing to read. After GAP_NS an incomplete unit is given up."""
        if not self._deframer.partial or now_ns - self._heard_ns < GAP_NS:
            return []
        return self._accept(self._deframer.give_up(), now_ns)

    def take(self, now_ns: int) -> bytes:
        """Return the next bytes to write; empty if there are none, or if enough is under way."""
        words = self._contact.words(now_ns)
        said = b"".join(part for unit in words for part in unit_parts(self._side, unit))
        return said + self._cutter.take(now_ns) if self.is_up else said

    def leave(self) -> None:
        """Say goodbye with the next bytes, ahead of what waits."""
        self._contact.leave()
        self._anew()

    def interrupt(self) -> bool:
        """Record that the line itself was lost and begins anew; return whether the two ends had met."""
        was_up = self.is_up
        self._contact.interrupt()
        self._deframer.reset()
        self._anew()
        return was_up

    def _anew(self) -> None:
        """Forget everything that belonged to the contact."""
        counts = self.counts
        self._past = DuplexCounts(0, counts.broken, counts.abandoned)
        self._cutter = Cutter(self._side, self._frame_bytes)
        self.joiner = Joiner()

    def _accept(self, units: list[Unit], now_ns: int) -> list[Whole | Change]:
        events: list[Whole | Change] = []
        for unit in units:
            if unit.kind is UnitKind.CONTACT:
                events += self._hear(unit)
            elif not self.is_up:
                self._contact.hear_stranger(now_ns)
            elif unit.kind is UnitKind.ACK:
                self._cutter.acknowledged(unit.number, now_ns)
            else:
                if unit.kind is UnitKind.FRAMES:
                    self._cutter.acknowledge(unit.number)
                whole = self.joiner.add(unit)
                if whole is not None:
                    events.append(whole)
        if self._deframer.garbage_bytes != self._told_garbage_bytes:
            self._told_garbage_bytes = self._deframer.garbage_bytes
            events.append(Change.GARBAGE)
        return events

    def _hear(self, unit: Unit) -> list[Whole | Change]:
        had_met = self.is_up
        news = self._contact.hear(bytes(unit.body))
        match news:
            case News.NONE:
                return []
            case News.MET:
                self._anew()
                return [Change.PARTED, Change.MET] if had_met else [Change.MET]
            case News.PARTED:
                self._anew()
                return [Change.PARTED]
            case _:
                assert_never(news)
