"""Pairs photographs: which image of this machine belongs to an image of the board, by the numbers in their names. Pure.

Both sides show stills on demand. The board shows its images in the order of their numbers, one for each credit, and
tells in its hello how many there are, and the first and the last number. The host asks its own camera for the image of
the same number. If one side's names do not number its images, or the board does not tell (an older one), the images are
paired in their order, as those of `stereo` and `calibrate`.

The board's number follows from the frame's sequence: one frame for each image. If numbers are missing on its side, it
follows from the frame's label, first + (number - first number) x period. Then the label of the very first image must be
known; a host that comes too late for it pairs by order. Where the numbers are times, the label is the number itself,
modulo 2**59. Times that each camera has stamped itself are not the same on both sides; then, too, the order pairs.
"""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Generic, TypeVar

from common.camera.image_numbers import TIMES_RING, ImageNumbers
from phone_host.sync.pairing import BoardOrphan, HostOrphan, OrphanReason, Outcome, Paired, PairingSettings

B = TypeVar("B")
H = TypeVar("H")


class PairedBy(Enum):
    """What says which two images belong together."""

    TIME = "time"
    NUMBER = "number"
    ORDER = "order"


class WhyOrder(Enum):
    """Why stills are paired in their order.

    UNKNOWN: the names of one side do not number its images, or the board does not tell the numbers. OTHER: both sides
    are numbered, by times or in ways that have nothing in common. LATE: the board's first images were shown to nobody.
    """

    UNKNOWN = "unknown"
    OTHER = "other"
    LATE = "late"


@dataclass(frozen=True, slots=True)
class PassedOver:
    """Own images that stay without a partner, because later ones were asked for, or none.

    Attributes:
        alone: the board has no image of their number.
        unsent: the board has one but did not send it, or it was lost on the link.
        numbers: those of the images that are alone; empty if the order pairs.
    """

    alone: int = 0
    unsent: int = 0
    numbers: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True)
class Wanted:
    """The partner of a board image.

    Attributes:
        index: index of the own image to show, over all laps; None: there is no image of that number.
        passed: own images that now stay without a partner.
        number: the number of a board image that has no partner; None if it has one, or its number is not known.
    """

    index: int | None
    passed: PassedOver = PassedOver()
    number: int | None = None


class Stills:
    """Knows which own image belongs to each board image of a session.

    Args:
        own: this machine's images.
        numbers: their numbers, ascending; empty if their names do not number them.
    """

    def __init__(self, own: ImageNumbers, numbers: Sequence[int]) -> None:
        self.own = own
        self.board: ImageNumbers | None = None
        self._numbers = tuple(numbers)
        self._positions = {number: position for position, number in enumerate(self._numbers)}
        self._period_ns = 1
        self._first_label_ns: int | None = None
        self._is_late = False
        self._next = 0

    @property
    def paired_by(self) -> PairedBy:
        """What says which images belong together."""
        return PairedBy.NUMBER if self.why_order is None else PairedBy.ORDER

    @property
    def why_order(self) -> WhyOrder | None:
        """Why images are paired in their order; None if their numbers pair them."""
        board = self.board
        if not self._numbers or board is None or board.first is None:
            return WhyOrder.UNKNOWN
        if self._is_late:
            return WhyOrder.LATE
        if not board.are_times and not self.own.are_times:
            return None
        kinds_differ = board.are_times is not self.own.are_times
        return WhyOrder.OTHER if kinds_differ or self._is_stamped_apart(board) else None

    def _is_stamped_apart(self, board: ImageNumbers) -> bool:
        """Whether each camera has stamped its images itself: as many, over as long a time, and none is known to be alike."""
        assert board.first is not None
        assert board.last is not None
        if board.first in self._positions or board.last in self._positions or board.count != self.own.count:
            return False
        span, between = self._numbers[-1] - self._numbers[0], len(self._numbers) - 1
        return 2 * between * abs(board.last - board.first - span) <= span  # half the mean time between two

    @property
    def unshown(self) -> PassedOver:
        """Own images that were not asked for yet; none if they are shown again and again."""
        return self._passed_before(self.own.count)

    def begin(self, board: ImageNumbers | None, period_ns: int) -> None:
        """Begin a board session.

        Args:
            board: what the board tells of its images; None if it tells nothing.
            period_ns: time between two of its labels.
        """
        self.board, self._period_ns = board, period_ns
        self._first_label_ns, self._is_late = None, False
        self._next = 0

    def wanted(self, sequence: int, label_ns: int) -> Wanted:
        """Return the partner of a board frame.

        Args:
            sequence: the frame's number in its session, from 0.
            label_ns: its exposure on the board's clock, ns.
        """
        if self._first_label_ns is None:
            self._first_label_ns = label_ns
            hides = self.board is not None and self.board.has_gaps and not self.board.are_times
            self._is_late = sequence > 0 and hides
        index = self._index(sequence, label_ns)
        if index is None:
            by_number = self.paired_by is PairedBy.NUMBER
            return Wanted(None, number=self.number_of(sequence, label_ns)[1] if by_number else None)
        passed = self._passed_before(min(index, self.own.count))
        self._next = max(self._next, index + 1)
        return Wanted(index, passed)

    def _passed_before(self, index: int) -> PassedOver:
        """Return what was passed over since the last image that was asked for, up to an index."""
        if self.own.looped or index <= self._next:
            return PassedOver()
        alone = [position for position in range(self._next, index) if not self._board_has(position)]
        by_number = self.paired_by is PairedBy.NUMBER
        numbers = tuple(self._numbers[position] for position in alone) if by_number else ()
        return PassedOver(len(alone), index - self._next - len(alone), numbers)

    def _board_has(self, position: int) -> bool:
        """Whether the board has told of a partner for an own image. Of numbers with gaps it tells only the ends."""
        board = self.board
        if board is None or self.paired_by is PairedBy.ORDER:
            return board is None or position < board.count
        assert board.first is not None
        assert board.last is not None
        return not board.has_gaps and board.first <= self._numbers[position] <= board.last

    def number_of(self, sequence: int, label_ns: int) -> tuple[int, int]:
        """Return the lap and the number of a board frame. Only for images paired by number."""
        board = self.board
        assert board is not None
        assert board.first is not None
        assert board.last is not None
        lap, position = divmod(sequence, board.count)
        if not board.has_gaps:
            return lap, board.first + position
        if board.are_times:
            return lap, board.first + (label_ns - board.first) % TIMES_RING
        assert self._first_label_ns is not None
        label = round((label_ns - self._first_label_ns) / self._period_ns)
        return lap, board.first + label % (board.last - board.first + 1)

    def _index(self, sequence: int, label_ns: int) -> int | None:
        count = self.own.count
        if self.paired_by is PairedBy.ORDER:
            # A board that does not end must not go on for ever beside a camera that has: its end is the run's.
            ends = self.board is not None and not self.board.looped
            return None if ends and not self.own.looped and sequence >= count else sequence
        lap, number = self.number_of(sequence, label_ns)
        if lap and not self.own.looped:
            return count * lap
        position = self._positions.get(number)
        return None if position is None else lap * count + position


