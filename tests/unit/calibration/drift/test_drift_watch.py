"""A rig is watched while it runs: steady, knocked, turned little by little, late, bare, corrected within bounds."""

import math
from dataclasses import replace

import numpy as np
import pytest

from phone_host.calibration.drift.fit import RowModel, Sighting
from phone_host.calibration.drift.watch import DriftWatch, Trends
from phone_host.diagnostics.codes import Code
from phone_host.diagnostics.drift import drift_concerns
from phone_host.model import AS_CALIBRATED, ChangeKind, Departure, DriftState
from phone_host.stereo.rectify import rectify_rig
from phone_host.stereo.scaled_rig import scaled_rig
from tests.support.drift_sightings import Sight, sight

KNOCKED, RETURNED, CORRECTED, BEYOND = (
    ChangeKind.KNOCKED,
    ChangeKind.RETURNED,
    ChangeKind.CORRECTED,
    ChangeKind.BEYOND,
)


@pytest.fixture(scope="module")
def made() -> Sight:
    """Two webcams."""
    return sight()


def pitched(degrees: float) -> Departure:
    """The right camera looks up or down by this."""
    return Departure(turn_rad=(math.radians(degrees), 0.0, 0.0))


def shown(watch: DriftWatch, made: Sight, departure: Departure, times: range, **kind: float) -> None:
    """Show a watch two sightings a second, by their numbers."""
    for number in times:
        watch.add(made.model, made.sighting(number, departure, **kind), number / 2)  # type: ignore[arg-type]


def kinds(watch: DriftWatch) -> list[ChangeKind]:
    """What was told, in order."""
    return [change.kind for change in watch.drift.changes]


def test_a_steady_rig_is_left_alone(made: Sight) -> None:
    """After three sightings it is called steady; no change is told, and nothing is corrected."""
    watch = DriftWatch()
    assert watch.drift.state is DriftState.UNKNOWN
    shown(watch, made, AS_CALIBRATED, range(2))
    assert watch.drift.state is DriftState.UNKNOWN
    shown(watch, made, AS_CALIBRATED, range(2, 56))
    drift = watch.drift
    assert (drift.state, kinds(watch), watch.overlay) == (DriftState.STEADY, [], AS_CALIBRATED)
    assert (drift.judged, drift.measurements) == (56, 6)
    assert drift.rows_sigma_px < 0.1
    assert all(
        abs(rate) < 4 * sigma for rate, sigma in zip(drift.trend.turn_rad_s, drift.trend.sigma_rad_s, strict=True)
    )


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_knock_is_told_by_the_second_sighting_and_corrected(made: Sight, axis: int) -> None:
    """A turn of 0.3 degrees about any axis: one sighting is doubted, the next one told and corrected, to 0.3 px of rows."""
    turn = [0.0, 0.0, 0.0]
    turn[axis] = math.radians(-0.3)
    knocked, watch = Departure(turn_rad=(turn[0], turn[1], turn[2])), DriftWatch()
    shown(watch, made, AS_CALIBRATED, range(8))
    shown(watch, made, knocked, range(8, 9))
    assert (watch.is_unsure, kinds(watch)) == (True, [])
    shown(watch, made, knocked, range(9, 10))
    assert (watch.is_unsure, kinds(watch)) == (False, [KNOCKED, CORRECTED])
    assert watch.take_news() == watch.drift.changes
    assert watch.take_news() == ()
    step = watch.drift.changes[0].step
    assert step.angle_rad == pytest.approx(math.radians(0.3), abs=math.radians(0.06))
    assert watch.overlay.turn_rad[axis] == pytest.approx(turn[axis], abs=math.radians(0.06))
    drift = watch.drift
    assert drift.state is DriftState.CORRECTED
    assert drift.left_px < 0.3


