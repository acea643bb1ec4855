"""Another user's process: what a compromised service, or somebody else on this machine, may do. Only root can start one."""

import os
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final, NoReturn

from tests.support.programs import until

NOBODY: Final = 65534


def _become(what: Callable[[], object]) -> NoReturn:
    code = 1
    try:
        os.setgroups([])
        os.setresgid(NOBODY, NOBODY, NOBODY)
        os.setresuid(NOBODY, NOBODY, NOBODY)
        what()
        code = 0
    finally:
        os._exit(code)  # a process must not go on as a second test run


def as_nobody(what: Callable[[], object]) -> None:
    """Do something, to its end."""
    child = os.fork()
    if not child:
        _become(what)
    assert os.waitpid(child, 0)[1] == 0


@contextmanager
def nobody(what: Callable[[], object], sign: Path | None = None) -> Iterator[None]:
    """Do something for the length of a block, which begins once there is a file of this name."""
    child = os.fork()
    if not child:
        _become(what)
    try:
        if sign is not None:
            until(sign.exists, f"{sign} is there")
        yield
    finally:
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
