"""The queueing model against known results of queueing theory."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from phone_host.bench.queue_model import LinkModel, Setting, predict, serve
from phone_host.sync.fifo import FifoSettings, Overflow

MS = 1e6
ENDLESS = 10**9


def constant(value: float) -> np.ndarray:
    return np.array([value])


def setting(period_ms: float = 20.0, service_ms: float = 5.0, fifo: FifoSettings | None = None) -> Setting:
    """Everything constant: capture 1 ms, latency 1 ms, 10 000 bytes at 1 us each, pairing and waking take no time."""
    return Setting(
        period_ns=period_ms * MS,
        size_bytes=constant(10_000.0),
        capture_ns=constant(1 * MS),
        link=LinkModel(latency_ns=1 * MS, ns_per_byte=1000.0, spread_ns=constant(0.0), self_paced=False),
        pairing_ns=constant(0.0),
        wake_ns=constant(0.0),
        service_ns=constant(service_ms * MS),
        fifo=fifo or FifoSettings(depth=ENDLESS),
    )


@given(st.lists(st.tuples(st.integers(0, 100), st.integers(0, 100)), min_size=1, max_size=200))
def test_waits_follow_lindleys_recursion(steps: list[tuple[int, int]]) -> None:
    """With a queue that never fills, W(k+1) = max(0, W(k) + S(k) - A(k+1)) (Lindley 1952), for any arrivals and services."""
    queued = np.cumsum([gap for gap, _ in steps]).astype(float)
    service = np.array([float(length) for _, length in steps])
    served = serve(queued_ns=queued, service_ns=service, depth=ENDLESS, overflow=Overflow.DROP_NEWEST)
    wait = [0.0]
    for index, (before, now) in enumerate(pairwise(queued)):
        wait.append(max(0.0, wait[-1] + service[index] - (now - before)))
    assert (served.start_ns - queued).tolist() == wait
    assert served.dropped == 0


@given(
    st.lists(st.tuples(st.integers(0, 60), st.integers(0, 100)), min_size=1, max_size=200),
    st.integers(1, 4),
)
def test_who_gives_way_does_not_change_how_many(steps: list[tuple[int, int]], depth: int) -> None:
    """The number of waiting pairs does not depend on which one is dropped, so both policies drop equally many and are busy at the same times."""
    queued = np.cumsum([gap for gap, _ in steps]).astype(float)
    service = np.array([float(length) for _, length in steps])
    oldest = serve(queued_ns=queued, service_ns=service, depth=depth, overflow=Overflow.DROP_OLDEST)
    newest = serve(queued_ns=queued, service_ns=service, depth=depth, overflow=Overflow.DROP_NEWEST)
    assert oldest.dropped == newest.dropped
    kept = [one.done_ns[~np.isnan(one.done_ns)].tolist() for one in (oldest, newest)]
    assert kept[0] == kept[1]


@pytest.mark.long
@pytest.mark.parametrize("load", [0.3, 0.6, 0.8])
def test_mean_wait_of_poisson_arrivals_and_constant_service(load: float) -> None:
    """M/D/1: mean wait = load / (2 (1 - load)) services (Pollaczek-Khinchine with a variance of zero; Kleinrock, Queueing Systems 1, chapter 5)."""
    random = np.random.default_rng(1)
    count = 400_000
    queued = np.cumsum(random.exponential(1.0 / load, count))
    served = serve(queued_ns=queued, service_ns=np.ones(count), depth=ENDLESS, overflow=Overflow.DROP_NEWEST)
    assert float((served.start_ns - queued).mean()) == pytest.approx(load / (2.0 * (1.0 - load)), rel=0.03)


def test_mean_wait_of_poisson_arrivals_and_drawn_service() -> None:
    """M/G/1: mean wait = rate E[S^2] / (2 (1 - load)) (Pollaczek-Khinchine), for services drawn from two measured values, 0.2 and 1.8."""
    random = np.random.default_rng(2)
    count, rate = 400_000, 0.6
    service = random.choice([0.2, 1.8], count)
    queued = np.cumsum(random.exponential(1.0 / rate, count))
    served = serve(queued_ns=queued, service_ns=service, depth=ENDLESS, overflow=Overflow.DROP_NEWEST)
    expected = rate * (0.5 * 0.2**2 + 0.5 * 1.8**2) / (2.0 * (1.0 - rate * 1.0))
    assert float((served.start_ns - queued).mean()) == pytest.approx(expected, rel=0.03)


@pytest.mark.long
@pytest.mark.parametrize(("load", "depth"), [(0.5, 1), (0.9, 2), (1.5, 3)])
def test_loss_of_a_full_queue_under_poisson_arrivals(load: float, depth: int) -> None:
    """M/M/1/K with K = depth + 1 loses (1 - load) load^K / (1 - load^(K + 1)) of all (Kleinrock, Queueing Systems 1, section 3.6)."""
    random = np.random.default_rng(3)
    count = 300_000
    queued = np.cumsum(random.exponential(1.0 / load, count))
    served = serve(
        queued_ns=queued, service_ns=random.exponential(1.0, count), depth=depth, overflow=Overflow.DROP_OLDEST
    )
    places = depth + 1
    expected = (1.0 - load) * load**places / (1.0 - load ** (places + 1))
    assert served.dropped / count == pytest.approx(expected, rel=0.03)


def test_a_processor_faster_than_the_camera_starves() -> None:
    """D/D/1 below capacity: nothing waits, the worker idles for period - service, and every delay is what was put in."""
    made = predict(setting(), 100, np.random.default_rng(0))
    assert made.pairs_per_s == pytest.approx(50.0)
    assert (made.replaced_share, made.dropped_share) == (0.0, 0.0)
    assert np.allclose(made.queuing_ns, 0.0)
    assert np.allclose(made.starvation_ns[1:], 15 * MS)
    assert np.allclose(made.propagation_ns, 11 * MS)
    assert np.allclose(made.end_to_end_ns, (1 + 11 + 5) * MS)


@pytest.mark.parametrize("policy", list(Overflow))
@pytest.mark.parametrize("depth", [1, 3])
def test_a_processor_slower_than_the_camera_sets_the_rate(policy: Overflow, depth: int) -> None:
    """D/D/1 above capacity: the rate is 1 / service, the worker never idles, and the excess is lost before the link or in the FIFO."""
    made = predict(setting(20.0, 50.0, FifoSettings(depth, policy)), 2000, np.random.default_rng(0))
    assert made.starvation_ns[5:].max() <= (0.0 if policy is not Overflow.BLOCK or depth > 1 else 50 * MS)
    lost = 1.0 - (1.0 - made.replaced_share) * (1.0 - made.dropped_share)
    if policy is Overflow.BLOCK:
        assert made.dropped_share == 0.0
    else:
        assert made.pairs_per_s == pytest.approx(20.0, rel=0.01)
        assert lost == pytest.approx(1.0 - 20.0 / 50.0, abs=0.01)
        assert made.replaced_share == 0.0
    if policy is Overflow.DROP_OLDEST:
        # The pair that is taken is among the newest `depth`: none is older than depth periods then.
        assert made.queuing_ns.max() <= depth * 20 * MS + 1
    if policy is Overflow.DROP_NEWEST:
        # A full queue is served in order: depth services, less the rest of the period in which the pair came.
        assert made.queuing_ns.max() <= depth * 50 * MS + 1
        assert made.queuing_ns[5:].min() >= (depth * 50 - 20) * MS - 1


def test_a_link_slower_than_the_camera_sets_the_rate_and_replaces_frames() -> None:
    """With 100 ms of line time per frame and one frame under way, frames follow each other by 100 ms and twice the latency; the rest are replaced."""
    slow = LinkModel(latency_ns=1 * MS, ns_per_byte=10_000.0, spread_ns=constant(0.0), self_paced=False)
    made = predict(replace(setting(), link=slow), 3000, np.random.default_rng(0))
    assert made.pairs_per_s == pytest.approx(1000.0 / 102.0, rel=0.01)
    assert made.replaced_share == pytest.approx(1.0 - 20.0 / 102.0, abs=0.01)
    # The newest frame leaves: it has waited for less than a period.
    assert made.outbox_ns.max() <= 20 * MS
    assert np.allclose(made.propagation_ns, 101 * MS)


def test_a_self_paced_link_is_never_idle_under_load() -> None:
    """If credit runs one frame ahead and the board waits for the line, frames follow each other by their line time alone."""
    slow = LinkModel(latency_ns=5 * MS, ns_per_byte=10_000.0, spread_ns=constant(0.0), self_paced=True)
    made = predict(replace(setting(), link=slow), 3000, np.random.default_rng(0))
    assert made.pairs_per_s == pytest.approx(10.0, rel=0.01)
    assert np.allclose(made.propagation_ns, 105 * MS)


@given(
    st.floats(2.0, 100.0),
    st.lists(st.floats(0.0, 80.0), min_size=1, max_size=5),
    st.lists(st.floats(0.0, 20.0), min_size=1, max_size=5),
    st.builds(FifoSettings, st.integers(1, 4), st.sampled_from(Overflow)),
    st.sampled_from([False, True]),
)
@settings(deadline=None, max_examples=60)
def test_delays_add_up_and_order_is_kept(
    period_ms: float, service_ms: list[float], spread_ms: list[float], fifo: FifoSettings, self_paced: object
) -> None:
    """For any setting end-to-end is the sum of the delays, no delay is negative, and shares are between 0 and 1."""
    link = LinkModel(
        latency_ns=1 * MS, ns_per_byte=500.0, spread_ns=np.array(spread_ms) * MS, self_paced=bool(self_paced)
    )
    base = setting(period_ms, 0.0, fifo)
    made = predict(replace(base, link=link, service_ns=np.array(service_ms) * MS), 200, np.random.default_rng(4))
    parts = (made.capture_ns, made.outbox_ns, made.propagation_ns, made.pairing_ns, made.queuing_ns, made.processing_ns)
    assert np.allclose(sum(parts), made.end_to_end_ns, atol=1.0)
    assert min(float(part.min()) for part in parts) >= -1e-3
    assert 0.0 <= made.replaced_share < 1.0
    assert 0.0 <= made.dropped_share < 1.0
    assert fifo.overflow is not Overflow.BLOCK or made.dropped_share == 0.0
