"""board-agent doctor: check camera, links, clocks, disk and power."""

import argparse
import json
import logging

from board_agent.doctor.board_doctor import examine
from board_agent.settings import SERVICE_SETTINGS, check, resolve_settings
from common.doctor.finding import exit_code, settings_finding, table, values
from common.errors import SettingsError
from common.program import logs
from common.program.terminal import fitted


def run(options: argparse.Namespace) -> int:
    """Check what `run` would use. If nothing is chosen, that is what the service uses, where it is installed.

    If the settings make no sense, that is the first finding, and the machine is checked by itself.
    """
    if not (options.config or options.camera or options.link) and SERVICE_SETTINGS.is_file():
        options.config = SERVICE_SETTINGS
    settings, wrong = None, None
    try:
        resolved = resolve_settings(options).values
        check(resolved)
        settings = resolved
    except SettingsError as error:
        wrong = error
    logs.set_up(logging.ERROR)  # the findings say it all
    findings = [settings_finding(str(options.config or ""), wrong), *examine(settings)]
    print(json.dumps(values(findings)) if options.json else fitted(table(findings)))
    return exit_code(findings, wrong)
