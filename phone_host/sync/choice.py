"""Which of several links is to carry the frames: the one over which they are youngest when they come. Sans-I/O, `now_ns` passed in.

The age of a frame over a link is half of the round trip now and what a frame takes beyond it there, measured while the link carried. A link that has
not carried yet, or long ago, is taken to be as good as its round trip: trying it costs a frame, not trying it could cost every one. While a
frame is owed (there is credit, the board goes on grabbing, nothing comes) the carrier's age grows with the waiting, so a link
whose frames are stuck gives way like a slow one.

Against flapping: the links stand in an order of preference. One that is preferred takes over if it is about as good (20 % and 8 ms), any other only if
it is better by 30 % and 12 ms; what lies between changes nothing. Both must hold for a second, and for twice as long each time that a link failed while
it carried.
"""

from collections import deque
from dataclasses import dataclass, field
from typing import Final

_MS: Final = 1_000_000

PROOF_NS: Final = 1000 * _MS
"""So long a link must be up and better before it takes over: a wave of echoes a second tells."""

MOST_PROOF_NS: Final = 60_000 * _MS
"""A link that breaks again and again is tried once a minute."""

MEMORY_NS: Final = 10_000 * _MS
MOST_MEMORY_NS: Final = 300_000 * _MS
"""What a frame took is forgotten after 10, 20, 40 … 300 s, as other trials of a link are repeated (flow.py): one stall of a busy machine must not keep
a good link out for minutes, a slow one must not be tried all the time."""

_AS_GOOD: Final = 1.2
_AS_GOOD_NS: Final = 8 * _MS
"""A quarter of a frame period at 30 per second: below that the order that the user gave says more than a measurement on a busy machine."""

_BETTER: Final = 0.7
_BETTER_NS: Final = 12 * _MS
"""So that there is a gap: what is given up at 1.43 a + 17 ms beside an age of a is taken back at 1.2 a + 8 ms."""

_ECHOES: Final = 6
"""The round trip now is the least of so many: two waves."""

_UNHEARD_NS: Final = 2500 * _MS
"""A link whose echoes fail to come for this long, two waves of a standby, is not one to change to."""

_SMOOTH: Final = 8


@dataclass(slots=True)
class _Known:
    """What is known of one link.

    Attributes:
        up_since_ns: since when it is up; None while it is not.
        proof_ns: how long it must be up and better.
        round_trips_ns: of the newest echoes.
        heard_ns: when the newest came.
        least_ns: least round trip since it came up.
        frame_ns: transit of a frame, smoothed; None before it carried.
        measured_ns: when that was.
        memory_ns: how long that is remembered.
        better_since_ns: since when it is better than the carrier.
    """

    up_since_ns: int | None = None
    proof_ns: int = PROOF_NS
    round_trips_ns: deque[int] = field(default_factory=lambda: deque(maxlen=_ECHOES))
    heard_ns: int = 0
    least_ns: int = 0
    frame_ns: float | None = None
    measured_ns: int = 0
    memory_ns: int = MEMORY_NS
    better_since_ns: int | None = None

    def is_forgotten(self, now_ns: int) -> bool:
        """Whether it is too long ago that frames came over this link."""
        return now_ns - self.measured_ns > self.memory_ns


