"""The board's outbox: one waiting frame, and counts that never lose one."""

from enum import Enum, auto

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from board_agent.outbox import Outbox
from common.frame import Frame
from common.protocol.message import DropReason
from tests.support.samples import shot


class Act(Enum):
    """What may happen to an outbox."""

    PUT = auto()
    PUT_WITHOUT_HOST = auto()
    SPOILED = auto()
    SKIPPED = auto()
    SENT = auto()
    LINK_FULL = auto()
    STOPPED = auto()


def frame(sequence: int) -> Frame:
    """A frame that is recognized by its number."""
    return shot(sequence, sequence, "board")


@given(st.lists(st.sampled_from(Act), max_size=60))
@settings(deadline=None)
def test_no_frame_is_lost_from_the_account(acts: list[Act]) -> None:
    """After any sequence of events grabbed = sent + dropped by reason + waiting, and the waiting frame is the newest."""
    outbox, newest = Outbox(), -1
    for number, act in enumerate(acts):
        before = outbox.counts
        match act:
            case Act.PUT | Act.PUT_WITHOUT_HOST:
                outbox.put(frame(number), has_host=act is Act.PUT)
                newest = number
                assert (outbox.waiting is None) == (act is Act.PUT_WITHOUT_HOST)
            case Act.SPOILED:
                outbox.spoiled()
            case Act.SKIPPED:
                outbox.skipped()
            case Act.SENT:
                if outbox.waiting is not None:
                    outbox.sent()
                    assert outbox.counts.sent == before.sent + 1
            case Act.LINK_FULL | Act.STOPPED:
                outbox.discard(DropReason[act.name])
                assert outbox.waiting is None
        counts = outbox.counts
        dropped = sum(count for _, count in counts.dropped)
        assert counts.grabbed == counts.sent + dropped + (outbox.waiting is not None)
        assert counts.grabbed - before.grabbed == (act in {Act.PUT, Act.PUT_WITHOUT_HOST, Act.SPOILED, Act.SKIPPED})
        if outbox.waiting is not None:
            assert outbox.waiting.sequence == newest


@pytest.mark.parametrize("reason", DropReason)
def test_each_drop_has_its_reason(reason: DropReason) -> None:
    """Each way to lose a frame is counted once, under its own name."""
    outbox = Outbox()
    match reason:
        case DropReason.SPOILED:
            outbox.spoiled()
        case DropReason.NO_HOST:
            outbox.put(frame(0), has_host=False)
        case DropReason.REPLACED:
            outbox.put(frame(0), has_host=True)
            outbox.put(frame(1), has_host=True)
        case DropReason.LINK_FULL | DropReason.STOPPED:
            outbox.put(frame(0), has_host=True)
            outbox.discard(reason)
            outbox.discard(reason)
    assert outbox.counts.dropped == ((reason, 1),)
