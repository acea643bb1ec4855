"""What limits the accuracy of the holdover: `python -m tests.bench.bench_holdover [--help]`.

Runs five minutes of echoes over the links of bench_clock, then 60 s without echoes. Compares the error of the offset at
that point with the error at the end of the echoes. On the same echoes it runs our estimator, other estimators that were
tried, and oracles, which know what no estimator can know. `drift known`: the clocks' true course is given; only the
offset is estimated, as the middle between the extremes of all echoes. `asymmetry alone`: the least delays are given as
well; half of their difference remains, which looks like an offset in every echo. That is a floor for all estimators;
knowing the scatter may improve the middle of the extremes a little.
"""

import argparse
import json
import math
import random
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from phone_host.sync.clock import ClockEstimator
from phone_host.sync.hull import SKEW_CHANGE
from tests.bench.machine import machine
from tests.support.clock_sim import MS, SECOND_NS, DriftingClocks, Profile, least_delays, loaded_line, waves, wifi

Values = NDArray[np.float64]

_LEARN_S, _HOLD_S = 300, 60
_SKEWS = np.linspace(-5e-6, 5e-6, 101)
"""Around our own estimate; wide enough for every skew that was seen to win."""

_SMALLEST = 12
_NEAR = 24
_BLOCK_NS = 15e9


@dataclass(frozen=True, slots=True, kw_only=True)
class Link:
    """A simulated link and the range of its least one-way delay, ns."""

    name: str
    profile: Profile
    low_ns: float
    high_ns: float


LINKS = (
    Link(name="Wi-Fi, jitter 2-10 ms", profile=wifi, low_ns=0.6 * MS, high_ns=1.2 * MS),
    Link(name="serial 8 Mbit/s", profile=loaded_line(8e6, 0.3 * MS, 0.125 * MS), low_ns=0.24 * MS, high_ns=0.36 * MS),
    Link(name="radio 1.5 Mbit/s", profile=loaded_line(1.5e6, 1.5 * MS, 1.25 * MS), low_ns=1.2 * MS, high_ns=1.8 * MS),
    Link(name="radio 0.64 Mbit/s", profile=loaded_line(0.64e6, 2.5 * MS, 1.25 * MS), low_ns=2.0 * MS, high_ns=3.0 * MS),
)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Run:
    """The tightest facts of each wave of one run. Times count from the end of the echoes; offsets are less ours at that moment and less our skew; ns.

    Attributes:
        lower_x: board time of each lower fact.
        below: the least that the offset was at each lower fact.
        upper_x: board time of each upper fact.
        above: the most that the offset was at each upper fact.
        true_lower: the true offset at the lower facts.
        true_upper: the true offset at the upper facts.
        true_end: the true offset at the end of the echoes.
        true_held: the true offset 60 s later.
        hold_ns: those 60 s on the board's clock.
        asymmetry_ns: half of the difference of the least delays.
    """

    lower_x: Values
    below: Values
    upper_x: Values
    above: Values
    true_lower: Values
    true_upper: Values
    true_end: float
    true_held: float
    hold_ns: float
    asymmetry_ns: float


def collect(link: Link, seed: int) -> Run:
    """Run a five-minute session in simulated time."""
    chance = random.Random(seed)
    clocks = DriftingClocks(chance)
    state = chance.getstate()
    there_ns, back_ns = least_delays(chance, link.low_ns, link.high_ns)
    chance.setstate(state)  # so that the profile draws the same values again
    estimator, now_ns = ClockEstimator(), clocks.start_ns
    lower, upper = [], []
    for at_ns, echoes in waves(clocks, link.profile(chance), chance, _LEARN_S):
        now_ns = at_ns
        for echo in echoes:
            estimator.add(echo)
        lower.append(max(((echo.t1_ns, echo.t0_ns - echo.t1_ns) for echo in echoes), key=lambda fact: fact[1]))
        upper.append(min(((echo.t2_ns, echo.t3_ns - echo.t2_ns) for echo in echoes), key=lambda fact: fact[1]))
    end_ns, held_ns = clocks.board(now_ns), clocks.board(now_ns + _HOLD_S * SECOND_NS)
    estimate = estimator.estimate
    assert estimate is not None

    def rest(board_ns: int, offset_ns: float) -> float:
        """An offset minus our line."""
        line = estimate.offset_at(end_ns) - clocks.origin_ns + estimate.skew * (board_ns - end_ns)
        return offset_ns - line

    def truth(board_ns: int) -> float:
        return rest(board_ns, clocks.offset(board_ns))

    return Run(
        lower_x=np.array([x - end_ns for x, _ in lower], float),
        below=np.array([rest(x, y - clocks.origin_ns) for x, y in lower]),
        upper_x=np.array([x - end_ns for x, _ in upper], float),
        above=np.array([rest(x, y - clocks.origin_ns) for x, y in upper]),
        true_lower=np.array([truth(x) for x, _ in lower]),
        true_upper=np.array([truth(x) for x, _ in upper]),
        true_end=truth(end_ns),
        true_held=truth(held_ns),
        hold_ns=float(held_ns - end_ns),
        asymmetry_ns=(there_ns - back_ns) / 2,
    )


