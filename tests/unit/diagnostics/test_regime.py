"""Which queueing regime holds: known arrival and processing times give the known regime, and remedies whose figures are correct."""

import re
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from phone_host.diagnostics.throughput import Judgement, Regime, RunFigures, judge
from phone_host.sync.fifo import Overflow

MS = 1_000_000
NAN = float("nan")


def figures(*, period_ms: float, arrival_ms: float, processing_ms: float, match_ms: float = 0.0) -> RunFigures:
    """A steady run: a pair is offered every `arrival_ms`; a slower processor drops the rest."""
    interval_ms = max(arrival_ms, processing_ms)
    return RunFigures(
        pairs=300,
        interval_ns=interval_ms * MS,
        processing_ns=processing_ms * MS,
        match_ns=match_ms * MS,
        starvation_ns=(interval_ms - processing_ms) * MS,
        period_ns=round(period_ms * MS),
        received=1.0,
        offered=interval_ms / arrival_ms,
        frame_bytes=50_000,
        propagation_ns=arrival_ms * MS,
    )


def numbers(text: str) -> list[float]:
    """All numbers in a text, in order."""
    return [float(found) for found in re.findall(r"\d+(?:\.\d+)?", text)]


def test_a_slow_link_starves_the_processor() -> None:
    """The paper's first case: 30 a second from the cameras, 10 through the link, 20 ms of work: the processor idles for 80 % of the time."""
    judgement = judge(figures(period_ms=100 / 3, arrival_ms=100, processing_ms=20))
    assert judgement.regime is Regime.STARVED_BY_LINK
    assert "80 %" in judgement.sentence
    smaller, link, fewer = judgement.remedies
    # With a third of the bytes frames come three times as often: 50 KB at 30 a second are 1.5 MB/s, and the link carries a third of that.
    assert numbers(smaller)[:2] == [16.7, 50.0]
    assert numbers(link) == [1.5, 0.5]
    assert "fps=10" in fewer


def test_a_slow_processor_has_a_backlog() -> None:
    """The paper's second case: 30 pairs a second are offered, each takes 100 ms."""
    judgement = judge(figures(period_ms=100 / 3, arrival_ms=100 / 3, processing_ms=100, match_ms=80))
    assert judgement.regime is Regime.BACKLOG
    assert "100 %" in judgement.sentence
    smaller, matcher, fewer = judgement.remedies
    share = numbers(smaller)[0] / 100
    assert 80 * share**3 + 20 * share**2 == pytest.approx(100 / 3, rel=0.03)  # the share is given in whole per cent
    assert numbers(matcher) == [pytest.approx(100 / 3 - 20, abs=0.05), 80.0]
    assert "fps=10" in fewer


def test_whoever_uses_the_fastest_matcher_is_not_told_to_use_a_faster_one() -> None:
    """The other remedies stay."""
    slow = figures(period_ms=33, arrival_ms=100, processing_ms=200, match_ms=150)
    told, spared = judge(slow).remedies, judge(replace(slow, matcher_is_fastest=True)).remedies
    assert [text for text in told if text not in spared] == [text for text in told if "faster matcher" in text]
    assert len(spared) == len(told) - 1


def test_a_backlog_behind_a_slow_link_names_what_the_link_brings() -> None:
    """The cameras show 30 a second, the link brings 15, each pair takes 100 ms: 15 are offered, and the matcher must get by with 66.7 ms."""
    run = figures(period_ms=100 / 3, arrival_ms=200 / 3, processing_ms=100, match_ms=80)
    judgement = judge(run)
    assert judgement.regime is Regime.BACKLOG
    assert "15 pairs arrive per second" in judgement.sentence
    assert numbers(judgement.remedies[1])[0] == pytest.approx(200 / 3 - 20, abs=0.05)


def test_a_fifo_that_blocks_hides_what_the_cameras_offer() -> None:
    """With `block` the board sends no more than is taken: the processor's shortfall is computed from the cameras' rate."""
    run = replace(figures(period_ms=100 / 3, arrival_ms=100, processing_ms=100), overflow=Overflow.BLOCK)
    assert "30 pairs arrive per second" in judge(run).sentence


def test_a_processor_that_just_keeps_up_is_not_said_to_drop() -> None:
    """With 95 ms of work for a pair every 100 ms the processor is busy, and no backlog remains."""
    judgement = judge(figures(period_ms=100, arrival_ms=100, processing_ms=95))
    assert judgement.regime is Regime.BACKLOG
    assert "dropped" not in judgement.sentence


def test_a_processor_that_keeps_up_waits_for_the_cameras() -> None:
    """With 10 ms of work for each of 30 pairs a second the processor keeps up, and its spare capacity is reported."""
    judgement = judge(figures(period_ms=100 / 3, arrival_ms=100 / 3, processing_ms=10))
    assert judgement.regime is Regime.STARVED_BY_CAMERAS
    assert "the processor has time to spare: it could do 3.3 times as much" in judgement.remedies[0]


def test_frames_without_partner_are_told_from_a_slow_link() -> None:
    """If all board frames arrive and only every third is paired, the link is not to blame."""
    run = replace(figures(period_ms=100 / 3, arrival_ms=100, processing_ms=20), received=3.0)
    judgement = judge(run)
    assert judgement.regime is Regime.STARVED_BY_PAIRING
    assert "67 %" in judgement.sentence
    assert "--tolerance" in judgement.remedies[0]