def test_one_strange_sighting_is_no_knock(made: Sight) -> None:
    """A single pair that says otherwise, and two that say different things, change nothing."""
    watch = DriftWatch()
    shown(watch, made, AS_CALIBRATED, range(6))
    shown(watch, made, pitched(0.4), range(6, 7))
    shown(watch, made, pitched(-0.4), range(7, 8))
    shown(watch, made, AS_CALIBRATED, range(8, 9))
    assert (kinds(watch), watch.is_unsure, watch.drift.measurements) == ([], False, 6)


def test_a_rig_that_turns_little_by_little_is_followed_and_told_with_its_trend(made: Sight) -> None:
    """0.3 degrees a minute: the correction follows in steps, without a knock, and the trend is proven."""
    watch, last = DriftWatch(), AS_CALIBRATED
    for number in range(60):
        last = pitched(0.0025 * number)
        watch.add(made.model, made.sighting(number, last), number / 2)
    drift = watch.drift
    assert set(kinds(watch)) == {CORRECTED}
    assert 3 < len(drift.changes) <= 20
    assert math.degrees(drift.trend.turn_rad_s[0]) * 60 == pytest.approx(0.3, rel=0.1)
    assert drift.trend.turn_rad_s[0] > 10 * drift.trend.sigma_rad_s[0]
    assert watch.overlay.turn_rad[0] == pytest.approx(last.turn_rad[0], abs=math.radians(0.03))
    assert drift.trend.rows_px_s > 0


def test_a_rig_that_goes_back_is_corrected_no_more(made: Sight) -> None:
    """Knocked and put right: two knocks, and in the end no correction."""
    watch = DriftWatch()
    shown(watch, made, AS_CALIBRATED, range(4))
    shown(watch, made, pitched(0.3), range(4, 8))
    shown(watch, made, AS_CALIBRATED, range(8, 14))
    assert kinds(watch) == [KNOCKED, CORRECTED, KNOCKED, CORRECTED]
    assert (watch.overlay, watch.drift.state) == (AS_CALIBRATED, DriftState.STEADY)


def test_beyond_its_bounds_nothing_is_corrected(made: Sight) -> None:
    """A turn of 1.3 degrees, or 3 % of focal length, is told once and left as it is."""
    for departure in (pitched(1.3), Departure(focal=1.03)):
        watch = DriftWatch()
        shown(watch, made, departure, range(6))
        assert (kinds(watch), watch.drift.state, watch.overlay) == ([BEYOND], DriftState.BEYOND, AS_CALIBRATED)


def test_who_wants_no_correction_is_told_all_the_same(made: Sight) -> None:
    """The knock is told, the state says that it is not corrected."""
    watch = DriftWatch(corrects=False)
    shown(watch, made, AS_CALIBRATED, range(4))
    shown(watch, made, pitched(0.3), range(4, 8))
    drift = watch.drift
    assert (kinds(watch), drift.state, drift.overlay) == ([KNOCKED], DriftState.DEPARTED, AS_CALIBRATED)
    assert drift.left_px == drift.rows_px > 2


@pytest.mark.parametrize("count", [0, 10, 30])
def test_too_few_features_never_correct(made: Sight, count: int) -> None:
    """Bare walls: whatever the rig does, nothing is said of it."""
    watch = DriftWatch()
    shown(watch, made, pitched(0.5), range(2), count=count)
    for number in range(2, 12):  # some that all lie in one corner
        seen = made.sighting(number, pitched(0.5), count=400)
        corner = (seen.slopes < -0.3).all(axis=1)
        part = replace(
            seen,
            slopes=seen.slopes[corner],
            columns=seen.columns[corner],
            off_px=seen.off_px[corner],
            speed_px_s=seen.speed_px_s[corner],
        )
        watch.add(made.model, part, number / 2)
    assert (watch.drift.state, watch.overlay, kinds(watch)) == (DriftState.UNKNOWN, AS_CALIBRATED, [])


