"""Which frames are believed at once, which wait for an echo, and which are never believed."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.ledger import BoardMarks
from phone_host.sync.quarantine import LABELS_NS, PATIENCE_NS, Disbelief, Quarantine, Suspects, Unproven, disbelief

MS, SECOND_NS = 1_000_000, 1_000_000_000
PERIOD_NS = 33_000_000
NOW_NS = 500 * SECOND_NS


@pytest.mark.parametrize(
    ("exposed_ms", "grabbed_ms", "sent_ms", "reason"),
    [
        (-40, -10, -5, None),
        (-2, -2, 0, None),
        (-40, -10, 2, None),
        (-40, -10, 3, Disbelief.FUTURE),
        (4, -10, -5, Disbelief.FUTURE),
        (3_600_000, 3_600_000, 3_600_000, Disbelief.FUTURE),
        (-10, -40, -5, Disbelief.MARKS),
        (-40, -5, -10, Disbelief.MARKS),
        (-60_001, -10, -5, Disbelief.PAST),
        (-59_999, -10, -5, None),
    ],
)
def test_marks_that_cannot_be(exposed_ms: int, grabbed_ms: int, sent_ms: int, reason: Disbelief | None) -> None:
    """With the time of arrival known to 2 ms: nothing is sent after it, exposed after it was grabbed, or older than a minute."""
    marks = BoardMarks(
        exposed_ns=NOW_NS + exposed_ms * MS, grabbed_ns=NOW_NS + grabbed_ms * MS, sent_ns=NOW_NS + sent_ms * MS
    )
    assert disbelief(marks, NOW_NS, 2 * MS, labelled=False) is reason


@given(st.integers(-(2**62), 2**62))
def test_labels_may_lie_anywhere_but_at_the_ends(exposed_ns: int) -> None:
    """Stamps of images shown on demand are believed unless the difference of two exceeds 64 bits; the time of sending is no label."""
    marks = BoardMarks(exposed_ns=exposed_ns, grabbed_ns=NOW_NS - 2, sent_ns=NOW_NS - 1)
    far = abs(NOW_NS - exposed_ns) >= LABELS_NS
    assert disbelief(marks, NOW_NS, 0, labelled=True) is (Disbelief.PAST if far else None)
    for sent_ns, reason in ((2**62, Disbelief.FUTURE), (-(2**62), Disbelief.MARKS)):
        assert (
            disbelief(BoardMarks(exposed_ns=NOW_NS, grabbed_ns=NOW_NS - 2, sent_ns=sent_ns), NOW_NS, 0, labelled=True)
            is reason
        )
    ancient = BoardMarks(exposed_ns=NOW_NS, grabbed_ns=NOW_NS - 61 * SECOND_NS, sent_ns=NOW_NS - 61 * SECOND_NS)
    assert disbelief(ancient, NOW_NS, 0, labelled=True) is Disbelief.PAST


def opened(transits_ms: list[float]) -> Quarantine[int]:
    """A quarantine that has proven frames with these times under way."""
    quarantine: Quarantine[int] = Quarantine()
    for number, transit in enumerate(transits_ms):
        quarantine.arrived(-1 - number, number, round(transit * MS), PERIOD_NS, NOW_NS)
        quarantine.confirmed(number, NOW_NS)
    return quarantine


def test_the_first_frame_waits_for_an_echo() -> None:
    """Before anything is proven no frame passes; an echo from before the frame's sending proves nothing."""
    quarantine: Quarantine[str] = Quarantine()
    assert not quarantine.arrived("first", 1000, 3 * MS, PERIOD_NS, NOW_NS)
    assert not quarantine.arrived("second", 2000, 3 * MS, PERIOD_NS, NOW_NS), "order is kept"
    assert quarantine.confirmed(999, NOW_NS) == []
    assert quarantine.confirmed(1000, NOW_NS) == ["first"]
    assert len(quarantine.held) == 1
    assert quarantine.confirmed(5000, NOW_NS) == ["second"]
    assert quarantine.arrived("third", 6000, 3 * MS, PERIOD_NS, NOW_NS)


@given(
    st.lists(st.floats(0, 16), min_size=1, max_size=40),
    st.floats(0, 16),
    st.floats(2.0, 1000.0),
    st.booleans(),
)
def test_no_step_of_two_periods_passes(recent_ms: list[float], true_ms: float, periods: float, back: bool) -> None:  # noqa: FBT001 - drawn
    """If frames take up to half a period, a step of the clock by two periods or more, either way, holds up the next frame."""
    step_ns = round(periods * PERIOD_NS)
    transit_ns: int = round(true_ms * MS) + (step_ns if back else -step_ns)
    assert not opened(recent_ms).arrived(7, 10**6, transit_ns, PERIOD_NS, NOW_NS)


@given(st.lists(st.floats(0, 16), min_size=1, max_size=40), st.floats(0, 16))
def test_a_steady_link_holds_nothing_up(recent_ms: list[float], transit_ms: float) -> None:
    """If frames take up to half a period and no clock steps, every frame passes at once."""
    assert opened(recent_ms).arrived(7, 10**6, round(transit_ms * MS), PERIOD_NS, NOW_NS)


def test_an_unsteady_link_waits_each_time() -> None:
    """If frames take 500 to 900 ms, no frame passes without an echo: a step of two periods would not be seen."""
    quarantine = opened([500, 900, 700, 650])
    for transit_ms in (500, 650, 700, 900):
        assert not quarantine.arrived(transit_ms, 10**6, transit_ms * MS, PERIOD_NS, NOW_NS)
        assert quarantine.confirmed(10**6, NOW_NS) == [transit_ms]


def test_a_doubt_drops_what_waits() -> None:
    """Frames that waited for an echo are returned to be counted, and the next frame has to wait again."""
    quarantine = opened([3, 3, 3])
    quarantine.arrived(8, 10**6, 900 * MS, PERIOD_NS, NOW_NS)
    assert quarantine.void() == [8]
    assert quarantine.void() == []
    assert not quarantine.arrived(9, 10**6, 3 * MS, PERIOD_NS, NOW_NS)


def test_nobody_waits_for_ever() -> None:
    """Without an echo frames are given up after ten seconds, the oldest first."""
    quarantine: Quarantine[int] = Quarantine()
    for number in range(3):
        assert not quarantine.arrived(number, number, 3 * MS, PERIOD_NS, NOW_NS + number * SECOND_NS)
    assert quarantine.expired(NOW_NS + PATIENCE_NS) == []
    assert quarantine.expired(NOW_NS + PATIENCE_NS + SECOND_NS + 1) == [0, 1]
    assert len(quarantine.held) == 1


def test_frames_since_the_last_echo_are_suspect() -> None:
    """After a step the report names exactly the frames that no echo had proven."""
    unproven = Unproven()
    assert unproven.stepped() is None
    for number in range(10, 20):
        unproven.passed(number * 100, "s", number)
    unproven.confirmed(1299)
    assert unproven.stepped() == Suspects(session="s", first=13, last=19, frames=7)
    assert unproven.stepped() is None
