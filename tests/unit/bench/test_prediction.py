"""Predictions from measured cells, checked by arithmetic on constant delays."""

from dataclasses import fields, replace

import numpy as np
import pytest

from common.ledger import BoardMarks
from phone_host.bench.emulate import PROFILES
from phone_host.bench.prediction import (
    Cell,
    Figures,
    Images,
    Target,
    Unknown,
    foretell,
    held_out,
    learn_link,
    measured,
    nominal_link,
    with_own_delays,
)
from phone_host.sync.fifo import FifoSettings, Overflow
from tests.support.samples import LEDGER

MS = 1_000_000
LATENCY_NS, NS_PER_BYTE = 2 * MS, 1000
"""2 ms and 1 MB/s."""


def cell(interface: str = "tcp", size_bytes: int = 10_000, period_ms: int = 40, width_px: int = 320) -> Cell:
    """A cell without load: capture 1 ms, processing 10 ms for 320 x 240 and proportional to pixels times width for others, nothing waits."""
    images = Images(
        width_px=width_px,
        height_px=width_px * 3 // 4,
        period_ns=period_ms * MS,
        size_bytes=np.full(1, float(size_bytes)),
    )
    processing_ns = round(10 * MS * (width_px / 320) ** 3)
    ledgers = []
    for number in range(50):
        exposed_ns = number * period_ms * MS
        received_ns = exposed_ns + 1 * MS + LATENCY_NS + NS_PER_BYTE * size_bytes
        board = BoardMarks(exposed_ns=exposed_ns, grabbed_ns=exposed_ns + 1 * MS, sent_ns=exposed_ns + 1 * MS)
        done_ns = received_ns + processing_ns
        ledgers.append(
            replace(
                LEDGER,
                sequence=number,
                host_sequence=number,
                bytes=size_bytes,
                board=board,
                received_ns=received_ns,
                paired_ns=received_ns,
                queued_ns=received_ns,
                dequeued_ns=received_ns,
                done_ns=done_ns,
                previous_done_ns=done_ns - period_ms * MS,
            )
        )
    return Cell(
        interface,
        self_paced=False,
        images=images,
        fifo=FifoSettings(),
        ledgers=tuple(ledgers),
        pairs_per_s=1000 / period_ms,
        lost_share=0.0,
    )


def figures(found: Figures | Unknown) -> Figures:
    """The figures; they must exist."""
    assert isinstance(found, Figures)
    return found


TWENTY_KB = Figures(
    pairs_per_s=20.0,
    lost_share=0.0,
    propagation_p50_ns=22.0 * MS,
    queuing_p95_ns=0.0,
    starvation_p50_ns=40.0 * MS,
    end_to_end_p50_ns=33.0 * MS,
    end_to_end_p95_ns=33.0 * MS,
)
"""20 000 bytes every 50 ms, by hand: 2 + 20 ms on the link, 1 ms of capture before and 10 ms of processing after it; idle for the rest of 50 ms."""


def assert_like(found: Figures, expected: Figures) -> None:
    """All figures agree within 1 %."""
    for one in fields(Figures):
        assert getattr(found, one.name) == pytest.approx(getattr(expected, one.name), rel=0.01, abs=1e-6), one.name


def test_what_was_measured_is_what_the_ledgers_say() -> None:
    """A cell's figures are those of its pairs, which are known here."""
    assert_like(measured(cell(size_bytes=20_000, period_ms=50)), TWENTY_KB)


def test_a_cell_is_foretold_by_the_others() -> None:
    """From cells with 10 000 and 30 000 bytes at other rates, 20 000 bytes every 50 ms are predicted without a measurement of them."""
    target = cell(size_bytes=20_000, period_ms=50)
    cells = [cell(), cell(size_bytes=30_000, period_ms=100), target]
    assert_like(figures(held_out(target, cells)), TWENTY_KB)


def test_a_cell_gives_nothing_to_its_own_prediction() -> None:
    """A cell's own measurements do not affect its prediction: with nonsense in its ledgers the prediction is the same."""
    target = cell(size_bytes=20_000, period_ms=50)
    nonsense = replace(target, ledgers=tuple(replace(one, done_ns=one.done_ns + 10**9) for one in target.ledgers))
    others = [cell(), cell(size_bytes=30_000)]
    assert held_out(target, [*others, target]) == held_out(nonsense, [*others, nonsense])


