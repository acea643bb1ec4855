"""board-agent doctor: check camera, links, clocks, disk and power."""

import argparse
import json
import logging

from board_agent.doctor.board_doctor import examine
from board_agent.settings import SERVICE_SETTINGS, check, resolve_settings
from common.doctor.finding import exit_code, table, values
from common.program import logs
from common.program.terminal import fitted


def run(options: argparse.Namespace) -> int:
    """Check what `run` would use. If nothing is chosen, that is what the service uses, where it is installed."""
    if not (options.config or options.camera or options.link) and SERVICE_SETTINGS.is_file():
        options.config = SERVICE_SETTINGS
    settings = resolve_settings(options).values
    check(settings)
    logs.set_up(logging.ERROR)  # the findings say it all
    findings = examine(settings, options.config)
    print(json.dumps(values(findings)) if options.json else fitted(table(findings)))
    return exit_code(findings)
