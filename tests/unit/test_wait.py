"""What a loop waits on, and when it looks without sleep."""

import os
from collections.abc import Iterator

import pytest

from common.link.wait import Waiter


class Core:
    """A core that others have for `turn_ns` whenever it is given away, and its clock."""

    def __init__(self) -> None:
        self.now_ns = 10**12
        self.turn_ns = 10_000
        self.turns = 0

    def give_away(self) -> None:
        """Stand in for sched_yield."""
        self.turns += 1
        self.now_ns += self.turn_ns


@pytest.fixture
def core(monkeypatch: pytest.MonkeyPatch) -> Core:
    """The core that waiters give away."""
    found = Core()
    monkeypatch.setattr(os, "sched_yield", found.give_away)
    return found


@pytest.fixture
def pipe() -> Iterator[tuple[int, int]]:
    """Both ends of a pipe."""
    ends = os.pipe2(os.O_NONBLOCK)
    yield ends
    for end in ends:
        os.close(end)


def test_a_waiter_sleeps_unless_it_is_to_stay_awake(core: Core, pipe: tuple[int, int]) -> None:
    """It gives the core away again and again for 200 us after `stay_awake`, and sleeps before and afterwards, and where it was not to wait at all."""
    waiter = Waiter(pipe[:1], lambda: core.now_ns)
    assert waiter.wait(1) == []
    waiter.stay_awake()
    assert waiter.wait(0) == []
    assert core.turns == 0
    assert waiter.wait(1) == []
    assert core.turns == 20
    assert waiter.wait(1) == []
    assert core.turns == 20


def test_what_is_readable_ends_the_looking(core: Core, pipe: tuple[int, int]) -> None:
    """It is told at once, and once."""
    waiter = Waiter(pipe[:1], lambda: core.now_ns)
    waiter.stay_awake()
    os.write(pipe[1], b"x")
    assert waiter.wait(10_000) == [pipe[0]]
    assert core.turns == 1


def test_a_core_that_others_want_is_left_to_them(core: Core, pipe: tuple[int, int]) -> None:
    """Once others had it for longer than it may look, it sleeps as ever for a second, however often it is to stay awake; news of that turn is told."""
    waiter = Waiter(pipe[:1], lambda: core.now_ns)
    core.turn_ns = 3_000_000
    waiter.stay_awake()
    os.write(pipe[1], b"x")
    assert waiter.wait(1) == [pipe[0]]
    os.read(pipe[0], 1)
    for turns in (1, 2):
        begin_ns = core.now_ns
        while core.now_ns - begin_ns < 999_000_000:
            waiter.stay_awake()
            assert waiter.wait(1) == []
            assert core.turns == turns
            core.now_ns += 100_000_000
        waiter.stay_awake()
        assert waiter.wait(1) == []
        assert core.turns == turns + 1
