"""How a rig's departure is told: concerns, one line, JSON, a table, and the overlay file."""

import math
import re
from dataclasses import replace
from pathlib import Path

import cv2
import pytest

from common.errors import DataError
from phone_host.diagnostics.codes import Code, diagnose
from phone_host.diagnostics.drift import drift_concerns, drift_lines, stills_remedy, stills_words, told_as_a_turn
from phone_host.model import AS_CALIBRATED, Change, ChangeKind, Departure, Drift, DriftState, Trend
from phone_host.output.overlay_yaml import fingerprint, overlay_text, read_overlay
from phone_host.report.drift_report import RunDrift, StillsDrift, drift_table
from phone_host.report.json_result import result_values
from tests.support.drift_sightings import two_webcams

PITCHED = Departure(turn_rad=(math.radians(0.1), 0.0, 0.0))
FAR = Departure(turn_rad=(math.radians(0.3), 0.0, math.radians(-0.1)))
ZOOMED = Departure(focal=1.01)
KNOCK = Change(kind=ChangeKind.KNOCKED, at_s=12.34, departure=PITCHED, step=PITCHED)
KNOWN = Drift(
    state=DriftState.CORRECTED,
    turn_sigma_rad=(1e-4, 4e-4, 1e-4),
    focal_sigma=1e-4,
    rows_px=1.0,
    rows_sigma_px=0.05,
    left_px=0.02,
    zero_sigma_px=0.2,
    features=300,
    measurements=6,
    judged=20,
    late_ns=1e5,
    late_sigma_ns=1e6,
    late_px=0.0,
)


def corrected(departure: Departure, *changes: Change) -> Drift:
    """A rig that is corrected."""
    return replace(KNOWN, departure=departure, overlay=departure, changes=changes)


def test_a_small_slow_departure_is_told_in_a_line_and_worries_nobody() -> None:
    """0.1 degrees, corrected: no concern; the line names the turn and what is left."""
    drift = corrected(PITCHED)
    assert drift_concerns(drift) == ()
    [line] = drift_lines(drift)
    assert "pitch +0.10 degrees; corrected: vertical error 1.00 px, 0.02 px left" in line


def test_what_is_unknown_since_a_knock_is_said_so() -> None:
    """Too few features since: a concern, and a line that does not deny the correction in use."""
    drift = Drift(state=DriftState.UNKNOWN, judged=9, changes=(KNOCK,))
    [concern] = drift_concerns(drift)
    assert concern.code == Code.RIG_MOVED
    assert "at once 12 s after the start; by how much is not known" in concern.message
    assert drift_lines(drift)[0].endswith("nothing was corrected")
    assert drift_lines(replace(drift, overlay=PITCHED))[0].endswith("the earlier correction is kept")


def test_a_camera_that_was_away_is_told() -> None:
    """Once, and several times."""
    away = Change(kind=ChangeKind.RETURNED, at_s=30.0, departure=AS_CALIBRATED, away_s=1.5)
    once, twice = (drift_lines(replace(KNOWN, changes=(away,) * count))[1] for count in (1, 2))
    assert once == "a camera or the board was away once, last for 1.5 s: drift measurement started again"
    assert "away twice" in twice


@pytest.mark.parametrize(
    ("drift", "doubt", "words", "remedy"),
    [
        (corrected(PITCHED, KNOCK), Code.RIG_MOVED, "by 0.10 degrees against each other, at once 12 s after", "bar"),
        (corrected(FAR), Code.RIG_MOVED, "by 0.32 degrees against each other since the calibration", "--pose-only"),
        (
            replace(corrected(FAR), state=DriftState.DEPARTED, overlay=AS_CALIBRATED),
            Code.RIG_MOVED,
            "rows are off by 1.0 px",
            "tighten",
        ),
        (replace(corrected(FAR), state=DriftState.BEYOND), Code.RIG_MOVED, "too far to be corrected", "stiff bar"),
        (corrected(ZOOMED), Code.FOCUS_CHANGED, "changed by +1.0 % against each other", "autofocus off"),
        (
            replace(KNOWN, late_ns=2e7, late_px=1.5),
            Code.LATE_IMAGES,
            "left images show it 20 +- 2 ms",
            "calibrate-time",
        ),
        (replace(KNOWN, late_ns=-2e7, late_px=1.5), Code.LATE_IMAGES, "the right images show it 20", "calibrate-time"),
    ],
)
def test_what_the_user_must_know_is_one_concern(drift: Drift, doubt: Code, words: str, remedy: str) -> None:
    """Each is named once, with its figure and a remedy; none of them ends a run as failed."""
    [concern] = drift_concerns(drift)
    assert concern.code == doubt
    assert words in concern.message
    assert remedy in concern.remedy
    assert not concern.is_failure


