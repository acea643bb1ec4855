"""Two things at once."""

import threading

import pytest

from phone_host.stereo.two_threads import in_two_threads


def test_both_results_come_and_both_run_at_once() -> None:
    """Each waits for the other, so it would never end if one ran after the other."""
    meet = threading.Barrier(2, timeout=60)
    first, second = in_two_threads(lambda: (meet.wait(), "a")[1], lambda: (meet.wait(), "b")[1])
    assert (first, second) == ("a", "b")


def test_errors_of_either_come_out() -> None:
    """The caller sees what went wrong, after both have ended; the first's error if both fail."""
    ended: list[int] = []
    with pytest.raises(ZeroDivisionError):
        in_two_threads(lambda: ended.append(1), lambda: 1 // 0)
    assert ended == [1]
    with pytest.raises(ValueError, match="nothing"):
        in_two_threads(lambda: int("nothing"), lambda: 1 // 0)


def test_threads_are_kept_for_the_next_time() -> None:
    """To start a thread costs more than to wake one: a hundred uses, of which each really takes two, need four new ones at most."""
    before = threading.active_count()
    helpers = set()
    meet = threading.Barrier(2, timeout=60)
    for _ in range(100):
        _, helper = in_two_threads(meet.wait, lambda: (meet.wait(), threading.get_ident())[1])
        helpers.add(helper)
    assert 1 <= len(helpers) <= 4
    assert threading.active_count() <= before + 4
    assert threading.get_ident() not in helpers


def test_where_no_helper_is_free_this_thread_does_both() -> None:
    """Many callers at once, each of whose second things waits for something else: none waits for a helper for ever."""
    may_end, begun = threading.Event(), threading.Semaphore(0)

    def held() -> str:
        begun.release()
        assert may_end.wait(60)
        return "held"

    found: list[tuple[str, str]] = []
    callers = [
        threading.Thread(target=lambda: found.append(in_two_threads(lambda: str(may_end.wait(60)), held)))
        for _ in range(8)
    ]
    for caller in callers:
        caller.start()
    for _ in range(4):
        assert begun.acquire(timeout=60)
    mine = in_two_threads(threading.get_ident, threading.get_ident)
    assert mine == (threading.get_ident(),) * 2
    may_end.set()
    for caller in callers:
        caller.join()
    assert found == [("True", "held")] * 8
