"""Limits how much may be under way on a line of unknown rate, by measuring acknowledgements. Sans-I/O, `now_ns` passed in.

The bound on unacknowledged bytes is rate x (least round trip + 10 ms) - the bytes of the unit with the least round trip (at most 5 ms'
worth). So what is written next waits at most about 10 ms behind what was written before. The bound is never below two chunks of 256
bytes, which keep a slow line busy.
The rate is the largest recent delivery rate. One sample is the bytes that arrived between a unit's writing and its acknowledgement, over
that time (Cheng et al., "Delivery Rate Estimation", draft-cheng-iccrg-delivery-rate-estimation-02). A busy line always holds a queue, so
the least round trip is measured again every ten seconds after letting the line run empty (BBR's ProbeRTT,
draft-cardwell-iccrg-bbr-congestion-control-02, 4.3.4). If acknowledgements repeatedly leave nothing under way although more waits to be
written, the line is not full: one of the two programs is seldom awake, or an adapter passes bytes on in bursts. Then the 10 ms grow until
the line no longer runs empty. The length of a tty's output queue is not used: drivers and adapters report less than they hold.
"""

from collections import deque
from dataclasses import dataclass
from typing import Final

from common.protocol.framing import MAX_BODY_BYTES, UNIT_OVERHEAD_BYTES

MS: Final = 1_000_000

MIN_CHUNK_BYTES: Final = 256
"""Small enough that waiting for two of them is bearable at 115200 baud (46 ms), large enough that their framing costs 4 %."""

_CHUNK_NS: Final = 2_500_000
"""A chunk takes this long on the line: a quarter of the slack, so that the line does not run empty between two acknowledgements."""

_SLACK_NS: Final = 10 * MS

_MOST_SLACK_NS: Final = 500 * MS
"""Round trips of 200 ms were seen between two programs on a board with six other busy ones, beside least round trips of 7 ms."""

_MOST_AHEAD_BYTES: Final = 256 * 1024
"""Upper limit of such a slack: less than the 640 KB that Linux holds for a tty (drivers/tty/tty_buffer.c) before it drops the rest."""

_RATE_SPAN_NS: Final = 1000 * MS
"""The rate is the largest in this span and the one before. When a line slows down, the rate follows within two seconds."""

_ROUND_TRIP_SPAN_NS: Final = 10_000 * MS

_FIRST_PATIENCE_NS: Final = 1000 * MS
_LEAST_PATIENCE_NS: Final = 200 * MS
_MOST_PATIENCE_NS: Final = 2000 * MS
"""Units under way are written off after this long without an acknowledgement (four round trips, within these limits)."""

_MOST_REMEMBERED: Final = 4096
_NUMBERS: Final = 1 << 16


@dataclass(slots=True, kw_only=True)
class _UnderWay:
    """A unit that was written, with the delivery state at that moment."""

    number: int
    size_bytes: int
    sent_ns: int
    delivered_bytes: int
    delivered_ns: int
    first_sent_ns: int
    alone: bool
    starved: bool
    counts: bool = True


