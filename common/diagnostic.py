"""One kind of finding, whoever makes it: what is wrong or was done, how grave it is, and what helps. Pure.

Doctors, runs, scans, commands on files and the page all show these. The codes of doubts about depth stand in
`phone_host/diagnostics/codes.py`; a doctor's code is the thing that it checked.
"""

from dataclasses import dataclass, field
from enum import Enum
from typing import Any

from common.errors import TandemError
from common.plain_text import printable


class Severity(Enum):
    """How grave it is, for the result that it speaks of."""

    OK = "ok"
    NOTE = "note"
    WARN = "warn"
    FAIL = "fail"


@dataclass(frozen=True, slots=True)
class Diagnostic:
    """One finding.

    Attributes:
        message: what it is, with figures, without a full stop.
        remedy: what to do about it; empty: nothing.
        severity: ok: as it should be; note: only told, the result is right; warn: it may be wrong; fail: it is wrong, or there is none.
        code: its kind; empty: the message is its kind.
        evidence: what rules need of what it was drawn from; its code says of which type. Not compared.
    """

    message: str
    remedy: str = ""
    severity: Severity = Severity.WARN
    code: str = ""
    evidence: Any = field(default=None, compare=False)

    @property
    def is_failure(self) -> bool:
        """Whether the result must not be taken for right; a command ends with exit code 4."""
        return self.severity is Severity.FAIL

    @property
    def is_note(self) -> bool:
        """Whether nothing is wrong."""
        return self.severity is Severity.NOTE

    @property
    def text(self) -> str:
        """Message and remedy on one line."""
        return f"{self.message}: {self.remedy}" if self.remedy else self.message

    @property
    def line(self) -> str:
        """As a terminal shows it."""
        return f"{'note' if self.is_note else 'warning'}: {self.text}"

    @property
    def sentences(self) -> str:
        """Message and remedy as they follow a colon."""
        return f"{self.message}. Remedy: {self.remedy}."


def diagnostic_of(error: BaseException) -> Diagnostic:
    """Return an error in words. One that is none of ours is a mistake of the program, and named by its kind."""
    if isinstance(error, TandemError):
        return Diagnostic(printable(error.problem), printable(error.remedy), Severity.FAIL)
    reported = printable(f"{type(error).__name__}: {error}")
    remedy = "run it again with --debug and report what it prints"
    return Diagnostic(f"the program itself failed ({reported})", remedy, Severity.FAIL)
