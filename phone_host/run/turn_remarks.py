"""What must be said of an object that turned before the cameras."""

import math
from collections.abc import Sequence

from common.words import counted, distance_text
from phone_host.report.stereo_report import Remark
from phone_host.scan.full_turn import LEAST_VIEWS
from phone_host.scan.scan import Scan
from phone_host.scan.turntable import TurntableScan

_REMEDY = "turn it all the way round about one axis, by 3 to 15 degrees between the pairs"


def turn_remarks(scan: Scan) -> Sequence[Remark]:
    """Say whether the turn was found, and whether it is closed.

    Args:
        scan: whose model was made.
    """
    if not isinstance(scan, TurntableScan) or not scan.fused:
        return ()
    if scan.views < LEAST_VIEWS:
        few = f"only {counted(scan.views, 'pair')} of the object as it turns: {LEAST_VIEWS} are needed to find its axis"
        return (Remark(few, _REMEDY, is_blocking=True),)
    turn = scan.turn
    if turn is None:
        return (Remark("the pairs agree on no axis about which the object turns", _REMEDY, is_blocking=True),)
    degrees = f"{math.degrees(turn.span):.0f} degrees"
    if turn.is_closed:
        gap = f"{abs(math.degrees(turn.gap)):.2g} degrees"
        closed = f"the end met the beginning {gap} off, which was distributed, and lies {distance_text(turn.closed_m)} from it now"
        return (Remark(f"the turn of {degrees} is closed: {closed}", is_note=True),)
    if turn.span < 2 * math.pi:
        return (Remark(f"the object has turned by {degrees} only", "go on until its first side shows again"),)
    words = "the end of the turn was not recognised as its beginning: the surface may be doubled there"
    return (Remark(words, "go on turning for a few pairs more, and show more texture"),)
