"""The host's border: decides which board frames to believe, and by which clock. It drops and counts the others.

Rules: a frame from before a doubt of the clock never meets one from after it. While the clock is in doubt, no frame is
believed. The stamps of a frame that has passed need no further check. Used by the receiver's thread only.
"""

import logging
from collections.abc import Callable
from typing import Final

from common.program.logs import event
from common.protocol.message import CameraDescription, FrameMessage, Pacing
from common.protocol.session import Echo
from common.value import value
from phone_host.accounts.link_account import LinkAccount, SessionAccount
from phone_host.model import BoardFrame
from phone_host.sync.clock import ClockEstimate, Heard
from phone_host.sync.clocks import LinkClocks
from phone_host.sync.quarantine import Disbelief, Quarantine, Unproven, disbelief

_LOG = logging.getLogger(__name__)

_MOST_HELD: Final = 4
"""While this many frames wait for an echo, the board gets no further credit."""


@value()
class Arrival:
    """A frame that came, with its link, session account and camera at that time, and the last byte's arrival, ns."""

    frame: FrameMessage
    link: int
    account: SessionAccount
    camera: CameraDescription
    received_ns: int


_TIGHT_NS: Final = 10_000_000
"""An echo is tight if it takes at most twice the least recent round trip plus this."""

_WAIT_NS: Final = 500_000_000
"""A frame waits this long for a tight echo. Several are asked for meanwhile; none is tight if a queue slows all."""

Admitted = tuple[int, BoardFrame]
"""A frame that may pass, after the number of the link that it came over."""


