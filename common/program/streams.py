"""Makes a process's standard streams safe to use, whatever its parent left of them, and whatever becomes of its terminal."""

import errno
import io
import os
import sys
from contextlib import suppress
from typing import Final

from common.program.interrupts import forget_terminal

_STANDARD: Final = (0, 1, 2)


def mend_streams() -> None:
    """Open what is closed, and let every letter be written.

    A closed descriptor (`>&-`) would go to the next file that is opened, and what native code prints would end up in it. What is written to
    such a stream is lost, as its caller wanted. A letter that the terminal's encoding does not have is written as its code.
    """
    for descriptor in _STANDARD:
        try:
            os.fstat(descriptor)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # the lowest free one: this
    sys.stdin = sys.stdin or open(0, closefd=False)  # noqa: SIM115 - a descriptor, for the whole process
    sys.stdout = sys.stdout or open(1, "w", closefd=False)  # noqa: SIM115
    sys.stderr = sys.stderr or open(2, "w", closefd=False)  # noqa: SIM115
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError):
            if isinstance(stream, io.TextIOWrapper):
                stream.reconfigure(errors="backslashreplace")
    if isinstance(sys.stderr, io.TextIOWrapper) and not isinstance(sys.stderr, _Stderr) and sys.stderr.isatty():
        sys.stderr = _Stderr(
            sys.stderr.buffer, encoding=sys.stderr.encoding, errors=sys.stderr.errors, line_buffering=True
        )


class _Stderr(io.TextIOWrapper):
    """Messages to a terminal. Once that is closed they are lost: a bar that cannot be drawn must not end the work that it shows."""

    def write(self, text: str, /) -> int:
        """Write, as every stream; a terminal that is gone takes everything."""
        try:
            return super().write(text)
        except OSError as error:
            self._forget(error)
            return len(text)

    def flush(self) -> None:
        """Flush, likewise."""
        try:
            super().flush()
        except OSError as error:
            self._forget(error)

    def _forget(self, error: OSError) -> None:
        if error.errno != errno.EIO:
            raise error
        forget_terminal()