Found = tuple[float, float]
"""Offset at the end of the echoes, ns, and skew; both relative to ours."""


def ours(_run: Run) -> Found:
    """Our estimator; all other results are relative to it."""
    return 0.0, 0.0


def hulls(run: Run, seconds: float, bends: int, *, shaped: bool = False) -> Found:
    """The mean of all curves above the lower facts and below the upper ones, weighted by the likelihood of exponential delays.

    A constant difference between the two directions shifts both hulls equally and leaves the skew unchanged.

    Args:
        run: the echoes.
        seconds: how far back echoes count.
        bends: how many evenly spaced changes of the skew to try, between both limits; 1: none.
        shaped: whether to estimate the distance of the smallest delays from the least one from their scatter (Hall,
            Annals of Statistics 10(2), 1982).
    """
    strip = _strip(run, seconds, bends)
    beyond = _beyond_ns if shaped else _spacing_ns
    return strip.offset_ns + (beyond(strip.there) - beyond(strip.back)) / 2, strip.skew


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class _Strip:
    """Mean of the middles of all allowed curves, their skew, and the scatter of the delays around the likeliest curve, rising; ns."""

    offset_ns: float
    skew: float
    there: Values
    back: Values


@lru_cache(maxsize=1)
def _strip(run: Run, seconds: float, bends: int) -> _Strip:
    late, late2 = run.lower_x > -seconds * 1e9, run.upper_x > -seconds * 1e9
    x, y, x2, y2 = run.lower_x[late], run.below[late], run.upper_x[late2], run.above[late2]
    tried = np.linspace(-1, 1, bends) * SKEW_CHANGE if bends > 1 else np.zeros(1)
    low = np.array([(y[:, None] - bend / 2 * x[:, None] ** 2 - _SKEWS * x[:, None]).max(0) for bend in tried])
    high = np.array([(y2[:, None] - bend / 2 * x2[:, None] ** 2 - _SKEWS * x2[:, None]).min(0) for bend in tried])
    rise = _SKEWS * x.mean() + tried[:, None] / 2 * (x * x).mean()
    best = np.unravel_index(np.argmax(high - low), low.shape)
    there, back, logs = np.empty(0), np.empty(0), high
    for _ in range(2):
        bend, skew = tried[best[0]], _SKEWS[best[1]]
        there = np.sort(low[best] + skew * x + bend / 2 * x * x - y)
        back = np.sort(y2 - high[best] - skew * x2 - bend / 2 * x2 * x2)
        logs = (high + rise) / _spacing_ns(back) - (low + rise) / _spacing_ns(there)
        logs[high < low] = -np.inf
        best = np.unravel_index(np.argmax(logs), logs.shape)
    weight = np.exp(logs - logs.max())
    weight /= weight.sum()
    return _Strip(
        offset_ns=float(((low + high) / 2 * weight).sum()), skew=float((_SKEWS * weight).sum()), there=there, back=back
    )


def _spacing_ns(scatter: Values) -> float:
    """Mean distance between neighbouring smallest delays."""
    return max(500.0, float(scatter[_SMALLEST]) / (_SMALLEST - 1))


def _beyond_ns(scatter: Values) -> float:
    """How far the least delay lies below the smallest of these: the k-th smallest grows like k^(1 / shape)."""
    near, far = float(scatter[_NEAR] - scatter[0]), float(scatter[4 * _NEAR] - scatter[0])
    shape = min(3.0, max(0.7, math.log(4) / math.log(max(1.01, far / max(near, 1.0)))))
    first = math.gamma(1 + 1 / shape)
    return first * near / (math.pow(_NEAR, 1 / shape) - first)


def _blocks(run: Run) -> list[tuple[float, float, float]]:
    """Middle and width of the strip in every 15 s: (time, offset, width), oldest first."""
    found = []
    for number in reversed(range(int(_LEARN_S * 1e9 / _BLOCK_NS))):
        begin, end = -(number + 1) * _BLOCK_NS, -number * _BLOCK_NS
        low = run.below[(run.lower_x > begin) & (run.lower_x <= end)].max()
        high = run.above[(run.upper_x > begin) & (run.upper_x <= end)].min()
        found.append(((begin + end) / 2, float(low + high) / 2, float(high - low)))
    return found


