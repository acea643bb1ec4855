"""When a camera is opened, switched on and off, found silent, closed and tried again: one automaton for every camera that can be lost.

No device, no thread, no clock: times are CLOCK_MONOTONIC, ns, and passed in. Its shell asks `due` what time brings, tells it what happened and what is
ordered, carries out every `Step` that it is given, and reports the outcome of those that have one. It holds, whatever happens:

- what was opened is closed before it is opened again;
- between an opening that gave no frame and the next lies a rest, unless the owner's order (`resume`, `renew`) comes between;
- a camera that is wanted and silent is closed and tried again, for ever;
- openings = refused + opened; opened = lost + released + open now.
"""

from dataclasses import dataclass, field
from enum import Enum
from typing import Final

from common.camera.base import CameraState

NEVER_NS: Final = 2**63 - 1

_MOST_DOUBLINGS: Final = 16
"""A camera may be away for months; the rest has long reached its limit."""


class Unwanted(Enum):
    """What becomes of a camera while nobody listens."""

    STAYS_OPEN = "stays open"
    IS_CLOSED = "is closed"


class Standing(Enum):
    """Where the camera stands: closed, being opened, on, off for a moment to be steered, off because nobody listens, being closed."""

    CLOSED = "closed"
    OPENING = "opening"
    STREAMING = "streaming"
    STEERED = "steered"
    RESTING = "resting"
    CLOSING = "closing"


class Step(Enum):
    """What the shell does now."""

    NONE = "none"
    OPEN = "open"
    """Open it, switched on if it `is_wanted`; then report `opened` or `refused`."""
    START = "start"
    """Switch it on; report `lost` if that fails."""
    STOP = "stop"
    """Switch it off; report `lost` if that fails."""
    LOOK = "look"
    """See whether it is still there; report `lost` if it is not."""
    CLOSE = "close"
    """Let go of it; then report `closed`."""


class Loss(Enum):
    """Why an open camera is given up."""

    STALLED = "stalled"
    FAILED = "failed"
    UNPLUGGED = "unplugged"


@dataclass(frozen=True, slots=True, kw_only=True)
class LifeSettings:
    """How patient a kind of camera is.

    Attributes:
        start_ns: so long its first frame of all may take, ns.
        first_frame_ns: so long the first frame after any later switching on, ns.
        silence_ns: so long any further frame, ns.
        silence_periods: or so many periods, whichever is longer.
        lost_rest_ns: from the loss of one that gave frames to the next attempt, ns; one that fell silent gets `rest_ns`.
        rest_ns: from any other loss to the next attempt, ns; doubled with each attempt that brings no frame.
        longest_rest_ns: limit of that, ns.
        unwanted: what becomes of it while nobody listens.
        look_ns: how often one that stays open is looked for then, ns.
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
        opened: openings that did not.
        lost: how often an open one was given up, by reason.
        released: how often it was closed by order.
        returned: how often it was back after it had been lost.
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

    Args:
        settings: how patient it is.
        now_ns: the time.
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
        """Where it stands."""
        return self._phase

    @property
    def is_wanted(self) -> bool:
        """Whether anybody listens."""
        return self._is_wanted

    @property
    def is_ended(self) -> bool:
        """Whether it is over."""
        return self._is_ended

    @property
    def is_lost(self) -> bool:
        """Whether it was there and is not: from a loss or a refusal to the next frame, or to its opening where no frame is wanted."""
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
        """When `due` will have a step, ns; the far future if that is up to a report or an order."""
        if self._phase is not Standing.CLOSED:
            return self._next_ns
        has_rest = not self._is_wanted and self._settings.unwanted is Unwanted.IS_CLOSED
        return NEVER_NS if self._is_ended or has_rest else self._retry_ns

    def due(self, now_ns: int) -> Step:
        """What time brings."""
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
        """Whether a camera that is not accepted yet is not to be waited for any longer: it was refused, or its time is over."""
        return not self._is_accepted and (self.counts.refused > 0 or now_ns >= self._begun_ns + self._settings.start_ns)

    # Reports.

    def accept(self) -> None:
        """It is what was asked for: from now on it is never given up, and its loss is news."""
        self._is_accepted, self._is_gone = True, False

    def opened(self, now_ns: int, period_ns: int = 0) -> Step:
        """It is open, and on if it was wanted.

        Args:
            now_ns: the time.
            period_ns: between its frames; 0: not known yet.

        Returns:
            CLOSE if nobody wants it any more, else NONE.
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
        """It could not be opened."""
        assert self._phase is Standing.OPENING, self._phase
        self.counts.refused += 1
        self._phase, self._is_gone = Standing.CLOSED, True
        self._rest(now_ns)

    def heard(self, now_ns: int, period_ns: int = 0) -> None:
        """A frame came; when it is not on, that is a late one and no news.

        Args:
            now_ns: the time.
            period_ns: between its frames; 0: not known yet.
        """
        if self._phase is not Standing.STREAMING:
            return
        self._was_heard, self._futile, self._period_ns = True, 0, period_ns
        self._listen_until(now_ns, self._settings.silence_ns)
        self._come_back()

    def stirred(self, now_ns: int) -> None:
        """Something came that is no frame of use: it is not silent, and not back either.

        Args:
            now_ns: the time.
        """
        if self._phase is Standing.STREAMING:
            self._listen_until(now_ns, self._settings.silence_ns)

    def lost(self, loss: Loss, now_ns: int) -> Step:
        """It failed or is gone; again, or while it is being closed, is no news.

        Returns:
            CLOSE, or NONE if it was no news.
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
        """It is closed, as was told."""
        assert self._phase is Standing.CLOSING, self._phase
        self._phase = Standing.CLOSED

    # Orders.

    def pause(self) -> Step:
        """Nobody listens any more; again is harmless. One that stays open is looked for at once.

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
        """Somebody listens: no rest is kept any longer; again is harmless.

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
        """Switch it off until then.

        Returns:
            STOP if it is on.
        """
        if self._phase not in {Standing.STREAMING, Standing.STEERED}:
            return Step.NONE
        self._phase, self._next_ns = Standing.STEERED, start_ns
        return Step.STOP

    def renew(self, now_ns: int) -> Step:
        """Open it anew, because it is to be another; without a rest.

        Returns:
            CLOSE if it is open; then an opening is due.
        """
        if self._phase not in {Standing.STREAMING, Standing.STEERED, Standing.RESTING}:
            return Step.NONE
        self._retry_ns = now_ns
        return self._release()

    def end(self) -> Step:
        """It is over; again is harmless.

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