@pytest.mark.parametrize("count", [20, 25, 29])
def test_a_knock_with_few_features_is_told_once_and_taken_in(made: Sight, count: int) -> None:
    """Two sightings do not know the rows: what was known before is over at once, and six of them make a new estimate."""
    watch = DriftWatch()
    shown(watch, made, AS_CALIBRATED, range(6))
    number, states = 6, list[DriftState]()
    while CORRECTED not in kinds(watch) and number < 30:
        shown(watch, made, pitched(0.3), range(number, number + 1), count=count)
        states.append(watch.drift.state)
        number += 1
    assert kinds(watch) == [KNOCKED, CORRECTED]
    assert list(dict.fromkeys(states)) == [DriftState.STEADY, DriftState.UNKNOWN, DriftState.CORRECTED]
    assert watch.drift.left_px < 0.1


def test_after_a_camera_was_away_the_rig_is_measured_afresh(made: Sight) -> None:
    """It is told at once; that it stands otherwise by the second sighting; that it stands as before by no change."""
    watch = DriftWatch()
    shown(watch, made, AS_CALIBRATED, range(6))
    watch.returned(3.0, 2.5)
    assert [(change.kind, change.away_s) for change in watch.drift.changes] == [(RETURNED, 2.5)]
    shown(watch, made, AS_CALIBRATED, range(6, 9))
    assert (kinds(watch), watch.drift.measurements) == ([RETURNED], 3)
    watch.returned(5.0, 1.5)
    shown(watch, made, pitched(0.2), range(9, 11))
    assert kinds(watch) == [RETURNED, RETURNED, KNOCKED, CORRECTED]
    fresh = DriftWatch()
    fresh.returned(0.5, 2.0)
    assert fresh.drift.changes[0].departure == AS_CALIBRATED


def test_a_correction_of_an_earlier_run_is_kept_or_given_up(made: Sight) -> None:
    """The start is in use at once; it stays if the rig stands so, and ends if it does not."""
    start = pitched(0.3)
    right, wrong = DriftWatch(start=start), DriftWatch(start=start)
    assert right.overlay == start
    shown(right, made, start, range(4))
    shown(wrong, made, AS_CALIBRATED, range(4))
    assert (right.overlay, kinds(right)) == (start, [])
    assert (wrong.overlay, kinds(wrong)) == (AS_CALIBRATED, [CORRECTED])


def test_another_size_begins_a_new_window(made: Sight) -> None:
    """Half the size has half the pixels of rows: sightings of the two are not mixed, and the rig is still known."""
    half = scaled_rig(made.rig, (320, 240), (320, 240))
    small = RowModel(half, rectify_rig(half))
    watch = DriftWatch()
    shown(watch, made, pitched(0.3), range(4))
    seen = made.sighting(9, pitched(0.3))
    for number in (4, 5):
        watch.add(small, replace(seen, off_px=seen.off_px / 2, columns=seen.columns / 2), number / 2)
    assert (watch.drift.measurements, kinds(watch)) == (2, [CORRECTED])
    assert watch.drift.rows_px == pytest.approx(1.7, abs=0.15)


def test_stacked_cameras_are_watched_too() -> None:
    """One above the other: a yaw moves all columns alike and is corrected; the disparity's zero is that of the pitch."""
    made, watch = sight(is_stacked=True), DriftWatch()
    departure = Departure(turn_rad=(0.0, math.radians(0.3), 0.0))
    shown(watch, made, departure, range(4))
    assert watch.overlay.turn_rad[1] == pytest.approx(departure.turn_rad[1], abs=math.radians(0.03))
    drift = watch.drift
    assert drift.zero_sigma_px == pytest.approx(
        made.model.rectification.geometry.focal_px * drift.turn_sigma_rad[0], rel=1e-6
    )


def test_changes_are_bounded() -> None:
    """A camera that comes and goes for hours does not fill the memory: the first and the latest changes stay."""
    watch = DriftWatch()
    for number in range(100):
        watch.returned(float(number), 2.0)
    times = [change.at_s for change in watch.drift.changes]
    assert (len(times), times[0], times[-1]) == (40, 0.0, 99.0)


