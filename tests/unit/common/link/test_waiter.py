"""What a loop waits on, and when it polls without sleep: on real pipes, with a clock that counts its readings."""

import os
from collections.abc import Iterator

import pytest

from common.link.waiter import Waiter

_TURN_NS = 10_000


class Clock:
    """A clock that advances by 10 us with each reading, or by a given time."""

    def __init__(self) -> None:
        self.now_ns = 10**12
        self.read = 0
        self.steps_ns: list[int] = []

    def __call__(self) -> int:
        """Read it."""
        self.read += 1
        self.now_ns += self.steps_ns.pop(0) if self.steps_ns else _TURN_NS
        return self.now_ns


@pytest.fixture
def clock() -> Clock:
    """The waiter's clock."""
    return Clock()


@pytest.fixture
def pipe() -> Iterator[tuple[int, int]]:
    """Both ends of a pipe."""
    ends = os.pipe2(os.O_NONBLOCK)
    yield ends
    for end in ends:
        os.close(end)


def looks(waiter: Waiter, clock: Clock) -> int:
    """How often an idle wait polled without sleep: it reads the clock once before, if it is to stay awake, and after each poll."""
    before = clock.read
    assert waiter.wait(1) == []
    return max(0, clock.read - before - 1)


def test_a_waiter_sleeps_unless_it_is_to_stay_awake(clock: Clock, pipe: tuple[int, int]) -> None:
    """The waiter polls for 200 us after `stay_awake`. It sleeps before and afterwards, and does not poll if it was not to wait at all."""
    waiter = Waiter(pipe[:1], clock)
    assert looks(waiter, clock) == 0
    waiter.stay_awake()
    read = clock.read
    assert waiter.wait(0) == []
    assert clock.read == read
    assert looks(waiter, clock) == 200_000 // _TURN_NS - 1
    assert looks(waiter, clock) == 0


def test_what_is_readable_ends_the_looking(clock: Clock, pipe: tuple[int, int]) -> None:
    """It is reported at once, and once."""
    waiter = Waiter(pipe[:1], clock)
    waiter.stay_awake()
    os.write(pipe[1], b"x")
    read = clock.read
    assert waiter.wait(10_000) == [pipe[0]]
    assert clock.read - read == 2


def test_a_core_that_others_want_is_left_to_them(clock: Clock, pipe: tuple[int, int]) -> None:
    """If other programs had the core for longer than the waiter may poll, it sleeps normally for a second, however often it is told to stay awake; news of that turn is reported."""
    waiter = Waiter(pipe[:1], clock)
    waiter.stay_awake()
    os.write(pipe[1], b"x")
    clock.steps_ns = [_TURN_NS, 3_000_000]
    assert waiter.wait(1) == [pipe[0]]
    os.read(pipe[0], 1)
    begin_ns = clock.now_ns
    while clock.now_ns - begin_ns < 900_000_000:
        waiter.stay_awake()
        assert looks(waiter, clock) == 0
        clock.now_ns += 50_000_000
    clock.now_ns = begin_ns + 1_000_000_000
    waiter.stay_awake()
    assert looks(waiter, clock) > 0
