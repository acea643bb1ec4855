"""phone-host doctor --capture: films with the camera, guides whoever holds it, and keeps what was found beside the rig."""

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from common import now
from common.doctor.finding import Finding, ok
from common.stamp import HOST_CLOCK
from phone_host.calibration.capture.check import Plan, Progress
from phone_host.calibration.capture.words import findings_of, stage_words
from phone_host.camera.factory import open_camera
from phone_host.doctor.capture import film_capture
from phone_host.doctor.host_doctor import Question
from phone_host.model.capture import CaptureReport
from phone_host.output.atomic import write_text
from phone_host.output.capture_json import capture_path, capture_text, capture_values
from phone_host.output.rig_files.imported import read_own_rig
from phone_host.run.progress_bar import ShareBar, share_bar
from phone_host.verbs.output_folders import unwritable


@dataclass(frozen=True, slots=True)
class Checked:
    """What a check came to.

    Attributes:
        findings: in words.
        values: as JSON.
    """

    findings: list[Finding]
    values: dict[str, Any]


def checked_capture(question: Question, whole_s: float) -> Checked:
    """Film, check, and keep the report beside the calibration.

    Args:
        question: camera and calibration.
        whole_s: how long it takes, s.

    Raises:
        TandemError: the camera cannot be had, or the report not written.
    """
    calibration = Path(question.calibration) if question.calibration else None
    rig = None if calibration is None else read_own_rig(calibration)
    camera = open_camera(question.camera, HOST_CLOCK, now.monotonic_ns())
    plan = Plan(whole_s, min(8.0, whole_s / 6), whole_s * 2 / 3)
    with share_bar("checking the camera") as bar:
        report = film_capture(camera, rig, plan, lambda: False, _Guide(bar).tell)
    findings = findings_of(report)
    if calibration is not None:
        findings.append(_kept(report, calibration))
    return Checked(findings, capture_values(report))


def _kept(report: CaptureReport, calibration: Path) -> Finding:
    path = capture_path(calibration)
    try:
        write_text(path, capture_text(report))
    except OSError as error:
        raise unwritable(path, error, "--calibration") from error
    return ok("capture", f"kept in {path}")


class _Guide:
    """Shows what to do: in the bar on a terminal, else as lines."""

    def __init__(self, bar: ShareBar) -> None:
        self._bar, self._said = bar, ""

    def tell(self, progress: Progress) -> None:
        """Show it; called with each frame."""
        words = stage_words(progress)
        if words != self._said:
            self._said = words
            if sys.stderr.isatty():
                self._bar.say(words)
            else:
                print(f"phone-host: {words}", file=sys.stderr)
        self._bar(progress.share)
