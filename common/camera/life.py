"""When a camera is opened, switched on and off, found silent, closed and tried again: one automaton for every camera that can be lost.

It has no device, thread or clock; times are CLOCK_MONOTONIC, ns, and are passed in. Its shell asks `due` what is to be done now, reports events and
orders, carries out every `Step` that it is given, and reports the outcome of steps that have one. These invariants always hold:

- what was opened is closed before it is opened again;
- an opening that gave no frame is followed by a rest before the next one, unless the owner's order (`resume`, `renew`) comes in between;
- a camera that is wanted and silent is closed and tried again, for ever;
- openings = refused + opened; opened = lost + released + open now.
"""

from dataclasses import dataclass, field
from enum import Enum
from typing import Final

from common.camera.base import CameraState
from common.value import value

NEVER_NS: Final = 2**63 - 1

_MOST_DOUBLINGS: Final = 16
"""A camera may be away for months; the rest has long reached its limit by then."""


class Unwanted(Enum):
    """What becomes of a camera while nobody listens."""

    STAYS_OPEN = "stays open"
    IS_CLOSED = "is closed"


class Standing(Enum):
    """The camera's current state: closed, being opened, on, briefly off to be steered, off because nobody listens, being closed."""

    CLOSED = "closed"
    OPENING = "opening"
    STREAMING = "streaming"
    STEERED = "steered"
    RESTING = "resting"
    CLOSING = "closing"


class Step(Enum):
    """What the shell must do now."""

    NONE = "none"
    OPEN = "open"
    """Open it, switched on if it `is_wanted`; then report `opened` or `refused`."""
    START = "start"
    """Switch it on; report `lost` if that fails."""
    STOP = "stop"
    """Switch it off; report `lost` if that fails."""
    LOOK = "look"
    """Check that it is still there; report `lost` if it is not."""
    CLOSE = "close"
    """Release it; then report `closed`."""


class Loss(Enum):
    """Why an open camera was given up."""

    STALLED = "stalled"
    FAILED = "failed"
    UNPLUGGED = "unplugged"


@value(kw_only=True)
class LifeSettings:
    """How patient to be with a kind of camera.

    Attributes:
        start_ns: time allowed for its very first frame, ns.
        first_frame_ns: time allowed for the first frame whenever it is switched on later, ns.
        silence_ns: time allowed for every further frame, ns.
        silence_periods: the same in frame periods; the longer of the two counts.
        lost_rest_ns: time from the loss of a camera that gave frames to the next attempt, ns; one that fell silent gets `rest_ns`.
        rest_ns: time from any other loss to the next attempt, ns; doubled with each attempt that brings no frame.
        longest_rest_ns: upper limit of that, ns.
        unwanted: what becomes of it while nobody listens.
        look_ns: how often to check then that an open camera is still there, ns.
    """

    start_ns: int
    first_frame_ns: int
    silence_ns: int
    silence_periods: int
    lost_rest_ns: int
    rest_ns: int
    longest_rest_ns: int
    unwanted: Unwanted
    look_ns: int = NEVER_NS


@dataclass(slots=True)
class LifeCounts:
    """What has happened.

    Attributes:
        refused: openings that failed.
        opened: openings that succeeded.
        lost: how often an open camera was given up, by reason.
        released: how often it was closed by order.
        returned: how often it came back after a loss.
    """

    refused: int = 0
    opened: int = 0
    lost: dict[Loss, int] = field(default_factory=lambda: dict.fromkeys(Loss, 0))
    released: int = 0
    returned: int = 0


