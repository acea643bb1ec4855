"""Which of the two queueing regimes holds, what would help, and how a run held its time budget. Pure.

The paper (chapter 4) names both: if propagation takes longer than processing, the processor waits for input; if it
takes less, input waits in a FIFO. The stages overlap here, so the comparison uses the times between pairs, not the
delays themselves: how often pairs arrive, and how long each keeps the processor busy.
"""

import math
from dataclasses import dataclass, replace
from enum import Enum
from typing import Final

from common.diagnostic import Diagnostic
from common.words import counted, distance_text, times
from phone_host.accounts.delays import DelayStatistics
from phone_host.diagnostics.codes import Code
from phone_host.diagnostics.run_snapshot import (
    RunSnapshot,
    spoiled_on_board,
)
from phone_host.model import (
    BudgetAccount,
    BudgetReason,
    BudgetStep,
    PairCounts,
)
from phone_host.sync.fifo import Overflow

_BUSY: Final = 0.9
"""The processor is the bottleneck if it is busy for this share of the time or more.

With random arrivals a queue's length grows as 1 / (1 - share)."""

_SLOWER: Final = 1.15
"""Arrivals count as slower than the cameras above this factor. A run of 30 pairs may lack one or two at its ends."""

_FEW: Final = 10

_LINK_SHARE: Final = 0.5
"""A link that is too slow for the cameras is busy with each frame for more than a period, and so long is its propagation.
Half of it leaves room for two frames under way at a time. Below that, the link is not what frames wait for."""

_WORTH_WHILE: Final = 0.95
"""Images are not made smaller by less than this: it changes nothing that anyone could notice."""


class Regime(Enum):
    """The regime; for starvation, also what the processor waits for."""

    UNKNOWN = "unknown"
    STARVED_BY_CAMERAS = "starved by the cameras"
    STARVED_BY_LINK = "starved by the link"
    STARVED_BY_MACHINES = "starved by a slow camera or machine"
    STARVED_BY_PAIRING = "starved by pairing"
    STARVED_BY_SPOILED = "starved by spoiled images"
    BACKLOG = "backlog"


@dataclass(frozen=True, slots=True, kw_only=True)
class RunFigures:
    """The figures that determine the regime: means over a run or over its last pairs, ns, if not stated otherwise; NaN = not measured.

    Attributes:
        pairs: number of processed pairs.
        interval_ns: time between two results.
        processing_ns: processing time of a pair.
        match_ns: the matcher's share of it.
        starvation_ns: how long the processor had nothing to do before a pair.
        period_ns: period of the slower camera; 0 if images come on demand.
        received: board frames that reached the host, per paired frame.
        offered: pairs formed, per processed pair.
        frame_bytes: size of a board frame.
        propagation_ns: median propagation of a board frame. A machine that is busy delays some by much, a slow link all.
        overflow: the FIFO's overflow policy. With `block` the board is held back, so the pairs offered do not show how
            many there could be.
        spoiled: share of the board camera's frames that the board dropped because they were not whole.
        gap_s: time without the board, left out of all other figures, s.
        matcher_is_fastest: whether none of ours is faster than the one that runs.
    """

    pairs: int
    interval_ns: float
    processing_ns: float
    match_ns: float
    starvation_ns: float
    period_ns: int
    received: float
    offered: float
    frame_bytes: float
    propagation_ns: float
    overflow: Overflow = Overflow.DROP_OLDEST
    spoiled: float = 0.0
    gap_s: float = 0.0
    matcher_is_fastest: bool = False

    @property
    def busy(self) -> float:
        """Share of the time during which the processor has work."""
        return self.processing_ns / (self.processing_ns + self.starvation_ns)

    @property
    def arrival_ns(self) -> float:
        """Time between two pairs offered to the processor, ns."""
        return self.interval_ns / max(1.0, self.offered)


@dataclass(frozen=True, slots=True)
class Judgement:
    """The regime in words.

    Attributes:
        regime: the regime.
        sentence: a description with figures.
        remedies: what would help, each with an estimate from the measured figures.
    """

    regime: Regime
    sentence: str
    remedies: tuple[str, ...] = ()


