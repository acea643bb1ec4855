"""Pairs the frames of two free-running cameras by their stamps on one clock. Pure, `now_ns` passed in.

Invariants: both queues are sorted by stamp. After every call, no two heads could still be paired or given up. Each
frame leaves exactly once, as half of a pair or as an orphan with its reason. Pairs leave in the order of their stamps.

The aim is the greatest number of pairs and, among those solutions, the least sum of time skews. Two facts allow this
without knowing later frames. First, pairing the two oldest frames whenever they are within tolerance, and otherwise
giving up the older one, never loses a pair (exchanging partners turns any other pairing into this one). Second, if each
camera's frames are more than twice the tolerance apart, no frame has a choice of partners, so this is optimal at once.
Otherwise the older head may be given up for its successor if the successor is nearer to the other head and this costs
no pair, i.e. the other head's own successor could not be the successor's partner. A successor that has not arrived is
expected one period after its predecessor. Pairing waits for it only if it may help, for one period of the slower camera
at most.

Two cameras half a period apart could always pair either way. Giving up a frame for a nearer successor would then cost a
pair, so the stream keeps the alignment that it began with (previous or next). Only at a beginning (first frames, or
after an outage) is the choice free; then the nearer alignment is taken.
"""

from collections import deque
from dataclasses import dataclass
from enum import Enum
from typing import Final, Generic, TypeVar

B = TypeVar("B")
H = TypeVar("H")


_OUTAGE_FRAMES: Final = 3
"""This many successive frames without a partner are an outage, not single losses: the alignment is chosen anew."""


class OrphanReason(Enum):
    """Why a frame found no partner."""

    NO_PARTNER = "no_partner"
    OUT_OF_ORDER = "out_of_order"
    EVICTED = "evicted"
    STREAM_ENDED = "stream_ended"
    CLOCK = "clock_in_doubt"
    NO_SUCH_NUMBER = "no_image_of_that_number"


@dataclass(frozen=True, slots=True)
class PairingSettings:
    """The tolerance and the cameras' periods.

    Attributes:
        tolerance_ns: greatest time skew of a pair, ns.
        board_period_ns: time between two frames of the board's camera, ns.
        host_period_ns: the same for the host's camera.
    """

    tolerance_ns: int
    board_period_ns: int
    host_period_ns: int


@dataclass(frozen=True, slots=True)
class Paired(Generic[B, H]):
    """Two frames that belong together. `time_skew_ns` = board's stamp - host's stamp."""

    board: B
    host: H
    time_skew_ns: int


@dataclass(frozen=True, slots=True)
class BoardOrphan(Generic[B]):
    """A board frame without a partner."""

    frame: B
    reason: OrphanReason


@dataclass(frozen=True, slots=True)
class HostOrphan(Generic[H]):
    """A host frame without a partner."""

    frame: H
    reason: OrphanReason


class _Choice(Enum):
    """What to do with two frames that are within tolerance."""

    PAIR = 0
    SKIP = 1
    WAIT = 2


Outcome = Paired[B, H] | BoardOrphan[B] | HostOrphan[H]


class Pairing(Generic[B, H]):
    """Pairs the nearest frames of two streams, in order."""

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
        """Settle everything that can be settled. Call this also when time has passed without a frame."""
        return self._settle(now_ns)

    def change(self, settings: PairingSettings, now_ns: int) -> list[Outcome[B, H]]:
        """Use other periods and another tolerance from now on, because a camera's rate was changed."""
        self._settings = settings
        self._undecided_since_ns = None
        return self.decide(now_ns)

    def evict_host(self, before_ns: int) -> list[Outcome[B, H]]:
        """Give up host frames older than `before_ns`: no board frame that old can still come."""
        outcomes: list[Outcome[B, H]] = []
        while self._host and self._host[0][0] < before_ns:
            outcomes.append(HostOrphan(self._host.popleft()[1], OrphanReason.NO_PARTNER))
            self._undecided_since_ns = None
        return outcomes

    def evict_board(self, before_ns: int) -> list[Outcome[B, H]]:
        """Give up board frames older than `before_ns`: no host frame that old can still come."""
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
        """Give up all board frames and forget their last stamp, because another board clock or session follows."""
        outcomes: list[Outcome[B, H]] = [BoardOrphan(frame, reason) for _, frame in self._board]
        self._board.clear()
        self._last_board_ns = -(2**63)
        self._undecided_since_ns = None
        self._aligned = False
        return outcomes

    def void(self) -> list[Outcome[B, H]]:
        """Give up all frames of both sides.

        One of the two clocks may have stood still, so earlier frames cannot be compared with later ones.
        """
        outcomes = self.restart(OrphanReason.CLOCK)
        outcomes += [HostOrphan(frame, OrphanReason.CLOCK) for _, frame in self._host]
        self._host.clear()
        return outcomes

    def finish(self) -> list[Outcome[B, H]]:
        """No frame will follow: pair what can be paired without waiting for better partners, then give up the rest."""
        outcomes = self._settle(None)
        outcomes += self.restart(OrphanReason.STREAM_ENDED)
        outcomes += [HostOrphan(frame, OrphanReason.STREAM_ENDED) for _, frame in self._host]
        self._host.clear()
        return outcomes

    def _settle(self, now_ns: int | None) -> list[Outcome[B, H]]:
        """Settle the heads as long as possible. If `now_ns` is None, do not wait for better partners."""
        outcomes: list[Outcome[B, H]] = []
        while self._board and self._host:
            skew_ns = self._board[0][0] - self._host[0][0]
            if abs(skew_ns) > self._settings.tolerance_ns:
                # Both streams only move forward in time, so the earlier head can find no partner any more.
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
        """Decide about two heads within tolerance: is the earlier one's successor a better partner of the later one?"""
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
        """Return whether the wait for the better partner is over: one period of the slower camera."""
        if self._undecided_since_ns is None:
            self._undecided_since_ns = now_ns
        return now_ns - self._undecided_since_ns >= max(self._settings.board_period_ns, self._settings.host_period_ns)
