"""phone-host doctor: check settings, Python, camera, link, rig and disk."""

import argparse
import math

from common.diagnostic import Severity
from common.doctor.finding import exit_code, settings_finding, table, values
from common.errors import SettingsError
from common.program.terminal import fitted
from phone_host.camera.examples import EXAMPLE
from phone_host.declared_settings import PhoneHostSettings
from phone_host.doctor.host_doctor import Question, examine
from phone_host.output.data_folder import data_folder
from phone_host.output.json_text import json_text
from phone_host.settings import check, key_folder, resolve_settings


def run(options: argparse.Namespace) -> int:
    """Run the checks and print the findings. If the settings make no sense, that is the first finding, and the machine is checked by itself."""
    if not (math.isfinite(options.wait) and options.wait >= 0):
        raise SettingsError(f"--wait is {options.wait}", "give 0 or more seconds")
    settings, wrong = PhoneHostSettings(), None
    try:
        resolved = resolve_settings(options).values
        check(resolved)
        settings = resolved
    except SettingsError as error:
        wrong = error
    question = Question(
        camera=settings.camera,
        links=settings.link,
        calibration=settings.calibration,
        out=options.out,
        wait_s=options.wait,
        keys=key_folder(settings.keys),
        data=data_folder(),
    )
    if options.capture is not None:
        _require_capture(options.capture, question)
    findings = [settings_finding(str(options.config or ""), wrong), *examine(question, keeps=options.capture is None)]
    found = values(findings)
    if options.capture is not None and all(each.severity is not Severity.FAIL for each in findings):
        from phone_host.output.capture_json import capture_values  # noqa: PLC0415 - numpy and OpenCV, seen to work
        from phone_host.verbs.doctor.capture import guided_capture  # noqa: PLC0415 - the same

        capture = guided_capture(question, options.capture)
        findings += capture.findings
        found = {**values(findings), "capture": capture_values(capture.report)}
    print(json_text(found) if options.json else fitted(table(findings)))
    return exit_code(findings, wrong)


def _require_capture(whole_s: float, question: Question) -> None:
    """Check what --capture needs.

    Raises:
        SettingsError: it lacks something.
    """
    if not (math.isfinite(whole_s) and 10 <= whole_s <= 600):
        raise SettingsError(f"--capture is {whole_s:g}", "give 10 to 600 seconds; 60 are usual")
    if not question.camera:
        raise SettingsError("--capture without --camera", f"add --camera {EXAMPLE}")
