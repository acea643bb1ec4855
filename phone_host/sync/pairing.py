"""Who belongs to whom: frames of two free-running cameras, by their stamps on one clock. Pure, `now_ns` passed in.

Invariants: both queues are sorted by stamp; after every call no two heads could still be paired or given up; each frame leaves exactly once,
as half of a pair or as an orphan with its reason; pairs leave in the order of their stamps.

Wanted are most pairs, and among those the least sum of time skews. Two facts make that possible without seeing the end. Pairing the two oldest
frames whenever they are within tolerance, and else giving up the older one, never loses a pair (an exchange of partners in any other pairing gives
this one). And where each camera's frames are further apart than twice the tolerance, no frame has a choice of partners, so this is the optimum, at
once. Elsewhere the older head may be given up for its successor, if that is nearer to the other head and costs no pair: the other head's
own successor would be no partner of it. Successors that have not come are taken to come after one period, and waited for only where that
may gain something: one period of the slower camera at most.

Two cameras half a period apart could pair either way all the time; as giving up a frame for a nearer successor would cost a pair then, whatever
partner the stream began with (previous or next) stays. Only at a beginning (first frames, or after an outage), where the choice is free, the
nearer alignment is taken.
"""

from collections import deque
from dataclasses import dataclass
from enum import Enum
from typing import Final, Generic, TypeVar

B = TypeVar("B")
H = TypeVar("H")


_OUTAGE_FRAMES: Final = 3
"""So many frames in succession without partner are an outage, no single losses: a new beginning."""


class OrphanReason(Enum):
    """Why a frame found no partner."""

    NO_PARTNER = "no_partner"
    OUT_OF_ORDER = "out_of_order"
    EVICTED = "evicted"
    STREAM_ENDED = "stream_ended"
    CLOCK = "clock_in_doubt"


@dataclass(frozen=True, slots=True)
class PairingSettings:
    """What makes a pair.

    Attributes:
        tolerance_ns: greatest time skew of a pair, ns.
        board_period_ns: time between two frames of the board's camera, ns.
        host_period_ns: the same of the host's.
    """

    tolerance_ns: int
    board_period_ns: int
    host_period_ns: int


@dataclass(frozen=True, slots=True)
class Paired(Generic[B, H]):
    """Two frames that belong together; `time_skew_ns` = board's stamp - host's stamp."""

    board: B
    host: H
    time_skew_ns: int


@dataclass(frozen=True, slots=True)
class BoardOrphan(Generic[B]):
    """A frame of the board without partner."""

    frame: B
    reason: OrphanReason


@dataclass(frozen=True, slots=True)
class HostOrphan(Generic[H]):
    """A frame of the host without partner."""

    frame: H
    reason: OrphanReason


class _Choice(Enum):
    """What to do with two frames that are within tolerance."""

    PAIR = 0
    SKIP = 1
    WAIT = 2


Outcome = Paired[B, H] | BoardOrphan[B] | HostOrphan[H]


