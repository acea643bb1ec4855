"""phone-host doctor: check Python, camera, link, rig and disk."""

import argparse
import json
import math
from pathlib import Path

from common.doctor.finding import exit_code, table, values
from common.errors import SettingsError
from phone_host.doctor.host_doctor import Question, examine
from phone_host.settings import key_folder
from phone_host.verbs.run import resolve_settings

EXAMPLES = """  phone-host doctor
  phone-host doctor --link tcp://192.168.7.2:5555 --camera v4l2:/dev/video0 --calibration rig.yaml --out scan
  phone-host doctor --config phone-host.toml --json
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the verb's options."""
    parser.add_argument("--config", type=Path, metavar="FILE", help="settings file (TOML)")
    parser.add_argument("--link", action="append", metavar="URI", help="ask the board at this link; may be given again")
    parser.add_argument("--camera", metavar="URI", help="stream from this own camera for a second")
    parser.add_argument("--calibration", metavar="FILE", help="rig.yaml to check")
    parser.add_argument("--out", type=Path, default=Path(), metavar="DIR", help="folder of results (default: this one)")
    parser.add_argument("--wait", type=float, default=5.0, metavar="S", help="wait this long for the board (default 5)")


def run(options: argparse.Namespace) -> int:
    """Check, and print what was found."""
    if not (math.isfinite(options.wait) and options.wait >= 0):
        raise SettingsError(f"--wait {options.wait}", "give seconds, 0 or more")
    settings = resolve_settings(options).values
    question = Question(
        settings.camera, settings.link, settings.calibration, options.out, options.wait, key_folder(settings.keys)
    )
    findings = examine(question)
    print(json.dumps(values(findings)) if options.json else table(findings))
    return exit_code(findings)
