"""When a run's time is over: counted from its first pair, or from the board's coming if no pair follows."""

from phone_host.run.course import TimeLimit

S = 1_000_000_000


def test_time_counts_from_the_first_pair() -> None:
    """3 s after a first pair at 5 s the run is over at 8 s, however long the board took."""
    limit = TimeLimit(3 * S)
    assert not limit.is_over(4 * S, has_met_board=True, begun_ns=0)
    assert not limit.is_over(8 * S - 1, has_met_board=True, begun_ns=5 * S)
    assert limit.is_over(8 * S, has_met_board=True, begun_ns=5 * S)


def test_without_a_pair_ten_seconds_more_are_given_from_the_boards_coming() -> None:
    """The board comes at 100 s: over at 113 s. While no board has come, that is another option's matter."""
    limit = TimeLimit(3 * S)
    assert not limit.is_over(99 * S, has_met_board=False, begun_ns=0)
    assert not limit.is_over(100 * S, has_met_board=True, begun_ns=0)
    assert not limit.is_over(113 * S - 1, has_met_board=True, begun_ns=0)
    assert limit.is_over(113 * S, has_met_board=True, begun_ns=0)


def test_no_limit_never_ends() -> None:
    """0 is no limit."""
    assert not TimeLimit(0).is_over(10**18, has_met_board=True, begun_ns=1)
