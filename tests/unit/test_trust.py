"""Time skew, clock and age against motion: a warning in words exactly where a point is displaced too far."""

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from phone_host.trust import Doubt, Timing, concerns

MS = 1_000_000
STILL = Timing(time_skew_ns=16 * MS, uncertainty_ns=0.1 * MS, end_to_end_ns=80 * MS, motion_px_s=0.0, width_px=640)


@pytest.mark.parametrize(
    ("timing", "found"),
    [
        (STILL, []),
        (replace(STILL, motion_px_s=31.0), []),  # 16 ms x 31 px/s = 0.496 px
        (replace(STILL, motion_px_s=32.0), [Doubt.TIME_SKEW]),  # 0.512 px
        (replace(STILL, motion_px_s=300.0, time_skew_ns=0.1 * MS), []),
        (replace(STILL, motion_px_s=300.0, time_skew_ns=0, uncertainty_ns=5 * MS), [Doubt.CLOCK]),
        (replace(STILL, motion_px_s=410.0, time_skew_ns=0), [Doubt.AGE]),  # 80 ms x 410 px/s: 32.8 of 640 px
        (replace(STILL, motion_px_s=1e4, uncertainty_ns=5 * MS), [Doubt.TIME_SKEW, Doubt.CLOCK, Doubt.AGE]),
        (replace(STILL, motion_px_s=float("nan")), []),
        (
            replace(
                STILL,
                motion_px_s=1e4,
                time_skew_ns=float("nan"),
                uncertainty_ns=float("nan"),
                end_to_end_ns=float("nan"),
            ),
            [],
        ),
    ],
)
def test_the_limits(timing: Timing, found: list[Doubt]) -> None:
    """Half a pixel by time skew or clock, a twentieth of the width by age; what is not known makes no warning."""
    assert [concern.doubt for concern in concerns(timing)] == found


@given(st.floats(0, 1e8), st.floats(0, 1e4))
def test_more_skew_or_motion_never_silences_the_warning(skew_ns: float, motion_px_s: float) -> None:
    """The skew warning stands exactly where skew x motion passes half a pixel, and names a remedy."""
    warned = [
        c for c in concerns(replace(STILL, time_skew_ns=skew_ns, motion_px_s=motion_px_s)) if c.doubt is Doubt.TIME_SKEW
    ]
    assert bool(warned) is (skew_ns / 1e9 * motion_px_s > 0.5)
    assert all(concern.remedy for concern in warned)
