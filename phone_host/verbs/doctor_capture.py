"""phone-host doctor --capture: films with the camera, and guides whoever holds it."""

import sys
from pathlib import Path

from common import now
from common.stamp import HOST_CLOCK
from phone_host.camera.factory import open_camera
from phone_host.doctor.camera_check.check import Progress
from phone_host.doctor.camera_check.words import stage_words
from phone_host.doctor.capture import CheckedCapture, check_capture
from phone_host.doctor.host_doctor import Question
from phone_host.run.progress_bar import ShareBar, share_bar
from phone_host.serve.page import camera_page


def guided_capture(question: Question, whole_s: float) -> CheckedCapture:
    """Film, check, and keep the report.

    Args:
        question: camera and calibration.
        whole_s: how long it takes, s.

    Raises:
        TandemError: the camera cannot be had.
    """
    calibration = Path(question.calibration) if question.calibration else None
    with camera_page(question.camera, question.keys.path) as feed, share_bar("checking the camera") as bar:
        camera = open_camera(question.camera, HOST_CLOCK, now.monotonic_ns(), feed=feed)
        return check_capture(camera, calibration, question.data, whole_s, stopped=lambda: False, tell=_Guide(bar).tell)


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
