"""How many frames may be in flight on a link at once. Sans-I/O, `now_ns` passed in.

The link should be busy, but no frame should wait in it behind another. A second frame in flight helps only if the board
waits because of the link's delay. If the link's rate is the limit, the second frame queues behind the first in socket
buffers and is one frame time older on arrival. One frame alone cannot tell the two cases apart, so the host tries: if
one more frame in flight makes frames slower, they queue. With W frames in flight, a fastest recent transit time of
`base` and a present one of `transit`, W (1 - base / transit) frames are queued (Brakmo, Peterson, "TCP Vegas", IEEE
JSAC 13(8), 1995, 3.2).

More frames are tried only while frames had to wait on the board for credit. A failed trial is repeated after 10, 20,
40 … s.
"""

from typing import Final

MOST: Final = 4
"""Most frames in flight, however long the link's delay: more would only be older."""

_QUEUED: Final = 0.6
"""More queued frames than this are too many. With a second frame in flight, 1 frame is queued if the rate is the limit,
otherwise 0; frame sizes differ by a fifth."""

_SWIFT: Final = 4
"""A link is fast while a frame takes less than a period divided by this: it arrives before the next one is grabbed."""

_WAITED: Final = 8
"""A frame waited for credit if it was in the outbox for longer than a period divided by this."""

_LONGEST_NS: Final = 250_000_000
"""If a lone frame takes longer than this, the rate is the limit: all radio links and continents have less delay."""

_SMOOTH: Final = 4
_BASE_SPAN_NS: Final = 10_000_000_000
_TRIAL_NS: Final = 10_000_000_000
_MOST_TRIAL_NS: Final = 300_000_000_000


class Flow:
    """The frames in flight on one link while it is the carrier."""

    def __init__(self) -> None:
        self._window = 1
        self._arrivals = 0
        self._newest_ns: int | None = None
        self._base_ns = self._base_before_ns = 0
        self._base_since_ns = 0
        self._transit_ns = 0.0
        self._trial_ns = _TRIAL_NS
        self._no_trial_before_ns = 0

    @property
    def window(self) -> int:
        """How many frames may be in flight."""
        return self._window

    def credit(self, outstanding: int, period_ns: int, paced_round_trip_ns: int | None = None) -> int:
        """Return how many frames the board may now send beyond the last one that arrived.

        Args:
            outstanding: frames that the board may still send.
            period_ns: the camera's period.
            paced_round_trip_ns: the round trip of a self-paced link; None for other links. Such a link holds the next
                frame back so that a newer one may replace it. It always has credit for that frame, too, and for as many
                more as its round trip has periods. Echoes measure this round trip correctly because they bypass frames.

        Returns:
            The number of frames; 0 if the credit granted before is enough.
        """
        needed = self._window
        if paced_round_trip_ns is not None:
            needed = min(MOST, 1 + max(1, paced_round_trip_ns // period_ns))
        if outstanding >= needed:
            return 0
        # A fast link never has two frames in flight, whatever the credit. So grant several at once, which saves the
        # board most wake-ups (a fifth of its CPU time per frame, bench_link).
        is_swift = self._newest_ns is not None and self._newest_ns * _SWIFT < period_ns
        return MOST if is_swift else needed

    def arrived(self, transit_ns: int, waited_ns: int, period_ns: int, now_ns: int) -> None:
        """Take note of a frame.

        Args:
            transit_ns: its transit time; may be wrong by the clocks' uncertainty.
            waited_ns: how long it was in the board's outbox.
            period_ns: the camera's period.
            now_ns: host's clock, ns.
        """
        self._newest_ns = transit_ns
        transit_ns = max(1, transit_ns)
        if self._window == 1 and now_ns - self._base_since_ns >= _BASE_SPAN_NS:
            # Keep the least of this span and the previous one. A new span begins only with one frame in flight: queued
            # frames tell nothing about an empty link.
            self._base_before_ns, self._base_ns, self._base_since_ns = self._base_ns, transit_ns, now_ns
        self._base_ns = min(self._base_ns or transit_ns, transit_ns)
        self._arrivals += 1
        if self._arrivals <= self._window:
            self._transit_ns = transit_ns  # sent before the window changed
            return
        self._transit_ns += (transit_ns - self._transit_ns) / _SMOOTH
        base_ns = min(self._base_ns, self._base_before_ns or self._base_ns)
        queued = self._window * (1 - base_ns / self._transit_ns)
        if self._window > 1 and queued > _QUEUED:
            self._no_trial_before_ns, self._trial_ns = now_ns + self._trial_ns, min(_MOST_TRIAL_NS, 2 * self._trial_ns)
            self._change(-1)
        elif (
            self._window < MOST
            and base_ns < _LONGEST_NS
            and waited_ns * _WAITED > period_ns
            and now_ns >= self._no_trial_before_ns
        ):
            self._change(1)

    def _change(self, by: int) -> None:
        self._window += by
        self._arrivals = 0