class Life:
    """One camera's life, from before its first opening. It is wanted from the beginning.

    Attributes:
        counts: what has happened.
    """

    def __init__(self, settings: LifeSettings, now_ns: int) -> None:
        self.counts = LifeCounts()
        self._settings = settings
        self._begun_ns = self._retry_ns = now_ns
        self._next_ns = NEVER_NS
        self._period_ns = 0
        self._phase = Standing.CLOSED
        self._is_wanted = self._is_gone = True
        self._is_accepted = self._is_ended = self._was_heard = False
        self._futile = 0

    @property
    def phase(self) -> Standing:
        """The camera's current state."""
        return self._phase

    @property
    def is_wanted(self) -> bool:
        """Whether anybody listens."""
        return self._is_wanted

    @property
    def is_ended(self) -> bool:
        """Whether its life is over."""
        return self._is_ended

    @property
    def is_lost(self) -> bool:
        """Whether it was there and is gone: from a loss or refusal until the next frame, or until it is open if no frame is wanted."""
        return self._is_accepted and self._is_gone

    @property
    def state(self) -> CameraState:
        """Whether frames come."""
        if self._is_wanted:
            return CameraState.GONE if self._is_gone else CameraState.RUNNING
        stays_open = self._settings.unwanted is Unwanted.STAYS_OPEN
        return CameraState.GONE if stays_open and self._phase is not Standing.RESTING else CameraState.PAUSED

    @property
    def due_ns(self) -> int:
        """When `due` will return a step, ns; the far future if that depends on a report or an order."""
        if self._phase is not Standing.CLOSED:
            return self._next_ns
        has_rest = not self._is_wanted and self._settings.unwanted is Unwanted.IS_CLOSED
        return NEVER_NS if self._is_ended or has_rest else self._retry_ns

    def due(self, now_ns: int) -> Step:
        """Return the step that is due now."""
        if now_ns < self.due_ns:
            return Step.NONE
        match self._phase:
            case Standing.CLOSED:
                self._phase, self._next_ns = Standing.OPENING, NEVER_NS
                return Step.OPEN
            case Standing.STREAMING:
                return self.lost(Loss.STALLED, now_ns)
            case Standing.STEERED:
                self._switch_on(now_ns)
                return Step.START
            case Standing.RESTING:
                self._next_ns = now_ns + self._settings.look_ns
                return Step.LOOK
            case Standing.OPENING | Standing.CLOSING:
                return Step.NONE

    def gives_up(self, now_ns: int) -> bool:
        """Whether to stop waiting for a camera that has not been accepted: it was refused, or its time is over."""
        return not self._is_accepted and (self.counts.refused > 0 or now_ns >= self._begun_ns + self._settings.start_ns)

    # Reports.

    def accept(self) -> None:
        """Report that it is what was asked for. From now on it is never given up, and its loss counts as one."""
        self._is_accepted, self._is_gone = True, False

    def opened(self, now_ns: int, period_ns: int = 0) -> Step:
        """Report that it is open, and on if it was wanted.

        Args:
            now_ns: the time.
            period_ns: time between its frames; 0 if not yet known.

        Returns:
            CLOSE if nobody wants it any more, otherwise NONE.
        """
        assert self._phase is Standing.OPENING, self._phase
        self.counts.opened += 1
        self._was_heard, self._period_ns = False, period_ns
        if self._is_wanted and not self._is_ended:
            self._switch_on(now_ns)
            return Step.NONE
        if self._is_ended or self._settings.unwanted is Unwanted.IS_CLOSED:
            return self._release()
        self._phase, self._next_ns = Standing.RESTING, now_ns + self._settings.look_ns
        self._come_back()
        return Step.NONE

    def refused(self, now_ns: int) -> None:
        """Report that it could not be opened."""
        assert self._phase is Standing.OPENING, self._phase
        self.counts.refused += 1
        self._phase, self._is_gone = Standing.CLOSED, True
        self._rest(now_ns)

    def heard(self, now_ns: int, period_ns: int = 0) -> None:
        """Report a frame. If the camera is not on, the frame is a late one and is ignored.

        Args:
            now_ns: the time.
            period_ns: time between its frames; 0 if not yet known.
        """
        if self._phase is not Standing.STREAMING:
            return
        self._was_heard, self._futile, self._period_ns = True, 0, period_ns
        self._listen_until(now_ns, self._settings.silence_ns)
        self._come_back()

    def stirred(self, now_ns: int) -> None:
        """Report that something other than a usable frame came: it is not silent, but not back either."""
        if self._phase is Standing.STREAMING:
            self._listen_until(now_ns, self._settings.silence_ns)

    def lost(self, loss: Loss, now_ns: int) -> Step:
        """Report that it failed or is gone. Repeated reports, and reports while it is being closed, are ignored.

        Returns:
            CLOSE, or NONE if the report was ignored.
        """
        if self._phase not in {Standing.STREAMING, Standing.STEERED, Standing.RESTING}:
            return Step.NONE
        self.counts.lost[loss] += 1
        self._phase, self._next_ns, self._is_gone = Standing.CLOSING, NEVER_NS, True
        if not self._was_heard:
            self._rest(now_ns)
        elif loss is Loss.STALLED:
            self._retry_ns = now_ns + self._settings.rest_ns
        else:
            self._retry_ns = now_ns + self._settings.lost_rest_ns
        return Step.CLOSE

    def closed(self) -> None:
        """Report that it is closed, as ordered."""
        assert self._phase is Standing.CLOSING, self._phase
        self._phase = Standing.CLOSED

    # Orders.

    def pause(self) -> Step:
        """Nobody listens any more. A camera that stays open is checked at once. Repeating the order is harmless.

        Returns:
            STOP or CLOSE, if it was on.
        """
        if not self._is_wanted:
            return Step.NONE
        self._is_wanted = False
        if self._phase not in {Standing.STREAMING, Standing.STEERED}:
            return Step.NONE
        if self._settings.unwanted is Unwanted.IS_CLOSED:
            return self._release()
        self._phase, self._next_ns = Standing.RESTING, 0
        return Step.STOP

    def resume(self, now_ns: int) -> Step:
        """Somebody listens again: a pending rest is cut short. Repeating the order is harmless.

        Returns:
            START if it stayed open.
        """
        if self._is_wanted:
            return Step.NONE
        self._is_wanted, self._retry_ns = True, now_ns
        if self._phase is not Standing.RESTING:
            return Step.NONE
        self._switch_on(now_ns)
        return Step.START

    def steer(self, start_ns: int) -> Step:
        """Switch it off until `start_ns`.

        Returns:
            STOP if it is on.
        """
        if self._phase not in {Standing.STREAMING, Standing.STEERED}:
            return Step.NONE
        self._phase, self._next_ns = Standing.STEERED, start_ns
        return Step.STOP

    def renew(self, now_ns: int) -> Step:
        """Reopen it without a rest, because it is to become another one.

        Returns:
            CLOSE if it is open; after that, an opening is due.
        """
        if self._phase not in {Standing.STREAMING, Standing.STEERED, Standing.RESTING}:
            return Step.NONE
        self._retry_ns = now_ns
        return self._release()

    def end(self) -> Step:
        """End its life. Repeating the order is harmless.

        Returns:
            CLOSE if it is open.
        """
        self._is_ended = True
        return self._release() if self._phase in {Standing.STREAMING, Standing.STEERED, Standing.RESTING} else Step.NONE

    def _switch_on(self, now_ns: int) -> None:
        self._phase = Standing.STREAMING
        self._listen_until(now_ns, self._settings.first_frame_ns if self._is_accepted else self._settings.start_ns)

    def _listen_until(self, now_ns: int, patience_ns: int) -> None:
        self._next_ns = now_ns + max(patience_ns, self._settings.silence_periods * self._period_ns)

    def _release(self) -> Step:
        self.counts.released += 1
        self._phase, self._next_ns = Standing.CLOSING, NEVER_NS
        return Step.CLOSE

    def _rest(self, now_ns: int) -> None:
        self._futile += 1
        rest_ns = self._settings.rest_ns << min(self._futile, _MOST_DOUBLINGS)
        self._retry_ns = now_ns + min(self._settings.longest_rest_ns, rest_ns)

    def _come_back(self) -> None:
        if self.is_lost:
            self.counts.returned += 1
            self._is_gone = False
