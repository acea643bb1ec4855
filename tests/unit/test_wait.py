"""What a loop waits on, and when it looks without sleep."""

import os
from itertools import count

import pytest

from common.link.wait import Waiter

_STEP_NS = 10_000


@pytest.fixture
def turns(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """One entry for each time that the core was given away."""
    seen: list[int] = []
    monkeypatch.setattr(os, "sched_yield", lambda: seen.append(len(seen)))
    return seen


def waiter(fd: int, step_ns: int = _STEP_NS) -> Waiter:
    """A waiter whose clock goes on by a step with each look at it."""
    clock = count(10**12, step_ns)
    return Waiter([fd], lambda: next(clock))


def test_a_waiter_sleeps_unless_it_is_to_stay_awake(turns: list[int]) -> None:
    """It gives the core away again and again for 200 us after `stay_awake`, and sleeps before and afterwards, and where it was not to wait at all."""
    read, write = os.pipe2(os.O_NONBLOCK)
    awake = waiter(read)
    assert awake.wait(1) == []
    awake.stay_awake()
    assert awake.wait(0) == []
    assert not turns
    assert awake.wait(1) == []
    told = len(turns)
    assert 15 <= told < 20
    assert awake.wait(1) == []
    assert len(turns) == told
    os.close(read)
    os.close(write)


def test_what_comes_meanwhile_is_told_once(turns: list[int]) -> None:
    """A descriptor that is readable ends the looking."""
    read, write = os.pipe2(os.O_NONBLOCK)
    awake = waiter(read)
    awake.stay_awake()
    os.write(write, b"x")
    assert awake.wait(10_000) == [read]
    assert len(turns) == 1
    os.close(read)
    os.close(write)


def test_a_core_that_others_want_is_left_to_them(turns: list[int]) -> None:
    """Where a turn of others took long, it sleeps and is woken instead."""
    read, write = os.pipe2(os.O_NONBLOCK)
    awake = waiter(read, step_ns=60_000)
    awake.stay_awake()
    assert awake.wait(1) == []
    assert len(turns) == 1
    os.close(read)
    os.close(write)