def test_a_machine_that_was_slower_in_other_runs_is_no_error_of_the_queues() -> None:
    """A cell with_own_delays gives its own figures, however slow processing was in the other cells, which do spoil the normal prediction."""
    target = cell(size_bytes=20_000, period_ms=50)
    others = [cell(), cell(size_bytes=40_000, period_ms=100)]
    slow = [
        replace(other, ledgers=tuple(replace(one, done_ns=one.done_ns + 30 * MS) for one in other.ledgers))
        for other in others
    ]
    cells = [target, *slow]
    assert_like(figures(with_own_delays(target, cells)), TWENTY_KB)
    from_others = figures(held_out(target, cells))
    assert from_others.end_to_end_p50_ns > (33 + 25) * MS


def test_what_others_cannot_tell_is_not_guessed() -> None:
    """For another interface, or if all frames have another size, there are no figures but the reason."""
    target = cell("wifi")
    unknown = held_out(target, [target, cell(), cell(size_bytes=30_000)])
    assert isinstance(unknown, Unknown)
    assert "wifi" in unknown.reason
    far = cell(size_bytes=60_000)
    assert isinstance(held_out(far, [far, cell(), cell(period_ms=50)]), Unknown)


def test_frames_of_one_size_stand_for_their_like() -> None:
    """If all other cells had frames of exactly this size, their delay is used unchanged."""
    target = cell(period_ms=50)
    made = figures(held_out(target, [target, cell(period_ms=40), cell(period_ms=30)]))
    assert made.propagation_p50_ns == pytest.approx(12 * MS, rel=0.001)


@pytest.mark.parametrize("others", [[cell(width_px=320)], [cell(width_px=320), cell(width_px=480)]])
def test_processing_of_a_size_that_was_not_run_follows_its_work(others: list[Cell]) -> None:
    """Twice the width and height is eight times the pixels times disparities: 80 ms where 320 x 240 took 10."""
    images = Images(width_px=640, height_px=480, period_ns=1000.0 * MS, size_bytes=np.array([10_000.0]))
    link = learn_link("tcp", images, others)
    assert not isinstance(link, Unknown)
    made = figures(foretell(Target("tcp", link, images, FifoSettings()), others))
    assert made.end_to_end_p50_ns == pytest.approx((1 + 12 + 80) * MS, rel=0.01)


def test_settings_of_the_queue_and_the_matcher_change_what_they_should() -> None:
    """A matcher that takes 60 ms at 25 frames/s gives 16.7 pairs/s, whether the FIFO drops or blocks. If a deep FIFO drops the newest, pairs wait through all of it."""
    base = cell()
    link = learn_link("tcp", base.images, [base])
    assert not isinstance(link, Unknown)
    target = Target("tcp", link, base.images, FifoSettings(), processing_factor=6.0)
    made = figures(foretell(target, [base]))
    assert made.pairs_per_s == pytest.approx(1000 / 60, rel=0.01)
    assert made.lost_share == pytest.approx(1 - 40 / 60, abs=0.01)
    assert made.starvation_p50_ns == 0.0
    blocked = figures(foretell(replace(target, fifo=FifoSettings(1, Overflow.BLOCK)), [base]))
    assert blocked.pairs_per_s == pytest.approx(1000 / 60, rel=0.01)
    deep = figures(foretell(replace(target, fifo=FifoSettings(4, Overflow.DROP_NEWEST)), [base]))
    # Four services come before it, less the part of the running one that was over when it came.
    assert 180 * MS <= deep.queuing_p95_ns <= 240 * MS


def test_a_profile_alone_gives_a_link() -> None:
    """For an interface that was not measured: delay, rate and jitter of its profile, nothing else."""
    for profile in PROFILES:
        link = nominal_link(profile, self_paced=profile.carrier == "serial")
        assert link.ns_per_byte == pytest.approx(1e9 / profile.bytes_per_s)
        least, most = link.latency_ns + link.spread_ns.min(), link.latency_ns + link.spread_ns.max()
        assert profile.delay_ns - 1 <= least <= most <= profile.delay_ns + profile.jitter_ns + 1


def test_nothing_measured_gives_nothing() -> None:
    """Without any cell there is a reason instead of figures."""
    base = cell()
    assert isinstance(held_out(base, [base]), Unknown)
    assert measured(base).pairs_per_s == 25.0


