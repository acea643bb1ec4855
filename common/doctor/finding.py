"""A check's result and how a list of them is printed. Pure.

A check takes readings and returns findings; it opens nothing. What could not be read becomes a warning that says how to read it, never silence.
"""

from collections.abc import Sequence
from typing import Any, Final

from common.diagnostic import Diagnostic, Severity
from common.errors import SettingsError
from common.plain_text import printable

CHECK_FAILED: Final = 4


def ok(what: str, text: str) -> Diagnostic:
    """A finding: something is as it should be."""
    return Diagnostic(text, severity=Severity.OK, code=what)


def warn(what: str, text: str, remedy: str) -> Diagnostic:
    """A finding: something works badly, or could not be checked."""
    return Diagnostic(text, remedy, Severity.WARN, what)


def fail(what: str, text: str, remedy: str, *, exit_code: int = CHECK_FAILED) -> Diagnostic:
    """A finding: something is broken without which nothing works.

    Args:
        what: the thing checked.
        text: the finding.
        remedy: what to do about it.
        exit_code: the command's: 3 if something must be installed or plugged in before any other check means much.
    """
    return Diagnostic(text, remedy, Severity.FAIL, what, exit_code)


def settings_finding(file: str, wrong: SettingsError | None) -> Diagnostic:
    """A finding: the settings, the first thing that a doctor looks at.

    Args:
        file: the settings file; empty: none is used.
        wrong: why the settings make no sense; None: they do.
    """
    if wrong is not None:
        return fail("settings", printable(wrong.problem), printable(wrong.remedy))
    return ok("settings", file or "no file: defaults, environment and options")


def table(findings: Sequence[Diagnostic]) -> str:
    """The findings as text, one line each."""
    width = max((len(item.code) for item in findings), default=0)
    return "\n".join(
        f"{item.severity.value:4}  {item.code:{width}}  {item.message}" + (f" -> {item.remedy}" if item.remedy else "")
        for item in findings
    )


def values(findings: Sequence[Diagnostic]) -> dict[str, Any]:
    """The findings as one JSON object."""
    return {
        "failed": sum(item.severity is Severity.FAIL for item in findings),
        "warnings": sum(item.severity is Severity.WARN for item in findings),
        "checks": [
            {"what": item.code, "verdict": item.severity.value, "finding": item.message, "remedy": item.remedy}
            for item in findings
        ],
    }


def exit_code(findings: Sequence[Diagnostic], wrong: SettingsError | None = None) -> int:
    """Return the command's exit code: 0 if nothing failed, with or without warnings.

    Wrong settings give theirs, as from every verb. Otherwise it is 3 if a package is missing, and 4 if anything else failed.
    """
    if wrong is not None:
        return wrong.exit_code
    return min((item.evidence for item in findings if item.severity is Severity.FAIL), default=0)
