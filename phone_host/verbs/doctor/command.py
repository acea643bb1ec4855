"""phone-host doctor: check Python, camera, link, rig and disk."""

import argparse
import json
import math

from common.doctor.finding import exit_code, table, values
from common.errors import SettingsError
from common.program.terminal import fitted
from phone_host.doctor.host_doctor import Question, examine
from phone_host.settings import key_folder, resolve_settings


def run(options: argparse.Namespace) -> int:
    """Run the checks and print the findings."""
    if not (math.isfinite(options.wait) and options.wait >= 0):
        raise SettingsError(f"--wait is {options.wait}", "give 0 or more seconds")
    settings = resolve_settings(options).values
    question = Question(
        camera=settings.camera,
        links=settings.link,
        calibration=settings.calibration,
        out=options.out,
        wait_s=options.wait,
        keys=key_folder(settings.keys),
    )
    findings = examine(question)
    print(json.dumps(values(findings)) if options.json else fitted(table(findings)))
    return exit_code(findings)
