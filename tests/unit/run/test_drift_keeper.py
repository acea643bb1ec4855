"""The keeper of a run's rig: absences are told, speeds are known between close pairs only, and a turned rig is corrected and logged."""

import logging
import math
from dataclasses import replace

import pytest

from common import now
from phone_host.calibration.drift.see import Timed
from phone_host.model import AS_CALIBRATED, Change, ChangeKind, Departure, Drift, DriftState, Processed, Result, Side
from phone_host.run.trust_sink import DriftKeeper, Moment, log_change
from phone_host.scene.scene import demo_scene
from phone_host.scene.scene_model import rig_poses
from phone_host.scene.scene_render import render
from phone_host.stereo.core import StereoCore
from phone_host.stereo.evidence import look_at, maps_of
from phone_host.stereo.match import MatchSettings
from phone_host.stereo.rectifier import Rectifier, corrected_rig
from tests.support.results import result
from tests.support.rigs import small_rig

TURNED = Departure(turn_rad=(math.radians(0.5), 0.0, 0.0))


@pytest.fixture(scope="module")
def turned() -> tuple[StereoCore, Processed]:
    """A core, and what it made of the first pair of a rig that has turned."""
    rig = small_rig()
    core, stands = StereoCore(MatchSettings(disparities=48), Rectifier(rig)), corrected_rig(rig, TURNED)
    left, right = (
        render(demo_scene(), model, pose)
        for model, pose in zip((stands.left, stands.right), rig_poses(stands), strict=True)
    )
    return core, core.compute(left, right, now.monotonic_ns)


def _at(processed: Processed, at_ns: int, session: str = "one") -> Result:
    """A result that was exposed and done at a time."""
    made = result(0)
    message = replace(made.pair.board.message, session=session)
    marks = replace(made.pair.board.marks, exposed_ns=at_ns)
    board = replace(made.pair.board, message=message, marks=marks)
    host = replace(made.ledger.host, exposed_ns=at_ns)
    return replace(
        made,
        pair=replace(made.pair, board=board, time_skew_ns=4_000_000),
        processed=processed,
        ledger=replace(made.ledger, done_ns=at_ns, host=host),
    )


def test_absences_are_told_and_speeds_known_between_close_pairs(turned: tuple[StereoCore, Processed]) -> None:
    """Another session, or a pause of a second that was not usual, is told; across it nothing is followed."""
    core, processed = turned
    keeper, told = DriftKeeper(core, Side.LEFT), []
    ms = 1_000_000
    times = [(0, "one"), (100, "one"), (1600, "one"), (1700, "one"), (1900, "two")]
    for at_ms, session in times:
        told.append(keeper.note(_at(processed, (1000 + at_ms) * ms, session), at_ms / 1e3).timed)
    assert [timed.before is not None for timed in told] == [False, True, False, True, True]
    assert told[1].seconds == pytest.approx(0.1)
    assert told[1].late_s == pytest.approx(0.004)
    changes = keeper.drift.changes
    assert [(change.kind, change.at_s) for change in changes] == [
        (ChangeKind.RETURNED, 1.6),
        (ChangeKind.RETURNED, 1.9),
    ]
    other = DriftKeeper(core, Side.RIGHT)
    assert other.note(_at(processed, 1000 * ms), 0.0).timed.late_s == pytest.approx(-0.004)


def test_stills_have_no_moment(turned: tuple[StereoCore, Processed]) -> None:
    """Images that are shown on demand: no pause is an absence, nothing is late, nothing moves."""
    core, processed = turned
    keeper = DriftKeeper(core, Side.LEFT, is_timeless=True)
    for at_ns in (1, 9_000_000_000):
        timed = keeper.note(_at(processed, at_ns), 0.0).timed
        assert (timed.late_s, timed.before) == (0.0, None)
    assert keeper.drift.changes == ()


def test_a_turned_rig_is_corrected_from_the_next_pair_on_and_logged(
    turned: tuple[StereoCore, Processed], caplog: pytest.LogCaptureFixture
) -> None:
    """Three judged stills: the core has the correction, the log says so once, the overlay holds it; without a moment nothing is judged."""
    core, processed = turned
    core.correct(AS_CALIBRATED)
    look = look_at(processed, maps_of(core, processed))
    timed = DriftKeeper(core, Side.LEFT)
    timed.judge(Moment(result(0), Timed()), look, 0.0)
    assert timed.drift.judged == 0
    keeper = DriftKeeper(core, Side.LEFT, is_timeless=True)
    assert keeper.overlay == ""
    with caplog.at_level(logging.INFO):
        for number in range(4):
            keeper.judge(Moment(replace(result(number), processed=processed), Timed()), look, number / 2)
    drift = keeper.drift
    assert (drift.state, keeper.is_unsure) == (DriftState.CORRECTED, False)
    assert drift.overlay.turn_rad[0] == pytest.approx(TURNED.turn_rad[0], abs=math.radians(0.05))
    assert sum("drift_corrected" in line for line in caplog.messages) == 1
    assert "right_turn" in keeper.overlay
    left, right = processed.pair.left, processed.pair.right
    rig = small_rig()
    assert left.shape == right.shape
    size = (rig.left.height_px, rig.left.width_px, 3)
    blank = left[:1, :1].repeat(size[0], 0).repeat(size[1], 1)
    other = right[:1, :1].repeat(rig.right.height_px, 0).repeat(rig.right.width_px, 1)
    assert core.compute(blank, other, now.monotonic_ns).overlay == drift.overlay
    core.correct(AS_CALIBRATED)
    assert DriftKeeper(core, Side.LEFT, start=TURNED).drift.overlay == TURNED
    assert core.compute(blank, other, now.monotonic_ns).overlay == TURNED
    core.correct(AS_CALIBRATED)


def test_images_that_came_rectified_are_not_watched(turned: tuple[StereoCore, Processed]) -> None:
    """Without a rig there is nothing to correct and no overlay."""
    core = StereoCore(MatchSettings(disparities=48))
    processed = replace(turned[1], overlay=AS_CALIBRATED)
    keeper = DriftKeeper(core, Side.LEFT, is_timeless=True)
    keeper.judge(
        Moment(replace(result(0), processed=processed), Timed()), look_at(processed, maps_of(core, processed)), 0.0
    )
    assert (keeper.drift.judged, keeper.overlay) == (0, "")


@pytest.mark.parametrize("kind", [ChangeKind.KNOCKED, ChangeKind.BEYOND])
def test_a_jump_of_the_focus_is_logged_as_one(kind: ChangeKind, caplog: pytest.LogCaptureFixture) -> None:
    """Where only the focal length is proven to have changed, the remedy is the focus and not the bar."""
    zoomed, turned_too = Departure(focal=1.03), Departure(turn_rad=(0.05, 0.0, 0.0), focal=1.03)
    for departure in (zoomed, turned_too):
        log_change(Change(kind=kind, at_s=3.0, departure=departure, step=departure), Drift())
    focus, bar = (record.getMessage() for record in caplog.records)
    assert "autofocus" in focus
    assert "bar" in bar
    assert "autofocus" not in bar