def judge(figures: RunFigures) -> Judgement:
    """Determine which regime holds and what would help."""
    judgement = _judge(figures)
    if not figures.gap_s:
        return judgement
    said = f"{judgement.sentence}; the {figures.gap_s:.1f} s around the board's absence are not counted"
    return replace(judgement, sentence=said)


def _judge(figures: RunFigures) -> Judgement:
    if figures.pairs < _FEW or not math.isfinite(figures.interval_ns) or not figures.processing_ns > 0:
        return Judgement(
            Regime.UNKNOWN, f"too few pairs ({figures.pairs}) to say whether the processor waits for frames"
        )
    if figures.busy >= _BUSY:
        return _backlog(figures)
    waits = f"the processor is idle for {100 * (1 - figures.busy):.0f} % of the time"
    if not figures.period_ns or figures.arrival_ns <= _SLOWER * figures.period_ns:
        rate = _rate(figures.arrival_ns)
        text = f"{waits}: it keeps up with the cameras; each of the {rate} pairs per second takes it {_ms(figures.processing_ns)} ms"
        return Judgement(Regime.STARVED_BY_CAMERAS, text, _room(figures))
    if figures.spoiled and figures.arrival_ns <= _SLOWER * figures.period_ns / max(1 - figures.spoiled, 0.01):
        text = f"{waits}: {100 * figures.spoiled:.0f} % of the frames of the board's camera are not whole and are dropped there"
        remedy = "check the board camera's cable and its format; board-agent doctor looks at it"
        return Judgement(Regime.STARVED_BY_SPOILED, text, (remedy,))
    if figures.arrival_ns <= _SLOWER * figures.period_ns * figures.received:
        lost = 100 * (1 - 1 / figures.received)
        text = f"{waits}: frames arrive at the cameras' rate, but {lost:.0f} % of them find no partner"
        remedy = "give a larger --tolerance, or run both cameras at the same rate; frames.orphaned in report.json has the reasons"
        return Judgement(Regime.STARVED_BY_PAIRING, text, (remedy,))
    is_quick = figures.propagation_ns < _LINK_SHARE * figures.period_ns
    return _starved_by_machines(figures, waits) if is_quick else _starved_by_link(figures, waits)


def _starved_by_machines(figures: RunFigures, waits: str) -> Judgement:
    """Describe starvation that the link does not explain: frames are with it for a small part of a period."""
    rate = _rate(figures.arrival_ns)
    text = (
        f"{waits}: only {rate} of the cameras' {_rate(figures.period_ns)} frames per second come, and not because of the link "
        f"(propagation {_ms(figures.propagation_ns)} ms): a camera or a machine is too slow"
    )
    remedies = (
        "look in top on both machines whether other programs need the processor; a webcam gives fewer frames in the dark",
        f"lower the camera's rate (fps={rate}): that gives no more pairs, but it spares both machines",
    )
    return Judgement(Regime.STARVED_BY_MACHINES, text, remedies)


def _starved_by_link(figures: RunFigures, waits: str) -> Judgement:
    """Describe starvation by the link: propagation is slower than processing."""
    rate_bytes = figures.frame_bytes * 1e9 / figures.arrival_ns
    wanted_bytes = figures.frame_bytes * 1e9 / figures.period_ns
    fitting_bytes = figures.frame_bytes * figures.period_ns / figures.arrival_ns
    text = (
        f"{waits}: the link carries only {_rate(figures.arrival_ns)} of the cameras' {_rate(figures.period_ns)} frames per second "
        f"(propagation {_ms(figures.propagation_ns)} ms, processing {_ms(figures.processing_ns)} ms)"
    )
    scale = math.sqrt(figures.period_ns / figures.arrival_ns)
    how = f"(about {100 * scale:.0f} % of width and height, or a lower JPEG quality)"
    remedies = (
        f"send smaller frames: with {fitting_bytes / 1000:.1f} instead of {figures.frame_bytes / 1000:.1f} kB the link carries all of them {how}",
        f"use another link: {wanted_bytes / 1e6:.2f} MB/s are needed, this one carries {rate_bytes / 1e6:.2f}",
        f"lower the camera's rate (fps={_rate(figures.arrival_ns)}): that gives no more pairs, but the board drops no frames",
    )
    return Judgement(Regime.STARVED_BY_LINK, text, remedies)


