"""Corners of the images in which no board was seen: there a lens is guessed, and no figure of a fit tells how wrongly. Pure."""

from collections.abc import Iterable

from phone_host.calibration.guide.coverage import placement
from phone_host.calibration.guide.wants import CORNERS, ORDER, Placed, Want, is_seen
from phone_host.calibration.solve.bend import Bend
from phone_host.calibration.solve.result import Calibration
from phone_host.calibration.solve.verdict import Assessment
from phone_host.calibration.target.corners import Board
from phone_host.calibration.target.pairs import BoardPair
from phone_host.model import CameraModel, Verdict


def unseen(places: Iterable[Placed]) -> frozenset[Want]:
    """Return the image corners that no board reaches."""
    left = set(CORNERS)
    for placed in places:
        left -= {want for want in left if is_seen(want, placed)}
    return frozenset(left)


def unseen_in(pairs: Iterable[BoardPair], board: Board, left: CameraModel, right: CameraModel) -> frozenset[Want]:
    """Return the image corners that the board reaches in none of some pairs; of the cameras only the sizes count."""
    return unseen(
        Placed(placement(pair.left_px, board, left), placement(pair.right_px, board, right)) for pair in pairs
    )


def guessed_corners(found: Calibration, pairs: Iterable[BoardPair], board: Board) -> frozenset[Want]:
    """Return the image corners that the board reaches in none of the pairs (as they were seen) that a calibration used, if a lens is guessed there."""
    if not is_guessed(found.bends):
        return frozenset()
    used = {each.name for each in found.used}
    return unseen_in((pair for pair in pairs if pair.name in used), board, found.rig.left, found.rig.right)


def is_guessed(bends: Iterable[Bend]) -> bool:
    """Return whether a lens may bend freely where nothing was seen: one of more than four coefficients.

    Beyond what was seen the powers of the fifth coefficient and more run away; four stay near the truth, because webcams' lenses follow them.
    """
    return any(bend is not Bend.USUAL for bend in bends)


def with_corners(judgement: Assessment, missing: Iterable[Want]) -> Assessment:
    """Return a verdict that promises nothing of what was not seen: good becomes usable where corners are missing."""
    names = [want.value for want in ORDER if want in set(missing)]
    if judgement.verdict is not Verdict.GOOD or not names:
        return judgement
    where = " or ".join(filter(None, (", ".join(names[:-1]), names[-1])))
    remedy = f"no board was seen in the {where} of the pictures, so the lens is guessed there: take views with it there"
    return Assessment(Verdict.USABLE, remedy)
