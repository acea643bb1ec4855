"""Which frames of the board are believed: at once, when an echo has confirmed the clock, or never. Pure.

A frame's stamps are mapped by an estimate that rests on echoes before it. A clock may have stepped since: the board's or the host's stood still in
a suspend of its machine, or was stopped with it. Then the frame would be paired with an image of another moment. Two things tell:

- What cannot be: a frame is not sent after it came (beyond the hard bound of the estimate), nor exposed after it was grabbed, nor
  older than anything that the host keeps. Such a frame is dropped by name.
- What is unusual: after a step by S the frames' times under way change by S. As long as they stay within STEP_PERIODS of what they were, no step of
  two frame periods can hide in them, and frames pass at once. Any other frame waits for an echo that the board answered after sending it: one that
  agrees proves the clock, one that does not voids the frame. On a link whose frames take very unequal times every frame waits, for one round trip.

A step of less than two periods may pass until the next echo; which frames those are is told (`Suspects`).
"""

from collections import deque
from dataclasses import dataclass
from enum import Enum
from typing import Final, Generic, TypeVar

from common.ledger import BoardMarks

F = TypeVar("F")

STEP_PERIODS: Final = 1.5
"""A step of two periods stays visible though a frame is half a period swifter or slower than any of late."""

_RECENT: Final = 32
"""A second of frames: a hitch makes the frames of so long wait for an echo, which takes a round trip of the link."""

_HISTORY_NS: Final = 60_000_000_000
"""No frame of the host's own camera is kept for longer (`stream/pair_queue.py`)."""

PATIENCE_NS: Final = 10_000_000_000
"""So long a frame waits for an echo: three times the round trip of the slowest link on which anything can be done."""

LABELS_NS: Final = 2**60
"""Stamps of images shown on demand are labels and may lie anywhere, but for differences that do not fit into 64 bits."""


class Disbelief(Enum):
    """Why a frame of the board was not believed."""

    FUTURE = "from_the_future"
    PAST = "older_than_any_partner"
    MARKS = "marks_out_of_order"
    CLOCK = "clock_in_doubt"
    UNPROVEN = "proven_by_no_echo"
    PACING = "on_demand_beside_a_live_camera"
    CREDIT = "beyond_credit"
    SIZE = "larger_than_its_camera"


def disbelief(marks: BoardMarks, received_ns: int, bound_ns: int, *, labelled: bool) -> Disbelief | None:
    """Say what about a frame's marks cannot be. All times on the board's clock, so that no claim of the frame is used to judge it.

    Args:
        marks: as they came.
        received_ns: arrival of the last byte, ns.
        bound_ns: hard half-width of what is known of that moment.
        labelled: the exposure is a label, as of images shown on demand.

    Returns:
        The reason; None for a frame that can be.
    """
    exposed_ns = marks.grabbed_ns if labelled else marks.exposed_ns
    if max(exposed_ns, marks.sent_ns) > received_ns + bound_ns:
        return Disbelief.FUTURE
    if not exposed_ns <= marks.grabbed_ns <= marks.sent_ns:
        return Disbelief.MARKS
    if received_ns - exposed_ns > _HISTORY_NS or abs(received_ns - marks.exposed_ns) >= LABELS_NS:
        return Disbelief.PAST
    return None


@dataclass(frozen=True, slots=True, kw_only=True)
class _Held(Generic[F]):
    """A frame that waits: when it was sent (board's clock), how long it took, and since when it waits (host's clock), ns."""

    frame: F
    sent_ns: int
    transit_ns: int
    since_ns: int


class Quarantine(Generic[F]):
    """Lets frames pass in the order in which they came, those that an echo has to confirm when it has."""

    def __init__(self) -> None:
        self._recent: deque[int] = deque(maxlen=_RECENT)
        self._held: deque[_Held[F]] = deque()

    @property
    def held(self) -> int:
        """Frames that wait for an echo."""
        return len(self._held)

    def arrived(self, frame: F, sent_ns: int, transit_ns: int, period_ns: int, now_ns: int) -> bool:
        """Take a frame.

        Args:
            frame: a frame that can be.
            sent_ns: its sending, board's clock, ns.
            transit_ns: how long it was under way by the present estimate.
            period_ns: between two frames of its camera.
            now_ns: host's clock, ns.

        Returns:
            Whether it may pass now; else it is kept until `confirmed`, `expired` or `void`.
        """
        if not self._held and self._is_usual(transit_ns, period_ns):
            self._recent.append(transit_ns)
            return True
        self._held.append(_Held(frame=frame, sent_ns=sent_ns, transit_ns=transit_ns, since_ns=now_ns))
        return False

    def confirmed(self, board_ns: int, before_ns: int) -> list[F]:
        """Take note of an echo that agreed; gives the frames that may pass now.

        Args:
            board_ns: when the board heard it, board's clock, ns: what it sent before is proven.
            before_ns: only frames that have waited since before this moment, host's clock, ns.
        """
        passed = []
        while self._held and self._held[0].sent_ns <= board_ns and self._held[0].since_ns <= before_ns:
            held = self._held.popleft()
            self._recent.append(held.transit_ns)
            passed.append(held.frame)
        return passed

    def expired(self, now_ns: int) -> list[F]:
        """Give up the frames that have waited for too long: a board that does not answer cannot be believed."""
        dropped = []
        while self._held and now_ns - self._held[0].since_ns > PATIENCE_NS:
            dropped.append(self._held.popleft().frame)
        return dropped

    def void(self) -> list[F]:
        """Take note that the clock is in doubt, or begins anew; gives the frames that will not pass."""
        dropped = [held.frame for held in self._held]
        self._held.clear()
        self._recent.clear()
        return dropped

    def _is_usual(self, transit_ns: int, period_ns: int) -> bool:
        if not self._recent:
            return False
        slack_ns = STEP_PERIODS * period_ns
        return max(self._recent) - slack_ns < transit_ns < min(self._recent) + slack_ns


@dataclass(frozen=True, slots=True, kw_only=True)
class Suspects:
    """Frames that were believed although a clock had stepped: the step was too small to be seen before an echo told of it.

    Attributes:
        session: the board's session.
        first: sequence number of the first of these frames.
        last: of the last.
        frames: how many; those of them that were paired are suspect pairs.
    """

    session: str
    first: int
    last: int
    frames: int


_MOST_UNPROVEN: Final = 4096
"""More frames than come between two echoes on any link."""


class Unproven:
    """Frames that have passed and that no echo has confirmed yet."""

    def __init__(self) -> None:
        self._frames: deque[tuple[int, str, int]] = deque(maxlen=_MOST_UNPROVEN)

    def passed(self, sent_ns: int, session: str, sequence: int) -> None:
        """Take note of a frame: its sending (board's clock, ns), its session and its number."""
        self._frames.append((sent_ns, session, sequence))

    def confirmed(self, board_ns: int) -> None:
        """Take note of an echo that agreed and that the board heard then."""
        while self._frames and self._frames[0][0] <= board_ns:
            self._frames.popleft()

    def stepped(self) -> Suspects | None:
        """Take note of a step; gives the frames since the last echo before it, None if there were none."""
        if not self._frames:
            return None
        session = self._frames[-1][1]
        numbers = [number for _, of, number in self._frames if of == session]
        self._frames.clear()
        return Suspects(session=session, first=min(numbers), last=max(numbers), frames=len(numbers))
