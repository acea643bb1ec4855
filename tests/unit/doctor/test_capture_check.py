"""The check of a camera: when frames came, what to do next, what it comes to, in words and in its file."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from common.camera_identity import CameraIdentity
from common.diagnostic import Severity
from common.errors import DataError
from phone_host.doctor.camera_check.check import ENOUGH, CaptureCheck, Plan, Shot, Stage, pace_of, rigidity_of
from phone_host.doctor.camera_check.look import FRAMES, Reading, Window, guessed_lens, look
from phone_host.doctor.camera_check.words import (
    CHECK_AGAIN,
    findings_of,
    holds_for,
    stage_words,
    stored_finding,
    warp_finding,
)
from phone_host.model import Image
from phone_host.model.capture import CaptureReport, CaptureSource, Pace, Rigidity, Unseen, Warping
from phone_host.output.capture_json import capture_path, capture_text, read_capture

MS = 1_000_000
PHONE = CaptureSource(camera=CameraIdentity("browser", "back"), software="Chrome 140", width_px=64, height_px=48)
GREY = np.full((48, 64), 100, np.uint8)
RIGID = Reading(None, 0.2, 0.03, 15.0, 0.2, 0.1)
WARPED = Reading(None, 3.0, 0.03, 15.0, 0.2, 0.1)


def shots(times_ms: list[float], delay_ms: float = 30.0, **given: float) -> list[Shot]:
    """Frames with these stamps."""
    exposure = round(given["exposure_ms"] * MS) if "exposure_ms" in given else None
    return [
        Shot(round(at * MS), round((at + delay_ms) * MS), exposure, given.get("brightness", 100.0)) for at in times_ms
    ]


def grades(pace: Pace, rigidity: Rigidity | None = None) -> dict[str, Severity]:
    """What each finding of a report comes to."""
    report = CaptureReport(source=PHONE, pace=pace, rigidity=rigidity or rigidity_of([RIGID] * 3))
    return {each.code: each.severity for each in findings_of(report)}


def even(hz: float, seconds: float = 8.0) -> list[float]:
    """Stamps of an even beat, ms."""
    return [1e3 * number / hz for number in range(round(hz * seconds))]


def test_an_even_camera_is_fine() -> None:
    """Thirty frames a second, on the beat, are all right, and each thing is named once."""
    pace = pace_of(shots(even(30), exposure_ms=8), 30.0)
    assert pace.rate_hz == pytest.approx(30)
    assert pace.jitter_ms < 0.01
    assert pace.delay_ms == pytest.approx(30)
    assert set(grades(pace).values()) == {Severity.OK}
    assert list(grades(pace)) == ["rate", "stamps", "exposure", "shutter", "slow-down", "stabilisation"]


def test_half_the_rate_in_the_dark_is_told_with_light_as_the_remedy() -> None:
    """A rate that automatic exposure halved is a matter of light; one that is merely lower is not."""
    dark = pace_of(shots(even(15), exposure_ms=60, brightness=30), 30.0)
    report = CaptureReport(source=PHONE, pace=dark, rigidity=Rigidity())
    rate, _, exposure, *_ = findings_of(report)
    assert rate.severity is exposure.severity is Severity.WARN
    assert "light" in rate.remedy
    slow = findings_of(replace(report, pace=pace_of(shots(even(24)), 30.0)))[0]
    assert slow.severity is Severity.WARN
    assert "light" not in slow.remedy


def test_gaps_are_counted_as_missing_frames_and_not_as_jitter() -> None:
    """Every fifth frame is missing: the beat is the same, and so is the jitter."""
    times = [at for number, at in enumerate(even(30)) if number % 5]
    pace = pace_of(shots(times), 30.0)
    assert pace.missing == pytest.approx(240 / 5, abs=1)
    assert pace.usual_hz == pytest.approx(30)
    assert pace.jitter_ms < 0.01
    assert grades(pace)["rate"] is Severity.WARN


def test_jitter_is_that_of_one_stamp() -> None:
    """Stamps with a normal error of 6 ms scatter by twice that, 95 %; they are told as arrivals. A stamp that goes back is told."""
    random = np.random.default_rng(1)
    times = np.sort(np.array(even(20, 60)) + random.normal(0, 6, 1200)).tolist()
    pace = pace_of(shots(times), 20.0)
    assert pace.jitter_ms == pytest.approx(2 * 6, rel=0.15)
    assert grades(pace)["stamps"] is Severity.WARN
    assert pace_of(shots([*even(30), 100.0]), 30.0).backwards == 1
    assert grades(pace_of(shots([*even(30), 100.0]), 30.0))["stamps"] is Severity.WARN


def test_a_phone_that_grows_hot_is_told() -> None:
    """A rate that falls over the minute, or frames that arrive ever later, are a slow-down."""
    slower = [*even(30, 20), *(20_000 + at for at in even(20, 20))]
    assert grades(pace_of(shots(slower), math.nan))["slow-down"] is Severity.WARN
    later = [
        *shots(even(30, 10), 30),
        *(
            replace(each, captured_ns=each.captured_ns + 10**10, arrived_ns=each.arrived_ns + 10**10)
            for each in shots(even(30, 10), 80)
        ),
    ]
    assert grades(pace_of(later, math.nan))["slow-down"] is Severity.WARN


@pytest.mark.parametrize("times", [[], [0.0], [5.0, 5.0], [0.0, 33.0, 66.0]])
def test_few_frames_say_little_and_break_nothing(times: list[float]) -> None:
    """Without two stamps there is no rate, and the finding says so."""
    pace = pace_of(shots(times), 30.0)
    assert pace.frames == len(times)
    if len(set(times)) < 2:
        assert grades(pace) == {"rate": Severity.WARN}


def passing(number: int) -> Image:
    """A picture that moves by a pixel with each frame."""
    return np.asarray(np.roll(np.random.default_rng(4).integers(0, 255, (48, 64), np.uint8), number, axis=1))


def fed(check: CaptureCheck, first: int, count: int, hz: float = 30) -> list[Window]:
    """The stretches that a check hands out for so many frames."""
    windows = [
        check.add(passing(number), round(number * 1e9 / hz), round(number * 1e9 / hz), None)
        for number in range(first, first + count)
    ]
    return [window for window in windows if window is not None]


def stage(check: CaptureCheck) -> Stage:
    """What the user shall do now."""
    return check.progress.stage


def test_a_check_leads_from_still_over_moving_to_its_end() -> None:
    """It asks to hold still, then to move until enough stretches told something, then watches the rate for the rest of its time."""
    check = CaptureCheck(PHONE, 30.0, None, Plan(whole_s=20, still_s=2, move_s=15))
    assert stage(check) is Stage.STILL
    assert not fed(check, 0, 60)
    assert stage(check) is Stage.STILL
    windows = fed(check, 60, 8 * FRAMES)
    assert [len(window.frames) for window in windows] == [FRAMES] * ENOUGH
    assert stage(check) is Stage.WATCH  # unless they tell nothing
    check.take(Reading(Unseen.STILL))
    assert stage(check) is Stage.MOVE
    assert stage_words(check.progress).startswith("the picture moved too little: turn the camera")
    flat = stage_words(replace(check.progress, last=Unseen.FLAT))
    assert flat == "the scene is flat: film a shelf or a desk with things on it, near and far; go on turning"
    (_,) = fed(check, 220, FRAMES + 1)
    for _ in range(ENOUGH):
        check.take(RIGID)
    assert not fed(check, 241, 60)
    assert stage(check) is Stage.WATCH
    fed(check, 301, 310)
    assert stage(check) is Stage.DONE
    assert check.progress.share == 1.0
    report = check.report
    assert report.rigidity.warping is Warping.GOOD
    assert not report.rigidity.knows_lens
    assert report.pace.rate_hz == pytest.approx(30)


def test_a_stretch_has_no_gap_and_no_other_size() -> None:
    """A missing frame begins a new stretch; a frame of another size is left out; of fast films every second frame is used."""
    check = CaptureCheck(PHONE, 30.0, guessed_lens(64, 48), Plan(60, 0.01, 50))
    assert not fed(check, 0, FRAMES)
    assert not fed(check, FRAMES + 1, FRAMES - 1)
    check.add(GREY.T.copy(), 2 * FRAMES * 33_333_333, 0, None)
    fast = CaptureCheck(PHONE, 60.0, None, Plan(60, 0.01, 50))
    (window,) = fed(fast, 0, 2 * FRAMES + 5, hz=60)
    assert window.period_ms == pytest.approx(1e3 / 30, rel=0.01)


def test_a_plain_picture_and_a_still_one_tell_nothing() -> None:
    """Nothing is followed on a plain wall; where nothing moves, nothing is told."""
    plain = tuple(np.full((240, 320), 128, np.uint8) for _ in range(FRAMES))
    assert look(Window(plain, 33.3, None)).unseen is Unseen.PLAIN
    noise = np.random.default_rng(2).integers(0, 255, (240, 320), np.uint8)
    assert look(Window((np.asarray(noise),) * FRAMES, 33.3, None)).unseen is Unseen.STILL


@pytest.mark.parametrize(
    ("readings", "verdict", "unseen"),
    [
        ([], Warping.UNKNOWN, Unseen.STILL),
        ([Reading(Unseen.PLAIN)] * 3, Warping.UNKNOWN, Unseen.PLAIN),
        ([RIGID] * 2, Warping.UNKNOWN, Unseen.STILL),
        ([RIGID] * 2 + [Reading(Unseen.LIVELY)] * 9, Warping.UNKNOWN, Unseen.LIVELY),
        ([RIGID] * 3, Warping.GOOD, None),
        ([RIGID] * 3 + [WARPED], Warping.GOOD, None),
        ([RIGID] * 3 + [WARPED] * 2, Warping.UNKNOWN, Unseen.VAGUE),
        ([RIGID] + [WARPED] * 3, Warping.STABILISED, None),
        ([WARPED] * 3 + [Reading(Unseen.FLAT)] * 3, Warping.UNKNOWN, Unseen.FLAT),
        ([WARPED] + [Reading(Unseen.FLAT, 0.9)] * 2 + [Reading(Unseen.FLAT, 0.5)] * 5, Warping.STABILISED, None),
        ([Reading(Unseen.FLAT, 0.9)] * 2 + [Reading(Unseen.FLAT, 0.5)] * 5, Warping.UNKNOWN, Unseen.FLAT),
    ],
)
def test_all_stretches_together_give_the_verdict(
    readings: list[Reading], verdict: Warping, unseen: Unseen | None
) -> None:
    """Three stretches must tell something; one that contradicts three others is overruled, two of five are not; before a wall only a strong warp tells."""
    found = rigidity_of(readings)
    assert (found.warping, found.unseen) == (verdict, unseen)
    grade = Severity.OK if verdict is Warping.GOOD else Severity.WARN
    assert warp_finding(found).severity is grade


def test_rows_of_one_moment_are_a_programs_work() -> None:
    """A phone's sensor is read row by row: a browser's film without that was stabilised; a camera of its own may have a global shutter."""
    rows = [replace(RIGID, readout_ms=0.9)] * 3
    assert rigidity_of(rows).warping is Warping.GOOD
    found = rigidity_of(rows, by_phone=True)
    assert found.warping is Warping.STABILISED
    assert "one moment" in warp_finding(found).message
    assert rigidity_of([RIGID] * 3, by_phone=True).warping is Warping.GOOD


def test_a_missing_calibration_and_a_global_shutter_are_named() -> None:
    """A good film without a lens says what is missing; rows that are read at once are called so."""
    assert "once the lens is calibrated" in warp_finding(rigidity_of([RIGID] * 3)).message
    assert (
        "global"
        in findings_of(
            CaptureReport(
                source=PHONE,
                pace=pace_of(shots(even(30)), 30),
                rigidity=rigidity_of([replace(RIGID, readout_ms=0.4)] * 3),
            )
        )[3].message
    )


def test_a_report_survives_its_file_and_belongs_to_one_camera(tmp_path: Path) -> None:
    """What was written is read again; it holds for the same phone, browser and size alone; without a file there is none."""
    report = CaptureReport(source=PHONE, pace=pace_of(shots(even(30)), math.nan), rigidity=rigidity_of([WARPED] * 3))
    path = capture_path(tmp_path / "rig.yaml", tmp_path / "data")
    assert read_capture(path) is None
    path.write_text(capture_text(report))
    kept = read_capture(path)
    assert kept is not None
    assert capture_text(kept) == capture_text(report)
    assert kept.rigidity == report.rigidity
    assert holds_for(kept.source, PHONE)
    assert holds_for(kept.source, replace(PHONE, software=""))
    others = [
        replace(PHONE, software="Firefox"),
        replace(PHONE, width_px=128),
        replace(PHONE, camera=CameraIdentity("browser", "front")),
    ]
    assert not any(holds_for(kept.source, each) for each in others)
    verdicts = [stored_finding(each, PHONE, has_lens=True).severity for each in (None, kept)]
    assert verdicts == [Severity.WARN, Severity.WARN]
    assert "never" in stored_finding(None, PHONE, has_lens=True).message
    assert "Firefox" in stored_finding(kept, others[0], has_lens=True).message


def test_a_check_before_the_calibration_is_kept_elsewhere_and_made_again_after_it(tmp_path: Path) -> None:
    """Without a lens a rigid film is good until there is a calibration, which would show a crop; a warped one is warped before and after."""
    assert capture_path(None, tmp_path / "data").parent == tmp_path / "data"
    early = CaptureReport(source=PHONE, pace=pace_of(shots(even(30)), math.nan), rigidity=rigidity_of([RIGID] * 3))
    assert stored_finding(early, PHONE, has_lens=False).severity is Severity.OK
    now = stored_finding(early, PHONE, has_lens=True)
    assert (now.severity, now.remedy) == (Severity.WARN, CHECK_AGAIN)
    assert "before it was calibrated" in now.message
    late = replace(early, rigidity=replace(early.rigidity, knows_lens=True))
    assert stored_finding(late, PHONE, has_lens=True).severity is Severity.OK
    warped = replace(early, rigidity=rigidity_of([WARPED] * 3))
    said = [stored_finding(warped, PHONE, has_lens=has_lens) for has_lens in (False, True)]
    assert said[0] == said[1]
    assert "warped or cropped" in said[0].message


@pytest.mark.parametrize(
    "change",
    [
        {"format_version": 99},
        {"width_px": 0},
        {"software": 3},
        {"pace": {}},
        {"pace": {"frames": "many"}},
        {"rigidity": {"warping": "perhaps"}},
        {"camera": []},
    ],
)
def test_a_spoiled_file_is_refused(tmp_path: Path, change: dict[str, object]) -> None:
    """A file that is none of ours, or newer, is named with a remedy."""
    values = json.loads(capture_text(CaptureReport(source=PHONE, pace=Pace(), rigidity=Rigidity())))
    for key, value in change.items():
        values[key] = {**values[key], **value} if isinstance(value, dict) and value else value
    path = tmp_path / "capture.json"
    path.write_text(json.dumps(values))
    with pytest.raises(DataError):
        read_capture(path)


@pytest.mark.parametrize("text", ["", "[]", "nonsense", "{}"])
def test_other_text_is_refused(tmp_path: Path, text: str) -> None:
    """So is what is no object."""
    path = tmp_path / "capture.json"
    path.write_text(text)
    with pytest.raises(DataError):
        read_capture(path)
    with pytest.raises(DataError, match="cannot be read"):
        read_capture(tmp_path)
