"""Simulated clocks and links with known truth: the clock estimator is measured against them.

The waves are those of the real `HostSession`; only time, delays and the board's answers are simulated. On every link
the least delays of the two directions differ by up to 8 % of the least round trip, the near-symmetry that the estimator
assumes; profiles named adversarial do not keep it.
"""

import math
import random
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from common.protocol.host_session import HostSession
from common.protocol.message import BoardCounts, BoardHello, Lane, Ping, Pong, Rung
from common.protocol.session import Echo, Outgoing, Output, connection_name
from tests.support.samples import CAMERA

US, MS, SECOND_NS = 1_000, 1_000_000, 1_000_000_000
HOURS_NS = 5 * 3600 * SECOND_NS
PPM_PER_MINUTE = 1e-6 / 60e9
_ASYMMETRY = 0.08
_UNIT_BYTES = 256 + 11
"""A chunk with its frame (DESIGN, decision 2)."""

_BITS_PER_BYTE = 10
_LANES = {lane: connection_name(0, lane.name.encode()) for lane in (Lane.CONTROL, Lane.FRAMES)}


class DriftingClocks:
    """A host's and a board's clock: offset up to hours, skew up to 100 ppm, changing as slowly as temperature does.

    offset(b) = o + s (b - b0) + a P / 2 pi (cos p - cos(2 pi (b - b0) / P + p)): the skew swings by a around s with
    period P; |its change| <= a 2 pi / P, which is drawn from 0 to `change`.

    Args:
        chance: draws the clocks.
        change: greatest change of the skew, per ns.
    """

    def __init__(self, chance: random.Random, change: float = PPM_PER_MINUTE) -> None:
        self.board_start_ns = chance.randrange(10**12, 10**14)
        self._offset_ns = chance.randint(-HOURS_NS, HOURS_NS)
        self._rate = 2 * math.pi / chance.uniform(120e9, 1200e9)
        self._swing = min(3e-6, chance.random() * change / self._rate)
        self._skew = chance.uniform(-97e-6, 97e-6)
        self._phase = chance.uniform(0, 2 * math.pi)

    @property
    def start_ns(self) -> int:
        """Host time at the start."""
        return self.board_start_ns + self._offset_ns

    def offset(self, board_ns: int) -> float:
        """Host clock minus board clock minus `origin_ns`, exact to a small fraction of a ns."""
        age = board_ns - self.board_start_ns
        return self._skew * age + self._swing / self._rate * (
            math.cos(self._phase) - math.cos(self._rate * age + self._phase)
        )

    @property
    def origin_ns(self) -> int:
        """The integer part of the offset, kept apart because a float cannot hold hours and nanoseconds at once."""
        return self._offset_ns

    def board(self, host_ns: int) -> int:
        """What the board's clock shows at a moment of the host's clock."""
        elapsed = host_ns - self.start_ns
        age = float(elapsed)
        for _ in range(4):  # each step's error is 1e-4 of the one before
            age = elapsed - self.offset(self.board_start_ns + round(age))
        return self.board_start_ns + round(age)


@dataclass(frozen=True, slots=True)
class Delays:
    """A randomly drawn link: the delays of both directions, ns, given whether the echo is the first after a rest and since when the link is up."""

    there: Callable[[bool, int], float]
    back: Callable[[bool, int], float]


Profile = Callable[[random.Random], Delays]


def least_delays(chance: random.Random, low_ns: float, high_ns: float) -> tuple[float, float]:
    """Draw the least delays there and back, ns: around one base in a range, unequal by up to the near-symmetry."""
    base, unequal = chance.uniform(low_ns, high_ns), chance.uniform(-_ASYMMETRY, _ASYMMETRY)
    return base * (1 + unequal), base * (1 - unequal)


def loopback(chance: random.Random) -> Delays:
    """Two processes of one machine: wake-ups, a cold first one, rare waits on the run queue; frames of a MB ahead of a third of the answers."""
    (there, back), scatter = least_delays(chance, 30 * US, 60 * US), chance.uniform(10 * US, 60 * US)

    def wake(*, first: bool) -> float:
        late = chance.expovariate(1 / MS) if chance.random() < 0.05 else 0.0
        return chance.expovariate(1 / scatter) + late + (chance.uniform(20 * US, 80 * US) if first else 0.0)

    def answer(first: bool, _age_ns: int) -> float:  # noqa: FBT001 - one of many of one type
        return back + wake(first=first) + (chance.uniform(0, 300 * US) if chance.random() < 1 / 3 else 0.0)

    return Delays(lambda first, _age_ns: there + wake(first=first), answer)


