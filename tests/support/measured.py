"""A plugin for pytest, `-p tests.support.measured`: coverage.py follows the pure modules, and nothing else, in each of pytest's processes.

`coverage combine` and `coverage report` then show the result. Programs that tests start are not followed: that would be
slow, and a program is no test of a pure module.
"""

import functools
import os
from collections.abc import Callable, Generator
from contextlib import contextmanager
from typing import Any, Final

import coverage
import pytest

from tests.support.pure import ROOT, pure_modules

# A process id, since each worker writes its own file.
_MEASURED = coverage.Coverage(
    config_file=str(ROOT / "pyproject.toml"),
    data_suffix=str(os.getpid()),
    include=[str(file) for file in pure_modules().values()],
)

_EXAMPLES: Final = 30


def pytest_collectstart(collector: pytest.Collector) -> None:
    """The first test module is about to import its pure modules; the process that only hands out the tests collects none."""
    if isinstance(collector, pytest.Session):
        _MEASURED.start()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Generator[None, None, None]:
    """Do not trace long computations, nor a property after its first examples: the tracer slows all Python down, including hypothesis."""
    handle = getattr(getattr(item, "obj", None), "hypothesis", None)
    if item.get_closest_marker("long") is not None:
        with _left_alone():
            yield
    elif handle is not None:
        with _begun(handle):
            yield
    else:
        yield


@contextmanager
def _left_alone() -> Generator[None, None, None]:
    _MEASURED.stop()
    try:
        yield
    finally:
        _MEASURED.start()


@contextmanager
def _begun(handle: Any) -> Generator[None, None, None]:
    """Trace only the first examples of a property; `handle` is what hypothesis attaches to its test."""
    prove: Callable[..., Any] = handle.inner_test
    count = 0

    @functools.wraps(prove)
    def counted(*given: Any, **named: Any) -> Any:
        nonlocal count
        count += 1
        if count == _EXAMPLES + 1:
            _MEASURED.stop()
        return prove(*given, **named)

    handle.inner_test = counted
    try:
        yield
    finally:
        handle.inner_test = prove
        if count > _EXAMPLES:
            _MEASURED.start()


def pytest_unconfigure() -> None:
    """The process has finished its tests."""
    _MEASURED.stop()
    _MEASURED.save()
