"""What the delay benchmark measured, as a JSON object and as a page with plots. Pure. Every number's unit stands in its key."""

import os
import platform
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Final

import zmq

from common import now
from phone_host.bench import WARM_UP_S, CaseResult, RunSettings
from phone_host.bench_cases import BOARD_SETS, Interface
from phone_host.delays import DELAYS, STAGES, DelayStatistics, Spread
from phone_host.plots import Budget, Part, Quantity, Strips, budgets, distributions, legend
from phone_host.report_page import DelaySeries, delay_series, document, section, two_widths
from phone_host.sync.fifo import FifoSettings

PERCENTILES: Final = ("p50", "p95", "p99", "max")


@dataclass(frozen=True, slots=True)
class Conditions:
    """Under what the figures were measured.

    Attributes:
        machine: processor, system, versions.
        date: local wall time.
        matcher: of the stereo core.
        fifo: depth and policy of the queue before it.
        seconds: length of each run after its warm-up, s.
        not_run: interfaces that could not be measured, and why.
    """

    machine: str
    date: str
    matcher: str
    fifo: FifoSettings
    seconds: float
    not_run: tuple[tuple[Interface, str], ...] = ()


def conditions(settings: RunSettings, not_run: Sequence[tuple[Interface, str]]) -> Conditions:
    """Look at this machine and the clock on its wall."""
    versions = f"Python {platform.python_version()}, pyzmq {zmq.pyzmq_version()}, libzmq {zmq.zmq_version()}"
    system = f"{platform.machine()}, {os.cpu_count()} cores, {platform.system()} {platform.release()}"
    return Conditions(
        f"{system}, {versions}",
        now.wall_time(),
        settings.matcher.value,
        settings.fifo,
        settings.seconds,
        tuple(not_run),
    )


def as_json(results: Sequence[CaseResult], under: Conditions) -> dict[str, object]:
    """The object of delay-bench.json.

    Args:
        results: what was measured.
        under: machine, date, settings.
    """
    return {
        "machine": under.machine,
        "date": under.date,
        "matcher": under.matcher,
        "measured_per_run_s": under.seconds,
        "left_out_warm_up_s": WARM_UP_S,
        "fifo": f"{under.fifo.depth}:{under.fifo.overflow.value}",
        "runs": [_run(result) for result in results],
        "not_run": [{"link": str(interface), "reason": reason} for interface, reason in under.not_run],
    }


def statistics_of(result: CaseResult) -> DelayStatistics:
    """The spreads of one run's pairs after the warm-up."""
    statistics = DelayStatistics()
    for ledger in result.ledgers:
        statistics.add(ledger)
    return statistics


def losses(result: CaseResult) -> dict[str, int]:
    """Everything that did not become a result, by what became of it, over the whole run; reasons with nothing are left out."""
    counts, link = result.counts, result.link
    lost = {f"{reason}_on_board": count for reason, count in result.board.dropped}
    lost["lost_on_link"] = sum(account.lost for account in link.sessions)
    lost["stale"] = sum(account.duplicate + account.old_session for account in link.sessions)
    lost["before_clock"] = link.no_clock
    lost |= {f"{reason}_board_frame": count for reason, count in counts.board_orphans}
    lost["dropped_in_fifo"] = counts.dropped
    lost["undecodable"] = result.undecodable
    return {reason: count for reason, count in lost.items() if count}


def page(results: Sequence[CaseResult], under: Conditions) -> str:
    """A self-contained HTML page: for each size and rate the links side by side, stage by stage.

    Args:
        results: what was measured.
        under: machine, date, settings.
    """
    method = (
        f"Two real programs on one machine over rendered films, matcher {under.matcher}. {under.seconds:g} s each, after a warm-up "
        f"of {WARM_UP_S:g} s that is left out. Delays as of the host's clock; propagation carries the clocks' uncertainty."
    )
    head = f"<header><h1>Delays of every link and stage</h1><p class='sub'>{under.machine} · {under.date}</p></header>"
    cards = [section("How this was measured", method, "")]
    cards += [_card(group) for group in grouped(results)]
    return document("delay-bench", head + "".join(cards))


def grouped(results: Sequence[CaseResult]) -> list[list[CaseResult]]:
    """Runs of the same images together, in their order."""
    groups: dict[str, list[CaseResult]] = {}
    for result in results:
        groups.setdefault(result.case.images, []).append(result)
    return list(groups.values())


def rows(results: Sequence[CaseResult]) -> list[tuple[str, ...]]:
    """The terminal's table: stage, link, percentiles in ms; the stages of processing are indented below it.

    Args:
        results: the runs to stand below each other, stage by stage.
    """
    spreads = [(str(result.case.interface), statistics_of(result)) for result in results]
    table = []
    for name in (*DELAYS[:6], *STAGES, *DELAYS[6:], "time_skew"):
        for index, (link, statistics) in enumerate(spreads):
            values = _percentiles(statistics.spread(name))
            label = "" if index else f"  {name}" if name in STAGES else name.replace("_", "-")
            table.append((label, link, *(_cell(values[key]) for key in PERCENTILES)))
    return table


