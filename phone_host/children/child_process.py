"""A program of ours as a child process that is gone when its block ends, whatever happens."""

import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Final

GOODBYE_S: Final = 10.0
"""One that was asked to end gets this long; our programs need 0.3 s at most on an idle machine."""


@contextmanager
def child_process(module: str, arguments: Sequence[str], *, errors: bool = False) -> Iterator[subprocess.Popen[bytes]]:
    """Run `python -m MODULE` for the length of a block, with a pipe from its stdout.

    Args:
        module: of ours, runnable.
        arguments: of its command line.
        errors: whether its stderr comes through a pipe, too; else it goes where ours goes.
    """
    # -P: a folder named `common` where the user happens to stand must not be taken for ours.
    process = subprocess.Popen(
        [sys.executable, "-P", "-m", module, *arguments],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE if errors else None,
    )
    try:
        yield process
    finally:
        if process.poll() is None:
            process.terminate()
            try:
                process.wait(GOODBYE_S)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        for pipe in (process.stdout, process.stderr):
            if pipe is not None:
                pipe.close()
