"""What must be said of an object that turned before the cameras."""

import math
from collections.abc import Sequence

from common.words import counted, distance_text
from phone_host.report.stereo_report import Remark
from phone_host.scan.field_bytes import field_bytes
from phone_host.scan.full_turn import LEAST_VIEWS, FullTurn
from phone_host.scan.scan import Scan
from phone_host.scan.surface_match import Match, SurfaceMatch
from phone_host.scan.turntable import TurntablePoses

_REMEDY = "turn it all the way round about one axis, by 3 to 15 degrees between the pairs"
_BOTH = "let both passes show the object's sides, and leave its shape as it is when you turn it over"


def turn_remarks(scan: Scan) -> Sequence[Remark]:
    """Say whether the turn was found, and whether it is closed.

    Args:
        scan: whose model was made.
    """
    poses = scan.poses
    if not isinstance(poses, TurntablePoses) or not scan.fused:
        return ()
    if poses.views < LEAST_VIEWS:
        few = (
            f"only {counted(poses.views, 'pair')} of the object as it turns: {LEAST_VIEWS} are needed to find its axis"
        )
        return (Remark(few, _REMEDY, is_blocking=True),)
    turn = poses.fit.turn
    if turn is None:
        return (Remark("the pairs do not agree on the axis about which the object turns", _REMEDY, is_blocking=True),)
    return (*_match_remarks(poses.fit.match), *_closing_remarks(turn))


def _match_remarks(match: SurfaceMatch | None) -> Sequence[Remark]:
    if match is None:
        return ()
    if match.match is Match.NONE:
        return (Remark("this pass does not fit the surface of the earlier one", _BOTH, is_blocking=True),)
    if match.match is Match.SEVERAL:
        several = "this pass fits the earlier one in several ways, and the colours do not tell which is right"
        return (Remark(several, "put a mark on the object, and scan both passes again", is_blocking=True),)
    fits = f"{match.share:.0%} of this pass lie on the earlier one, {distance_text(match.off_m)} off on average"
    return (Remark(fits, is_note=True),)


def _closing_remarks(turn: FullTurn) -> Sequence[Remark]:
    degrees = f"{math.degrees(turn.span):.0f} degrees"
    if turn.is_closed:
        gap = f"{abs(math.degrees(turn.gap)):.2g} degrees"
        closed = f"the end met the beginning {gap} off, which was distributed, and lies {distance_text(turn.closed_m)} from it now"
        return (Remark(f"the turn of {degrees} is closed: {closed}", is_note=True),)
    if turn.span < 2 * math.pi:
        return (Remark(f"the object has turned by {degrees} only", "go on until its first side shows again"),)
    words = "the end of the turn was not recognised as its beginning: the surface may be doubled there"
    return (Remark(words, "go on turning for a few pairs more, and show more texture"),)


def keeps_field(scan: Scan) -> bool:
    """Whether another pass can be added: there is a turn, and it was put together with the earlier pass if there was one.

    Args:
        scan: whose model was made.
    """
    poses = scan.poses
    if not isinstance(poses, TurntablePoses) or poses.fit.turn is None:
        return False
    return poses.fit.match is None or poses.fit.is_on_earlier_pass


def field_of_turn(scan: Scan) -> bytes:
    """Return the field of a turn, for another pass; empty: none can be added.

    Args:
        scan: whose model was made.
    """
    return field_bytes(scan.volume, scan.carved) if scan.volume is not None and keeps_field(scan) else b""