def test_what_is_over_or_not_proven_is_no_concern() -> None:
    """A knocked rig that was put right, lateness within the stamps' own doubt, and a rig that was never measured."""
    right = replace(corrected(AS_CALIBRATED, KNOCK), rows_px=0.0, state=DriftState.STEADY)
    unproven = replace(KNOWN, late_ns=3e6, late_px=1.0)
    for drift in (right, unproven, Drift()):
        assert drift_concerns(drift) == ()


def test_the_line_says_what_is_known() -> None:
    """Nothing without a rig or a judged pair; too few features; steady; departed; still turning."""
    assert drift_lines(None) == drift_lines(Drift()) == []
    assert "not measured: too few features" in drift_lines(Drift(judged=3))[0]
    assert (
        "matches its calibration, the row error is known to 0.05 px"
        in drift_lines(replace(KNOWN, state=DriftState.STEADY))[0]
    )
    assert "not corrected" in drift_lines(replace(corrected(FAR), state=DriftState.DEPARTED))[0]
    assert "focal length +1.00 %; corrected" in drift_lines(corrected(ZOOMED))[0]
    assert "as calibrated; corrected" in drift_lines(corrected(AS_CALIBRATED))[0]
    trend = Trend(turn_rad_s=(1e-4, 0, 0), sigma_rad_s=(1e-6, 1e-6, 1e-6), rows_px_s=0.1, seconds=60.0)
    [line] = drift_lines(replace(corrected(FAR), trend=trend))
    assert line.endswith("it still turns, pitch by +0.344 degrees a minute")


def test_report_and_page_hold_the_changes() -> None:
    """JSON has degrees and per cent, None where nothing is known; the page has a table only if something happened."""
    assert result_values(RunDrift, None) is None
    back = Change(kind=ChangeKind.RETURNED, at_s=20.0, away_s=2.5)
    values = result_values(RunDrift, corrected(FAR, KNOCK, back))
    assert values is not None
    assert values["departure"] == {"turn_deg": [0.3, 0.0, -0.1], "focal_percent": 0.0}
    changes = values["changes"]
    assert isinstance(changes, list)
    first, second = changes
    assert (first["what"], first["step"]["turn_deg"][0]) == ("knocked", 0.1)
    assert (second["what"], second["away_s"], "step" in second) == ("returned", 2.5, False)
    empty = result_values(RunDrift, Drift())
    assert empty is not None
    assert (empty["vertical_error_px"], empty["turn_sigma_deg"]) == (None, [None, None, None])
    [table] = drift_table(corrected(FAR, KNOCK, back))
    assert [row[0] for row in table.rows] == ["12.3 s", "20.0 s"]
    assert drift_table(None) == drift_table(KNOWN) == ()


