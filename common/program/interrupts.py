"""Ctrl-C and SIGTERM end a command within a second, wherever they come: exit code 130 or 143, one line, no traceback, nothing half written.

Three phases. While a command is being imported there is nothing to tidy up: `leave_at_once` ends the process in the
signal handler. While it runs, Python raises KeyboardInterrupt, but only once native code returns, and OpenCV may
compute for a minute. So under `interruptible(native=True)` a thread waits for the signal too. It ends the process if
the main thread has not left within `_GRACE_S`. Once the command is done, its results count and Ctrl-C is ignored.

SIGTERM ends a command that computes in the same way, at once: nothing of it is of use yet, so its exit code is not 0.
One that keeps what it has come to takes it as Ctrl-C (`terminable`), and is given the time to write it (`answering`).

Commands that end in their own way (StopSignals) replace the handler while they run. Light: a command's first import.
"""

import os
import select
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import Final, NoReturn

INTERRUPTED: Final = 130
"""128 + SIGINT, as shells report it."""

TERMINATED: Final = 143
"""128 + SIGTERM."""

_SAID: Final = {signal.SIGINT: (b"interrupted\n", INTERRUPTED), signal.SIGTERM: (b"terminated\n", TERMINATED)}

_STDERR: Final = 2

_ANSWERING: Final = threading.Event()
"""Set while the main thread writes what it has come to."""

_CLEAR_LINE: Final = b"\r\x1b[K\x1b[?25h"
"""Empties the line of a progress bar and shows the cursor, which a bar hides (ECMA-48: EL; DEC private mode 25)."""

_GRACE_S: Final = 0.5
"""Python code ends within milliseconds of a signal; the other half of the second is for a busy machine."""


class Terminated(KeyboardInterrupt):
    """SIGTERM came where it is taken as Ctrl-C."""


def leave_at_once() -> None:
    """Let Ctrl-C end this process without any further code, until `interruptible` begins. Call it in the main thread."""
    signal.signal(signal.SIGINT, _leave)


@contextmanager
def interruptible(*, native: bool = False) -> Iterator[None]:
    """Raise KeyboardInterrupt on Ctrl-C while the block runs.

    Outside the main thread, and in a process that handles Ctrl-C in another way, this does nothing.

    Args:
        native: whether to end the process if native code keeps KeyboardInterrupt from being raised. Only for commands
            whose child processes, if any, need no goodbye.
    """
    handler = signal.getsignal(signal.SIGINT)
    is_ours = handler in {
        _leave,
        signal.default_int_handler,
        signal.SIG_IGN,
    }  # a script's job in the background ignores it
    if threading.current_thread() is not threading.main_thread() or not is_ours:
        yield
        return
    if handler is not signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    is_default = signal.getsignal(signal.SIGTERM) is signal.SIG_DFL
    if is_default:
        signal.signal(signal.SIGTERM, _end)
    watcher = _Watcher() if native else None
    try:
        yield
    finally:
        if watcher is not None:
            watcher.stop()
        # A process that began with `leave_at_once` has only its exit left, which a signal must not disturb.
        signal.signal(signal.SIGINT, signal.SIG_IGN if handler is _leave else handler)
        if is_default:
            signal.signal(signal.SIGTERM, signal.SIG_IGN if handler is _leave else signal.SIG_DFL)


@contextmanager
def terminable() -> Iterator[None]:
    """Raise `Terminated` on SIGTERM while the block runs, where `interruptible` would end the process at once."""
    if threading.current_thread() is not threading.main_thread() or signal.getsignal(signal.SIGTERM) is not _end:
        yield
        return
    signal.signal(signal.SIGTERM, _terminate)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, _end)


@contextmanager
def answering() -> Iterator[None]:
    """Let the main thread write what it has come to, however long that takes; another Ctrl-C or SIGTERM ends the process at once."""
    _ANSWERING.set()
    try:
        yield
    finally:
        _ANSWERING.clear()


def leave(number: int = signal.SIGINT) -> NoReturn:
    """End this process now with one line and the exit code of a signal. What it had begun to write is removed.

    Args:
        number: SIGINT or SIGTERM.
    """
    from common.unfinished import remove_unfinished  # noqa: PLC0415 - a start does not pay for it

    remove_unfinished()
    _say_so(number)
    os._exit(_SAID[signal.Signals(number)][1])


def is_heard() -> bool:
    """Whether stderr takes a line now. A pipe that nobody empties, or a terminal that is held, would block for ever."""
    with suppress(OSError, ValueError):
        return bool(select.select([], [_STDERR], [], 0)[1])
    return True  # closed: writing to it fails at once


def _say_so(number: int) -> None:
    """Write the one line, in a terminal in place of a progress bar."""
    if is_heard():
        with suppress(OSError):  # closed: the exit code must suffice
            os.write(_STDERR, _CLEAR_LINE * os.isatty(_STDERR) + _SAID[signal.Signals(number)][0])


def _end(number: int, frame: FrameType | None) -> None:
    del frame
    leave(number)


def _terminate(number: int, frame: FrameType | None) -> NoReturn:
    del number, frame
    raise Terminated


def _leave(number: int, frame: FrameType | None) -> None:
    del frame
    _say_so(number)
    os._exit(INTERRUPTED)


class _Watcher:
    """Ends the process some time after SIGINT, unless it is stopped before. Create and stop it in the main thread."""

    def __init__(self) -> None:
        self._reader, self._writer = os.pipe()
        os.set_blocking(self._writer, False)
        # The wakeup descriptor is written by the C handler at once, while native code still runs in the main thread.
        self._before = signal.set_wakeup_fd(self._writer, warn_on_full_buffer=False)
        self._stopped = threading.Event()
        self._thread = threading.Thread(target=self._watch, name="interrupts", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Leave the process alone from now on."""
        self._stopped.set()
        signal.set_wakeup_fd(self._before)
        os.close(self._writer)
        self._thread.join()
        os.close(self._reader)

    def _watch(self) -> None:
        while number := os.read(self._reader, 1):
            if number[0] in _SAID:
                break
        if not number or self._stopped.wait(_GRACE_S):
            return
        while _ANSWERING.is_set() and not self._is_told_again():
            pass
        if not self._stopped.wait(_GRACE_S):
            leave(number[0])

    def _is_told_again(self) -> bool:
        """Wait a moment; return whether another signal that ends the process came, or the watching ended."""
        if not select.select([self._reader], [], [], _GRACE_S)[0]:
            return False
        number = os.read(self._reader, 1)
        return not number or number[0] in _SAID
