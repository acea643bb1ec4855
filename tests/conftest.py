"""For all tests: properties, the signals of programs that tests start, and what was skipped.

A property has no time limit, since how long an example takes says what else the machine does. It draws the same examples in every run, so that a red
run is red again; `make test-slow` and `make fuzz` draw new ones (`--hypothesis-profile=exploring`).
"""

import os
from pathlib import Path

import pytest
from hypothesis import settings

from tests.support.inherited_signals import restore_for_children
from tests.support.skipped import append_skips

settings.register_profile("repeatable", settings.get_profile("ci"), deadline=None)
settings.register_profile("exploring", settings.get_profile("default"), deadline=None)
settings.load_profile("repeatable")

restore_for_children()


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Note what was skipped and why, for the list at the end of `make test`: TEST_SKIPS names the file."""
    if file := os.environ.get("TEST_SKIPS"):
        append_skips(Path(file), [report.longrepr for report in terminalreporter.getreports("skipped")])
