"""Two ends of a line in virtual time, with a rate, a delay, and a way to corrupt bytes. Nothing sleeps; the same seed gives the same run."""

import heapq
from collections.abc import Callable
from dataclasses import dataclass, field

from common.protocol.chunking import Whole
from common.protocol.duplex import Change, Duplex
from common.protocol.framing import LinkEnd

Spoil = Callable[[bytes], bytes]

_GRAIN_BYTES = 16
_GRAIN_NS = 250_000
"""A line passes data on after this many bytes or this much time."""


@dataclass(slots=True)
class Way:
    """One direction.

    Attributes:
        bytes_per_s: how fast bytes leave; bytes that have not left wait in an unlimited queue.
        delay_ns: from leaving to arriving.
        spoil: what happens to the bytes on the way.
        chop: gives the number of bytes that arrive at once; by default what leaves in 250 us, but at least 16.
        nap_ns: the reader wakes only at this interval.
    """

    bytes_per_s: float
    delay_ns: int
    spoil: Spoil = bytes
    chop: Callable[[], int] | None = None
    nap_ns: int = 1
    free_ns: int = 0


@dataclass(slots=True)
class VirtualLine:
    """Both ends and the line between them.

    Attributes:
        ends: dialler and listener.
        ways: from each end to the other.
        came: what each end was told, with its time.
        now_ns: virtual time.
    """

    ends: dict[LinkEnd, Duplex]
    ways: dict[LinkEnd, Way]
    came: dict[LinkEnd, list[tuple[int, Whole | Change]]] = field(
        default_factory=lambda: {side: [] for side in LinkEnd}
    )
    now_ns: int = 1
    _arrivals: list[tuple[int, int, LinkEnd, bytes]] = field(default_factory=list)
    _count: int = 0

    @classmethod
    def of(cls, bytes_per_s: float, delay_ns: int, spoil: Spoil = bytes, frame_bytes: int = 1) -> "VirtualLine":
        """A line with two equal directions."""
        ends = {side: Duplex(side, 17, frame_bytes) for side in LinkEnd}
        return cls(ends, {side: Way(bytes_per_s, delay_ns, spoil) for side in LinkEnd})

    def write(self) -> None:
        """Let both ends write what they have."""
        for side, end in self.ends.items():
            way = self.ways[side]
            while data := end.take(self.now_ns):
                way.free_ns = max(way.free_ns, self.now_ns)
                step = max(_GRAIN_BYTES, int(way.bytes_per_s * _GRAIN_NS / 1e9))
                while data:
                    size = way.chop() if way.chop is not None else step
                    grain, data = data[:size], data[size:]
                    way.free_ns += round(len(grain) / way.bytes_per_s * 1e9)
                    self._count += 1
                    at_ns = -(-(way.free_ns + way.delay_ns) // way.nap_ns) * way.nap_ns
                    arrival = (at_ns, self._count, side.peer, way.spoil(grain))
                    heapq.heappush(self._arrivals, arrival)

    def run(self, until_ns: int, act: Callable[["VirtualLine"], None] = lambda _: None) -> None:
        """Let time pass; `act` is called after every event."""
        act(self)
        self.write()
        while self.now_ns < until_ns:
            due = min(end.due_ns for end in self.ends.values())
            arrival = self._arrivals[0][0] if self._arrivals else until_ns
            self.now_ns = max(self.now_ns, min(until_ns, arrival, max(due, self.now_ns + 1000)))
            while self._arrivals and self._arrivals[0][0] <= self.now_ns:
                _, _, side, data = heapq.heappop(self._arrivals)
                if events := self.ends[side].feed(data, self.now_ns):
                    self._note(side, events)
            for side, end in self.ends.items():
                if changes := end.silence(self.now_ns):
                    self._note(side, changes)
            act(self)
            self.write()

    def meet(self) -> None:
        """Let the two ends meet."""
        while not all(end.is_up for end in self.ends.values()):
            self.run(self.now_ns + 10_000_000)

    def packets(self, side: LinkEnd) -> list[Whole]:
        """The packets received by an end."""
        return [event for _, event in self.came[side] if isinstance(event, Whole)]

    def _note(self, side: LinkEnd, events: list[Whole | Change]) -> None:
        self.came[side] += [(self.now_ns, event) for event in events]
