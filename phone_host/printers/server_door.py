"""Prints by a server: hands the file over, watches it, and on cancelling sees that the heaters are off.

The server prints by itself: when this program ends, the print goes on. When the server is silent, it is asked again for a minute.
"""

import re
import threading
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

from common import now
from common.errors import TandemError, UnavailableError
from phone_host.printers.door import Ended, Job, Phase, Progress, Wishes
from phone_host.printers.gcode import passed_note
from phone_host.printers.line import PrinterGoneError
from phone_host.printers.server import Condition, PrintServer, ServerState
from phone_host.printers.server_talk import LEAVING_S, ServerLostError

_SECOND_NS: Final = 1_000_000_000
_TELL_S: Final = 0.25
_SOON_S: Final = 0.2
"""Between questions while it cancels."""

_LOST_NS: Final = 60 * _SECOND_NS
_BEGIN_NS: Final = 20 * _SECOND_NS
_AGAIN_NS: Final = 2 * _SECOND_NS
_UNPROVED: Final = "the server has taken the orders to end the print and to switch the heaters off, and nobody has waited until they were done: see that the printer cools"
_MOST_NAME: Final = 60
_PHASE_OF: Final = {Condition.PAUSED: Phase.PAUSED, Condition.PRINTING: Phase.PRINTING, Condition.BUSY: Phase.PRINTING}


@dataclass(frozen=True, slots=True)
class ServerPatience:
    """How long a server is waited for.

    Attributes:
        ask_s: between questions while it prints, s.
        obey_s: until it has cancelled, s. Klipper cancels only when it has heated, which may take minutes: after this, what can be halted is halted.
        halted_s: until what was halted is cold, s.
    """

    ask_s: float = 1.0
    obey_s: float = 10.0
    halted_s: float = 5.0


class _StoppedError(Exception):
    """Raised inside a transfer that shall end. Nobody's fault."""


class ServerDoor:
    """A printer behind a server."""

    leaving_s = LEAVING_S

    def __init__(self, server: PrintServer, patience: ServerPatience | None = None) -> None:
        self._server, self._patience = server, patience or ServerPatience()

    def require_ready(self) -> None:
        """See PrinterDoor."""
        self._require_idle(self._server.state())

    def send(self, job: Job, wishes: Wishes, tell: Callable[[Progress], None]) -> Ended:
        """See PrinterDoor."""
        wishes.when_left(self._server.hurry)
        try:
            self.require_ready()
        except ServerLostError:
            if wishes.is_left:
                return Ended(phase=Phase.CANCELLED, share=0.0)
            raise

        def sent(share: float) -> None:
            tell(Progress(phase=Phase.SENDING, share=share))
            if wishes.is_cancelled:
                raise _StoppedError

        try:
            self._server.start(job.gcode, name_there(job.name), sent)
        except _StoppedError:
            return Ended(phase=Phase.CANCELLED, share=0.0)
        except ServerLostError as error:
            if wishes.is_left:
                return _Watch(self._server, job, wishes, tell, self._patience).until_over()
            raise ServerLostError(
                f"{error.problem} while it gets the file: it may or may not print", "look at its own page"
            ) from None
        ended = _Watch(self._server, job, wishes, tell, self._patience).until_over()
        return replace(ended, notes=(*ended.notes, *passed_note(job.facts.host_commands, self._server.title)))

    def _require_idle(self, state: ServerState) -> None:
        title = self._server.title
        if state.condition.is_active:
            share = f", {state.share:.0%} done" if state.share else ""
            raise UnavailableError(f"the printer of {title} is busy{share}", "wait until it is done, or end it there")
        if state.condition is Condition.OFFLINE:
            raise UnavailableError(
                f"{title} has no printer ({state.words or 'not connected'})",
                "switch the printer on, and connect it there",
            )
        if state.condition is Condition.ERROR:
            raise UnavailableError(f"{title} reports an error: {state.words or 'no words'}", "mend it on its own page")


def name_there(name: str) -> str:
    """Return a name for a file on a server: plain characters, and one that takes no other program's file away."""
    stem = re.sub(r"\.(gcode|gco|g)$", "", name, flags=re.IGNORECASE)
    plain = re.sub(r"[^A-Za-z0-9._-]+", "_", stem).strip("._")[:_MOST_NAME] or "print"
    return f"tandemscan-{plain}.gcode"


def _pause(wait_s: float) -> None:
    threading.Event().wait(wait_s)


