"""Whole sentences of advice, one example of each. Only here is their wording fixed; other tests check kinds and figures.

After an intended change of wording run `python -m tests.unit.diagnostics.test_sentences`: it rewrites sentences.txt. Read its diff.
"""

from collections import Counter, deque
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Final

from common.camera.base import CameraHealth, CameraState
from common.diagnostic import Diagnostic
from common.protocol.message import BoardCounts, RefusalReason
from common.versions import PROTOCOL_VERSION
from phone_host.accounts.link_account import Away, LinkAccount, SessionAccount
from phone_host.diagnostics.codes import REJECTED_RIG
from phone_host.diagnostics.image_rules import image_doubts
from phone_host.diagnostics.run_rules import (
    Timing,
    arrival_concerns,
    gone_concerns,
    no_depth,
    stamp_doubt,
    timing_concerns,
)
from phone_host.diagnostics.throughput import RunFigures, judge
from phone_host.model import Arrangement, CutCounts, DepthLimits, Evidence, Exposure, Support, TimeOffset
from phone_host.stream.refusals import BoardRefusal, refusal_text
from phone_host.sync.fifo import Overflow
from phone_host.sync.quarantine import Disbelief, Suspects
from tests.support.run_snapshots import run

MS: Final = 1_000_000
FILE: Final = Path(__file__).with_name("sentences.txt")

# 30 pairs: the cameras show one every 100 ms, the link brings one every 100 ms, and the processor takes 20 ms for each.
CALM: Final = RunFigures(
    pairs=30,
    interval_ns=100 * MS,
    processing_ns=20 * MS,
    starvation_ns=80 * MS,
    match_ns=15 * MS,
    period_ns=100 * MS,
    offered=1.0,
    received=1.0,
    frame_bytes=40_000,
    propagation_ns=30 * MS,
)
REGIMES: Final = {
    "too few": replace(CALM, pairs=3),
    "cameras": CALM,
    "pairing": replace(CALM, interval_ns=300 * MS, starvation_ns=280 * MS, received=3.0),
    "link": replace(CALM, interval_ns=300 * MS, starvation_ns=280 * MS, propagation_ns=310 * MS),
    "machines": replace(CALM, interval_ns=300 * MS, starvation_ns=280 * MS),
    "stills": replace(CALM, interval_ns=200 * MS, processing_ns=200 * MS, starvation_ns=0, period_ns=0),
    "backlog": replace(
        CALM, interval_ns=200 * MS, processing_ns=200 * MS, starvation_ns=0, match_ns=150 * MS, offered=2
    ),
    "backlog behind a FIFO that blocks": replace(
        CALM, interval_ns=200 * MS, processing_ns=200 * MS, starvation_ns=0, match_ns=0, overflow=Overflow.BLOCK
    ),
    "just keeps up": replace(CALM, processing_ns=95 * MS, starvation_ns=5 * MS),
}
FAST: Final = Timing(
    time_skew_ns=16 * MS, uncertainty_ns=5 * MS, end_to_end_ns=80 * MS, motion_px_s=1000.0, width_px=640
)
ARRIVALS: Final = CameraHealth(jitter_ns=4 * MS)
STAMPS: Final = {
    "never measured": (TimeOffset(), CameraHealth()),
    "measured": (TimeOffset(3 * MS, 2 * MS), CameraHealth()),
    "measured, arrivals": (TimeOffset(3 * MS, 2 * MS), ARRIVALS),
    "arrivals": (TimeOffset(), ARRIVALS),
    "arrivals, latency": (TimeOffset(), replace(ARRIVALS, latency_ns=90 * MS)),
    "arrivals, latency stated": (
        TimeOffset(),
        replace(ARRIVALS, latency_ns=90 * MS, latency_uncertainty_ns=20 * MS),
    ),
}


