"""The verdict on a calibration whose views tell of a mistake, and what is said of images that are turned, mirrored or out of step: the option that helps. Pure."""

from typing import Final

from common.diagnostic import Diagnostic
from common.errors import DataError
from common.orientation import Flip, Orientation
from phone_host.calibration.failure_modes.arrangement import Misplaced, composed, is_contradicted
from phone_host.calibration.failure_modes.mistakes import Mistake
from phone_host.calibration.failure_modes.partners import OutOfStep
from phone_host.calibration.solve.verdict import Assessment, Calibration, judge
from phone_host.calibration.target.board_views import BoardViews, Mounted
from phone_host.calibration.target.pairs import Rejected
from phone_host.model import Side, Verdict

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


def arrangement_hint(views: BoardViews, mounted: Mounted, wrong: Misplaced, *, is_live: bool = False) -> str:
    """Say which side's images are turned or mirrored, and the options that mend it.

    Args:
        views: the board in the images; its corners are those of images already turned by `mounted`.
        mounted: the turns that were given.
        wrong: what is to be done besides.
        is_live: whether the images come from cameras now, whose addresses mend it.
    """
    side, other = wrong.side.value, (Side.LEFT if wrong.side is Side.RIGHT else Side.RIGHT).value
    what = f"the {side} images are {_state(_plainest(wrong.turn))} against the {other} ones"
    if views.turned[0] != views.turned[1]:
        what = f"left and right EXIF headers differ, and {what}"
    given = mounted[0] if wrong.side is Side.LEFT else mounted[1]
    remedy = (
        _address(side, _plainest(wrong.turn))
        if is_live
        else _options(side, given, _plainest(composed(given, wrong.turn)))
    )
    if wrong.is_mirrored:
        remedy = f"switch mirroring off in that camera, or {remedy}"
    if wrong.is_either:
        remedy += f", or the same for {other} if that is the wrong side"
    return f"{what}: {remedy}"


def out_of_step_error(shifted: OutOfStep) -> DataError:
    """Say from which picture on the pairs show two moments, and what to do."""
    side, other = shifted.side.value, (Side.LEFT if shifted.side is Side.RIGHT else Side.RIGHT).value
    names, count = shifted.alone, shifted.missing
    what = "a picture is" if count == 1 else f"{count} pictures are"
    problem = f"{what} missing on the {side}: the folders are out of step from {names[0]} on"
    shown = " and ".join(names) if len(names) == count else f"what has no partner of {', '.join(names)}"
    return DataError(problem, f"give both images of a pair the same number, or delete {shown} on the {other}")


def _plainest(turn: Orientation) -> Orientation:
    """Return the same with a turn by 180 degrees and a mirror written as the other mirror."""
    if turn.rotate_deg != 180 or turn.flip is Flip.NONE:
        return turn
    return Orientation(0, Flip.V if turn.flip is Flip.H else Flip.H)


def _state(turn: Orientation) -> str:
    parts = [f"turned by {turn.rotate_deg} degrees"] if turn.rotate_deg else []
    parts += ["mirrored"] if turn.flip is Flip.H else []
    parts += ["mirrored top to bottom"] if turn.flip is Flip.V else []
    return " and ".join(parts)


def _address(side: str, needed: Orientation) -> str:
    """Return what to add to a camera's address."""
    turn = [f"rotate={needed.rotate_deg}"] if needed.rotate_deg else []
    flip = [f"flip={needed.flip.value}"] if needed.flip is not Flip.NONE else []
    return f"add {'&'.join([*turn, *flip])} to the address of the {side} camera"


def _options(side: str, given: Orientation, needed: Orientation) -> str:
    """Return what to give, and what of the options already given to leave out."""
    turn = f"--rotate-{side} {needed.rotate_deg}" if needed.rotate_deg else ""
    flip = f"--flip-{side} {needed.flip.value}" if needed.flip is not Flip.NONE else ""
    surplus = [f"--rotate-{side}"] if given.rotate_deg and not turn else []
    surplus += [f"--flip-{side}"] if given.flip is not Flip.NONE and not flip else []
    parts = [f"add {' '.join(filter(None, (turn, flip)))}"] if turn or flip else []
    parts += [f"leave out {' and '.join(surplus)}"] if surplus else []
    return " and ".join(parts)
