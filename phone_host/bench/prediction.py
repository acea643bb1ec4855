"""Predicts settings that were not run, from the measured cells of a matrix: what to draw from, and how close the prediction comes. Pure.

When a cell is compared with its own prediction (`held_out`), it contributes only what is known without running it:
which frames are shown, how large and how often. If the other cells do not tell enough, the result says so instead of
guessing.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final

import numpy as np

from common.ledger import PairLedger
from phone_host.bench.delay_fit import LIKE_SIZES, DelayFit, Values, fit_delay
from phone_host.bench.emulate import Profile
from phone_host.bench.queue_model import LinkModel, Predicted, Setting, predict
from phone_host.sync.fifo import FifoSettings

_FRAMES: Final = 3000
"""Frames that a prediction simulates: the p95 of 3000 values is known to 0.4 percentage points of rank."""

_SEED: Final = 1

_SLOWER: Final = 1.15
"""If frames begin this many times more rarely than the camera shows them while the processor waits, then they wait for the line."""

_LEAST_GAPS: Final = 10
"""With fewer gaps, a single hitch would move the median."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Images:
    """What the board's camera shows.

    Attributes:
        width_px: image width.
        height_px: image height.
        period_ns: time between two images.
        size_bytes: (N,) sizes of the frames in their order.
    """

    width_px: int
    height_px: int
    period_ns: float
    size_bytes: Values

    @property
    def work(self) -> float:
        """The cost of matching a pair, up to a factor: pixels times disparities, which grow with the width."""
        return float(self.width_px) ** 2 * self.height_px


@dataclass(frozen=True, slots=True, eq=False)
class Cell:
    """One measured combination, as far as the model needs it.

    Attributes:
        interface: its name.
        self_paced: whether its link puts a frame on the line only when the one before has left.
        images: what was shown.
        fifo: the queue before the worker.
        ledgers: of its pairs, at least one.
        pairs_per_s: rate of results.
        lost_share: share of the frames that the board grabbed which a newer one replaced or the FIFO dropped.
    """

    interface: str
    self_paced: bool
    images: Images
    fifo: FifoSettings
    ledgers: tuple[PairLedger, ...]
    pairs_per_s: float
    lost_share: float


@dataclass(frozen=True, slots=True, eq=False)
class Target:
    """A setting to predict.

    Attributes:
        interface: its name.
        link: what it does to a frame.
        images: what the board's camera shows.
        fifo: depth and policy.
        processing_factor: predicted processing time as a multiple of the measured one.
    """

    interface: str
    link: LinkModel
    images: Images
    fifo: FifoSettings
    processing_factor: float = 1.0


@dataclass(frozen=True, slots=True)
class Unknown:
    """No prediction, and why."""

    reason: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Figures:
    """The figures that are compared, predicted or measured; delays in ns.

    Attributes:
        pairs_per_s: rate of results.
        lost_share: share of the frames that the board grabbed which a newer one replaced or the FIFO dropped, 0 to 1.
        propagation_p50_ns: on the link.
        queuing_p95_ns: waiting for the worker.
        starvation_p50_ns: how long the worker had nothing to do.
        end_to_end_p50_ns: from exposure to results.
        end_to_end_p95_ns: the same, 95th percentile.
    """

    pairs_per_s: float
    lost_share: float
    propagation_p50_ns: float
    queuing_p95_ns: float
    starvation_p50_ns: float
    end_to_end_p50_ns: float
    end_to_end_p95_ns: float


def values_of(ledgers: Sequence[PairLedger], value: Callable[[PairLedger], int]) -> Values:
    """Extract a column of numbers from ledgers: (N,) float64."""
    return np.array([value(ledger) for ledger in ledgers], dtype=np.float64)


def fit_of(ledgers: Sequence[PairLedger], *, intervals: bool) -> DelayFit:
    """Fit propagation as latency + bytes / rate over these pairs."""
    size = values_of(ledgers, lambda ledger: ledger.bytes)
    delay = values_of(ledgers, lambda ledger: ledger.propagation_ns)
    return fit_delay(size, delay) if intervals else fit_delay(size, delay, draws=0)


