"""Points in time that know their clock, so that the times of two machines cannot be mixed by accident."""

from common.errors import ClockMismatchError
from common.value import value

HOST_CLOCK = "host"
"""Name of the clock on which pairs are formed and delays are summed: CLOCK_MONOTONIC of the host."""


def board_clock(boot_id: str) -> str:
    """Name the CLOCK_MONOTONIC of a board. A reboot starts a new clock; a restart of the service does not."""
    return f"board:{boot_id}"


@value()
class Stamp:
    """A moment: nanoseconds on a named clock.

    Attributes:
        ns: nanoseconds since that clock's own zero.
        clock: the clock's name; only stamps of one clock may be compared.
    """

    ns: int
    clock: str

    def __sub__(self, other: "Stamp") -> int:
        """Nanoseconds from `other` to this moment.

        Raises:
            ClockMismatchError: the two are on different clocks.
        """
        self._check(other)
        return self.ns - other.ns

    def __lt__(self, other: "Stamp") -> bool:
        self._check(other)
        return self.ns < other.ns

    def __le__(self, other: "Stamp") -> bool:
        self._check(other)
        return self.ns <= other.ns

    def plus(self, duration_ns: int) -> "Stamp":
        """Return the moment `duration_ns` later on the same clock."""
        return Stamp(self.ns + duration_ns, self.clock)

    def _check(self, other: "Stamp") -> None:
        if self.clock != other.clock:
            raise ClockMismatchError(f"stamps of clocks {self.clock!r} and {other.clock!r} are mixed")