class Window:
    """The bound on unacknowledged bytes of one direction of a line.

    Args:
        frame_bytes: size of the frames in which the line carries bytes (RFCOMM); units then fill whole frames or equal parts of one. 1: no frames.
    """

    def __init__(self, frame_bytes: int = 1) -> None:
        self._frame_bytes = frame_bytes
        self._least_unit_bytes = fill(MIN_CHUNK_BYTES + UNIT_OVERHEAD_BYTES, frame_bytes)
        self._under_way: deque[_UnderWay] = deque()
        self._under_way_bytes = 0
        self._delivered_bytes = 0
        self._delivered_ns = 0
        self._first_sent_ns = 0
        self._starved_until_bytes = 0
        self._rate_before = 0.0
        self._rate_now = 0.0
        self._rate_since_ns = 0
        self._round_trip_ns = 0
        self._round_trip_bytes = 0
        self._round_trip_at_ns = 0
        self._smooth_ns = 0
        self._probing = False
        self._slack_ns = _SLACK_NS
        self._ran_empty = False
        self._progress_ns = 0
        self._backoff = 1

    @property
    def bytes_per_s(self) -> float:
        """The line's measured rate; 0 while unknown."""
        return max(self._rate_before, self._rate_now) * 1e9

    @property
    def chunk_bytes(self) -> int:
        """How large a chunk's body should be now."""
        body = min(MAX_BODY_BYTES, max(MIN_CHUNK_BYTES, int(max(self._rate_before, self._rate_now) * _CHUNK_NS)))
        return fill(body + UNIT_OVERHEAD_BYTES, self._frame_bytes) - UNIT_OVERHEAD_BYTES

    @property
    def limit_bytes(self) -> int:
        """How many bytes may be under way now."""
        if self._probing:
            return 1
        rate, least_bytes = max(self._rate_before, self._rate_now), self._least_unit_bytes
        if self._backoff > 1 or not rate:
            return 2 * least_bytes
        own_bytes = min(self._round_trip_bytes, rate * _SLACK_NS / 2)
        limit = int(rate * (self._round_trip_ns + _SLACK_NS) - own_bytes)
        more = int(rate * (self._slack_ns - _SLACK_NS))
        limit = max(2 * least_bytes, limit, min(limit + more, _MOST_AHEAD_BYTES))
        # On a slow line the slack is less than a chunk. Unless a whole chunk more than is known to fit may leave, a higher rate is never seen.
        return limit if self.chunk_bytes + UNIT_OVERHEAD_BYTES > least_bytes else -(-limit // least_bytes) * least_bytes

    def has_room(self, size_bytes: int) -> bool:
        """Whether a unit of this size may be written now."""
        return not self._under_way_bytes or self._under_way_bytes + size_bytes <= self.limit_bytes

    def starved(self) -> None:
        """Record that there was room but nothing to write: rates measured from what is under way may be too small."""
        self._starved_until_bytes = self._delivered_bytes + self._under_way_bytes

    def sent(self, number: int, size_bytes: int, now_ns: int) -> None:
        """Record that a unit is being written.

        Args:
            number: the unit's number.
            size_bytes: its size on the wire.
            now_ns: any steady clock, ns.
        """
        alone = not self._under_way_bytes
        if alone:
            self._first_sent_ns = self._delivered_ns = self._progress_ns = now_ns
        self._under_way_bytes += size_bytes
        starved = self._delivered_bytes < self._starved_until_bytes
        self._under_way.append(
            _UnderWay(
                number=number,
                size_bytes=size_bytes,
                sent_ns=now_ns,
                delivered_bytes=self._delivered_bytes,
                delivered_ns=self._delivered_ns,
                first_sent_ns=self._first_sent_ns,
                alone=alone,
                starved=starved,
            )
        )
        if len(self._under_way) > _MOST_REMEMBERED:
            self._forget(self._under_way.popleft())

    def acknowledged(self, number: int, now_ns: int) -> bool:
        """Record that a unit has arrived; this also settles the fate of all units before it.

        Args:
            number: the unit's number; one that is not under way is ignored.
            now_ns: any steady clock, ns.

        Returns:
            Whether it was under way.
        """
        if not self._under_way or (number - self._under_way[0].number) % _NUMBERS >= len(self._under_way):
            return False
        while True:
            unit = self._under_way.popleft()
            self._forget(unit)
            self._delivered_bytes += unit.size_bytes
            if unit.number == number:
                break
        self._delivered_ns = self._progress_ns = now_ns
        self._backoff = 1
        self._first_sent_ns = unit.sent_ns
        self._learn(unit, now_ns)
        self._adapt_slack()
        return True

    def tick(self, now_ns: int) -> None:
        """Do what is due: write off unacknowledged units, or let the line run empty to measure its round trip."""
        if self._under_way_bytes and now_ns >= self.due_ns:
            for unit in self._under_way:
                unit.counts = False
            self._under_way_bytes = 0
            self._backoff = min(self._backoff * 2, 16)
        if self._round_trip_ns and now_ns - self._round_trip_at_ns >= _ROUND_TRIP_SPAN_NS:
            self._probing = True

    @property
    def due_ns(self) -> int:
        """When units under way are to be written off; 2^63 - 1 while there are none."""
        if not self._under_way_bytes:
            return 2**63 - 1
        patience = 4 * self._smooth_ns if self._smooth_ns else _FIRST_PATIENCE_NS
        patience = min(_MOST_PATIENCE_NS, max(_LEAST_PATIENCE_NS, patience) * self._backoff)
        return self._progress_ns + patience

    def _forget(self, unit: _UnderWay) -> None:
        if unit.counts:
            self._under_way_bytes -= unit.size_bytes

    def _adapt_slack(self) -> None:
        """Allow more under way once two acknowledgements in a row have left the line empty because of the bound."""
        if self._under_way_bytes:
            self._ran_empty = False
            self._slack_ns -= (self._slack_ns - _SLACK_NS) // 8
        elif not self._probing and self._delivered_bytes > self._starved_until_bytes:
            if self._ran_empty:
                self._slack_ns = min(self._slack_ns * 5 // 4, _MOST_SLACK_NS)
            self._ran_empty = True

    def _learn(self, unit: _UnderWay, now_ns: int) -> None:
        round_trip_ns = max(1, now_ns - unit.sent_ns)
        self._smooth_ns = (7 * self._smooth_ns + round_trip_ns) // 8 if self._smooth_ns else round_trip_ns
        stale = self._probing and unit.alone
        if not self._round_trip_ns or round_trip_ns <= self._round_trip_ns or stale:
            self._round_trip_ns, self._round_trip_bytes, self._round_trip_at_ns = round_trip_ns, unit.size_bytes, now_ns
            self._probing = False
        took_ns = max(unit.sent_ns - unit.first_sent_ns, now_ns - unit.delivered_ns)
        if took_ns < self._round_trip_ns:
            return  # acknowledgements that came in a burst
        rate = (self._delivered_bytes - unit.delivered_bytes) / took_ns
        if unit.starved and rate <= max(self._rate_before, self._rate_now):
            return
        if now_ns - self._rate_since_ns >= _RATE_SPAN_NS:
            self._rate_before, self._rate_now, self._rate_since_ns = self._rate_now, 0.0, now_ns
        self._rate_now = max(self._rate_now, rate)


def fill(unit_bytes: int, frame_bytes: int) -> int:
    """Return the size of a unit that leaves no frame half full.

    Args:
        unit_bytes: the desired size.
        frame_bytes: what one frame of the line carries.

    Returns:
        A multiple of the frame, at most `unit_bytes`. For less than a frame: the next larger equal part of one.
    """
    return unit_bytes // frame_bytes * frame_bytes or frame_bytes // (frame_bytes // unit_bytes)
