"""The verdict of phone-host calibrate where the views tell of a mistake."""

from typing import Final

from common.diagnostic import Diagnostic
from phone_host.calibration.failure_modes.arrangement import is_contradicted
from phone_host.calibration.failure_modes.mistakes import Mistake
from phone_host.calibration.solve.result import Calibration
from phone_host.calibration.solve.verdict import Assessment, judge
from phone_host.calibration.target.pairs import Rejected
from phone_host.model import Verdict

_BEST_FIRST: Final = (Verdict.GOOD, Verdict.USABLE, Verdict.REJECT)


def assessed(found: Calibration, rejected: tuple[Rejected, ...], finding: Diagnostic | None, hint: str) -> Assessment:
    """Judge a calibration and say what to do: the mistake's remedy if there is one, else that of the verdict.

    Args:
        found: the calibration.
        rejected: all pairs that are not used.
        finding: what is wrong with the series; None: nothing.
        hint: what to do about a turned or mirrored side; empty: it is none.
    """
    judgement = judge(found, rejected)
    if finding is None:
        return judgement
    wrong = finding.evidence.misplaced
    if wrong is None:
        is_cause = found.obstacle is None or finding.code is Mistake.PARTNERS  # of which no rig can come
        return with_cause(judgement, finding) if is_cause else judgement
    if found.obstacle is not None or wrong.is_mirrored or is_contradicted(found):
        return Assessment(Verdict.REJECT, hint)  # all else follows from it
    return judgement if judgement.verdict is Verdict.GOOD else Assessment(judgement.verdict, hint)


def with_cause(judgement: Assessment, finding: Diagnostic) -> Assessment:
    """Give the mistake's remedy, which helps most, in place of all others; a series that has it may get no better verdict than it allows.

    A rig that is good all the same needs no remedy: the mistake is only told.
    """
    verdict = max(judgement.verdict, finding.evidence.most, key=_BEST_FIRST.index)
    if verdict is Verdict.GOOD:
        return judgement
    return Assessment(verdict, finding.text)