def _backlog(figures: RunFigures) -> Judgement:
    """Describe a backlog: processing is slower than arrival. Images shown on demand wait for the processor."""
    busy = f"the processor is busy for {100 * figures.busy:.0f} % of the time: a pair takes it {_ms(figures.processing_ns)} ms"
    if not figures.period_ns:
        text = f"{busy}; images shown on demand wait for it, and none is dropped"
        return Judgement(Regime.BACKLOG, text)
    # Pairs cannot arrive more often than the cameras give images; the ends of a short run only make it seem so.
    arrival_ns = max(figures.arrival_ns, figures.period_ns)
    if figures.overflow is Overflow.BLOCK:
        arrival_ns = figures.period_ns
    scale = _fitting_scale(figures, arrival_ns)
    others = "the others wait in the FIFO or are dropped" if scale < 1 else "it just keeps up"
    text = f"{busy}, and {_rate(arrival_ns)} pairs arrive per second; {others}"
    remedies = []
    if scale < 1:
        if scale < _WORTH_WHILE:
            remedies.append(
                f"use smaller images: {100 * scale:.0f} % of width and height are enough (estimated from pixels and disparities)"
            )
        rest_ns = figures.processing_ns - figures.match_ns
        if not figures.matcher_is_fastest and figures.match_ns > 0 and rest_ns < arrival_ns:
            remedies.append(
                f"use a faster matcher: it may take {_ms(arrival_ns - rest_ns)} ms, this one takes {_ms(figures.match_ns)} ms"
            )
        remedies.append(
            f"lower the camera's rate: fps={_rate(figures.processing_ns)} is what the processor manages; it also spares the link"
        )
    return Judgement(Regime.BACKLOG, text, tuple(remedies))


def _room(figures: RunFigures) -> tuple[str, ...]:
    """Describe what the processor's spare time would allow."""
    factor = figures.arrival_ns / figures.processing_ns
    if factor < 1.5:
        return ()
    return (f"the processor has time to spare: it could do {factor:.1f} times as much on each pair",)


def _fitting_scale(figures: RunFigures, arrival_ns: float) -> float:
    """Return the share of width and height at which a pair's processing fits between two arrivals.

    Matching scales with its cube, the rest with its square.
    """
    rest_ns = figures.processing_ns - figures.match_ns
    low, high = 0.0, 1.0
    if figures.processing_ns <= arrival_ns:
        return 1.0
    for _ in range(30):
        middle = (low + high) / 2
        fits = figures.match_ns * middle**3 + rest_ns * middle**2 <= arrival_ns
        low, high = (middle, high) if fits else (low, middle)
    return low


def _rate(interval_ns: float) -> str:
    return f"{1e9 / interval_ns:.3g}"


def _ms(time_ns: float) -> str:
    return f"{time_ns / 1e6:.1f}"


def figures(run: RunSnapshot) -> RunFigures:
    """Return the figures that determine the regime, over the whole run."""
    processed, steps = run.processed, run.processed - 1 - run.gaps
    interval_ns = run.seconds * 1e9 / steps if steps > 0 else float("nan")
    known = figures_of(
        run.delays,
        run.counts,
        processed,
        interval_ns=interval_ns,
        period_ns=run.period_ns,
        overflow=run.fifo.overflow,
    )
    lost, grabbed = spoiled_on_board(run.link)
    spoiled = lost / grabbed if grabbed else 0.0
    return replace(known, spoiled=spoiled, gap_s=run.gap_s, matcher_is_fastest=run.matcher_is_fastest)


