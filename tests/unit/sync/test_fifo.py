"""The bounded queue before the stereo pipeline."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.errors import SettingsError
from phone_host.sync.fifo import Fifo, FifoSettings, Overflow

PUT, TAKE = True, False


@pytest.mark.many
@given(st.integers(1, 5), st.sampled_from(Overflow), st.lists(st.sampled_from([PUT, TAKE]), max_size=80))
@settings(deadline=None, max_examples=200)
def test_order_bound_policy_and_conservation(depth: int, overflow: Overflow, acts: list[bool]) -> None:
    """Order is kept, the depth is never exceeded, only a full queue drops, each policy drops at its end, and nothing is lost unnoticed."""
    fifo: Fifo[int] = Fifo(FifoSettings(depth, overflow))
    inside: list[int] = []
    for number, act in enumerate(acts):
        if act is TAKE:
            if inside:
                assert fifo.take() == inside.pop(0)
            else:
                with pytest.raises(IndexError):
                    fifo.take()
            continue
        dropped = fifo.put(number)
        inside.append(number)
        if len(inside) <= depth:
            assert dropped == []
        else:
            assert dropped == [inside.pop(0 if overflow is Overflow.DROP_OLDEST else -1)]
        assert len(fifo) == len(inside) <= depth
        assert fifo.free == depth - len(inside)
    assert [fifo.take() for _ in range(len(fifo))] == inside


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("1", FifoSettings(1, Overflow.DROP_OLDEST)),
        ("1000", FifoSettings(1000, Overflow.DROP_OLDEST)),
        ("2:block", FifoSettings(2, Overflow.BLOCK)),
        ("3:oldest", FifoSettings(3, Overflow.DROP_OLDEST)),
        ("3:drop-oldest", FifoSettings(3, Overflow.DROP_OLDEST)),
        ("4:newest", FifoSettings(4, Overflow.DROP_NEWEST)),
        ("4:drop-newest", FifoSettings(4, Overflow.DROP_NEWEST)),
    ],
)
def test_depth_and_policy_are_read(text: str, expected: FifoSettings) -> None:
    """DEPTH and DEPTH:POLICY mean what they say."""
    assert FifoSettings.parse(text) == expected


@pytest.mark.parametrize(
    "text",
    [
        "",
        ":",
        ":block",
        "0",
        "-1",
        "1001",
        "1.5",
        "one",
        "1:",
        "1:both",
        "1:block:2",
        "1:BLOCK",
        " 1",
        "²",
        "٣",
        "1" * 5000,
    ],
)
def test_other_texts_are_refused(text: str) -> None:
    """Anything else is a SettingsError that shows the text."""
    with pytest.raises(SettingsError, match="--fifo"):
        FifoSettings.parse(text)


@given(st.text(max_size=12))
@settings(deadline=None)
def test_any_text_is_read_or_refused(text: str) -> None:
    """No text raises anything but a SettingsError, and what is read is within its bounds."""
    try:
        fifo = FifoSettings.parse(text)
    except SettingsError:
        return
    assert 1 <= fifo.depth <= 1000