class _Watch:
    """Watches one print."""

    def __init__(
        self,
        server: PrintServer,
        job: Job,
        wishes: Wishes,
        tell: Callable[[Progress], None],
        patience: ServerPatience,
    ) -> None:
        self._server, self._job, self._wishes, self._tell_user, self._patience = server, job, wishes, tell, patience
        self._began_ns = self._heard_ns = now.monotonic_ns()
        self._was_active = self._is_paused = False
        self._last = ServerState(condition=Condition.READY)

    def until_over(self) -> Ended:
        """Return how it ended."""
        while True:
            if self._wishes.is_cancelled:
                return self._cancelled()
            self._ask()
            if (ended := self._over()) is not None:
                return ended
            self._tell(_PHASE_OF.get(self._last.condition, Phase.OPENING))
            self._wait(self._patience.ask_s if self._was_active else _SOON_S)

    def _ask(self) -> None:
        """Ask how it is, and pass a pause on.

        Raises:
            UnavailableError: the server is silent for long, or says nothing that makes sense: a proxy before it may do so while it restarts.
        """
        try:
            if self._wishes.is_paused != self._is_paused:
                self._is_paused = not self._is_paused
                (self._server.pause if self._is_paused else self._server.go_on)()
            self._last = self._server.state()
        except UnavailableError as error:
            if now.monotonic_ns() - self._heard_ns > _LOST_NS:
                more = " any more" if isinstance(error, ServerLostError) else ""
                raise PrinterGoneError(
                    f"{error.problem}{more}: the print goes on there, and cannot be cooled from here",
                    "go and look",
                ) from None
            return
        self._heard_ns = now.monotonic_ns()

    def _over(self) -> Ended | None:
        """Return how it ended; None: it has not."""
        state, title = self._last, self._server.title
        if state.condition.is_active:
            self._was_active = True
            return None
        if state.condition in {Condition.ERROR, Condition.OFFLINE}:
            return self._failed(
                f"{title} says: {state.words or state.condition.value}",
                "see what the printer's display says: it cannot be cooled from here",
            )
        has_begun = self._was_active or now.monotonic_ns() - self._began_ns > _BEGIN_NS
        if not has_begun:
            return None
        if state.condition is Condition.DONE:
            return Ended(phase=Phase.DONE, share=1.0, notes=self._cold_at_end())
        if not self._was_active:
            return self._failed(f"{title} has the file, but does not print it", "look at its own page")
        words = f" ({state.words})" if state.condition is Condition.CANCELLED and state.words else ""
        return self._failed(f"the print was ended at the printer or on the page of {title}{words}", "start it again")

    def _failed(self, problem: str, remedy: str) -> Ended:
        done = f"; {self._last.share:.0%} of it was done" if self._last.share else ""
        return Ended(phase=Phase.FAILED, share=self._last.share, problem=problem, remedy=f"{remedy}{done}")

    def _cold_at_end(self) -> tuple[str, ...]:
        if not self._job.facts.leaves_hot:
            return ()
        try:
            if self._server.cool():
                return ("its G-code leaves heaters on: they were switched off",)
        except TandemError as error:
            return (f"its G-code leaves heaters on, and they could not be switched off ({error.problem}): go and look",)
        return (f"its G-code leaves heaters on, and {self._server.title} cannot switch them off: go and look",)

    def _cancelled(self) -> Ended:
        """End the print; return when the heaters are off.

        Raises:
            PrinterGoneError: nobody knows whether they are.
        """
        share, began_ns, asked_ns = self._last.share, now.monotonic_ns(), 0
        obey_ns = round(self._patience.obey_s * _SECOND_NS)
        while (now_ns := now.monotonic_ns()) - began_ns < obey_ns and not self._wishes.is_left:
            if now_ns - asked_ns > _AGAIN_NS:
                self._end_and_cool(is_first=not asked_ns)
                asked_ns = now_ns
            if self._is_cold():
                return Ended(phase=Phase.CANCELLED, share=share)
            self._tell(Phase.CANCELLING)
            _pause(_SOON_S)
        if self._wishes.is_left:
            is_taken, is_cold = self._end_and_cool(is_first=not asked_ns), self._is_cold()
            if is_taken or is_cold:
                return Ended(phase=Phase.CANCELLED, share=share, notes=() if is_cold else (_UNPROVED,))
        while (
            now.monotonic_ns() - began_ns < obey_ns + round(self._patience.halted_s * _SECOND_NS)
            and not self._wishes.is_left
            and (remedy := self._halted())
        ):
            if self._is_cold():
                said = f"the printer did not obey within {self._patience.obey_s:g} s and was stopped at once: {remedy}"
                return Ended(phase=Phase.CANCELLED, share=share, notes=(said,))
            _pause(_SOON_S)
        raise PrinterGoneError(
            f"{self._server.title} does not say that the print has ended and its heaters are off",
            "go and look; switch the printer off if its display does not say that they are cold",
        )

    def _end_and_cool(self, *, is_first: bool) -> bool:
        """Ask for the end, again only where the print still goes on, and for cold heaters; return whether the server has taken all."""
        is_taken = True
        ends = (self._server.cancel,) if is_first or self._last.condition.is_active else ()
        for ask in (*ends, self._server.cool):
            try:
                ask()
            except TandemError:  # one that is refused, or gets no answer, does not keep the other one away
                is_taken = False
        return is_taken

    def _halted(self) -> str:
        try:
            return self._server.halt()
        except TandemError:
            return ""

    def _is_cold(self) -> bool:
        try:
            self._last = self._server.state()
        except TandemError:
            return False
        return not self._last.condition.is_active and not self._last.is_hot

    def _tell(self, phase: Phase) -> None:
        last = self._last
        self._tell_user(Progress(phase=phase, share=last.share, seconds_left=last.seconds_left, heat=last.heat))

    def _wait(self, wait_s: float) -> None:
        """Wait, but not longer than until the user wishes something."""
        end_ns = now.monotonic_ns() + round(wait_s * _SECOND_NS)
        while now.monotonic_ns() < end_ns and self._wishes.is_paused == self._is_paused:
            if self._wishes.wait_cancelled(min(_TELL_S, wait_s)):
                return
            self._tell(_PHASE_OF.get(self._last.condition, Phase.OPENING))