class Border:
    """Clock and quarantine of one board.

    Args:
        account: the links' account, which counts doubts, steps and disbelieved frames.
        on_doubt: called when no frame from before this moment may be paired any more.
    """

    def __init__(self, account: LinkAccount, on_doubt: Callable[[], None]) -> None:
        self._account = account
        self._on_doubt = on_doubt
        self._clock = LinkClocks(len(account.links))
        self._quarantine: Quarantine[Arrival] = Quarantine()
        self._unproven = Unproven()

    @property
    def estimate(self) -> ClockEstimate | None:
        """The clock estimate now; None before the first echo, and while it is in doubt."""
        return self._clock.estimate

    @property
    def held(self) -> int:
        """Number of frames that wait for an echo."""
        return len(self._quarantine.held)

    @property
    def waits_for_echo(self) -> bool:
        """Whether the next echo is wanted as soon as possible."""
        return self.held > 0 or (self._clock.estimate is None and self._clock.in_doubt)

    @property
    def takes_frames(self) -> bool:
        """Whether a frame that came now could be of use."""
        return self._clock.estimate is not None and self.held < _MOST_HELD

    def round_trip_ns(self, link: int) -> int | None:
        """Return the least recent round trip over one link, ns; None before its first echo."""
        return self._clock.round_trip_ns(link)

    def other_clock(self) -> None:
        """The board has rebooted or slept, so its clock is another one. A doubt about the old clock stays undecided."""
        if self._clock.in_doubt:
            self._note_suspects()
        self._clock = LinkClocks(len(self._account.links))
        self._unproven = Unproven()
        self.close()

    def void(self, why: str) -> None:
        """Forget what is known of the clock. The next echo tells whether it has stepped."""
        self._clock.void()
        self._begin_doubt(why)

    def slept(self, slept_ns: int) -> None:
        """This machine has slept: its clock stood still while the board's and the cameras' went on."""
        self._clock.void(stepped=True)
        self._begin_doubt(f"this machine slept for {slept_ns / 1e9:.1f} s")
        self._note_step()

    def link_down(self, link: int) -> None:
        """A link is lost, and with it the questions that its echoes left open."""
        self._clock.down(link)

    def close(self) -> None:
        """Give up the frames that wait for an echo, because none will come."""
        for arrival in self._quarantine.void():
            arrival.account.disbelieved[Disbelief.CLOCK] += 1

    def learn(self, echo: Echo) -> list[Admitted]:
        """Give an echo to the clock.

        Returns:
            The frames that it has proven.
        """
        was_in_doubt = self._clock.in_doubt
        match self._clock.add(echo):
            case Heard.DOUBTED if not was_in_doubt:
                self._begin_doubt("an echo contradicts the ones before it")
            case Heard.STEPPED:
                self._note_step()
            case Heard.AGREED:
                if was_in_doubt and not self._clock.in_doubt and self._account.clock_doubts.bit_count() == 1:
                    _LOG.info(event("clock_confirmed"))
                return self._confirm(echo)
            case _:
                pass
        return []

    def _confirm(self, echo: Echo) -> list[Admitted]:
        """Handle an echo that agreed with the clock.

        A slow echo leaves room for a step and proves nothing. It only lets frames pass that have waited long enough for
        a better one.
        """
        estimate = self._clock.estimate
        if estimate is None:
            return []
        round_trip_ns = (echo.t3_ns - echo.t0_ns) - (echo.t2_ns - echo.t1_ns)
        if round_trip_ns <= 2 * estimate.round_trip_ns + _TIGHT_NS:
            self._unproven.confirmed(echo.t1_ns)
            passed = self._quarantine.confirmed(echo.t1_ns, echo.t3_ns)
        else:
            passed = self._quarantine.confirmed(echo.t1_ns, echo.t3_ns - _WAIT_NS)
        return [(arrival.link, known) for arrival in passed if (known := self._examine(arrival)) is not None]

    def admit(self, arrival: Arrival) -> BoardFrame | None:
        """Take a frame that has come.

        Returns:
            The frame with its marks on the host's clock, if it may pass now. None if it was dropped or must wait for
            an echo.
        """
        if self._clock.estimate is None and not self._clock.in_doubt:
            self._account.no_clock += 1
            return None
        known = self._examine(arrival)
        if known is None or arrival.camera.pacing is Pacing.DEMAND:
            return known
        transit_ns = arrival.received_ns - known.marks.sent_ns
        sent_ns, period_ns = arrival.frame.marks.sent_ns, arrival.camera.period_ns
        passes = self._quarantine.arrived(arrival, sent_ns, transit_ns, period_ns, arrival.received_ns)
        return known if passes else None

    def tick(self, now_ns: int) -> None:
        """Let time pass: drop and count frames that no echo has proven in time."""
        for arrival in self._quarantine.expired(now_ns):
            arrival.account.disbelieved[Disbelief.UNPROVEN] += 1
            self._warn(
                "frame_unproven", arrival.account.disbelieved[Disbelief.UNPROVEN], why="the board answers no echo"
            )

    def _examine(self, arrival: Arrival) -> BoardFrame | None:
        """Map a frame's marks to the host's clock. If that is impossible, count the reason and return None."""
        frame, estimate = arrival.frame, self._clock.estimate
        reason = Disbelief.CLOCK if estimate is None else self._doubts(arrival, estimate)
        if estimate is None or reason is not None:
            arrival.account.disbelieved[reason or Disbelief.CLOCK] += 1
            return None
        # Only `sent` is mapped to the host's clock, once, when the frame is believed. The other marks keep their
        # distance from it.
        sent_ns = frame.marks.sent_ns
        offset_ns, uncertainty_ns = estimate.offset_at(sent_ns), estimate.uncertainty_at(sent_ns)
        name, asked_px = self._account.links[arrival.link].name, (arrival.camera.width_px, arrival.camera.height_px)
        marks = frame.marks.moved_to(sent_ns + offset_ns)
        return BoardFrame(
            message=frame,
            link=name,
            marks=marks,
            received_ns=arrival.received_ns,
            offset_ns=offset_ns,
            uncertainty_ns=uncertainty_ns,
            asked_px=asked_px,
            orientation=arrival.camera.orientation,
        )

    def _doubts(self, arrival: Arrival, estimate: ClockEstimate) -> Disbelief | None:
        frame, camera = arrival.frame, arrival.camera
        if frame.width_px > camera.width_px or frame.height_px > camera.height_px:
            return Disbelief.SIZE
        labelled, since_ns = camera.pacing is Pacing.DEMAND, self._clock.since_ns
        if since_ns is not None and frame.marks.exposed_ns < since_ns and not labelled:
            return Disbelief.CLOCK
        arrived_ns = arrival.received_ns - estimate.offset_at(arrival.received_ns - estimate.offset_ns)
        # Computing the bound takes some us, so do it only if it decides: a frame that arrived after it was sent is
        # within any bound.
        marks = frame.marks
        if marks.exposed_ns <= marks.grabbed_ns <= marks.sent_ns <= arrived_ns:
            bound_ns = 0
        else:
            bound_ns = estimate.bound_at(arrived_ns)
        return disbelief(marks, arrived_ns, bound_ns, labelled=labelled)

    def passed(self, frame: FrameMessage) -> None:
        """Take note of a frame that was passed on. Until an echo proves it, a clock step makes it suspect."""
        self._unproven.passed(frame.marks.sent_ns, frame.session, frame.sequence)

    def _begin_doubt(self, why: str) -> None:
        self._account.clock_doubts += 1
        self.close()
        self._on_doubt()
        self._warn("clock_in_doubt", self._account.clock_doubts, why=why)

    def _note_step(self) -> None:
        """A clock has stepped: frames that passed since the last echo before the step may be paired wrongly."""
        self._account.clock_steps += 1
        frames = self._note_suspects()
        self._warn("clock_stepped", self._account.clock_steps, suspect_frames=frames)

    def _note_suspects(self) -> int:
        """Record the frames that no echo has proven since. Return their number."""
        suspects = self._unproven.stepped()
        if suspects is None:
            return 0
        self._account.suspects.append(suspects)
        return suspects.frames

    @staticmethod
    def _warn(name: str, count: int, **facts: object) -> None:
        if count.bit_count() == 1:  # log the 1st, 2nd, 4th, 8th …: a board that steps on purpose must not fill the log
            _LOG.warning(event(name, count=count, **facts))
