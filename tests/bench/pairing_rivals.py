"""Rivals of the pairing, written from their published descriptions, for bench_pairing.

`ApproximateTime` of ROS message_filters for two streams follows wiki.ros.org/message_filters/ApproximateTime. Each
message is used once, and sets do not cross. The pivot is the later of the two heads. The smallest set that contains it
is output once that is proven, i.e. when the next message of the other stream is known to be no better; a later set must
be smaller by the age penalty, 0.1. The lower bound on the time between messages, 0 by default, may prove it earlier.
"""

from collections import deque

Pair = tuple[int, int]
Item = tuple[int, bool]
"""A stamp, and whether it is the board's."""


class ApproximateTime:
    """Two streams; the lower bound is the only parameter.

    Args:
        lower_bound_ns: least time between two messages of a stream.
    """

    _AGE_PENALTY = 0.1

    def __init__(self, lower_bound_ns: int = 0) -> None:
        self._lower_bound_ns = lower_bound_ns
        self._queues: dict[bool, deque[int]] = {True: deque(), False: deque()}

    def add(self, stamp_ns: int, *, from_board: bool) -> list[Pair]:
        """Add a message; returns the pairs that it proves, (board, host)."""
        self._queues[from_board].append(stamp_ns)
        pairs: list[Pair] = []
        while (pair := self._proven()) is not None:
            pairs.append(pair)
        return pairs

    def _proven(self) -> Pair | None:
        board, host = self._queues[True], self._queues[False]
        if not board or not host:
            return None
        pivot, other = (board, host) if board[0] >= host[0] else (host, board)
        pivot_ns = pivot[0]
        while len(other) > 1 and other[1] <= pivot_ns:
            other.popleft()
        known = len(other) > 1
        next_ns = other[1] if known else max(pivot_ns, other[0] + self._lower_bound_ns)
        earlier_is_best = (next_ns - pivot_ns) * (1 + self._AGE_PENALTY) >= pivot_ns - other[0]
        if not earlier_is_best and not known:
            return None
        if not earlier_is_best:
            other.popleft()
        pivot.popleft()
        partner_ns = other.popleft()
        return (pivot_ns, partner_ns) if pivot is board else (partner_ns, pivot_ns)


class Nearest:
    """The naive way: each board frame takes the nearest unused host frame received so far, if within the tolerance.

    Args:
        tolerance_ns: greatest time skew.
    """

    def __init__(self, tolerance_ns: int) -> None:
        self._tolerance_ns = tolerance_ns
        self._host: deque[int] = deque(maxlen=100)

    def add(self, stamp_ns: int, *, from_board: bool) -> list[Pair]:
        """Add a frame; returns the pair that it completes, (board, host)."""
        if not from_board:
            self._host.append(stamp_ns)
            return []
        near = min(self._host, key=lambda host: abs(host - stamp_ns), default=None)
        if near is None or abs(near - stamp_ns) > self._tolerance_ns:
            return []
        self._host.remove(near)
        return [(stamp_ns, near)]