def _cell(value_ns: float) -> str:
    return "-" if value_ns != value_ns else f"{value_ns / 1e6:.3f}"  # noqa: PLR0124 - NaN is the only value unlike itself


def _run(result: CaseResult) -> dict[str, object]:
    case, statistics = result.case, statistics_of(result)
    uncertainty = statistics.spread("uncertainty")
    return {
        "link": case.interface.link,
        "emulated": case.interface.profile.name if case.interface.profile is not None else None,
        "width_px": case.size.width_px,
        "height_px": case.size.height_px,
        "jpeg_quality_percent": None if case.quality_percent == BOARD_SETS else case.quality_percent,
        "camera_rate_hz": case.rate_hz,
        "pair_rate_hz": _number(result.pairs_per_second),
        "measured_s": result.measured_s,
        "measured_pairs": len(result.ledgers),
        "mean_frame_bytes": round(sum(ledger.bytes for ledger in result.ledgers) / max(1, len(result.ledgers))),
        "least_frame_bytes": min((ledger.bytes for ledger in result.ledgers), default=0),
        "delays": {name: _spread(statistics.spread(name)) for name in DELAYS},
        "stages": {name: _spread(statistics.spread(name)) for name in STAGES},
        "time_skew": _spread(statistics.spread("time_skew")),
        "clock_uncertainty": {f"{key}_us": _number(value / 1e3) for key, value in _percentiles(uncertainty).items()},
        "clock_bound_at_end_us": _number(result.bound_ns / 1e3),
        "whole_run": _counts(result),
        "line": None if result.relay is None else asdict(result.relay),
    }


def _counts(result: CaseResult) -> dict[str, object]:
    board, counts, link = result.board, result.counts, result.link
    received = sum(account.received for account in link.sessions)
    lost = sum(account.lost for account in link.sessions)
    return {
        "grabbed_frames": board.grabbed,
        "dropped_on_board_frames": dict(board.dropped),
        "sent_frames": board.sent,
        "lost_on_link_frames": lost,
        "under_way_at_end_frames": board.sent - received - lost,
        "received_frames": received,
        "before_clock_frames": link.no_clock,
        "orphaned_frames": dict(counts.board_orphans),
        "held_at_end_frames": counts.held_board,
        "paired_pairs": counts.paired,
        "dropped_in_fifo_pairs": counts.dropped,
        "undecodable_pairs": result.undecodable,
        "processed_pairs": result.processed,
        "not_processed_at_end_pairs": counts.paired - counts.dropped - result.undecodable - result.processed,
    }


def _spread(spread: Spread) -> dict[str, float | None]:
    return {f"{key}_ms": _number(value / 1e6) for key, value in _percentiles(spread).items()}


def _percentiles(spread: Spread) -> dict[str, float]:
    return {
        "p50": spread.p50_ns,
        "p95": spread.p95_ns,
        "p99": spread.p99_ns,
        "max": spread.max_ns,
        "mean": spread.mean_ns,
    }


def _number(value: float) -> float | None:
    return None if value != value else round(value, 6)  # noqa: PLR0124 - NaN is the only value unlike itself; JSON has none


def _card(results: Sequence[CaseResult]) -> str:
    """The card of one size and rate: a bar for each link, then each delay and stage by itself."""
    case = results[0].case
    title = case.images
    measured = [(result.case, delay_series(result.ledgers)) for result in results if result.ledgers]
    if not measured:
        return section(title, "No pair was processed.", "")
    delays, stages = measured[0][1].delays, measured[0][1].stages
    bars = [
        Budget(str(case.interface), tuple(_mean(quantity) for quantity in series.delays)) for case, series in measured
    ]
    work = [
        Budget(str(case.interface), tuple(_mean(quantity) for quantity in series.stages)) for case, series in measured
    ]
    strips = [Strips(str(case.interface), _quantities(series)) for case, series in measured]
    content = (
        legend([(quantity.label, quantity.colour) for quantity in delays])
        + two_widths(lambda width: budgets(bars, width))
        + "<h3>Stages of processing, means</h3>"
        + legend([(quantity.label, quantity.colour) for quantity in stages])
        + two_widths(lambda width: budgets(work, width))
        + "<h3>Each by itself</h3>"
        + two_widths(lambda width: distributions(strips, width))
    )
    rates = "; ".join(f"{result.case.interface}: {summary_line(result)}" for result in results)
    return section(title, f"Means of all pairs, end to end. {rates}.", content)


def summary_line(result: CaseResult) -> str:
    """Rate, losses and clock of one run in a line."""
    lost = ", ".join(f"{count} {reason.replace('_', ' ')}" for reason, count in losses(result).items()) or "nothing"
    uncertainty_us = statistics_of(result).spread("uncertainty").p95_ns / 1e3
    return f"{result.pairs_per_second:.1f} pairs/s, clock +-{uncertainty_us:.0f} us (p95), +-{result.bound_ns / 1e3:.0f} us whatever the link does, whole run lost: {lost}"


def _quantities(series: DelaySeries) -> tuple[Quantity, ...]:
    return (*series.delays, series.end_to_end, series.starvation, *series.stages)


def _mean(quantity: Quantity) -> Part:
    return Part(quantity.label, float(quantity.values_ns.mean()), quantity.colour)
