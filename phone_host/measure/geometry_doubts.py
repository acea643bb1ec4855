"""Judges whether the geometry of images that came rectified can be theirs. Pure."""

from typing import Final

from phone_host.measure.trust import Concern, Doubt
from phone_host.model import Evidence

_BEHIND_SHARE: Final = 0.05
"""False matches put fewer points there; a sky may put more, where doffs is large and negative."""

_REMEDY: Final = "give the calib.txt that was published with these images"


def off_middle(evidence: Evidence) -> tuple[Concern, ...]:
    """Say that the principal point is that of other images; empty if it lies where theirs can lie.

    Args:
        evidence: of the pair.
    """
    seen = evidence.off_middle
    if seen is None:
        return ()
    return (
        Concern(
            Doubt.GEOMETRY,
            f"calib.txt or --center may belong to other images: the principal point {seen.cx_px:.0f},{seen.cy_px:.0f}"
            f" lies far from the middle of {seen.width_px}x{seen.height_px} px, and metres are wrong then",
            _REMEDY,
        ),
    )


def behind(evidence: Evidence) -> tuple[Concern, ...]:
    """Say that doffs is that of other images; empty if hardly a point lies behind infinity.

    Args:
        evidence: of the pair.
    """
    if not evidence.behind_share > _BEHIND_SHARE:
        return ()
    return (
        Concern(
            Doubt.GEOMETRY,
            f"{evidence.behind_share:.0%} of the points would lie at infinity or behind it: doffs may be that of other images",
            f"{_REMEDY}, or --doffs: cx of the right camera minus cx of the left one, px",
        ),
    )