def measured(cell: Cell) -> Figures:
    """Return the measured figures of a cell."""

    def percentile(value: Callable[[PairLedger], int], rank: float) -> float:
        return float(np.percentile(values_of(cell.ledgers, value), rank))

    return Figures(
        pairs_per_s=cell.pairs_per_s,
        lost_share=cell.lost_share,
        propagation_p50_ns=percentile(lambda ledger: ledger.propagation_ns, 50),
        queuing_p95_ns=percentile(lambda ledger: ledger.queuing_ns, 95),
        starvation_p50_ns=percentile(lambda ledger: ledger.starvation_ns, 50),
        end_to_end_p50_ns=percentile(lambda ledger: ledger.end_to_end_ns, 50),
        end_to_end_p95_ns=percentile(lambda ledger: ledger.end_to_end_ns, 95),
    )


def held_out(cell: Cell, cells: Sequence[Cell]) -> Figures | Unknown:
    """Predict a cell from all others."""
    others = [other for other in cells if other is not cell]
    link = learn_link(cell.interface, cell.images, others)
    if isinstance(link, Unknown):
        return link
    return foretell(Target(cell.interface, link, cell.images, cell.fifo), others)


def with_own_delays(cell: Cell, cells: Sequence[Cell]) -> Figures | Unknown:
    """Send a cell's frames through the queues once more, with its own delays drawn again; any difference from the run is the queues' error alone.

    Args:
        cell: the cell.
        cells: all cells; the line through all frames of its interface says how much of the link's delay depends on
            bytes.
    """
    link = learn_link(cell.interface, cell.images, cells)
    if isinstance(link, Unknown):
        return link
    size = values_of(cell.ledgers, lambda ledger: ledger.bytes)
    delay = values_of(cell.ledgers, lambda ledger: ledger.propagation_ns)
    own = replace(link, spread_ns=delay - link.latency_ns - link.ns_per_byte * size)
    return foretell(Target(cell.interface, own, cell.images, cell.fifo), [cell])


def foretell(target: Target, cells: Sequence[Cell]) -> Figures | Unknown:
    """Predict any setting.

    Args:
        target: the setting.
        cells: what was measured; cells of the target's interface are preferred.
    """
    images, interface = target.images, target.interface
    if not cells:
        return Unknown("nothing else was measured")
    near = [cell for cell in cells if cell.interface == interface] or list(cells)
    ledgers = [ledger for cell in near for ledger in cell.ledgers]
    idle = [ledger for ledger in ledgers if ledger.starvation_ns > 0] or ledgers
    setting = Setting(
        period_ns=images.period_ns,
        size_bytes=images.size_bytes,
        capture_ns=values_of(ledgers, lambda ledger: ledger.capture_ns),
        link=target.link,
        pairing_ns=values_of(ledgers, lambda ledger: ledger.pairing_ns),
        wake_ns=np.array([np.median(values_of(idle, lambda ledger: ledger.queuing_ns))]),
        service_ns=_services(images, cells) * target.processing_factor,
        fifo=target.fifo,
    )
    return _figures(predict(setting, _FRAMES, np.random.default_rng(_SEED)))


def learn_link(interface: str, images: Images, cells: Sequence[Cell]) -> LinkModel | Unknown:
    """Learn what a link does to frames of this size from the cells that ran over it."""
    mine = [cell for cell in cells if cell.interface == interface]
    if not mine:
        return Unknown(f"nothing else was measured over {interface}")
    ledgers = [ledger for cell in mine for ledger in cell.ledgers]
    size = values_of(ledgers, lambda ledger: ledger.bytes)
    delay = values_of(ledgers, lambda ledger: ledger.propagation_ns)
    if size.max() < LIKE_SIZES * size.min():
        wanted = float(np.median(images.size_bytes))
        if not size.min() / LIKE_SIZES <= wanted <= size.max() * LIKE_SIZES:
            return Unknown(f"frames of one size only were measured over {interface}")
        # Frames of one size do not determine a line. How much of the delay is latency hardly matters for frames of the
        # same size.
        latency_ns, ns_per_byte = 0.5 * float(np.median(delay)), 0.5 * float(np.median(delay / size))
    else:
        fit = fit_of(ledgers, intervals=False)
        latency_ns, ns_per_byte = fit.latency_ns, fit.ns_per_byte
    if mine[0].self_paced:
        taken = [_occupied(cell) for cell in mine]
        full = [one.ns_per_byte for one in taken if one.is_full]
        # Lines that were full show how long a byte takes; others show only that it takes no longer.
        ns_per_byte = float(np.median(full)) if full else min(ns_per_byte, *(one.ns_per_byte for one in taken))
    return LinkModel(
        latency_ns=latency_ns,
        ns_per_byte=ns_per_byte,
        spread_ns=delay - latency_ns - ns_per_byte * size,
        self_paced=mine[0].self_paced,
    )


