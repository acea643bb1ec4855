"""Frames under way: a link is kept busy, and no frame queues in it behind another. Simulated time and links."""

import random
from collections import deque

import pytest

from phone_host.sync.flow import MOST, Flow

MS = 1_000_000
SECOND_NS = 1000 * MS
PERIOD_NS = 33 * MS


def ages(delay_ns: int, bytes_per_s: float, seconds: int, frame_bytes: int = 25_000) -> list[tuple[int, int]]:
    """A board that sends its newest frame whenever it has credit, over a queue with a rate and a delay: (time, transit) of each frame."""
    flow, chance = Flow(), random.Random(1)
    arrivals: deque[tuple[int, int, int]] = deque()
    grants: deque[int] = deque()
    told, free_ns, leave, grabbed_ns = [], 0, 1, 0
    for now_ns in range(0, seconds * SECOND_NS, MS):
        if now_ns % PERIOD_NS < MS:
            grabbed_ns = now_ns
        while grants and grants[0] <= now_ns:
            grants.popleft()
            leave += 1
        if leave > 0 and grabbed_ns >= 0:
            leave -= 1
            size = frame_bytes * chance.uniform(0.9, 1.1)
            free_ns = max(free_ns, now_ns) + round(size / bytes_per_s * 1e9)
            arrivals.append((free_ns + delay_ns, now_ns, now_ns - grabbed_ns))
            grabbed_ns = -1
        while arrivals and arrivals[0][0] <= now_ns:
            _, sent_ns, waited_ns = arrivals.popleft()
            told.append((now_ns, now_ns - sent_ns))
            flow.arrived(now_ns - sent_ns, waited_ns, PERIOD_NS, now_ns)
            under_way = len(arrivals) + leave + len(grants)
            grants.extend([now_ns + delay_ns] * (flow.window - under_way))
    return told


@pytest.mark.parametrize("bytes_per_s", [12_500, 100_000, 500_000])
def test_where_the_rate_is_the_limit_no_frame_waits_in_the_link(bytes_per_s: float) -> None:
    """At 100 kbit/s to 4 Mbit/s nine frames in ten take at most 1.2 times what their bytes need, and the link is busy 85 % of the time."""
    told = ages(5 * MS, bytes_per_s, 120)
    own_ns = 25_000 / bytes_per_s * 1e9 + 5 * MS
    slow = [transit_ns for _, transit_ns in told if transit_ns > 1.2 * own_ns]
    assert len(slow) <= 0.1 * len(told)
    assert len(told) >= 0.85 * 120 * SECOND_NS / max(own_ns, PERIOD_NS)


def test_where_the_delay_is_the_limit_every_frame_goes() -> None:
    """Over a link with 50 ms each way and a high rate the full frame rate arrives, no frame slower than the delay."""
    told = ages(50 * MS, 1e8, 30)
    late = [transit_ns for now_ns, transit_ns in told if now_ns > 5 * SECOND_NS]
    assert len(late) >= 0.97 * 25 * SECOND_NS / PERIOD_NS
    assert max(late) <= 52 * MS


def test_a_swift_link_needs_no_more_than_one() -> None:
    """If each frame arrives long before the next one is there, the window stays at one."""
    flow = Flow()
    for number in range(1000):
        flow.arrived(MS, MS // 5, PERIOD_NS, number * PERIOD_NS)
    assert flow.window == 1


def test_the_window_is_bounded() -> None:
    """However long the link is, at most MOST frames are under way."""
    flow = Flow()
    for number in range(1000):
        flow.arrived(200 * MS, 30 * MS, PERIOD_NS, number * PERIOD_NS)
    assert flow.window == MOST


def test_a_swift_link_gets_leave_for_several_frames_at_once() -> None:
    """If a frame takes a tenth of a period, four are granted as soon as none is outstanding; before any has come, or if the link is slow, one."""
    flow = Flow()
    assert flow.credit(0, PERIOD_NS) == 1
    flow.arrived(PERIOD_NS // 10, 0, PERIOD_NS, SECOND_NS)
    assert [flow.credit(outstanding, PERIOD_NS) for outstanding in range(3)] == [MOST, 0, 0]
    flow.arrived(PERIOD_NS, 0, PERIOD_NS, 2 * SECOND_NS)
    assert flow.credit(0, PERIOD_NS) == 1


@pytest.mark.parametrize(("round_trip_ns", "frames"), [(0, 2), (PERIOD_NS, 2), (2 * PERIOD_NS, 3), (SECOND_NS, MOST)])
def test_a_link_that_paces_itself_always_has_leave_for_the_next_frame(round_trip_ns: int, frames: int) -> None:
    """One frame, plus one for each period of the round trip (at least one), four at most."""
    flow = Flow()
    flow.arrived(PERIOD_NS, 0, PERIOD_NS, SECOND_NS)
    assert flow.credit(frames - 1, PERIOD_NS, round_trip_ns) == frames
    assert flow.credit(frames, PERIOD_NS, round_trip_ns) == 0