def sentences() -> Iterator[str]:
    """All sentences, each after its name."""
    for name, figures in REGIMES.items():
        judgement = judge(figures)
        yield f"regime, {name}: {judgement.sentence}"
        yield from (f"    {remedy}" for remedy in judgement.remedies)
    yield from map(told, timing_concerns(FAST))
    for name, (offset, own) in STAMPS.items():
        doubt = stamp_doubt(offset, own)
        yield f"stamps, {name}: {doubt.message}\n    {doubt.remedy}"
    for reason in (Disbelief.CLOCK, Disbelief.FUTURE):
        session = SessionAccount("s", BoardCounts(), BoardCounts(), received=100, disbelieved=Counter({reason: 3}))
        link = LinkAccount([session], clock_steps=2, suspects=deque([Suspects(session="s", first=1, last=7, frames=7)]))
        yield from map(told, arrival_concerns(replace(run(1), link=link, spoiled_images=(("too_large", 5),))))
    yield from map(told, image_examples())
    for refused in RefusalReason:
        problem, remedy = refusal_text(BoardRefusal(refused))
        yield f"refused, {refused.name.lower()}: {problem}\n    {remedy}"
    for protocol in (PROTOCOL_VERSION - 1, PROTOCOL_VERSION + 1):
        problem, remedy = refusal_text(BoardRefusal(RefusalReason.VERSION, protocol))
        yield f"refused, version {protocol}: {problem}\n    {remedy}"


def image_examples() -> Iterator[Diagnostic]:
    """One example of each doubt that the images raise."""
    sharp = Exposure(mean_level=110, bright_level=200, structure=30, blur_px=1.0, features=400)
    blind = replace(sharp, mean_level=3, bright_level=5, structure=0.3)

    def support(arrangement: Arrangement, features: int) -> tuple[Support, ...]:
        return tuple(Support(kind, features if kind is arrangement else 0) for kind in Arrangement)

    good = Evidence(
        left=sharp, right=sharp, density=0.9, consistency=0.9, vertical_px=0.2, supports=support(Arrangement.RIGHT, 90)
    )
    for arrangement in Arrangement:
        yield from image_doubts(replace(good, supports=support(arrangement, 90)))
    yield from image_doubts(replace(good, density=0.05, supports=support(Arrangement.RIGHT, 0)))
    yield from image_doubts(replace(good, right=blind, supports=()))
    yield from image_doubts(replace(good, left=replace(sharp, mean_level=9, bright_level=20)))
    yield from image_doubts(replace(good, right=replace(sharp, blur_px=2.5)))
    plain = replace(sharp, structure=2)
    yield from image_doubts(
        replace(good, left=plain, right=plain, density=0.05, supports=support(Arrangement.RIGHT, 0))
    )
    yield from image_doubts(replace(good, density=0.1))
    yield from image_doubts(replace(good, consistency=0.1))
    yield from image_doubts(replace(good, vertical_px=3.1))
    given = DepthLimits(near_m=0.3, far_m=0.002, disparity_error_px=0.25, from_rig=False)
    for cut, limits in (
        (None, None),
        (CutCounts(at_zero=9), None),
        (CutCounts(too_far=9), given),
        (CutCounts(too_far=9, at_zero=1), replace(given, far_m=38.0, from_rig=True)),
        (CutCounts(too_near=9), given),
    ):
        yield no_depth(cut, limits)
    yield REJECTED_RIG
    gone = CameraHealth(CameraState.GONE)
    yield from gone_concerns(replace(run(1), away=(Away(3.0, 7.0, is_over=False),), camera=gone, last_s=5.2))


def told(concern: Diagnostic) -> str:
    """A concern with its remedy."""
    return f"concern, {concern.code}: {concern.message}\n    {concern.remedy}"


def test_the_sentences_are_those_that_were_read_and_agreed_to() -> None:
    """Each kind of advice reads as in sentences.txt."""
    assert "\n".join(sentences()).splitlines() == FILE.read_text(encoding="utf-8").splitlines()


if __name__ == "__main__":
    FILE.write_text("\n".join(sentences()) + "\n", encoding="utf-8")
