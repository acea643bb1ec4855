"""Speaks by a speech program of the system, if there is one. A thread of its own: speech never delays anything."""

import shutil
import subprocess
from collections.abc import Callable
from typing import Final

from phone_host.jobs.calibrate.newest import Newest

_PROGRAMS: Final = (("termux-tts-speak",), ("espeak-ng",), ("spd-say", "--wait"), ("say",))
_LONGEST_S: Final = 10.0
"""A speech program that takes longer hangs, for example because no sound device answers."""


def speech_program() -> tuple[str, ...]:
    """Return the command that speaks what follows it; empty: there is none."""
    return next((command for command in _PROGRAMS if shutil.which(command[0])), ())


class Voice:
    """Speaks the newest words; older ones that wait are left out.

    Args:
        command: of the speech program.
        failed: called once, in another thread, with the reason, if the program cannot be started. Then nothing is spoken any more.
    """

    def __init__(self, command: tuple[str, ...], failed: Callable[[OSError], None]) -> None:
        self._command, self._failed = command, failed
        self._words = Newest[str]("voice", self._speak)

    def say(self, words: str) -> None:
        """Speak. Returns at once."""
        self._words.offer(words)

    def finish(self) -> None:
        """Let the last words be spoken."""
        self._words.finish(patience_s=_LONGEST_S / 2)

    def _speak(self, words: str) -> None:
        quiet = subprocess.DEVNULL
        try:
            process = subprocess.Popen([*self._command, words], stdin=quiet, stdout=quiet, stderr=quiet)
        except OSError as error:
            self._failed(error)
            raise
        try:
            process.wait(_LONGEST_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
