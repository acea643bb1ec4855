"""A child process that gets a signal at one of its steps: before the Nth change of names or opening of a file for writing. Real processes, files and signals.

Python tells its audit hooks of each such step before it makes it (PEP 578), so every step of a program is reached, and always the same one.
"""

import os
import signal
import sys
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

_STEPS: Final = frozenset({"os.rename", "os.remove", "os.rmdir", "os.mkdir", "os.link", "os.truncate"})
_WRITES: Final = os.O_WRONLY | os.O_RDWR | os.O_CREAT


@dataclass(frozen=True, slots=True)
class Ending:
    """How a child process ended.

    Attributes:
        code: its exit code (1: an error, which it has printed); None: a signal ended it.
        steps: how many steps it came to; 0 if a signal ended it.
    """

    code: int | None
    steps: int = 0


def killed_at(step: int, work: Callable[[], object], number: int = signal.SIGKILL) -> Ending:
    """Do something in a child process that gets a signal before a step.

    Args:
        step: number of the step, from 1; 0: no signal comes.
        work: what the child does.
        number: of the signal.
    """
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        os._exit(_child(step, work, number, writer))
    os.close(writer)
    with os.fdopen(reader, "rb") as told:
        steps = told.read()
    status = os.waitpid(child, 0)[1]
    if os.WIFSIGNALED(status):
        return Ending(None)
    return Ending(os.waitstatus_to_exitcode(status), int(steps or b"0"))


def _child(step: int, work: Callable[[], object], number: int, writer: int) -> int:
    steps = 0

    def count(event: str, arguments: tuple[object, ...]) -> None:
        nonlocal steps
        is_writing = event == "open" and isinstance(arguments[2], int) and bool(arguments[2] & _WRITES)
        if event in _STEPS or is_writing:
            steps += 1
            if steps == step:
                os.kill(os.getpid(), number)

    code = 1
    try:
        sys.addaudithook(count)
        work()
        code = 0
    except SystemExit as error:
        code = error.code if isinstance(error.code, int) else 1
    except BaseException:  # noqa: BLE001 - a process must not go on as a second test run
        traceback.print_exc()
    os.write(writer, b"%d" % steps)
    return code
