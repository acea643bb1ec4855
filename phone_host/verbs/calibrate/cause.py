"""What phone-host calibrate does about a mistake that the views tell: the report's words, the verdict, and the rig without a drift."""

import math
from typing import Any, Final

from common.errors import DataError
from phone_host.calibration.arrangement import is_contradicted
from phone_host.calibration.board_pairs import BoardPair, Calibration, Rejected
from phone_host.calibration.calibrate import calibrate
from phone_host.calibration.causes.mistakes import Course, Finding, Mistake
from phone_host.calibration.causes.name import BoardSeries
from phone_host.calibration.causes.unturned import unturned
from phone_host.calibration.verdict import Assessment, Verdict, judge
from phone_host.model import Side

_BEST_FIRST: Final = (Verdict.GOOD, Verdict.USABLE, Verdict.REJECT)


def calibrated_as_last(
    series: BoardSeries, found: Calibration | DataError, finding: Finding | None, board_side: Side
) -> tuple[Calibration | DataError, Finding | None, list[BoardPair]]:
    """Give the rig as it stands in the last view, if the cameras turned against each other while the views were taken.

    Args:
        series: the views.
        found: what all views give together, as if the rig were stiff.
        finding: what is wrong with them.
        board_side: which camera is on the board.

    Returns:
        The rig without the drift, or what was found if there is none or the rig without it is no better; the finding; and
        the pairs that the rig was computed from.
    """
    pairs = list(series.pairs)
    turned = None if finding is None else finding.turned
    if turned is None or turned.course is Course.LOOSE:
        return found, finding, pairs
    straight = unturned(pairs, turned)
    try:
        without = calibrate(straight, series.board, series.sizes_px, board_side)
    except DataError:
        return found, finding, pairs
    if isinstance(found, Calibration) and len(without.used) < len(found.used):
        return found, finding, pairs
    return without, finding, straight


def assessed(found: Calibration, rejected: tuple[Rejected, ...], finding: Finding | None, hint: str) -> Assessment:
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
    wrong = finding.misplaced
    if wrong is None:
        is_cause = found.obstacle is None or finding.mistake is Mistake.PARTNERS  # of which no rig can come
        return with_cause(judgement, finding) if is_cause else judgement
    if found.obstacle is not None or wrong.is_mirrored or is_contradicted(found):
        return Assessment(Verdict.REJECT, hint)  # all else follows from it
    return judgement if judgement.verdict is Verdict.GOOD else Assessment(judgement.verdict, hint)


def with_cause(judgement: Assessment, finding: Finding) -> Assessment:
    """Give the mistake's remedy, which helps most, in place of all others; a series that has it may get no better verdict than it allows.

    A rig that is good all the same needs no remedy: the mistake is only told.
    """
    verdict = max(judgement.verdict, finding.most, key=_BEST_FIRST.index)
    if verdict is Verdict.GOOD:
        return judgement
    return Assessment(verdict, f"{finding.sentence}: {finding.remedy}")


def cause_report(finding: Finding | None, hint: str) -> dict[str, Any]:
    """Return a mistake for report.json.

    Args:
        finding: the mistake.
        hint: what to do about a turned or mirrored side; empty: it is none.
    """
    if finding is None:
        return {"cause": None}
    cause: dict[str, Any] = {
        "name": finding.mistake.value,
        "sentence": hint or finding.sentence,
        "remedy": finding.remedy,
        "explained_px": round(finding.explained_px, 4) if math.isfinite(finding.explained_px) else None,
    }
    if finding.turned is not None:
        turned = finding.turned
        cause["turned"] = {
            "course": turned.course.value,
            "turn_deg": [round(math.degrees(each), 4) for each in turned.turn_rad],
            "sigma_deg": [round(math.degrees(each), 4) for each in turned.sigma_rad],
            "from_pair": turned.names[turned.begins] if turned.begins >= 0 else None,
            "rows_px": round(turned.rows_px, 3),
            "depth_at_1_m_mm": round(turned.depth_at_1_m_m * 1e3, 2),
        }
    return {"cause": cause}
