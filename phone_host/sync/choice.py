"""Chooses the carrier among several links: the one whose frames are youngest on arrival. Sans-I/O, `now_ns` passed in.

The expected age of a frame over a link is half of the present round trip plus the additional transit time of a frame,
measured while the link was the carrier. A link that has never carried, or not recently, is assumed to be as good as its
round trip: trying it costs one frame, but not trying it could cost on every frame. A frame is owed while there is
credit and the board goes on grabbing but nothing comes. The carrier's age then grows with the wait, so a link whose
frames are stuck is replaced like a slow one.

To avoid flapping, the links have an order of preference. A preferred link takes over if it is about as good (within
20 % and 8 ms), any other only if it is better by 30 % and 12 ms. In between, nothing changes. The condition must hold
for one second; this time doubles each time that a link fails while it is the carrier.
"""

from collections import deque
from dataclasses import dataclass, field
from typing import Final

_MS: Final = 1_000_000

PROOF_NS: Final = 1000 * _MS
"""A link must be up and better for this long before it takes over. One wave of echoes a second is enough to tell."""

MOST_PROOF_NS: Final = 60_000 * _MS
"""A link that keeps failing is tried once a minute."""

MEMORY_NS: Final = 10_000 * _MS
MOST_MEMORY_NS: Final = 300_000 * _MS
"""A frame's transit time is forgotten after 10, 20, 40 … 300 s, the intervals of other trials of a link (flow.py).

One stall of a busy machine must not keep a good link out for minutes, and a slow link must not be tried all the
time."""

_AS_GOOD: Final = 1.2
_AS_GOOD_NS: Final = 8 * _MS
"""A quarter of a period at 30 fps. Below that, the user's order says more than a measurement on a busy machine."""

_BETTER: Final = 0.7
_BETTER_NS: Final = 12 * _MS
"""Leaves a gap: beside a link of age a, a preferred one is given up at 1.43 a + 17 ms, taken back at 1.2 a + 8 ms."""

_ECHOES: Final = 6
"""The present round trip is the least of this many echoes: two waves."""

_UNHEARD_NS: Final = 2500 * _MS
"""A link without echoes for this long, two waves of a standby, is not chosen."""

_SMOOTH: Final = 8


@dataclass(slots=True)
class _Known:
    """What is known of one link.

    Attributes:
        up_since_ns: when it came up; None while it is not up.
        proof_ns: how long it must be up and better.
        round_trips_ns: round trips of the newest echoes.
        heard_ns: when the newest echo came.
        least_ns: least round trip since it came up.
        frame_ns: smoothed transit time of a frame; None before it carried any.
        measured_ns: when `frame_ns` was last measured.
        memory_ns: how long `frame_ns` is remembered.
        better_since_ns: since when it has been better than the carrier; None while it is not.
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
        """Return whether the last frame over this link came too long ago."""
        return now_ns - self.measured_ns > self.memory_ns


class LinkChoice:
    """Chooses among links in their order of preference."""

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
        """Take note that this link is the carrier from now on."""
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
        """Take note of an echo's round trip."""
        known = self._known[link]
        known.heard_ns = now_ns
        known.round_trips_ns.append(round_trip_ns)
        known.least_ns = min(known.least_ns or round_trip_ns, round_trip_ns)

    def frame(self, link: int, transit_ns: int, now_ns: int) -> None:
        """Take note of a frame's transit time."""
        known = self._known[link]
        before = transit_ns if known.frame_ns is None or known.is_forgotten(now_ns) else known.frame_ns
        known.frame_ns = before + (transit_ns - before) / _SMOOTH
        known.measured_ns = now_ns
        if link == self._carrier:
            self._owed_since_ns = None

    def account(self, grabbed: int, now_ns: int, *, has_credit: bool) -> None:
        """Take note of the board's account.

        Args:
            grabbed: number of frames that the board has grabbed so far.
            now_ns: host's clock, ns.
            has_credit: whether the board has credit for a frame.
        """
        if grabbed > self._grabbed and has_credit and self._owed_since_ns is None:
            self._owed_since_ns = now_ns
        self._grabbed = grabbed

    def age_ns(self, link: int, now_ns: int) -> float:
        """Return the expected age of a frame on arrival over a link, ns. Infinite if the link is down or silent."""
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
        """Return the link that should become the carrier; None: keep the present one."""
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
        """Handle a carrier that was lost or whose frames did not come.

        It must prove itself for longer next time, and its earlier transit times no longer count.
        """
        lasted = now_ns - self._carries_since_ns >= MOST_PROOF_NS
        known.proof_ns = PROOF_NS if lasted else min(MOST_PROOF_NS, 2 * known.proof_ns)
        known.frame_ns = None
