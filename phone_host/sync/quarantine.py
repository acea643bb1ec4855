"""Decides when a board frame is believed: at once, after an echo has confirmed the clock, or never. Pure.

A frame's stamps are mapped by an estimate that rests on earlier echoes. A clock may have stepped since: the board's or
the host's clock stood still while its machine was suspended, or was stopped with it. The frame would then be paired
with an image of another moment. Two signs reveal this:

- The impossible: a frame cannot be sent after it arrived (beyond the estimate's hard bound), exposed after it was
  grabbed, or older than anything that the host keeps. Such a frame is dropped and counted by reason.
- The unusual: after a step by S, the frames' transit times change by S. While they stay within STEP_PERIODS of earlier
  ones, no step of two frame periods can hide in them, and frames pass at once. Any other frame waits for an echo that
  the board answered after sending the frame. If the echo agrees, it proves the clock; if not, the frame is dropped. On
  a link with very uneven transit times, every frame waits for one round trip.

A step of less than two periods may go unnoticed until the next echo. The frames affected are reported (`Suspects`).
"""

from collections import deque
from dataclasses import dataclass
from enum import Enum
from typing import Final, Generic, TypeVar

from common.ledger import BoardMarks

F = TypeVar("F")

STEP_PERIODS: Final = 1.5
"""A step of two periods stays visible even if a frame is half a period faster or slower than all recent ones."""

_RECENT: Final = 32
"""A second of frames. After a hitch, the frames of this long wait for an echo, which takes one round trip."""

_HISTORY_NS: Final = 60_000_000_000
"""No host frame is kept for longer (`stream/pair_queue.py`)."""

PATIENCE_NS: Final = 10_000_000_000
"""A frame waits this long for an echo: three times the round trip of the slowest usable link."""

LABELS_NS: Final = 2**60
"""Stamps of images shown on demand are labels and may have any value, as long as differences fit into 64 bits."""


class Disbelief(Enum):
    """Why a board frame was disbelieved."""

    FUTURE = "from_the_future"
    PAST = "older_than_any_partner"
    MARKS = "marks_out_of_order"
    CLOCK = "clock_in_doubt"
    UNPROVEN = "proven_by_no_echo"
    PACING = "on_demand_beside_a_live_camera"
    CREDIT = "beyond_credit"
    SIZE = "larger_than_its_camera"


def disbelief(marks: BoardMarks, received_ns: int, bound_ns: int, *, labelled: bool) -> Disbelief | None:
    """Return what is impossible about a frame's marks.

    All times are on the board's clock, so that no claim of the frame is used to judge it.

    Args:
        marks: the marks as received.
        received_ns: arrival of the last byte, ns.
        bound_ns: hard half-width of the uncertainty of that moment.
        labelled: whether the exposure is a label, as for images shown on demand.

    Returns:
        The reason to disbelieve the frame; None if nothing is impossible.
    """
    if marks.exposed_ns <= marks.grabbed_ns <= marks.sent_ns <= received_ns <= marks.exposed_ns + _HISTORY_NS:
        return None  # the usual case; it passes each of the tests below
    exposed_ns = marks.grabbed_ns if labelled else marks.exposed_ns
    if max(exposed_ns, marks.sent_ns) > received_ns + bound_ns:
        return Disbelief.FUTURE
    if not exposed_ns <= marks.grabbed_ns <= marks.sent_ns:
        return Disbelief.MARKS
    if received_ns - exposed_ns > _HISTORY_NS or abs(received_ns - marks.exposed_ns) >= LABELS_NS:
        return Disbelief.PAST
    return None


@dataclass(frozen=True, slots=True, kw_only=True)
class Held(Generic[F]):
    """A waiting frame: when it was sent (board's clock), its transit time, and its wait's begin (host's clock), ns."""

    frame: F
    sent_ns: int
    transit_ns: int
    since_ns: int


class Quarantine(Generic[F]):
    """Lets frames pass in order of arrival. Frames that need an echo's confirmation wait for it.

    Attributes:
        held: the frames that wait for an echo, the oldest first.
    """

    def __init__(self) -> None:
        self._recent: deque[int] = deque(maxlen=_RECENT)
        self.held: deque[Held[F]] = deque()

    def arrived(self, frame: F, sent_ns: int, transit_ns: int, period_ns: int, now_ns: int) -> bool:
        """Take a frame.

        Args:
            frame: a frame that is not impossible.
            sent_ns: when it was sent, board's clock, ns.
            transit_ns: its transit time by the present estimate.
            period_ns: its camera's period.
            now_ns: host's clock, ns.

        Returns:
            Whether it may pass now. If not, it is kept until `confirmed`, `expired` or `void` returns it.
        """
        recent = self._recent
        if recent and not self.held:
            slack_ns = STEP_PERIODS * period_ns
            if max(recent) - slack_ns < transit_ns < min(recent) + slack_ns:
                recent.append(transit_ns)
                return True
        self.held.append(Held(frame=frame, sent_ns=sent_ns, transit_ns=transit_ns, since_ns=now_ns))
        return False

    def confirmed(self, board_ns: int, before_ns: int) -> list[F]:
        """Take note of an echo that agreed. Return the frames that may pass now.

        Args:
            board_ns: when the board heard the echo, board's clock, ns. Frames sent before are proven.
            before_ns: only frames whose wait began by this moment may pass, host's clock, ns.
        """
        passed = []
        while self.held and self.held[0].sent_ns <= board_ns and self.held[0].since_ns <= before_ns:
            held = self.held.popleft()
            self._recent.append(held.transit_ns)
            passed.append(held.frame)
        return passed

    def expired(self, now_ns: int) -> list[F]:
        """Give up and return frames that waited too long: a board that does not answer cannot be believed."""
        dropped = []
        while self.held and now_ns - self.held[0].since_ns > PATIENCE_NS:
            dropped.append(self.held.popleft().frame)
        return dropped

    def void(self) -> list[F]:
        """Take note that the clock is in doubt or begins anew. Return the frames that will not pass."""
        dropped = [held.frame for held in self.held]
        self.held.clear()
        self._recent.clear()
        return dropped


@dataclass(frozen=True, slots=True, kw_only=True)
class Suspects:
    """Frames that were believed although a clock had stepped, because the step was too small to see before an echo.

    Attributes:
        session: the board's session.
        first: sequence number of the first of these frames.
        last: sequence number of the last one.
        frames: number of frames. Pairs formed with them are suspect, too.
    """

    session: str
    first: int
    last: int
    frames: int


_MOST_UNPROVEN: Final = 4096
"""More frames than arrive between two echoes on any link."""


class Unproven:
    """Frames that have passed but that no echo has confirmed yet."""

    def __init__(self) -> None:
        self._frames: deque[tuple[int, str, int]] = deque(maxlen=_MOST_UNPROVEN)

    def passed(self, sent_ns: int, session: str, sequence: int) -> None:
        """Take note of a frame: when it was sent (board's clock, ns), its session and its sequence number."""
        self._frames.append((sent_ns, session, sequence))

    def confirmed(self, board_ns: int) -> None:
        """Take note of an echo that agreed and that the board heard at `board_ns`."""
        while self._frames and self._frames[0][0] <= board_ns:
            self._frames.popleft()

    def stepped(self) -> Suspects | None:
        """Take note of a step. Return the frames since the last echo before it; None if there were none."""
        if not self._frames:
            return None
        session = self._frames[-1][1]
        numbers = [number for _, of, number in self._frames if of == session]
        self._frames.clear()
        return Suspects(session=session, first=min(numbers), last=max(numbers), frames=len(numbers))
