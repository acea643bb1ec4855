"""Draws conclusions from all measured cells: latency and rate of each interface, predictions beside measurements, settings not run. Pure."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from common.ledger import PairLedger
from phone_host.accounts.delays import DelayStatistics
from phone_host.bench.cases import Case, Interface
from phone_host.bench.changes import Change
from phone_host.bench.delay_fit import DelayFit
from phone_host.bench.emulate import PROFILES, Profile
from phone_host.bench.prediction import (
    Cell,
    Figures,
    Images,
    Target,
    Unknown,
    fit_of,
    foretell,
    held_out,
    learn_link,
    measured,
    nominal_link,
    values_of,
    with_own_delays,
)
from phone_host.bench.queue_model import LinkModel
from phone_host.bench.runs import CaseResult
from phone_host.diagnostics.throughput import Judgement, figures_of, judge
from phone_host.sync.fifo import FifoSettings, Overflow

_SELF_PACED: Final = ("serial", "rfcomm")

_ENOUGH_PAIRS: Final = 10
"""With fewer pairs, a rate is itself off by more than a tenth."""


@dataclass(frozen=True, slots=True)
class InterfaceFit:
    """Propagation over one interface, from all of its runs.

    Attributes:
        interface: the interface.
        results: its runs that gave pairs.
        fit: latency + bytes / rate.
    """

    interface: Interface
    results: tuple[CaseResult, ...]
    fit: DelayFit


@dataclass(frozen=True, slots=True, kw_only=True)
class Checked:
    """One run beside what the model predicts for it from all other runs.

    Attributes:
        case: the case of the run.
        pairs: number of pairs that it gave.
        measured: its measured figures.
        predicted: predicted from the other runs; or why not.
        queues: what the queues make of the run's own link, capture and processing; any difference from the run is the
            model's own error.
    """

    case: Case
    pairs: int
    measured: Figures
    predicted: Figures | Unknown
    queues: Figures | Unknown


@dataclass(frozen=True, slots=True, kw_only=True)
class Errors:
    """Relative errors of predictions, 0 = exact; NaN without predictions. Runs with few pairs are left out.

    Attributes:
        runs: how many were predicted.
        rate: median error of the pairs per second.
        worst_rate: its greatest error.
        end_to_end: median error of the median end-to-end delay.
        worst_end_to_end: its greatest error.
    """

    runs: int
    rate: float
    worst_rate: float
    end_to_end: float
    worst_end_to_end: float


@dataclass(frozen=True, slots=True)
class WhatIf:
    """A setting that was not run.

    Attributes:
        interface: its name.
        setting: the difference, in words.
        figures: predicted; or why not.
        asked_for: whether the user named it (`--predict`).
    """

    interface: str
    setting: str
    figures: Figures | Unknown
    asked_for: bool = False


@dataclass(frozen=True, slots=True)
class Analysis:
    """All conclusions from a matrix.

    Attributes:
        fits: one for each interface.
        checked: one for each run that gave pairs.
        what_ifs: settings that were not run.
    """

    fits: tuple[InterfaceFit, ...]
    checked: tuple[Checked, ...]
    what_ifs: tuple[WhatIf, ...]

    @property
    def held_out(self) -> Errors:
        """Errors of each run's prediction from the other runs."""
        return _errors([(one, one.predicted) for one in self.checked])

    @property
    def queues(self) -> Errors:
        """Errors of the queues alone, given each run's own link and processing."""
        return _errors([(one, one.queues) for one in self.checked])


def analyse(results: Sequence[CaseResult], fifo: FifoSettings, changes: Sequence[Change] = ()) -> Analysis:
    """Analyse all runs together."""
    useful = [result for result in results if result.ledgers]
    cells = [_cell(result, fifo) for result in useful]
    checked = [
        Checked(
            case=result.case,
            pairs=len(result.ledgers),
            measured=measured(cell),
            predicted=held_out(cell, cells),
            queues=with_own_delays(cell, cells),
        )
        for result, cell in zip(useful, cells, strict=True)
    ]
    by_interface: dict[str, list[CaseResult]] = {}
    for result in useful:
        by_interface.setdefault(str(result.case.interface), []).append(result)
    fits = [
        InterfaceFit(mine[0].case.interface, tuple(mine), fit_of(_all_ledgers(mine), intervals=True))
        for mine in by_interface.values()
    ]
    return Analysis(tuple(fits), tuple(checked), tuple(_what_ifs(cells, fifo, changes)))


def regime_of(result: CaseResult, fifo: FifoSettings) -> Judgement:
    """Judge which queueing regime held in a run, and what would help."""
    pairs = len(result.ledgers)
    return judge(
        figures_of(
            statistics_of(result),
            result.counts,
            result.processed,
            interval_ns=result.measured_s * 1e9 / pairs if pairs else float("nan"),
            period_ns=round(1e9 / result.case.rate_hz),
            overflow=fifo.overflow,
        )
    )


def statistics_of(result: CaseResult) -> DelayStatistics:
    """Return the spreads of one run's pairs after the warm-up."""
    statistics = DelayStatistics()
    for ledger in result.ledgers:
        statistics.add(ledger)
    return statistics


