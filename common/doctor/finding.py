"""A check's result and how a list of them is printed. Pure.

A check takes readings and returns findings; it opens nothing. What could not be read becomes a warning that says how to read it, never silence.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any, Final

from common.errors import SettingsError
from common.plain_text import printable

CHECK_FAILED: Final = 4


class Grade(Enum):
    """How a check came out."""

    OK = "ok"
    WARN = "warn"
    FAIL = "fail"


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """What one check found.

    Attributes:
        what: the thing checked.
        verdict: fail: nothing will work; warn: something works badly, or could not be checked.
        text: the finding.
        remedy: what to do about it; empty if nothing is to be done.
        exit_code: the command's, if the check failed: 3 if something must be installed or plugged in before any other check means much.
    """

    what: str
    verdict: Grade
    text: str
    remedy: str = ""
    exit_code: int = CHECK_FAILED


def ok(what: str, text: str) -> Finding:
    """A finding: something is as it should be."""
    return Finding(what=what, verdict=Grade.OK, text=text)


def warn(what: str, text: str, remedy: str) -> Finding:
    """A finding: something works badly, or could not be checked."""
    return Finding(what=what, verdict=Grade.WARN, text=text, remedy=remedy)


def fail(what: str, text: str, remedy: str, *, exit_code: int = CHECK_FAILED) -> Finding:
    """A finding: something is broken without which nothing works."""
    return Finding(what=what, verdict=Grade.FAIL, text=text, remedy=remedy, exit_code=exit_code)


def settings_finding(file: str, wrong: SettingsError | None) -> Finding:
    """A finding: the settings, the first thing that a doctor looks at.

    Args:
        file: the settings file; empty: none is used.
        wrong: why the settings make no sense; None: they do.
    """
    if wrong is not None:
        return fail("settings", printable(wrong.problem), printable(wrong.remedy))
    return ok("settings", file or "no file: defaults, environment and options")


def table(findings: Sequence[Finding]) -> str:
    """The findings as text, one line each."""
    width = max((len(item.what) for item in findings), default=0)
    return "\n".join(
        f"{item.verdict.value:4}  {item.what:{width}}  {item.text}" + (f" -> {item.remedy}" if item.remedy else "")
        for item in findings
    )


def values(findings: Sequence[Finding]) -> dict[str, Any]:
    """The findings as one JSON object."""
    return {
        "failed": sum(item.verdict is Grade.FAIL for item in findings),
        "warnings": sum(item.verdict is Grade.WARN for item in findings),
        "checks": [
            {"what": item.what, "verdict": item.verdict.value, "finding": item.text, "remedy": item.remedy}
            for item in findings
        ],
    }


def exit_code(findings: Sequence[Finding], wrong: SettingsError | None = None) -> int:
    """Return the command's exit code: 0 if nothing failed, with or without warnings.

    Wrong settings give theirs, as from every verb. Otherwise it is 3 if a package is missing, and 4 if anything else failed.
    """
    if wrong is not None:
        return wrong.exit_code
    return min((item.exit_code for item in findings if item.verdict is Grade.FAIL), default=0)
