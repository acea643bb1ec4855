"""A child process that is killed at one of its steps: before the Nth change of names or opening of a file for writing. Real processes, real files, SIGKILL.

Python tells its audit hooks of each such step before it makes it (PEP 578), so every step of a program is reached, and always the same one.
"""

import os
import signal
import sys
import traceback
from collections.abc import Callable
from typing import Final

_STEPS: Final = frozenset({"os.rename", "os.remove", "os.rmdir", "os.mkdir", "os.link", "os.truncate"})
_WRITES: Final = os.O_WRONLY | os.O_RDWR | os.O_CREAT


def killed_at(step: int, work: Callable[[], object]) -> int | None:
    """Do something in a child process that is killed before a step.

    Args:
        step: number of the step, from 1.
        work: what the child does.

    Returns:
        Its exit code if it ended by itself (1: an error, which it has printed); None if it was killed.
    """
    child = os.fork()
    if child == 0:
        left = step

        def count(event: str, arguments: tuple[object, ...]) -> None:
            nonlocal left
            is_writing = event == "open" and isinstance(arguments[2], int) and bool(arguments[2] & _WRITES)
            if event in _STEPS or is_writing:
                left -= 1
                if left == 0:
                    os.kill(os.getpid(), signal.SIGKILL)

        code = 1
        try:
            sys.addaudithook(count)
            work()
            code = 0
        except SystemExit as error:
            code = error.code if isinstance(error.code, int) else 1
        except BaseException:  # noqa: BLE001 - a process must not go on as a second test run
            traceback.print_exc()
        os._exit(code)
    status = os.waitpid(child, 0)[1]
    return None if os.WIFSIGNALED(status) else os.waitstatus_to_exitcode(status)
