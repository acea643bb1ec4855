"""What a loop waits on, and when it does so without sleep."""

import os
from itertools import count

import pytest

from common import now
from common.link.wait import Waiter


def test_a_waiter_sleeps_unless_it_is_to_stay_awake(monkeypatch: pytest.MonkeyPatch) -> None:
    """It gives the core away again and again for 200 us after `stay_awake`, and sleeps before and afterwards; what becomes readable then is told once."""
    read, write = os.pipe2(os.O_NONBLOCK)
    waiter = Waiter([read])
    clock, yielded = count(10**12, 10_000), count()
    turns: list[int] = []

    def yield_core() -> None:
        turns.append(next(yielded))
        if len(turns) == 30:
            os.write(write, b"x")

    monkeypatch.setattr(now, "monotonic_ns", lambda: next(clock))
    monkeypatch.setattr(os, "sched_yield", yield_core)
    assert waiter.wait(1) == []
    assert not turns
    waiter.stay_awake()
    assert waiter.wait(0) == []
    assert not turns
    assert waiter.wait(1) == []
    awake_turns = len(turns)
    assert 15 <= awake_turns < 20
    assert waiter.wait(1) == []
    assert len(turns) == awake_turns
    waiter.stay_awake()
    assert waiter.wait(10_000) == [read]
    assert len(turns) == 30
    os.close(read)
    os.close(write)
