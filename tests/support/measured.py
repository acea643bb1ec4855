"""A plugin for pytest, `-p tests.support.measured`: coverage.py follows the pure modules, and nothing else, in each of pytest's processes.

`coverage combine` and `coverage report` then tell what they saw. Programs that tests start are not followed: that would be slow, and a program is no
test of a pure module.
"""

import os
from collections.abc import Generator

import coverage
import pytest

from tests.support.pure import ROOT, pure_modules

# A process id, since each worker writes a file of its own.
_MEASURED = coverage.Coverage(
    config_file=str(ROOT / "pyproject.toml"),
    data_suffix=str(os.getpid()),
    include=[str(file) for file in pure_modules().values()],
)
_MEASURED.start()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Generator[None, None, None]:
    """A test that computes long is left alone."""
    followed = item.get_closest_marker("long") is None
    if not followed:
        _MEASURED.stop()
    try:
        yield
    finally:
        if not followed:
            _MEASURED.start()


def pytest_unconfigure() -> None:
    """The process has run its tests."""
    _MEASURED.stop()
    _MEASURED.save()
