"""phone-host calibrate in this process: what it writes when it rejects, and what it says about turned photographs."""

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from common.errors import DataError, SettingsError
from common.frame import PixelFormat
from common.recording.layout import ABOUT, About, image_topic
from common.recording.recording_file import written
from common.recording.ros_messages import COMPRESSED_IMAGE, RecordedImage, image_message
from phone_host.calibration.failure_modes.mistakes import Mistake, mistaken
from phone_host.calibration.failure_modes.remedies import with_cause
from phone_host.calibration.solve.verdict import Assessment
from phone_host.model import Image, Side, Verdict
from phone_host.output.rig_yaml import read_rig
from phone_host.report.calibration_lines import passed_over_notes, summary
from phone_host.report.calibration_report import Judged
from phone_host.verbs.calibrate import run
from tests.support.boards import poses, render_pair
from tests.support.calibration_series import calibration, calibration_report
from tests.support.oriented import oriented
from tests.support.pictures import encoded
from tests.support.requests import request_of
from tests.support.rigs import small_rig

_PAIRS = [render_pair(small_rig(), pose) for pose in poses(4, seed=8, depth_m=(0.4, 0.5))]


def folders(folder: Path, right: Callable[[Image], bytes]) -> Path:
    """Two folders of four photographs; `right` makes the right images' files."""
    for side in ("left", "right"):
        (folder / side).mkdir()
    for index, pair in enumerate(_PAIRS):
        (folder / "left" / f"{index}.png").write_bytes(encoded(".png", pair[0]))
        (folder / "right" / f"{index}.png").write_bytes(right(pair[1]))
    return folder


def _shaken(image: Image) -> Image:
    """The image with each column moved up or down, by up to 2 px, as a wave of 120 px."""
    columns, rows = np.meshgrid(np.arange(image.shape[1]), np.arange(image.shape[0]))
    moved = (rows + 2 * np.sin(columns / 120 * 2 * np.pi)).astype(np.float32)
    return np.asarray(cv2.remap(image, columns.astype(np.float32), moved, cv2.INTER_LINEAR), np.uint8)


def calibrated(folder: Path, *options: str, images: tuple[str, ...] = ()) -> tuple[int, dict[str, Any]]:
    """Exit code and report.json; `images` in place of the folders left and right."""
    given = [*(images or (str(folder / "left"), str(folder / "right"))), "--board", "9x6", "--square", "25mm", *options]
    code = run(request_of("calibrate", *given, "--out", str(folder / "rig.yaml")))
    report: dict[str, Any] = json.loads((folder / "report.json").read_text())
    return code, report


def test_files_that_are_not_read_are_told_once() -> None:
    """One, several, and photographs that need only be converted."""
    assert passed_over_notes(()) == []
    assert passed_over_notes((Path("l/a.raw"),)) == ["warning  1 file among the pictures is not read (a.raw)"]
    several = tuple(Path(f"l/{name}") for name in ("1.heic", "2.heic", "3.heic", "4.heic"))
    (told,) = passed_over_notes(several)
    assert told.endswith("4 files among the pictures are not read (1.heic, 2.heic, 3.heic, ...): convert them to JPEG")


