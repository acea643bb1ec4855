"""Time skew, clock and age against image motion: a warning exactly where a point is displaced too far."""

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.camera.base import CameraHealth, CameraState
from phone_host.diagnostics.codes import Code
from phone_host.diagnostics.run_rules import Timing, stamp_doubt, timing_concerns
from phone_host.model import UNMEASURED_NS, TimeOffset

MS = 1_000_000
STILL = Timing(time_skew_ns=16 * MS, uncertainty_ns=0.1 * MS, end_to_end_ns=80 * MS, motion_px_s=0.0, width_px=640)


@pytest.mark.parametrize(
    ("timing", "found"),
    [
        (STILL, []),
        (replace(STILL, motion_px_s=31.0), []),  # 16 ms x 31 px/s = 0.496 px
        (replace(STILL, motion_px_s=32.0), [Code.TIME_SKEW]),  # 0.512 px
        (replace(STILL, motion_px_s=300.0, time_skew_ns=0.1 * MS), []),
        (replace(STILL, motion_px_s=300.0, time_skew_ns=0, uncertainty_ns=5 * MS), [Code.CLOCK]),
        (replace(STILL, motion_px_s=410.0, time_skew_ns=0), [Code.AGE]),  # 80 ms x 410 px/s: 32.8 of 640 px
        (replace(STILL, motion_px_s=1e4, uncertainty_ns=5 * MS), [Code.TIME_SKEW, Code.CLOCK, Code.AGE]),
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
def test_the_limits(timing: Timing, found: list[Code]) -> None:
    """Half a pixel by time skew or clock, a twentieth of the width by age; unknown values cause no warning."""
    assert [concern.code for concern in timing_concerns(timing)] == found


def warned(skew_ns: float, motion_px_s: float) -> bool:
    """Whether this time skew at this motion causes a warning; a warning has a remedy."""
    concerns = [*timing_concerns(replace(STILL, time_skew_ns=skew_ns, motion_px_s=motion_px_s))]
    found = [concern for concern in concerns if concern.code == Code.TIME_SKEW]
    assert all(concern.remedy for concern in found)
    return bool(found)


@pytest.mark.parametrize(
    ("skew_ms", "motion_px_s"), [(0.25, 2000), (1, 500), (5, 100), (10, 50), (33, 15.1515151515), (100, 5)]
)
def test_the_limit_is_half_a_pixel(skew_ms: float, motion_px_s: float) -> None:
    """Where skew and motion together make half a pixel, a hundredth less of either gives no warning and a hundredth more gives one."""
    assert not warned(0.99 * skew_ms * MS, motion_px_s)
    assert warned(1.01 * skew_ms * MS, motion_px_s)
    assert not warned(skew_ms * MS, 0.99 * motion_px_s)
    assert warned(skew_ms * MS, 1.01 * motion_px_s)


@given(st.floats(0, 1e8), st.floats(0, 1e4), st.floats(1, 10), st.floats(1, 10))
def test_more_skew_or_motion_never_silences_the_warning(
    skew_ns: float, motion_px_s: float, later: float, faster: float
) -> None:
    """A warning stays when frames are further apart or things move faster."""
    assert warned(later * skew_ns, faster * motion_px_s) >= warned(skew_ns, motion_px_s)


RUNNING = CameraHealth(CameraState.RUNNING)
ARRIVALS = replace(RUNNING, jitter_ns=4 * MS)
MEASURED = TimeOffset(3 * MS, 2 * MS)


@pytest.mark.parametrize(
    ("offset", "own", "half_width_ns", "said", "remedy"),
    [
        (TimeOffset(), RUNNING, UNMEASURED_NS, "16.7 ms", "calibrate-time"),
        (MEASURED, RUNNING, 2 * MS, "2.0 ms", "calibrate-time"),
        (MEASURED, ARRIVALS, 6 * MS, "4.0 ms", "network"),
        (TimeOffset(), ARRIVALS, UNMEASURED_NS + 54 * MS, "50 ms", "latency_ms="),
        (
            TimeOffset(),
            replace(ARRIVALS, latency_ns=90 * MS),
            UNMEASURED_NS + 4 * MS,
            "latency_ms",
            "latency_uncertainty_ms=",
        ),
        (
            TimeOffset(),
            replace(ARRIVALS, latency_ns=90 * MS, latency_uncertainty_ns=20 * MS),
            UNMEASURED_NS + 24 * MS,
            "20.0 ms",
            "calibrate-time",
        ),
        (
            MEASURED,
            replace(ARRIVALS, latency_ns=90 * MS, latency_uncertainty_ns=20 * MS),
            6 * MS,
            "2.0 ms",
            "calibrate-time",
        ),
    ],
)
def test_what_is_not_known_of_the_stamps_adds_up(
    offset: TimeOffset, own: CameraHealth, half_width_ns: int, said: str, remedy: str
) -> None:
    """An unmeasured time offset and an own camera's latency and jitter add up; if that is half a pixel, a warning names figure and remedy."""
    doubt = stamp_doubt(offset, own)
    assert doubt.evidence == half_width_ns
    limit_px_s = 0.5e9 / half_width_ns
    calm = replace(STILL, time_skew_ns=0, uncertainty_ns=0, end_to_end_ns=0, stamps=doubt)
    assert not [*timing_concerns(replace(calm, motion_px_s=0.99 * limit_px_s))]
    (concern,) = timing_concerns(replace(calm, motion_px_s=1.01 * limit_px_s))
    assert concern.code == Code.STAMPS
    assert said in concern.message
    assert remedy in concern.remedy
