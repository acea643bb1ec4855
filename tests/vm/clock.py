"""A guest's clock, read from outside."""

import subprocess
import time
from typing import Final

ECHO: Final = "import sys, time\nfor _ in sys.stdin: print(time.monotonic_ns())"


class GuestClock:
    """Reads the guest's CLOCK_MONOTONIC from outside: the truth against which the product's own estimate is checked.

    Args:
        command: starts the echo.
    """

    def __init__(self, command: list[str]) -> None:
        self._echo = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, bufsize=0)

    def offset_ns(self) -> tuple[int, int]:
        """Measure guest's clock minus this machine's.

        Returns:
            The offset and its maximum error, ns: half of the shortest of 50 round trips.
        """
        readings = []
        for _ in range(50):
            before_ns = time.monotonic_ns()
            there_ns = self._ask()
            after_ns = time.monotonic_ns()
            readings.append((after_ns - before_ns, there_ns - (before_ns + after_ns) // 2))
        round_trip_ns, offset_ns = min(readings)
        return offset_ns, round_trip_ns // 2

    def close(self) -> None:
        """End the echo."""
        self._echo.kill()
        with self._echo:  # closes its pipes and waits
            pass

    def _ask(self) -> int:
        assert self._echo.stdin is not None
        assert self._echo.stdout is not None
        self._echo.stdin.write(b"\n")
        return int(self._echo.stdout.readline())
