"""Runs one of our programs as a child process that always ends with its block."""

import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Final

GOODBYE_S: Final = 10.0
"""How long a child may take to end when asked. Our programs need at most 0.3 s on an idle machine."""


@contextmanager
def child_process(module: str, arguments: Sequence[str], *, errors: bool = False) -> Iterator[subprocess.Popen[bytes]]:
    """Run `python -m MODULE` for the length of a block, with a pipe from its stdout.

    Args:
        module: one of our runnable modules.
        arguments: its command line.
        errors: whether its stderr is a pipe, too. Otherwise it goes where ours goes.
    """
    # -P: do not import a folder named `common` from the user's current folder.
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
