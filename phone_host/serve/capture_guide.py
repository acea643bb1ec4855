"""Tells the page how far the check of a camera's film is, no oftener than there is something new. Pure."""

from collections.abc import Callable, Sequence
from typing import Final

from common.diagnostic import Diagnostic, Severity
from common.doctor.finding import ok
from phone_host.doctor.camera_check.check import ENOUGH, Progress
from phone_host.doctor.camera_check.words import stage_words

_STEPS: Final = 20


class CaptureGuide:
    """Guides whoever holds the camera.

    Args:
        show: takes what the page shall show.
    """

    def __init__(self, show: Callable[[Sequence[Diagnostic]], None]) -> None:
        self._show, self._shown = show, ("", -1, -1)

    def wait(self) -> None:
        """Say that the camera is waited for; a phone's may take seconds."""
        self._show([ok("film", "waiting for the camera")])

    def tell(self, progress: Progress) -> None:
        """Take the progress; called with each frame."""
        now = (stage_words(progress), int(progress.share * _STEPS), progress.told)
        if now == self._shown:
            return
        self._shown = now
        done = f"{100 * now[1] // _STEPS} % done, {min(progress.told, ENOUGH)} of {ENOUGH} segments were usable"
        self._show([Diagnostic(now[0], done, Severity.OK, "film")])