class Pairing(Generic[B, H]):
    """Pairs the nearest frames of two streams, in order.

    Args:
        settings: tolerance and periods.
    """

    def __init__(self, settings: PairingSettings) -> None:
        self._settings = settings
        self._board: deque[tuple[int, B]] = deque()
        self._host: deque[tuple[int, H]] = deque()
        self._last_board_ns = self._last_host_ns = -(2**63)
        self._undecided_since_ns: int | None = None
        self._aligned = False
        self._passed = 0

    @property
    def held_board(self) -> int:
        """Board frames that wait for a partner."""
        return len(self._board)

    @property
    def held_host(self) -> int:
        """Host frames that wait for a partner."""
        return len(self._host)

    def add_board(self, stamp_ns: int, frame: B, now_ns: int) -> list[Outcome[B, H]]:
        """Take a board frame with its stamp on the host's clock, ns."""
        if stamp_ns <= self._last_board_ns:
            return [BoardOrphan(frame, OrphanReason.OUT_OF_ORDER)]
        self._last_board_ns = stamp_ns
        self._board.append((stamp_ns, frame))
        return self.decide(now_ns)

    def add_host(self, stamp_ns: int, frame: H, now_ns: int) -> list[Outcome[B, H]]:
        """Take a host frame with its stamp, ns."""
        if stamp_ns <= self._last_host_ns:
            return [HostOrphan(frame, OrphanReason.OUT_OF_ORDER)]
        self._last_host_ns = stamp_ns
        self._host.append((stamp_ns, frame))
        return self.decide(now_ns)

    def decide(self, now_ns: int) -> list[Outcome[B, H]]:
        """Settle all that can be settled; also to be called when time has passed without a frame."""
        return self._settle(now_ns)

    def change(self, settings: PairingSettings, now_ns: int) -> list[Outcome[B, H]]:
        """Go by other periods and another tolerance from now on: a camera was set to another rate."""
        self._settings = settings
        self._undecided_since_ns = None
        return self.decide(now_ns)

    def evict_host(self, before_ns: int) -> list[Outcome[B, H]]:
        """Give up host frames older than this; no board frame that old can still come."""
        outcomes: list[Outcome[B, H]] = []
        while self._host and self._host[0][0] < before_ns:
            outcomes.append(HostOrphan(self._host.popleft()[1], OrphanReason.NO_PARTNER))
            self._undecided_since_ns = None
        return outcomes

    def evict_board(self, before_ns: int) -> list[Outcome[B, H]]:
        """Give up board frames older than this; no host frame that old can still come."""
        outcomes: list[Outcome[B, H]] = []
        while self._board and self._board[0][0] < before_ns:
            outcomes.append(BoardOrphan(self._board.popleft()[1], OrphanReason.NO_PARTNER))
            self._undecided_since_ns = None
        return outcomes

    def evict_oldest_host(self) -> list[Outcome[B, H]]:
        """Give up the oldest host frame because memory is short."""
        self._undecided_since_ns = None
        return [HostOrphan(self._host.popleft()[1], OrphanReason.EVICTED)] if self._host else []

    def evict_oldest_board(self) -> list[Outcome[B, H]]:
        """Give up the oldest board frame because memory is short."""
        self._undecided_since_ns = None
        return [BoardOrphan(self._board.popleft()[1], OrphanReason.EVICTED)] if self._board else []

    def restart(self, reason: OrphanReason) -> list[Outcome[B, H]]:
        """Give up all board frames and forget their last stamp: another board clock or session follows."""
        outcomes: list[Outcome[B, H]] = [BoardOrphan(frame, reason) for _, frame in self._board]
        self._board.clear()
        self._last_board_ns = -(2**63)
        self._undecided_since_ns = None
        self._aligned = False
        return outcomes

    def void(self) -> list[Outcome[B, H]]:
        """Give up all frames of both sides: one of the two clocks may have stood still, so that frames from before mean nothing to those that follow."""
        outcomes = self.restart(OrphanReason.CLOCK)
        outcomes += [HostOrphan(frame, OrphanReason.CLOCK) for _, frame in self._host]
        self._host.clear()
        return outcomes

    def finish(self) -> list[Outcome[B, H]]:
        """Pair what can be paired without waiting for better, then give up the rest: no frame will follow."""
        outcomes = self._settle(None)
        outcomes += self.restart(OrphanReason.STREAM_ENDED)
        outcomes += [HostOrphan(frame, OrphanReason.STREAM_ENDED) for _, frame in self._host]
        self._host.clear()
        return outcomes

    def _settle(self, now_ns: int | None) -> list[Outcome[B, H]]:
        """Settle the heads as long as that is possible; without a time nothing better is waited for."""
        outcomes: list[Outcome[B, H]] = []
        while self._board and self._host:
            skew_ns = self._board[0][0] - self._host[0][0]
            if abs(skew_ns) > self._settings.tolerance_ns:
                # Both streams only go on in time: the earlier head has been passed by.
                outcomes.append(self._pop_earlier(skew_ns))
                self._passed += 1
                self._aligned = self._aligned and self._passed < _OUTAGE_FRAMES
            else:
                choice = self._choice(skew_ns)
                if choice is _Choice.WAIT and now_ns is not None and not self._waited(now_ns):
                    return outcomes
                if choice is _Choice.SKIP:
                    outcomes.append(self._pop_earlier(skew_ns))
                else:
                    outcomes.append(Paired(self._board.popleft()[1], self._host.popleft()[1], skew_ns))
                    self._aligned, self._passed = True, 0
            self._undecided_since_ns = None
        return outcomes

    def _pop_earlier(self, skew_ns: int) -> Outcome[B, H]:
        if skew_ns < 0:
            return BoardOrphan(self._board.popleft()[1], OrphanReason.NO_PARTNER)
        return HostOrphan(self._host.popleft()[1], OrphanReason.NO_PARTNER)

    def _choice(self, skew_ns: int) -> "_Choice":
        """What to do with two heads within tolerance: whether the earlier one's successor would be a better partner of the later one."""
        board = (self._board, self._settings.board_period_ns)
        host = (self._host, self._settings.host_period_ns)
        (earlier, earlier_period_ns), (later, later_period_ns) = (board, host) if skew_ns < 0 else (host, board)
        successor_ns = earlier[1][0] if len(earlier) > 1 else earlier[0][0] + earlier_period_ns
        gain_ns = abs(skew_ns) - abs(successor_ns - later[0][0])
        if gain_ns <= 0:
            return _Choice.PAIR
        next_ns = later[1][0] if len(later) > 1 else later[0][0] + later_period_ns
        costs_a_pair = abs(next_ns - successor_ns) <= self._settings.tolerance_ns
        if costs_a_pair and self._aligned:
            return _Choice.PAIR
        return _Choice.SKIP if len(earlier) > 1 else _Choice.WAIT

    def _waited(self, now_ns: int) -> bool:
        """Whether the better partner has had its time: one period of the slower camera."""
        if self._undecided_since_ns is None:
            self._undecided_since_ns = now_ns
        return now_ns - self._undecided_since_ns >= max(self._settings.board_period_ns, self._settings.host_period_ns)