def test_images_on_demand_are_never_slow() -> None:
    """If the cameras' rate is unknown, arrival cannot be called too slow."""
    run = replace(figures(period_ms=30, arrival_ms=100, processing_ms=20), period_ns=0)
    assert judge(run).regime is Regime.STARVED_BY_CAMERAS


@pytest.mark.parametrize(
    "run",
    [
        RunFigures(
            pairs=0,
            interval_ns=NAN,
            processing_ns=NAN,
            match_ns=NAN,
            starvation_ns=NAN,
            period_ns=0,
            received=1.0,
            offered=1.0,
            frame_bytes=NAN,
            propagation_ns=NAN,
        ),
        RunFigures(
            pairs=9,
            interval_ns=1e8,
            processing_ns=1e7,
            match_ns=0,
            starvation_ns=1e7,
            period_ns=0,
            received=1,
            offered=1,
            frame_bytes=1,
            propagation_ns=1,
        ),
    ],
)
def test_nothing_is_said_of_too_few_pairs(run: RunFigures) -> None:
    """With fewer than ten pairs no regime is named."""
    assert judge(run).regime is Regime.UNKNOWN


@given(st.floats(1, 1000), st.floats(1, 5), st.floats(1, 2000), st.floats(0, 1))
def test_the_slower_side_is_always_blamed(period_ms: float, slower: float, processing_ms: float, match: float) -> None:
    """A processor slower than arrival gives a backlog, one far faster starves; every remedy is a sentence with finite numbers."""
    arrival_ms = period_ms * slower
    judgement: Judgement = judge(
        figures(period_ms=period_ms, arrival_ms=arrival_ms, processing_ms=processing_ms, match_ms=match * processing_ms)
    )
    if processing_ms >= arrival_ms:
        assert judgement.regime is Regime.BACKLOG
    if processing_ms < 0.8 * arrival_ms:
        assert judgement.regime not in {Regime.BACKLOG, Regime.UNKNOWN}
    assert not any(word in text for text in (judgement.sentence, *judgement.remedies) for word in ("nan", "inf"))


def test_frames_spoiled_on_the_board_are_not_blamed_on_the_link() -> None:
    """A third of 30 frames a second is dropped on the board because it is not whole, so 20 a second come: the link carries all there is."""
    spoiled = replace(figures(period_ms=100 / 3, arrival_ms=50, processing_ms=10), spoiled=1 / 3)
    judgement = judge(spoiled)
    assert judgement.regime is Regime.STARVED_BY_SPOILED
    assert "33 % of the frames of the board's camera are not whole" in judgement.sentence
    assert "link" not in judgement.sentence
    slow_too = replace(figures(period_ms=100 / 3, arrival_ms=200, processing_ms=10), spoiled=1 / 3)
    assert judge(slow_too).regime is Regime.STARVED_BY_LINK


def test_time_without_the_board_is_named() -> None:
    """The judgement stays that of the time with the board, and says what it leaves out."""
    steady = figures(period_ms=50, arrival_ms=50, processing_ms=10)
    with_gap = judge(replace(steady, gap_s=6.2))
    assert with_gap.regime is judge(steady).regime
    assert with_gap.sentence == f"{judge(steady).sentence}; the 6.2 s around the board's absence are not counted"


@pytest.mark.parametrize(("propagation_ms", "is_link"), [(0.234, False), (16.0, False), (17.0, True), (60.0, True)])
def test_a_link_is_blamed_only_if_frames_are_long_with_it(propagation_ms: float, *, is_link: bool) -> None:
    """Of 30 frames a second 17.4 come. A link as slow as that holds each frame for a period of 33 ms; half of it is the limit."""
    slow = figures(period_ms=100 / 3, arrival_ms=1000 / 17.4, processing_ms=10)
    judgement = judge(replace(slow, propagation_ns=propagation_ms * MS))
    assert judgement.regime is (Regime.STARVED_BY_LINK if is_link else Regime.STARVED_BY_MACHINES)
    assert ("the link carries only" in judgement.sentence) is is_link
    assert any("use another link" in remedy for remedy in judgement.remedies) is is_link
    assert "17.4 of the cameras' 30 frames per second" in judgement.sentence


def test_stills_wait_and_get_no_advice_for_films() -> None:
    """Nothing is dropped of images shown on demand, and they have no rate that could be lowered."""
    judgement = judge(figures(period_ms=0, arrival_ms=117.5, processing_ms=121.1, match_ms=113.3))
    assert judgement.regime is Regime.BACKLOG
    assert "a pair takes it 121.1 ms" in judgement.sentence
    assert "none is dropped" in judgement.sentence
    assert judgement.remedies == ()


@pytest.mark.parametrize(("processing_ms", "advised"), [(104.0, False), (116.0, False), (118.0, True), (130.0, True)])
def test_images_are_not_made_smaller_by_a_hair(processing_ms: float, *, advised: bool) -> None:
    """If all is matching, 95 % of width and height take 0.95**3 of the time: 116.6 ms becomes 100."""
    judgement = judge(figures(period_ms=100, arrival_ms=100, processing_ms=processing_ms, match_ms=processing_ms))
    assert any("smaller images" in remedy for remedy in judgement.remedies) is advised