def least_squares(run: Run) -> Found:
    """Fit a parabola to the middles of the blocks."""
    blocks = np.array(_blocks(run))
    bend, skew, offset = np.polyfit(blocks[:, 0] / 1e9, blocks[:, 1], 2)
    del bend
    return float(offset), float(skew) / 1e9


def kalman(run: Run) -> Found:
    """Kalman filter. State: offset and skew (ns/s), the skew a random walk of SKEW_CHANGE a minute; measurements: the blocks' middles."""
    state, spread, step_s = np.zeros(2), np.diag([1e12, 5e3**2]), _BLOCK_NS / 1e9
    noise = (SKEW_CHANGE * 60e9 * 1e9) ** 2 / 60
    move = np.array([[1.0, step_s], [0.0, 1.0]])
    wander = noise * np.array([[step_s**3 / 3, step_s**2 / 2], [step_s**2 / 2, step_s]])
    for _, middle, width in _blocks(run):
        state, spread = move @ state, move @ spread @ move.T + wander
        gain = spread[:, 0] / (spread[0, 0] + (width / 10) ** 2)
        state = state + gain * (middle - state[0])
        spread = spread - np.outer(gain, spread[0])
    return float(state[0] + state[1] * step_s / 2), float(state[1]) / 1e9


ESTIMATORS: dict[str, Callable[[Run], Found]] = {
    "ours": ours,
    "hulls both ways, constant skew, 60 s": lambda run: hulls(run, 60, 1),
    "hulls both ways, constant skew, 120 s": lambda run: hulls(run, 120, 1),
    "hulls both ways, constant skew, 300 s": lambda run: hulls(run, 300, 1),
    "hulls both ways, even change of skew, 300 s": lambda run: hulls(run, 300, 17),
    "the same, least delays by the scatter's shape": lambda run: hulls(run, 300, 17, shaped=True),
    "least squares through minima of 15 s": least_squares,
    "Kalman filter on minima of 15 s": kalman,
}


def errors_of(run: Run) -> dict[str, tuple[float, float]]:
    """Error of each estimator at the end of the echoes and 60 s later, ns."""
    found = {}
    for name, estimator in ESTIMATORS.items():
        offset, skew = estimator(run)
        found[name] = (offset - run.true_end, offset + skew * run.hold_ns - run.true_held)
    extremes = ((run.below - run.true_lower).max() + (run.above - run.true_upper).min()) / 2
    found["oracle: drift known"] = (extremes, extremes)
    found["oracle: asymmetry alone"] = (run.asymmetry_ns, run.asymmetry_ns)
    return found


def main() -> None:
    """Run and print."""
    parser = argparse.ArgumentParser("python -m tests.bench.bench_holdover", description=__doc__)
    parser.add_argument("--runs", type=int, default=100, help="simulated runs of 5 minutes for each link (default 100)")
    parser.add_argument("--link", default="", help="only links whose name holds this text")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    options = parser.parse_args()
    console = Console(stderr=True)
    links = [link for link in LINKS if options.link in link.name]
    rows: list[tuple[str, str, list[float]]] = []
    with Progress(console=console, transient=True, disable=not console.is_terminal) as progress:
        work = progress.add_task("runs", total=len(links) * options.runs)
        for link in links:
            errors: dict[str, list[tuple[float, float]]] = {}
            for seed in range(options.runs):
                for name, pair in errors_of(collect(link, 10**6 + seed)).items():
                    errors.setdefault(name, []).append(pair)
                progress.advance(work)
            for name, pairs in errors.items():
                median, most = (np.percentile(np.abs(np.array(pairs)), q, axis=0) / 1e3 for q in (50, 99))
                rows.append((link.name, name, [float(v) for v in (median[1], most[1], median[0], most[0])]))
    if options.json:
        print(json.dumps({"machine": str(machine()), "runs": options.runs, "rows_us": rows}))
        return
    print(f"{machine()}\n{options.runs} runs of {_LEARN_S} s for each link")
    table = Table(title=f"|error| in us at the end of the echoes, and {_HOLD_S} s later", title_justify="left")
    for title in ("link", "estimator", "held p50", "held p99", "end p50", "end p99"):
        table.add_column(title, justify="left" if title in {"link", "estimator"} else "right")
    for link_name, name, figures in rows:
        table.add_row(link_name, name, *(f"{figure:.0f}" for figure in figures))
    Console(width=130).print(table)


if __name__ == "__main__":
    main()
