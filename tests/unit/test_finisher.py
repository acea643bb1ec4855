"""The finisher: one place, in order, nothing lost, and a failure never holds up who hands over."""

import threading

from phone_host.run.finisher import Finisher


def test_items_are_finished_in_order_and_none_is_lost() -> None:
    """A hundred items come out as they went in; `end` lets the last one through."""
    done: list[int] = []
    finisher: Finisher[int] = Finisher("test", done.append)
    finisher.start()
    for number in range(100):
        finisher.put(number)
    finisher.end()
    assert finisher.has_ended(60)
    assert done == list(range(100))


def test_the_place_is_taken_until_the_item_is_finished() -> None:
    """While the first item is being finished the second waits outside: at most one is under way in the finisher."""
    begun, may_end, handed = threading.Event(), threading.Event(), threading.Event()
    under_way: list[int] = []
    most: list[int] = []

    def finish(number: int) -> None:
        under_way.append(number)
        most.append(len(under_way))
        begun.set()
        assert may_end.wait(60)
        under_way.remove(number)

    finisher: Finisher[int] = Finisher("test", finish)
    finisher.start()
    finisher.put(0)
    assert begun.wait(60)

    def hand_over() -> None:
        finisher.put(1)
        handed.set()

    second = threading.Thread(target=hand_over)
    second.start()
    assert not handed.is_set()
    assert not finisher.has_ended(0)
    may_end.set()
    assert handed.wait(60)
    second.join()
    finisher.end()
    assert finisher.has_ended(60)
    assert most == [1, 1]


def test_a_failure_is_kept_and_whoever_hands_over_goes_on() -> None:
    """After an exception nothing more is finished, `put` returns at once, and the thread has ended."""
    done: list[int] = []

    def finish(number: int) -> None:
        done.append(number)
        raise ValueError(f"item {number}")

    finisher: Finisher[int] = Finisher("test", finish)
    finisher.start()
    for number in range(5):
        finisher.put(number)
    assert finisher.has_ended(60)
    assert done == [0]
    assert str(finisher.failure) == "item 0"
    finisher.put(5)


def test_an_item_is_only_taken_where_the_place_is_free() -> None:
    """Before the thread has started the first item is taken, the second is not; after it was finished, it is."""
    done: list[int] = []
    finisher: Finisher[int] = Finisher("test", done.append)
    assert finisher.take(0)
    assert not finisher.take(1)
    finisher.start()
    finisher.put(1)
    finisher.end()
    assert finisher.has_ended(60)
    assert done == [0, 1]