class LinkChoice:
    """Chooses among links in their order of preference.

    Args:
        links: how many.
    """

    def __init__(self, links: int) -> None:
        self._known = [_Known() for _ in range(links)]
        self._carrier: int | None = None
        self._carries_since_ns = 0
        self._owed_since_ns: int | None = None
        self._grabbed = 0

    def up(self, link: int, now_ns: int) -> None:
        """Take note that a link is up."""
        self._known[link] = _Known(now_ns, self._known[link].proof_ns)

    def down(self, link: int, now_ns: int) -> None:
        """Take note that a link was lost."""
        known = self._known[link]
        if link == self._carrier:
            self._failed(known, now_ns)
            self._carrier = None
        known.up_since_ns = known.better_since_ns = None

    def carries(self, link: int, now_ns: int) -> None:
        """Take note that frames come over that link from now on."""
        if link == self._carrier:
            return
        if self._carrier is not None:
            before = self._known[self._carrier]
            if self._owed_since_ns is not None:
                self._failed(before, now_ns)
            lasted = now_ns - self._carries_since_ns >= before.memory_ns
            before.memory_ns = MEMORY_NS if lasted else min(MOST_MEMORY_NS, 2 * before.memory_ns)
        self._owed_since_ns = None
        self._carrier, self._carries_since_ns = link, now_ns
        for known in self._known:
            known.better_since_ns = None

    def echo(self, link: int, round_trip_ns: int, now_ns: int) -> None:
        """Take an echo's round trip."""
        known = self._known[link]
        known.heard_ns = now_ns
        known.round_trips_ns.append(round_trip_ns)
        known.least_ns = min(known.least_ns or round_trip_ns, round_trip_ns)

    def frame(self, link: int, transit_ns: int, now_ns: int) -> None:
        """Take how long a frame was under way."""
        known = self._known[link]
        before = transit_ns if known.frame_ns is None or known.is_forgotten(now_ns) else known.frame_ns
        known.frame_ns = before + (transit_ns - before) / _SMOOTH
        known.measured_ns = now_ns
        if link == self._carrier:
            self._owed_since_ns = None

    def account(self, grabbed: int, now_ns: int, *, has_credit: bool) -> None:
        """Take the board's account.

        Args:
            grabbed: frames that it has grabbed so far.
            now_ns: host's clock, ns.
            has_credit: whether the board has leave to send one.
        """
        if grabbed > self._grabbed and has_credit and self._owed_since_ns is None:
            self._owed_since_ns = now_ns
        self._grabbed = grabbed

    def age_ns(self, link: int, now_ns: int) -> float:
        """How old a frame is expected to be when it has come over a link; infinite while it is not up."""
        known = self._known[link]
        if known.up_since_ns is None or not known.round_trips_ns or now_ns - known.heard_ns > _UNHEARD_NS:
            return float("inf")
        owed_ns = now_ns - self._owed_since_ns if link == self._carrier and self._owed_since_ns is not None else 0
        if known.frame_ns is None or known.is_forgotten(now_ns):
            return max(min(known.round_trips_ns) / 2, owed_ns)
        if link == self._carrier:
            return max(known.frame_ns, owed_ns)
        return known.frame_ns + (min(known.round_trips_ns) - known.least_ns) / 2

    def best(self, now_ns: int) -> int | None:
        """Give the link that is to carry the frames; None: leave it as it is."""
        carrier = self._carrier
        if carrier is None:
            return None
        mine_ns = self.age_ns(carrier, now_ns)
        found: tuple[float, int] | None = None
        for link, known in enumerate(self._known):
            if link == carrier or known.up_since_ns is None:
                continue
            age_ns = self.age_ns(link, now_ns)
            as_good, better = age_ns <= _AS_GOOD * mine_ns + _AS_GOOD_NS, age_ns < _BETTER * mine_ns - _BETTER_NS
            if not (as_good if link < carrier else better):
                known.better_since_ns = None
                continue
            if known.better_since_ns is None:
                known.better_since_ns = now_ns
            since_ns = max(known.better_since_ns, known.up_since_ns)
            if now_ns - since_ns >= known.proof_ns and (found is None or age_ns < found[0]):
                found = (age_ns, link)
        return None if found is None else found[1]

    def _failed(self, known: _Known, now_ns: int) -> None:
        """The carrier was lost, or frames did not come: it has to prove itself for longer, and what it took before means nothing."""
        lasted = now_ns - self._carries_since_ns >= MOST_PROOF_NS
        known.proof_ns = PROOF_NS if lasted else min(MOST_PROOF_NS, 2 * known.proof_ns)
        known.frame_ns = None