class StillsPairing(Generic[B, H]):
    """Holds board frames until the own image that was asked for has come. Answers come in the order of the questions.

    It has the methods of `Pairing`, so that the pair queue can use either. Nothing here depends on time.
    """

    def __init__(self) -> None:
        self._asked: deque[B] = deque()
        self.held_host = 0

    @property
    def held_board(self) -> int:
        """Board frames whose partner was asked for and has not come."""
        return len(self._asked)

    def add_board(self, stamp_ns: int, frame: B, now_ns: int) -> list[Outcome[B, H]]:
        """Take a board frame whose partner is being asked for."""
        del stamp_ns, now_ns
        self._asked.append(frame)
        return []

    def add_host(self, stamp_ns: int, frame: H, now_ns: int) -> list[Outcome[B, H]]:
        """Take the own image that was asked for longest ago."""
        del stamp_ns, now_ns
        return (
            [Paired(self._asked.popleft(), frame, 0)] if self._asked else [HostOrphan(frame, OrphanReason.NO_PARTNER)]
        )

    def unanswered(self) -> list[Outcome[B, H]]:
        """The own image that was asked for longest ago is spoiled."""
        return [BoardOrphan(self._asked.popleft(), OrphanReason.NO_PARTNER)] if self._asked else []

    def restart(self, reason: OrphanReason) -> list[Outcome[B, H]]:
        """Give up all board frames, because another session follows."""
        outcomes: list[Outcome[B, H]] = [BoardOrphan(frame, reason) for frame in self._asked]
        self._asked.clear()
        return outcomes

    def finish(self) -> list[Outcome[B, H]]:
        """No answer will come any more."""
        return self.restart(OrphanReason.STREAM_ENDED)

    def evict_oldest_board(self) -> list[Outcome[B, H]]:
        """Give up the oldest board frame because memory is short."""
        return [BoardOrphan(self._asked.popleft(), OrphanReason.EVICTED)] if self._asked else []

    def evict_oldest_host(self) -> list[Outcome[B, H]]:
        """No own image is ever held."""
        return []

    def change(self, settings: PairingSettings, now_ns: int) -> list[Outcome[B, H]]:
        """Periods do not matter."""
        del settings, now_ns
        return []

    def decide(self, now_ns: int) -> list[Outcome[B, H]]:
        """Time does not matter."""
        del now_ns
        return []

    def void(self) -> list[Outcome[B, H]]:
        """Clocks do not matter."""
        return []
