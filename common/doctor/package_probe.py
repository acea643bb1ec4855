"""Finds out which packages of the installation are missing. It imports none that is there."""

from collections.abc import Iterable
from importlib.util import find_spec

from common.android import is_android
from common.diagnostic import Diagnostic
from common.doctor.finding import fail
from common.errors import UnavailableError
from common.program.packages import remedy_for


def missing_packages(modules: Iterable[str]) -> list[Diagnostic]:
    """Look for modules, and return a finding for each that is not installed."""
    return [missing_package(module, "is not installed") for module in modules if not _is_installed(module)]


def missing_package(module: str, problem: str) -> Diagnostic:
    """Return the finding that a package cannot be used."""
    remedy = f"install it: {remedy_for(module, on_android=is_android())}"
    return fail(module, problem, remedy, exit_code=UnavailableError.exit_code)


def _is_installed(module: str) -> bool:
    try:
        return find_spec(module) is not None
    except ImportError:
        return False
