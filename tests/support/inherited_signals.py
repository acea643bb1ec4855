"""Signals that end a program, as the programs that tests start shall find them, whatever this process has inherited."""

import signal
from types import FrameType
from typing import Final

ENDING: Final = (signal.SIGINT, signal.SIGHUP, signal.SIGQUIT, signal.SIGTERM)
"""A background job of `sh` is born with the first and the third ignored, one under `nohup` with the second; its children inherit that."""


def restore_for_children() -> None:
    """Let every program that this process starts from now on begin with the default of each signal that was ignored.

    This process goes on ignoring them, by a handler: handlers do not outlast an exec, what is ignored does. Call it in the main thread.
    """
    for number in ENDING:
        if signal.getsignal(number) is signal.SIG_IGN:
            signal.signal(number, _ignore)


def _ignore(number: int, frame: FrameType | None) -> None:
    """Do nothing."""
    del number, frame