def figures_of(
    delays: DelayStatistics,
    counts: PairCounts,
    processed: int,
    *,
    interval_ns: float,
    period_ns: int,
    overflow: Overflow,
) -> RunFigures:
    """Return the figures that determine the regime.

    Args:
        delays: delays of the pairs to use.
        counts: counts of frames and pairs over the whole run.
        processed: number of processed pairs over the whole run.
        interval_ns: time between two results; NaN with fewer than two.
        period_ns: period of the slower camera; 0 if images come on demand.
        overflow: the FIFO's overflow policy.
    """
    return RunFigures(
        pairs=delays.spread("processing").count,
        interval_ns=interval_ns,
        processing_ns=delays.spread("processing").mean_ns,
        match_ns=delays.spread("match").mean_ns,
        starvation_ns=delays.spread("starvation").mean_ns,
        period_ns=period_ns,
        received=counts.received / counts.paired if counts.paired else 1.0,
        offered=counts.paired / processed if processed else 1.0,
        frame_bytes=delays.frame_bytes,
        propagation_ns=delays.spread("propagation").p50_ns,
        overflow=overflow,
    )


_MS: Final = 1e6

_WHY: Final = {
    BudgetReason.TOO_SLOW: "pairs took too long",
    BudgetReason.ROOM: "there was time to spare",
    BudgetReason.AS_FAST: "a better matching method takes no longer",
    BudgetReason.OTHER_SIZE: "images came in another size",
}


def budget_lines(account: BudgetAccount | None) -> list[str]:
    """Say what was chosen, how well the budget was held, and what is lost; nothing without a budget."""
    if account is None:
        return []
    took = "" if math.isnan(account.processing_ns) else f", the newest pairs took {account.processing_ns / _MS:.1f} ms"
    held = f"{account.held / account.pairs:.0%} of {counted(account.pairs, 'pair')} held it"
    lines = [f"budget: {account.budget_ns / _MS:g} ms for each pair: {_way(account.now, account.best)}{took}; {held}"]
    if account.changes:
        newest = account.changes[-1]
        took = "" if math.isnan(newest.processing_ns) else f" ({newest.processing_ns / _MS:.1f} ms)"
        lines.append(
            f"budget: changed {times(account.changed)}, last after {newest.at_s:.1f} s because {_WHY[newest.reason]}{took}"
        )
    if narrowed := narrowed_words(account):
        lines.append(f"budget: {narrowed}: nearer things get no depth, or a wrong one")
    elif account.narrowed:
        lines.append(
            f"budget: for {counted(account.narrowed, 'pair')} near things were not looked for; budget.changes in report.json says when"
        )
    return lines


def missed_words(account: BudgetAccount | None) -> str:
    """Say that the budget cannot be held, and what helps; empty if it can."""
    if account is None or not account.is_missed:
        return ""
    return (
        f"--budget {account.budget_ns / _MS:g} cannot be held: pairs take {account.processing_ns / _MS:.1f} ms,"
        f" of which matching takes {account.match_ns / _MS:.1f} ms, and nothing is left to choose that would hold it:"
        " give a longer --budget, or smaller images"
    )


def narrowed_words(account: BudgetAccount | None) -> str:
    """Say from which depth on nothing is found now, because the search is narrower; empty if it is not."""
    if account is None or not account.is_narrowed:
        return ""
    now, best = account.now, account.best
    if math.isnan(now.nearest_m + best.nearest_m):
        return f"disparities are now searched to {now.disparities - 1} px only, not to {best.disparities - 1} px"
    return f"nearest depth is now {distance_text(now.nearest_m)}, not {distance_text(best.nearest_m)}"


def with_budget(concern: Diagnostic, account: BudgetAccount | None) -> Diagnostic:
    """Return a doubt; if the budget has narrowed the search that is too short, with the remedy that helps then."""
    if concern.code != Code.SEARCH_TOO_SHORT or account is None or not account.is_narrowed:
        return concern
    return replace(concern, remedy="give a longer --budget: it has narrowed the search")


def _way(now: BudgetStep, best: BudgetStep) -> str:
    """Name how pairs are matched, and what that is of the best."""
    size = f"{now.width_px}x{now.height_px} px"
    share = "" if now.scale == best.scale else f" ({now.scale / best.scale:.0%} of the size)"
    return f"{now.matcher} at {size}{share}, disparities to {now.disparities - 1} px"