def test_a_trend_over_hours_keeps_few_estimates() -> None:
    """Ten thousand estimates of a rig that turns at a steady rate: the rate is theirs, over their whole time."""
    trends = Trends()
    for number in range(10_000):
        trends.add(number / 2, np.array([1e-6 * number, 0.0, 0.0, 0.0]), 0.0)
    assert trends.trend.seconds == pytest.approx(5000, rel=0.02)
    assert trends.trend.turn_rad_s[0] == pytest.approx(2e-6, rel=1e-6)
    trends.restart()
    assert trends.trend.seconds == 0.0


LEFTOVERS = (
    (0, 29, -0.36), (3, 23, -1.02), (4, 42, -0.35), (5, 20, 0.23), (10, 391, 0.0), (11, 260, 0.06), (12, 8, 0.36), (13, 75, -0.02),
    (14, 109, -0.07), (15, 133, -0.04), (16, 494, -0.01), (17, 156, -0.02), (18, 73, -1.0), (21, 112, 0.0), (23, 56, 1.0),
)  # fmt: skip
"""Cells of the image, their features in twelve pairs, and how far these lie beside their rows, px: as EuRoC V1_01 at rest has them with
its own calibration, but that the lower corners deny a yaw more loudly."""


def test_corners_that_contradict_each_other_are_no_turn(made: Sight) -> None:
    """What a good rig's lenses leave in two corners looks like a yaw that two others deny: nothing is told or corrected."""
    random, watch = np.random.default_rng(3), DriftWatch()
    geometry = made.model.rectification.geometry
    cells = np.concatenate([np.full(count // 6 + 1, cell) for cell, count, _ in LEFTOVERS])
    leftover_px = {cell: off_px for cell, _, off_px in LEFTOVERS}
    for number in range(12):
        places = (
            (np.column_stack([cells % 6, cells // 6]) + random.uniform(0, 1, (len(cells), 2))) / (6, 4) * (640, 480)
        )
        slopes = (places - (geometry.cx_px, geometry.cy_px)) / geometry.focal_px
        off_px = np.array([leftover_px[cell] for cell in cells.tolist()]) + random.normal(0, 0.05, len(cells))
        seen = Sighting(slopes, made.model.columns(slopes), off_px, np.zeros(len(cells)))
        watch.add(made.model, seen, number / 2)
    assert (kinds(watch), watch.overlay, watch.drift.departure) == ([], AS_CALIBRATED, AS_CALIBRATED)
    assert watch.drift.state is not DriftState.UNKNOWN


@pytest.mark.parametrize("degrees", [3.0, -10.0])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_rig_that_stands_far_away_is_told_once_as_a_turn(made: Sight, axis: int, degrees: float) -> None:
    """By 3 and by 10 degrees about any axis: one knock, too far to be corrected, and a turn rather than a focus."""
    turn = [0.0, 0.0, 0.0]
    turn[axis] = math.radians(degrees)
    stands, watch = Departure(turn_rad=(turn[0], turn[1], turn[2])), DriftWatch()
    shown(watch, made, AS_CALIBRATED, range(6))
    shown(watch, made, stands, range(6, 14))
    assert kinds(watch) == [KNOCKED, BEYOND]
    drift = watch.drift
    assert (drift.state, watch.overlay) == (DriftState.BEYOND, AS_CALIBRATED)
    assert drift.departure.turn_rad[axis] == pytest.approx(turn[axis], rel=0.05)
    assert [concern.code for concern in drift_concerns(drift)] == [Code.RIG_MOVED]


def test_a_focus_beyond_bounds_is_told_as_a_focus(made: Sight) -> None:
    """A focal length 4 % longer is no turn, though nothing of it is corrected."""
    watch = DriftWatch()
    shown(watch, made, AS_CALIBRATED, range(6))
    shown(watch, made, Departure(focal=1.04), range(6, 10))
    [concern] = drift_concerns(watch.drift)
    assert (watch.drift.state, concern.code) == (DriftState.BEYOND, Code.FOCUS_CHANGED)
    assert "too far to be corrected" in concern.message
