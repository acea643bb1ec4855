"""How many frames may be under way on a link at once, so that it is busy and none waits in it behind another. Sans-I/O, `now_ns` passed in.

A second frame under way is of use only where the link's delay, not its rate, keeps the board waiting; where the rate does, it queues behind the first one
in socket buffers and is a frame time older when it comes. The two cannot be told apart from one frame, but by trying: if a frame more under way makes
frames slower, they queue. With W under way, of which the swiftest of late took `base` and these take `transit`, W (1 - base / transit) frames
stand in a queue (Brakmo, Peterson, "TCP Vegas", IEEE JSAC 13(8), 1995, 3.2).

More is tried only while frames had to wait on the board for leave to go. A trial that fails is repeated after 10, 20, 40 … s.
"""

from typing import Final

MOST: Final = 4
"""Frames under way at most, however long the link: more would only be older."""

_QUEUED: Final = 0.6
"""So much of a frame in the queue is too much: 1 where the rate is the limit and a second frame was tried, 0 where it is not; sizes differ by a fifth."""

_SWIFT: Final = 4
"""A link is swift while a frame takes less than this part of a period: then it has come before the next one is grabbed."""

_WAITED: Final = 8
"""A frame waited for leave if it stood in the outbox for more than this part of a period."""

_LONGEST_NS: Final = 250_000_000
"""A frame that takes longer than this alone is held up by its bytes: radio links of all kinds and continents have less delay."""

_SMOOTH: Final = 4
_BASE_SPAN_NS: Final = 10_000_000_000
_TRIAL_NS: Final = 10_000_000_000
_MOST_TRIAL_NS: Final = 300_000_000_000


class Flow:
    """The frames under way on one link while it carries."""

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
        """How many frames may be under way."""
        return self._window

    def credit(self, outstanding: int, period_ns: int, paced_round_trip_ns: int | None = None) -> int:
        """How many frames beyond the last one that came the board may send now.

        Args:
            outstanding: frames that it may still send.
            period_ns: between two frames of the camera.
            paced_round_trip_ns: of a link that holds the next frame back itself, so that a newer one may take its place: it always has credit for
                that one too, and for as many more as its round trip is periods long, which echoes tell truly there, for they pass by the
                frames. None for other links.

        Returns:
            The number; 0: what was granted before is enough.
        """
        needed = self._window
        if paced_round_trip_ns is not None:
            needed = min(MOST, 1 + max(1, paced_round_trip_ns // period_ns))
        if outstanding >= needed:
            return 0
        # A swift link never has two frames under way, whatever the credit: then several are granted at once, which spares the
        # board most wake-ups (a fifth of its CPU time a frame, bench_link).
        is_swift = self._newest_ns is not None and self._newest_ns * _SWIFT < period_ns
        return MOST if is_swift else needed

    def arrived(self, transit_ns: int, waited_ns: int, period_ns: int, now_ns: int) -> None:
        """Take note of a frame.

        Args:
            transit_ns: how long it was under way; may be wrong by the clocks' uncertainty.
            waited_ns: how long it stood in the board's outbox.
            period_ns: between two frames of the camera.
            now_ns: host's clock, ns.
        """
        self._newest_ns = transit_ns
        transit_ns = max(1, transit_ns)
        self._keep_least(transit_ns, now_ns)
        self._arrivals += 1
        if self._arrivals <= self._window:
            self._transit_ns = transit_ns  # sent before the window was what it is
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

    def _keep_least(self, transit_ns: int, now_ns: int) -> None:
        """Keep the least transit of this span and the one before. While frames queue there is nothing to learn of an empty link."""
        if self._window == 1 and now_ns - self._base_since_ns >= _BASE_SPAN_NS:
            self._base_before_ns, self._base_ns, self._base_since_ns = self._base_ns, transit_ns, now_ns
        self._base_ns = min(self._base_ns or transit_ns, transit_ns)