@dataclass(frozen=True, slots=True)
class _Occupied:
    """How long a self-paced line was occupied from one frame's beginning to the next's, ns per byte. `is_full`: the line was the cause, not the camera."""

    ns_per_byte: float
    is_full: bool


def _occupied(cell: Cell) -> _Occupied:
    """Return the median time per byte that a line is occupied which begins a frame only when the one before has left.

    What the machine adds to propagation does not delay the next frame, but it tilts the fitted line.
    """
    gaps = np.array([after.board.sent_ns - before.board.sent_ns for before, after in pairwise(cell.ledgers)])
    if gaps.size < _LEAST_GAPS:
        return _Occupied(float("inf"), is_full=False)
    size = values_of(cell.ledgers, lambda ledger: ledger.bytes)[:-1]
    starved = float(np.median(values_of(cell.ledgers, lambda ledger: ledger.starvation_ns))) > 0.0
    slower = float(np.median(gaps)) > _SLOWER * cell.images.period_ns
    return _Occupied(float(np.median(gaps / size)), is_full=starved and slower)


def nominal_link(profile: Profile, *, self_paced: bool) -> LinkModel:
    """Make the model of a link that nobody ran, from its profile's figures alone."""
    random = np.random.default_rng(_SEED)
    middle_ns = profile.jitter_ns / 2.0
    spread_ns = random.uniform(-middle_ns, middle_ns, 1000) if profile.jitter_ns else np.zeros(1)
    return LinkModel(
        latency_ns=profile.delay_ns + middle_ns,
        ns_per_byte=1e9 / profile.bytes_per_s,
        spread_ns=spread_ns,
        self_paced=self_paced,
    )


def _services(images: Images, cells: Sequence[Cell]) -> Values:
    """Return processing delays to draw from: those of the same size over any interface; if there are none, others scaled by the work.

    The machine's other load varies more from run to run than the processor time that an interface costs. So all runs of
    a size together tell more than those over one interface.
    """
    alike = [cell for cell in cells if cell.images.work == images.work]
    if alike:
        return values_of([ledger for cell in alike for ledger in cell.ledgers], lambda ledger: ledger.processing_ns)
    nearest = min(cells, key=lambda cell: abs(np.log(cell.images.work / images.work)))
    drawn = values_of(nearest.ledgers, lambda ledger: ledger.processing_ns)
    by_work: dict[float, list[float]] = {}
    for cell in cells:
        here = values_of(cell.ledgers, lambda ledger: ledger.processing_ns)
        by_work.setdefault(cell.images.work, []).append(float(np.median(here)))
    if len(by_work) == 1:
        drawn *= images.work / nearest.images.work
        return drawn
    # Two sizes or more: a pair's cost has a constant part and a part proportional to its work.
    works = np.array(list(by_work))
    medians = np.array([np.median(values) for values in by_work.values()])
    slope, base = np.polyfit(works, medians, 1)
    wanted = max(base + slope * images.work, float(medians.min()) * min(1.0, images.work / float(works.min())))
    scaled: Values = drawn * (wanted / float(np.median(drawn)))
    return scaled


def _figures(made: Predicted) -> Figures:
    def percentile(values: Values, rank: float) -> float:
        return float(np.percentile(values, rank)) if values.size else float("nan")

    return Figures(
        pairs_per_s=made.pairs_per_s,
        lost_share=1.0 - (1.0 - made.replaced_share) * (1.0 - made.dropped_share),
        propagation_p50_ns=percentile(made.propagation_ns, 50),
        queuing_p95_ns=percentile(made.queuing_ns, 95),
        starvation_p50_ns=percentile(made.starvation_ns, 50),
        end_to_end_p50_ns=percentile(made.end_to_end_ns, 50),
        end_to_end_p95_ns=percentile(made.end_to_end_ns, 95),
    )