@pytest.mark.parametrize(("latency_ns", "ns_per_byte"), [(5 * MS, -50.0), (-5 * MS, 1000.0)])
def test_a_line_that_noise_has_tilted_gives_no_negative_delay(latency_ns: int, ns_per_byte: float) -> None:
    """If the fitted line falls, or begins below zero, neither latency nor time per byte is negative, and typical delays are preserved."""
    tilted = []
    for size_bytes in (10_000, 20_000, 40_000):
        base = cell(size_bytes=size_bytes)
        delay_ns = round(latency_ns + ns_per_byte * size_bytes)
        moved = [replace(one, received_ns=one.board.sent_ns + delay_ns) for one in base.ledgers]
        tilted.append(replace(base, ledgers=tuple(moved)))
    link = learn_link("tcp", tilted[1].images, tilted)
    assert not isinstance(link, Unknown)
    assert link.latency_ns >= 0.0
    assert link.ns_per_byte >= 0.0
    middle = link.latency_ns + link.ns_per_byte * 20_000 + float(np.median(link.spread_ns))
    assert middle == pytest.approx(latency_ns + ns_per_byte * 20_000, rel=0.3)


def test_a_line_is_as_fast_as_it_takes_frames() -> None:
    """If a self-paced link begins a frame every 9 ms, a frame takes 9 ms of its line, although propagation grows by 12 ms with a frame's bytes."""
    hurried = replace(cell(period_ms=9), self_paced=True)
    small = replace(cell(size_bytes=5_000), self_paced=True)

    def held_up(one: Cell, more_ns: int) -> Cell:
        return replace(
            one, ledgers=tuple(replace(each, received_ns=each.received_ns + more_ns) for each in one.ledgers)
        )

    cells = [held_up(hurried, 2 * MS), held_up(small, 1 * MS)]
    link = learn_link("tcp", hurried.images, cells)
    assert not isinstance(link, Unknown)
    assert link.ns_per_byte == pytest.approx(9 * MS / 10_000)
    # The delays are unchanged: 14 ms for the larger, 8 ms for the smaller.
    typical = {size: link.latency_ns + link.ns_per_byte * size for size in (10_000, 5_000)}
    left = sorted({round(typical[10_000] + spread) for spread in link.spread_ns[:50]})
    assert left == [pytest.approx(14 * MS, rel=1e-3)]
    free = learn_link("tcp", hurried.images, [replace(one, self_paced=False) for one in cells])
    assert not isinstance(free, Unknown)
    assert free.ns_per_byte == pytest.approx(12 * MS / 10_000, rel=1e-3)


def test_a_full_line_tells_how_long_it_is_taken() -> None:
    """If a self-paced link begins a frame only every 15 ms, while the camera shows one every 5 ms and the processor waits, one frame takes 15 ms of its line."""
    base = cell(period_ms=15)
    full = replace(base, self_paced=True, images=replace(base.images, period_ns=5.0 * MS))
    link = learn_link("tcp", full.images, [full])
    assert not isinstance(link, Unknown)
    assert link.ns_per_byte == pytest.approx(15 * MS / 10_000)
    assert figures(foretell(Target("tcp", link, full.images, FifoSettings()), [full])).pairs_per_s == pytest.approx(
        1000 / 15, rel=0.02
    )
    busy = replace(full, ledgers=tuple(replace(one, previous_done_ns=one.queued_ns) for one in full.ledgers))
    assert not isinstance(told := learn_link("tcp", busy.images, [busy]), Unknown)
    # If the processor is the bottleneck, the line may be faster: all that is known is the propagation of 12 ms.
    assert told.ns_per_byte < 12 * MS / 10_000


def test_other_cells_that_tell_too_little_give_a_reason() -> None:
    """Without any cell nothing is predicted. with_own_delays of a cell over an interface that is not among the others also says so."""
    base = cell()
    link = learn_link("tcp", base.images, [base])
    assert not isinstance(link, Unknown)
    assert isinstance(foretell(Target("tcp", link, base.images, FifoSettings()), []), Unknown)
    assert isinstance(with_own_delays(cell("wifi"), [base]), Unknown)
    # Two frames are too few to measure how long a self-paced line is busy: the fit through them and larger ones gives it.
    few = replace(base, self_paced=True, ledgers=base.ledgers[:2])
    told = learn_link("tcp", base.images, [few, replace(cell(size_bytes=30_000), self_paced=True)])
    assert not isinstance(told, Unknown)
    assert 0 < told.ns_per_byte <= NS_PER_BYTE * 1.01
