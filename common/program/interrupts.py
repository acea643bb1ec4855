"""Ctrl-C, SIGTERM, SIGHUP and SIGQUIT end a command within a second, wherever they come: one line, no traceback, nothing half written.

`ENDINGS` is the one table of these signals and their exit codes, for every command and both daemons.

Three phases. While a command is being imported there is nothing to tidy up: `leave_at_once` ends the process in the
signal handler. While it runs, Python raises KeyboardInterrupt, but only once native code returns, and OpenCV may
compute for a minute. So under `interruptible(native=True)` a thread waits for the signal too. It ends the process if
the main thread has not left within `_GRACE_S`. Once the command is done, its results count and Ctrl-C is ignored.

SIGTERM, SIGHUP (the terminal was closed, ssh was lost) and SIGQUIT end a command that computes in the same way, at once:
nothing of it is of use yet, so its exit code is not 0. One that keeps what it has come to takes them as Ctrl-C
(`terminable`), and is given the time to write it (`answering`). Where a parent has SIGHUP ignored (nohup), it stays so.

Commands that end in their own way (StopSignals) replace the handler while they run. Light: a command's first import.
"""

import os
import select
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from stat import S_ISCHR
from types import FrameType
from typing import Final, NamedTuple, NoReturn


class Ending(NamedTuple):
    """How a command ends by a signal: the word that it says, and its exit code."""

    word: str
    exit_code: int


ENDINGS: Final[dict[int, Ending]] = {
    signal.SIGINT: Ending("interrupted", 130),
    signal.SIGTERM: Ending("terminated", 143),
    signal.SIGHUP: Ending("hung up", 129),
    signal.SIGQUIT: Ending("quit", 131),
}
"""Signals that end a command, with 128 + their number, as shells report it. Daemons and streams end in order by all but Ctrl-C, with 0."""

INTERRUPTED: Final = ENDINGS[signal.SIGINT].exit_code
HUNG_UP: Final = ENDINGS[signal.SIGHUP].exit_code

_OTHERS: Final = tuple(number for number in ENDINGS if number != signal.SIGINT)
"""Those that Python leaves to the system."""

_STDERR: Final = 2

_ANSWERING: Final = threading.Event()
"""Set while the main thread writes what it has come to."""

_CLEAR_LINE: Final = b"\r\x1b[K\x1b[?25h"
"""Empties the line of a progress bar and shows the cursor, which a bar hides (ECMA-48: EL; DEC private mode 25)."""

_GRACE_S: Final = 0.5
"""Python code ends within milliseconds of a signal; the other half of the second is for a busy machine."""


class StopRequested(KeyboardInterrupt):
    """A signal came where it is taken as Ctrl-C.

    Attributes:
        number: of the signal.
    """

    def __init__(self, number: int) -> None:
        super().__init__(ENDINGS[number].word)
        self.number = number


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
    defaults = [number for number in _OTHERS if signal.getsignal(number) is signal.SIG_DFL]
    for number in defaults:
        signal.signal(number, _end)
    watcher = _Watcher() if native else None
    try:
        yield
    finally:
        if watcher is not None:
            watcher.stop()
        # A process that began with `leave_at_once` has only its exit left, which a signal must not disturb.
        signal.signal(signal.SIGINT, signal.SIG_IGN if handler is _leave else handler)
        for number in defaults:
            signal.signal(number, signal.SIG_IGN if handler is _leave else signal.SIG_DFL)


@contextmanager
def terminable() -> Iterator[None]:
    """Raise `StopRequested` on SIGTERM, SIGHUP and SIGQUIT while the block runs, where `interruptible` would end the process at once."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    taken = [number for number in _OTHERS if signal.getsignal(number) is _end]
    for number in taken:
        signal.signal(number, _request_stop)
    try:
        yield
    finally:
        for number in taken:
            signal.signal(number, _end)


@contextmanager
def answering() -> Iterator[None]:
    """Let the main thread write what it has come to, however long that takes; another Ctrl-C or SIGTERM ends the process at once."""
    _ANSWERING.set()
    try:
        yield
    finally:
        _ANSWERING.clear()


def leave(number: int = signal.SIGINT) -> NoReturn:
    """End this process now with one line and the exit code of a signal, or of what could not be left safely. What it had begun to write is removed."""
    from common.unfinished import remove_unfinished  # noqa: PLC0415 - a start does not pay for it

    if threading.current_thread() is threading.main_thread():
        for each in ENDINGS:  # a key that is held would call this again within itself, until Python gives up
            signal.signal(each, signal.SIG_IGN)
    removed = remove_unfinished()
    _say_so(number, removed.words)
    os._exit(removed.exit_code or ENDINGS[number].exit_code)


def is_heard() -> bool:
    """Whether stderr takes a line now. A pipe that nobody empties, or a terminal that is held, would block for ever."""
    with suppress(OSError, ValueError):
        return bool(select.select([], [_STDERR], [], 0)[1])
    return True  # closed: writing to it fails at once


def _say_so(number: int, words: str = "") -> None:
    """Write the one line, in a terminal in place of a progress bar."""
    if is_heard():
        line = ": ".join(filter(None, (ENDINGS[number].word, words)))
        with suppress(OSError):  # closed: the exit code must suffice
            os.write(_STDERR, _CLEAR_LINE * os.isatty(_STDERR) + f"{line}\n".encode())


def forget_terminal() -> None:
    """Send what goes to a terminal that has hung up nowhere: writing there would fail, in the middle of what must still be done."""
    for descriptor in (0, 1, 2):
        with suppress(OSError):
            poll = select.poll()
            poll.register(descriptor, 0)
            if S_ISCHR(os.fstat(descriptor).st_mode) and any(event & select.POLLHUP for _, event in poll.poll(0)):
                nowhere = os.open(os.devnull, os.O_RDWR)
                os.dup2(nowhere, descriptor)
                os.close(nowhere)


def _end(number: int, frame: FrameType | None) -> None:
    del frame
    leave(number)


def _request_stop(number: int, frame: FrameType | None) -> NoReturn:
    del frame
    forget_terminal()
    raise StopRequested(number)


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
            if number[0] in ENDINGS:
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
        return not number or number[0] in ENDINGS