def wifi(chance: random.Random) -> Delays:
    """Least round trip about 2 ms; exponential jitter, 2 to 10 ms on average in both directions."""
    (there, back), jitter = least_delays(chance, 0.6 * MS, 1.2 * MS), chance.uniform(2 * MS, 10 * MS)
    return Delays(
        lambda _first, _age_ns: there + chance.expovariate(1 / jitter),
        lambda _first, _age_ns: back + chance.expovariate(1 / jitter),
    )


def loaded_line(bits_per_s: float, least_ns: float, slot_ns: float, wait_ns: float | None = None) -> Profile:
    """A line full of image bytes: each answer waits behind up to two chunks (or `wait_ns`); both directions wait for a slot of the radio or bus."""
    wait = 2 * _UNIT_BYTES * _BITS_PER_BYTE / bits_per_s * 1e9 if wait_ns is None else wait_ns

    def draw(chance: random.Random) -> Delays:
        there, back = least_delays(chance, 0.8 * least_ns, 1.2 * least_ns)

        def slot() -> float:
            return chance.uniform(0, slot_ns) + chance.expovariate(1 / (30 * US))

        return Delays(
            lambda _first, _age_ns: there + slot(), lambda _first, _age_ns: back + slot() + chance.uniform(0, wait)
        )

    return draw


def one_sided(chance: random.Random) -> Delays:
    """Adversarial: one direction always takes 20 ms more."""
    return Delays(lambda _f, _a: MS + chance.expovariate(1 / MS), lambda _f, _a: 21 * MS + chance.expovariate(1 / MS))


def standing_queue(chance: random.Random) -> Delays:
    """Adversarial: a queue of up to half a second stands on the way back and changes its length every five seconds."""
    lengths = [chance.uniform(0, 500 * MS) for _ in range(200)]
    return Delays(
        lambda _f, _a: 0.3 * MS + chance.expovariate(1 / MS),
        lambda _f, age_ns: 0.3 * MS + lengths[age_ns // (5 * SECOND_NS) % 200] + chance.expovariate(1 / MS),
    )


def heavy_tails(chance: random.Random) -> Delays:
    """Adversarial: Pareto delays without a mean in both directions."""
    return Delays(
        lambda _f, _a: 0.2 * MS * chance.paretovariate(0.9), lambda _f, _a: 2 * MS * chance.paretovariate(0.9)
    )


def waves(
    clocks: DriftingClocks, delays: Delays, chance: random.Random, seconds: float
) -> Iterator[tuple[int, list[Echo]]]:
    """Run a session in simulated time.

    Args:
        clocks: the truth.
        delays: of the link.
        chance: draws the board's reaction times.
        seconds: how long.

    Yields:
        At the end of each wave: the host's time, and the wave's echoes.
    """
    session, now_ns = HostSession("host", [_LANES]), clocks.start_ns
    hello = BoardHello(
        session="board", boot_id="boot", camera=CAMERA, counts=BoardCounts(), rung=Rung(period_ns=CAMERA.period_ns)
    )
    for lane in _LANES.values():
        session.receive(lane, hello, now_ns)
    under_way: list[tuple[int, Pong]] = []
    echoes: list[Echo] = []
    while now_ns - clocks.start_ns < seconds * SECOND_NS:
        under_way.sort(key=lambda item: item[0])
        if under_way and under_way[0][0] <= session.due_ns:
            now_ns, pong = under_way.pop(0)
            outputs: list[Output] = session.receive(_LANES[Lane.CONTROL], pong, now_ns)
            first = False
        else:
            if echoes:
                yield now_ns, echoes
            echoes, now_ns, first = [], session.due_ns, True
            outputs = session.tick(now_ns)
        echoes += [output for output in outputs if isinstance(output, Echo)]
        for output in outputs:
            if isinstance(output, Outgoing) and isinstance(output.message, Ping):
                t0_ns, age_ns = now_ns + 5 * US, now_ns - clocks.start_ns
                t1_ns = t0_ns + round(delays.there(first, age_ns))
                t2_ns = t1_ns + round(20 * US + chance.expovariate(1 / (10 * US)))
                t3_ns = t2_ns + round(delays.back(first, age_ns)) + 1
                pong = Pong(wave=output.message.wave, t0_ns=t0_ns, t1_ns=clocks.board(t1_ns), t2_ns=clocks.board(t2_ns))
                under_way.append((t3_ns, pong))