def typical_and_slow(result: CaseResult) -> tuple[int, int]:
    """Choose two pairs that represent a run: the one at the median of end-to-end, and the one at its 99th percentile."""
    order = np.argsort(values_of(result.ledgers, lambda ledger: ledger.end_to_end_ns), kind="stable")
    last = order.size - 1
    return int(order[last // 2]), int(order[round(0.99 * last)])


def _errors(runs: Sequence[tuple[Checked, Figures | Unknown]]) -> Errors:
    pairs = [(one.measured, said) for one, said in runs if isinstance(said, Figures) and one.pairs >= _ENOUGH_PAIRS]
    if not pairs:
        none = float("nan")
        return Errors(runs=0, rate=none, worst_rate=none, end_to_end=none, worst_end_to_end=none)
    rate = np.abs([said.pairs_per_s / seen.pairs_per_s - 1.0 for seen, said in pairs])
    delay = np.abs([said.end_to_end_p50_ns / seen.end_to_end_p50_ns - 1.0 for seen, said in pairs])
    return Errors(
        runs=len(pairs),
        rate=float(np.median(rate)),
        worst_rate=float(rate.max()),
        end_to_end=float(np.median(delay)),
        worst_end_to_end=float(delay.max()),
    )


def _cell(result: CaseResult, fifo: FifoSettings) -> Cell:
    case = result.case
    interface = str(case.interface)
    return Cell(
        interface=interface,
        self_paced=case.interface.link.startswith(_SELF_PACED),
        images=Images(
            width_px=case.size.width_px,
            height_px=case.size.height_px,
            period_ns=1e9 / case.rate_hz,
            size_bytes=values_of(result.ledgers, lambda ledger: ledger.bytes),
        ),
        fifo=fifo,
        ledgers=result.ledgers,
        pairs_per_s=result.pairs_per_second,
        lost_share=_lost_share(result),
    )


def _lost_share(result: CaseResult) -> float:
    """Return the share of frames, of those for which a host was there, that a newer one replaced or whose pair the FIFO dropped."""
    replaced = dict(result.board.dropped).get("replaced", 0)
    kept = result.board.sent / max(1, result.board.sent + replaced)
    return 1.0 - kept * (1.0 - result.counts.dropped / max(1, result.counts.paired))


def _all_ledgers(results: Sequence[CaseResult]) -> tuple[PairLedger, ...]:
    return tuple(ledger for result in results for ledger in result.ledgers)


def _what_ifs(cells: Sequence[Cell], fifo: FifoSettings, changes: Sequence[Change]) -> list[WhatIf]:
    """Predict each interface's heaviest run with one thing changed, and with its link replaced by each profile that nobody ran."""
    found = []
    heaviest: dict[str, Cell] = {}
    for cell in cells:
        if cell.interface not in heaviest or _load(cell) > _load(heaviest[cell.interface]):
            heaviest[cell.interface] = cell
    for cell in heaviest.values():
        link = learn_link(cell.interface, cell.images, cells)
        if isinstance(link, LinkModel):
            target = Target(cell.interface, link, cell.images, fifo)
            found += [WhatIf(cell.interface, words, foretell(one, cells)) for words, one in _changes(target)]
            found += [
                WhatIf(
                    cell.interface,
                    change.words + _left_out(change.profile),
                    foretell(change.applied(target), cells),
                    asked_for=True,
                )
                for change in changes
            ]
    if heaviest:
        base = max(heaviest.values(), key=_load)
        for profile in PROFILES:
            interface = Interface(profile.carrier, profile)
            if str(interface) not in heaviest:
                link = nominal_link(profile, self_paced=profile.carrier in _SELF_PACED)
                target = Target(str(interface), link, base.images, fifo)
                words = f"{_images(base.images)}, from its figures alone{_left_out(profile)}"
                found.append(WhatIf(str(interface), words, foretell(target, cells)))
    return found


def _left_out(profile: Profile | None) -> str:
    """Say in words what the model does not know of a profile."""
    return ", without its losses" if profile is not None and (profile.byte_loss or profile.stall_share) else ""


def _load(cell: Cell) -> float:
    return float(cell.images.size_bytes.mean()) / cell.images.period_ns


def _images(images: Images) -> str:
    size = f"{images.width_px}x{images.height_px}"
    return f"{size} {images.size_bytes.mean() / 1e3:.0f} kB {1e9 / images.period_ns:.0f}/s"


def _changes(target: Target) -> list[tuple[str, Target]]:
    images = target.images
    # A JPEG's bytes scale with its pixels, at the same quality of the same scene.
    smaller = Images(
        width_px=images.width_px // 2,
        height_px=images.height_px // 2,
        period_ns=images.period_ns,
        size_bytes=images.size_bytes / 4,
    )
    return [
        (f"{_images(images)}, as it was run", target),
        ("camera twice as fast", replace(target, images=replace(images, period_ns=images.period_ns / 2))),
        (f"{smaller.width_px}x{smaller.height_px}", replace(target, images=smaller)),
        ("half the bytes", replace(target, images=replace(images, size_bytes=images.size_bytes / 2))),
        ("matcher twice as fast", replace(target, processing_factor=0.5)),
        ("matcher four times slower", replace(target, processing_factor=4.0)),
        ("FIFO 4:drop-newest", replace(target, fifo=FifoSettings(4, Overflow.DROP_NEWEST))),
        ("FIFO 1:block", replace(target, fifo=FifoSettings(1, Overflow.BLOCK))),
    ]
