"""What must be said of how sure the camera's way is."""

from collections.abc import Sequence
from typing import Final

from common.words import counted, distance_text, two_digits
from phone_host.report.stereo_report import Remark
from phone_host.scan.stretches import WayCertainty

_LEAST_WAY_M: Final = 5.0
"""Around a thing or a table the pairs see each other's surface, which holds them together better than their way does."""


def way_remarks(certainty: WayCertainty | None) -> Sequence[Remark]:
    """Say how far poses far from the beginning may be off: the noise of the surface knows nothing of that.

    Args:
        certainty: of the way; None: something else than the way tells where the camera is, or nobody knows.
    """
    if certainty is None or certainty.length_m < _LEAST_WAY_M:
        return ()
    known = f"its farthest poses are known to \u00b1 {two_digits(1e3 * certainty.sigma_m)} mm"
    way = f"the camera's way is {distance_text(certainty.length_m)} long"
    if certainty.loops:
        return (Remark(f"{way} and {counted(certainty.loops, 'loop')} were closed: {known}", is_note=True),)
    remedy = "come back to where you began, and show it for some pairs from the same side"
    return (Remark(f"{way} and no loop was closed: {known}", remedy, is_note=True),)
