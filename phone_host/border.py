"""The border of the host: which frames of the board are believed, by which clock. What cannot be is dropped here and counted by its reason.

Rules: no frame from before a doubt of the clock meets one from after it; while the clock is in doubt none is believed. What passes needs no
check of its stamps any more. Belongs to the receiver's thread.
"""

import logging
from collections.abc import Callable
from typing import Final

from common.logs import event
from common.protocol.message import CameraDescription, FrameMessage, Pacing
from common.protocol.session import Echo
from phone_host.accounts import LinkAccount, SessionAccount
from phone_host.model import BoardFrame
from phone_host.sync.clock import ClockEstimate, Heard
from phone_host.sync.clocks import LinkClocks
from phone_host.sync.gate import Disbelief, Gate, Unproven, disbelief

_LOG = logging.getLogger(__name__)

_MOST_HELD: Final = 4
"""While so many frames wait for an echo no more are asked for."""

Admitted = tuple[int, BoardFrame]
"""A frame that may pass, and the link that it came over."""


class Border:
    """Clock and gate of one board.

    Args:
        account: of the links; doubts, steps and what was not believed are counted there.
        on_doubt: told when nothing from before this moment may be paired any more.
    """

    def __init__(self, account: LinkAccount, on_doubt: Callable[[], None]) -> None:
        self._account = account
        self._on_doubt = on_doubt
        self._clock = LinkClocks(len(account.links))
        self._gate: Gate[Admitted] = Gate()
        self._unproven = Unproven()
        self._session: SessionAccount | None = None

    @property
    def estimate(self) -> ClockEstimate | None:
        """The clock estimate now; None before the first echo, and while it is in doubt."""
        return self._clock.estimate

    @property
    def waits_for_echo(self) -> bool:
        """Whether the next echo is wanted as soon as possible."""
        return self._clock.in_doubt or self._gate.held > 0

    @property
    def takes_frames(self) -> bool:
        """Whether a frame that came now could be of use."""
        return self._clock.estimate is not None and self._gate.held < _MOST_HELD

    def round_trip_ns(self, link: int) -> int | None:
        """Least round trip of late over one link; None before its first echo."""
        return self._clock.round_trip_ns(link)

    def other_clock(self) -> None:
        """The board has booted anew, or slept: another clock."""
        self._clock = LinkClocks(len(self._account.links))
        self._unproven = Unproven()
        self.close()

    def void(self, why: str) -> None:
        """Forget what was learnt of the clock; the next echo tells whether it has stepped."""
        self._clock.void()
        self._begin_doubt(why)

    def link_down(self, link: int) -> None:
        """A link is lost, and with it what its echoes left open."""
        self._clock.down(link)

    def close(self) -> None:
        """Give up the frames that wait for an echo: none will come for them."""
        for _ in self._gate.void():
            self._drop(Disbelief.CLOCK)

    def leave(self) -> list[BoardFrame]:
        """Give the frames that wait for an echo at the end of the run."""
        return [frame for _, frame in self._gate.void()]

    def learn(self, echo: Echo) -> list[Admitted]:
        """Take an echo to the clock.

        Args:
            echo: its four times.

        Returns:
            Frames that it has proven.
        """
        was_in_doubt = self._clock.in_doubt
        match self._clock.add(echo):
            case Heard.DOUBTED if not was_in_doubt:
                self._begin_doubt("an echo contradicts the ones before it")
            case Heard.STEPPED:
                self._note_step()
            case Heard.AGREED:
                if was_in_doubt and not self._clock.in_doubt:
                    _LOG.info(event("clock_known_again", stepped=False))
                self._unproven.confirmed(echo.t1_ns)
                return self._gate.confirmed(echo.t1_ns)
            case _:
                pass
        return []

    def admit(
        self, frame: FrameMessage, link: int, account: SessionAccount, camera: CameraDescription, now_ns: int
    ) -> BoardFrame | None:
        """Take a frame that has come.

        Args:
            frame: what came.
            link: over which link.
            account: of its session.
            camera: what the board says of its camera.
            now_ns: arrival of the last byte, ns.

        Returns:
            The frame with its marks on the host's clock, if it may pass now; None where it was dropped or has to wait for an echo.
        """
        self._session = account
        estimate = self._clock.estimate
        if frame.width_px > camera.width_px or frame.height_px > camera.height_px:
            self._drop(Disbelief.SIZE)
            return None
        if estimate is None:
            if self._clock.in_doubt:
                self._drop(Disbelief.CLOCK)
            else:
                self._account.no_clock += 1
            return None
        # Only `sent` is mapped to the host's clock, once, here; the other marks keep their distance to it.
        sent_ns = frame.marks.sent_ns
        told = estimate.to_host(sent_ns)
        marks = frame.marks.moved_to(told.ns)
        labelled = camera.pacing is Pacing.DEMAND
        reason = disbelief(marks, now_ns, told.bound_ns, labelled=labelled)
        if reason is not None:
            self._drop(reason)
            return None
        name = self._account.links[link].name
        asked_px = (camera.width_px, camera.height_px)
        taken = BoardFrame(frame, name, marks, now_ns, told.ns - sent_ns, told.uncertainty_ns, asked_px)
        passes = labelled or self._gate.arrived((link, taken), sent_ns, now_ns - marks.sent_ns, camera.period_ns)
        return taken if passes else None

    def passed(self, frame: FrameMessage) -> None:
        """Take note of a frame that was given on: until an echo proves it, it counts as suspect."""
        self._unproven.passed(frame.marks.sent_ns, frame.session, frame.sequence)

    def _drop(self, reason: Disbelief) -> None:
        if self._session is not None:
            self._session.disbelieved[reason] += 1

    def _begin_doubt(self, why: str) -> None:
        self._account.clock_doubts += 1
        self.close()
        self._on_doubt()
        _LOG.warning(event("clock_in_doubt", count=self._account.clock_doubts, why=why))

    def _note_step(self) -> None:
        """A step is confirmed: what passed since the last echo before it may be paired wrongly."""
        self._account.clock_steps += 1
        suspects = self._unproven.stepped()
        if suspects is not None:
            self._account.suspects.append(suspects)
        frames = 0 if suspects is None else suspects.frames
        _LOG.warning(event("clock_known_again", stepped=True, count=self._account.clock_steps, suspect_frames=frames))
