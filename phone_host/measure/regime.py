"""Which of the two queueing regimes holds, starvation of the processor or a backlog, and what would help. Pure.

The paper (chapter 4) names both: if propagation takes longer than processing, the processor waits for input; if it
takes less, input waits in a FIFO. The stages overlap here, so the comparison uses the times between pairs, not the
delays themselves: how often pairs arrive, and how long each keeps the processor busy.
"""

import math
from dataclasses import dataclass, replace
from enum import Enum
from typing import Final

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