def test_a_rejected_rig_is_written_as_such_and_a_good_one_is_kept_aside(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Right images whose columns shake by 2 px leave rows that do not match: exit 4, verdict reject in rig.yaml; the good rig stays in rig.yaml.old, also after a second time."""
    folder = folders(tmp_path, lambda image: encoded(".png", image))
    code, report = calibrated(folder)
    good = read_rig(folder / "rig.yaml")
    assert (code, good.verdict) == (0, Verdict(report["verdict"]))
    assert good.zero_sigma_px > 0
    assert report["zero_sigma_px"] == pytest.approx(good.zero_sigma_px, abs=1e-4)
    assert report["depth_limit_m"] > 0
    for earlier in ("rig.yaml.old", None):
        for index, pair in enumerate(_PAIRS):
            (folder / "right" / f"{index}.png").write_bytes(encoded(".png", _shaken(pair[1])))
        code, report = calibrated(folder)
        assert (code, report["verdict"], report.get("earlier_rig")) == (4, "reject", earlier)
        assert read_rig(folder / "rig.yaml").is_rejected
        assert read_rig(folder / "rig.yaml.old").verdict == good.verdict
        assert "refuse this calibration unless --use-rejected-rig is given" in capsys.readouterr().out


def test_a_rig_that_cannot_be_rectified_has_no_column_of_vertical_errors(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Left and right exchanged calibrate, but no rows can be compared: the table shows no `nan`."""
    folder = folders(tmp_path, lambda image: encoded(".png", image))
    for name, other in (("left", "a"), ("right", "left"), ("a", "right")):
        (folder / name).rename(folder / other)
    code, report = calibrated(folder)
    assert (code, report["verdict"], report["vertical_error_px"]["p95"]) == (4, "reject", None)
    told = capsys.readouterr().out
    assert "left px" in told
    assert "nan" not in told
    assert "vertical" not in told


def test_exif_headers_that_disagree_with_the_rig_are_told_with_the_option_that_helps(tmp_path: Path) -> None:
    """Two phones stand alike, but the right one wrote EXIF 6 when it lay flat: the remedy names the turn, and with it the true baseline comes."""
    folder = folders(tmp_path, lambda image: oriented(".png", image, 6))
    _, report = calibrated(folder)
    assert report["exif_orientation"] == {"right": {"rotate_deg": 90, "flip": "none"}}
    assert "EXIF headers differ" in report["remedy"]
    assert "--rotate-right 270" in report["remedy"]
    code, report = calibrated(folder, "--rotate-right", "270")
    assert code == 0
    true_mm = float(np.linalg.norm(small_rig().t_right_left_m)) * 1e3
    assert report["baseline_mm"] == pytest.approx(true_mm, rel=0.02)
    camera = read_rig(folder / "rig.yaml").right_camera
    assert camera is not None
    assert camera.orientation.rotate_deg == 270


def test_mirrored_pictures_are_told_with_the_option_that_helps(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The right images are mirrored: exit 4 and --flip-right h as the only remedy; with it the true baseline comes."""
    folder = folders(tmp_path, lambda image: encoded(".png", image[:, ::-1].copy()))
    try:
        code, report = calibrated(folder)
    except DataError as error:  # too few pairs fit each other at all
        code, report = error.exit_code, json.loads((folder / "report.json").read_text())
    assert (code, report["verdict"]) == (4, "reject")
    assert report["remedy"].endswith(
        "mirrored against the left ones: switch mirroring off in that camera, or add --flip-right h"
    )
    capsys.readouterr()
    code, report = calibrated(folder, "--flip-right", "h")
    assert code == 0
    assert report["baseline_mm"] == pytest.approx(float(np.linalg.norm(small_rig().t_right_left_m)) * 1e3, rel=0.02)


def test_folders_out_of_step_are_told_before_anything_is_fitted(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Names that share neither numbers nor words, and the second right picture missing: a warning that order was guessed, and the left picture to delete."""
    folder = folders(tmp_path, lambda image: encoded(".png", image))
    for side, names in (("left", ("ant", "bee", "cat", "dog")), ("right", ("ape", "bat", "cow", "doe"))):
        for index, name in enumerate(names):
            (folder / side / f"{index}.png").rename(folder / side / f"{name}.png")
    (folder / "right" / "bat.png").unlink()
    with pytest.raises(
        DataError, match=r"missing on the right: the folders are out of step from bee\.png on"
    ) as caught:
        calibrated(folder)
    assert "delete bee.png on the left" in caught.value.remedy
    assert capsys.readouterr().out.startswith(
        "warning  4 left and 3 right pictures were paired in the order of their names"
    )
    assert json.loads((folder / "report.json").read_text())["problem"] == caught.value.problem


@pytest.mark.parametrize("square", ["0.025", "0.3"])
def test_a_square_without_a_unit_that_no_board_has_is_refused(tmp_path: Path, square: str) -> None:
    """0.025 could be metres or a slip; both ways to write the metres are named, before any image is read."""
    given = ["none", "none", "--board", "9x6", "--square", square, "--out", str(tmp_path / "rig.yaml")]
    with pytest.raises(SettingsError, match=rf"write {float(square) * 1000:g}mm or {square}m"):
        request_of("calibrate", *given)


@pytest.mark.parametrize(
    ("paint", "said"),
    [
        (None, "these images show a chessboard of 9x6 inner corners: leave --board out, and give --square"),
        (90, "no chessboard is seen in 8 images: check --board: it counts squares (of an AprilGrid tags)"),
    ],
)
def test_marks_that_are_not_there_are_not_called_a_chessboard(
    tmp_path: Path, paint: int | None, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """--board charuco:... of pictures that show a chessboard, or nothing: the error says what they show, and what the option counts."""
    folder = folders(tmp_path, lambda image: encoded(".png", image))
    for path in folder.glob("*/*.png") if paint is not None else ():
        path.write_bytes(encoded(".png", np.full((240, 320), paint, np.uint8)))
    with pytest.raises(DataError) as caught:
        calibrated(folder, "--board", "charuco:8x6:25mm:18mm:5x5")
    assert said in str(caught.value)
    assert "too few of the board's marks are seen in either image" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("verdict", "remedy"),
    [
        (Verdict.GOOD, ""),
        (Verdict.USABLE, "the board is blurred; the light is poor: hold it still"),
        (Verdict.REJECT, "the board is blurred; the light is poor: hold it still"),
    ],
)
def test_a_good_rig_has_no_remedy_though_a_mistake_was_found(verdict: Verdict, remedy: str) -> None:
    """The mistake is told all the same, as a note; a rig that is not good has its remedy in place of the other."""
    finding = mistaken(Mistake.BLUR, "the board is blurred; the light is poor", "hold it still")
    before = Assessment(verdict, "" if verdict is Verdict.GOOD else "take more")
    judgement = with_cause(before, finding)
    assert judgement == Assessment(verdict, remedy)
    told = summary(calibration_report(Judged(calibration(), judgement, finding)), Path("rig.yaml"))
    assert ("note     the board is blurred; the light is poor" in told) == (verdict is Verdict.GOOD)
    assert [line for line in told if line.startswith("remedy")] == ([f"remedy   {remedy}"] if remedy else [])


@pytest.mark.parametrize(("measured_m", "asks"), [(math.nan, True), (0.1, False)])
def test_a_measured_baseline_is_compared_and_not_asked_for(measured_m: float, asks: bool) -> None:  # noqa: FBT001 - a case
    """Without --baseline the user is asked to measure it; with it, the difference is shown."""
    judged = Judged(calibration(), Assessment(Verdict.GOOD, ""), measured_m=measured_m)
    told = "\n".join(summary(calibration_report(judged), Path("rig.yaml")))
    assert ("compare it with a ruler" in told) is asks
    assert ("% against the 100.0 mm that you measured" in told) is not asks


def test_a_recording_gives_the_rig_of_its_pictures(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The same pictures, a second apart: the same figures as from folders, and the board's side is that of the recording."""
    by_folders = calibrated(folders(tmp_path, lambda image: encoded(".png", image)))[1]
    path = tmp_path / "again" / "s.mcap"
    path.parent.mkdir()
    with written(path) as file:
        file.tell(ABOUT, About(board_side="right").values())
        for number, pair in enumerate(_PAIRS):
            for side, image in zip(("left", "right"), pair, strict=True):
                at_ns = (1000 + number) * 10**9
                shown = RecordedImage(at_ns, side, PixelFormat.PNG, (0, 0), encoded(".png", image))
                topic = image_topic(side, COMPRESSED_IMAGE)
                file.add(topic, image_message(shown), sequence=number, log_ns=at_ns, publish_ns=at_ns)
    recorded = calibrated(path.parent, images=(str(path),))[1]
    assert read_rig(path.parent / "rig.yaml").board_side is Side.RIGHT
    for key in ("pairs", "views", "baseline_mm", "rms_px", "verdict"):
        assert recorded[key] == by_folders[key]
    capsys.readouterr()
