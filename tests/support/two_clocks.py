"""Two simulated clocks with a known relation, and the echoes that they would measure."""

import random
from dataclasses import dataclass
from fractions import Fraction

from common.protocol.session import Echo

START_NS = 10**12
BETWEEN_ECHOES_NS = 1000
BOARD_WORKS_NS = 20_000


@dataclass(slots=True)
class TwoClocks:
    """A board's clock that runs `skew` faster than the host's and showed `board_start_ns` when the host's showed START_NS.

    Attributes:
        board_start_ns: the board's clock at the start.
        skew: relative rate, exact.
    """

    board_start_ns: int
    skew: Fraction

    def board(self, host_ns: int) -> int:
        """What the board's clock shows at a moment of the host's."""
        return self.board_start_ns + round((host_ns - START_NS) * (1 + self.skew))

    def offset(self, board_ns: int) -> Fraction:
        """The true host clock minus board clock when the board's shows this."""
        return START_NS + (board_ns - self.board_start_ns) / (1 + self.skew) - board_ns

    def wave(
        self, number: int, host_ns: int, chance: random.Random, *, least_ns: int, jitter_ns: int, echoes: int = 5
    ) -> tuple[list[Echo], int]:
        """Back-to-back echoes, each way `least_ns` plus exponential jitter with that mean, and the host's time after them."""
        measured = []
        for _ in range(echoes):
            there, back = (least_ns + round(chance.expovariate(1) * jitter_ns) for _ in range(2))
            t1, t2 = host_ns + there, host_ns + there + BOARD_WORKS_NS
            t3 = t2 + back
            measured.append(Echo(wave=number, t0_ns=host_ns, t1_ns=self.board(t1), t2_ns=self.board(t2), t3_ns=t3))
            host_ns = t3 + BETWEEN_ECHOES_NS
        return measured, host_ns