def test_an_overlay_is_read_back_and_belongs_to_one_rig(tmp_path: Path) -> None:
    """The correction survives bit for bit, OpenCV reads the file, and another rig refuses it."""
    rig, path = two_webcams(), tmp_path / "overlay.yaml"
    used = Departure(turn_rad=(0.1 / 3, -1e-5, 2.5e-3), focal=1 / 0.99)
    path.write_text(overlay_text(rig, replace(KNOWN, overlay=used)))
    assert read_overlay(path, rig) == used
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
    assert storage.getNode("right_focal").real() == used.focal
    other = replace(rig, t_right_left_m=rig.t_right_left_m * 1.0001)
    assert fingerprint(other) != fingerprint(rig)
    with pytest.raises(DataError, match=re.escape("rig is that of another rig than --calibration")):
        read_overlay(path, other)
    path.write_text(overlay_text(rig, replace(KNOWN, overlay=used, focal_sigma=math.nan)))
    assert ".Nan" in path.read_text()
    assert read_overlay(path, rig) == used


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("format_version: 1", "format_version: 2", "format_version is 2, this program reads 1"),
        ("format_version: 1", "format_version: 2\nM1: 3", "is a rig.yaml, no overlay.yaml"),
        ("right_turn: [0.0017", "right_turn: [0.9", "right_turn is more than any rig turns"),
        ("right_turn: [0.0017", "right_turn: [nonsense", "right_turn holds 'nonsense"),
        ("right_focal: 1.0", "right_focal: 3.0", "right_focal is more than any focus changes"),
        ("right_focal: 1.0", "focal: 1.0", "right_focal is missing"),
    ],
)
def test_a_spoiled_overlay_is_refused_by_name(tmp_path: Path, old: str, new: str, words: str) -> None:
    """Another format, and numbers that no run writes: file and key are named."""
    rig, path = two_webcams(), tmp_path / "overlay.yaml"
    text = overlay_text(rig, replace(KNOWN, overlay=PITCHED))
    assert old in text
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(DataError, match=re.escape(words)):
        read_overlay(path, rig)


@pytest.mark.parametrize("content", [None, b"\xff\xfe\x00"])
def test_what_is_no_overlay_is_refused(tmp_path: Path, content: bytes | None) -> None:
    """A missing file and one that is no text: one line with a remedy."""
    path = tmp_path / "overlay.yaml"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(DataError) as error:
        read_overlay(path, two_webcams())
    assert str(path) in error.value.problem
    assert "--overlay" in error.value.remedy


@pytest.mark.parametrize(
    ("drift", "words", "remedy"),
    [
        (Drift(judged=2), "too few features", ""),
        (replace(KNOWN, state=DriftState.STEADY, rows_px=0.0), "drift: none; the rig matches its calibration", ""),
        (replace(corrected(FAR, KNOCK), left_px=1.0), "px left; the row error is known to 0.05 px; it changed at once at pair 12", "bar"),
        (replace(corrected(ZOOMED), left_px=2.5), "focal length +1.00 %", "autofocus"),
        (
            replace(corrected(FAR, KNOCK), trend=Trend(turn_rad_s=(4e-4, 0.0, 0.0), sigma_rad_s=(1e-6, 1e-6, 1e-6))),
            "it turns from pair to pair, pitch by +0.023 degrees",
            "",
        ),
    ],
)  # fmt: skip
def test_a_rig_of_stills_is_told_over_the_order_of_pairs(drift: Drift, words: str, remedy: str) -> None:
    """The line names the departure, what is left and the trend, or the pair at which it changed; a remedy only if rows are off."""
    assert words in stills_words(drift)
    assert (remedy in stills_remedy(drift)) if remedy else not stills_remedy(drift)


def test_the_report_of_stills_counts_pairs() -> None:
    """Rates are per pair, and a knock has the number of its pair; without a rig there is nothing."""
    assert result_values(StillsDrift, None) is None
    values = result_values(
        StillsDrift, replace(corrected(FAR, KNOCK), trend=Trend(turn_rad_s=(math.radians(0.02), 0.0, 0.0)))
    )
    assert values is not None
    assert values["knocked_at_pair"] == [12]
    assert values["trend"]["turn_deg_per_pair"] == [0.02, 0.0, 0.0]


def test_a_knocked_rig_explains_what_single_pairs_look_like() -> None:
    """With a proven turn neither `mirrored` nor `other scene` is told; a swap, and everything without a turn, is."""
    images = tuple(diagnose(doubt, "s", "r") for doubt in (Code.SWAPPED, Code.MIRRORED, Code.OTHER_SCENE))
    moved = drift_concerns(corrected(FAR))
    assert told_as_a_turn(images, ()) == images
    assert told_as_a_turn(images, moved) == images[:1]
