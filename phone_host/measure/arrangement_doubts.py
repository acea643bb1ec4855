"""Names how two images lie to each other if not as they should: exchanged, turned, mirrored, or both from one place. Pure.

A mistake is named only if clearly more features agree with it than with the right arrangement. Figures: decision 0029.
"""

from dataclasses import replace
from typing import Final

from phone_host.measure.file_remedies import FILE_REMEDIES, ImageSource
from phone_host.measure.trust import Concern, Doubt
from phone_host.model import Arrangement, Evidence

LEAST_SUPPORT: Final = 12
"""Features that must agree with a mistake before it is named. Pairs of unlike scenes reach 3 by chance, good ones 50 and more."""

_MARGIN: Final = 2.0
"""How many times more features must agree with a mistake than with the right arrangement. A chessboard mirrored looks
like itself and reaches a third."""

_CLEARLY_MORE: Final = 1.3
"""How many times more features tell cameras on their heads, or mirrored ones, from exchanged ones behind a rig."""

_SAME_SHARE: Final = 0.75
"""Share of the features that have not moved in two images from one place; noise moves some. In a street scene 2 % have not."""

_NAMED: Final = {
    Arrangement.SWAPPED: Concern(
        Doubt.SWAPPED,
        "left and right are exchanged: the scene moves the wrong way from the left image to the right one",
        "swap LEFT and RIGHT or --board-side; if each is where it should be, both cameras are upside down (rotate=180) or both mirror their images (flip=h)",
    ),
    Arrangement.TURNED: Concern(
        Doubt.TURNED,
        "one camera is upside down: the two images are turned by 180 degrees to each other",
        "mount it upright, or give that camera rotate=180",
        arrangement=Arrangement.TURNED,
    ),
    Arrangement.TURNED_BY_QUARTER: Concern(
        Doubt.TURNED_BY_QUARTER,
        "one camera lies on its side: the two images are turned by 90 degrees to each other",
        "mount it upright, or give that camera rotate=90 or rotate=270",
        arrangement=Arrangement.TURNED_BY_QUARTER,
    ),
    Arrangement.BOTH_TURNED: Concern(
        Doubt.TURNED,
        "both cameras are upside down: their images fit the calibration only when turned by 180 degrees",
        "mount them upright, or give both cameras rotate=180",
        arrangement=Arrangement.BOTH_TURNED,
    ),
    Arrangement.BOTH_MIRRORED: Concern(
        Doubt.MIRRORED,
        "both images are mirrored: they fit the calibration only when flipped",
        "switch mirroring off in both cameras, or give both flip=h (flip=v if top and bottom are exchanged)",
        arrangement=Arrangement.BOTH_MIRRORED,
    ),
    Arrangement.BOTH_TURNED_BY_QUARTER: Concern(
        Doubt.TURNED_BY_QUARTER,
        "both cameras lie on their sides: the scene moves up or down from one image to the other",
        "mount them upright, or give both cameras rotate=90 or rotate=270",
        arrangement=Arrangement.BOTH_TURNED_BY_QUARTER,
    ),
    Arrangement.MIRRORED: Concern(
        Doubt.MIRRORED,
        "one of the two images is a mirror image",
        "switch mirroring off in the camera's app, or give that camera flip=h (flip=v if top and bottom are exchanged)",
        arrangement=Arrangement.MIRRORED,
    ),
    Arrangement.SAME_PLACE: Concern(
        Doubt.SAME_IMAGE,
        "both images show the scene from the same place: nothing is shifted between them",
        "give two different cameras or files, and keep the cameras apart; if they are, everything is too far away",
    ),
}
_OF_BOTH: Final = (
    Arrangement.SWAPPED,
    Arrangement.BOTH_TURNED,
    Arrangement.BOTH_MIRRORED,
    Arrangement.BOTH_TURNED_BY_QUARTER,
)
"""Mistakes that leave the features of both images in the same direction; the first wins a tie."""


def _named(arrangement: Arrangement, source: ImageSource) -> Concern:
    concern = _NAMED[arrangement]
    return concern if source is ImageSource.CAMERAS else replace(concern, remedy=FILE_REMEDIES[arrangement].words)


def arrangement_doubts(evidence: Evidence, source: ImageSource) -> tuple[Concern, ...]:
    """Name the mistake that clearly more features agree with than with the right arrangement; empty if none.

    Args:
        evidence: of the pair, with supports.
        source: where the images come from: remedies name the options of a camera's address, or those for files.
    """
    support = {item.arrangement: item.features for item in evidence.supports}
    return tuple(_with_direction(concern, evidence) for concern in _arranged(support, source))


def _arranged(support: dict[Arrangement, int], source: ImageSource) -> tuple[Concern, ...]:
    related = max(support[Arrangement.RIGHT], support[Arrangement.TILTED])
    same = support[Arrangement.SAME_PLACE]
    if same >= max(LEAST_SUPPORT, _SAME_SHARE * related):
        return (_named(Arrangement.SAME_PLACE, source),)
    # These turn the features themselves: not even tilted rows explain them.
    turned = (Arrangement.TURNED, Arrangement.TURNED_BY_QUARTER, Arrangement.MIRRORED)
    best = max(turned, key=lambda arrangement: support[arrangement])
    if support[best] >= max(LEAST_SUPPORT, _MARGIN * related):
        return (_named(best, source),)
    best = max(_OF_BOTH, key=lambda arrangement: support[arrangement])
    if support[best] < max(LEAST_SUPPORT, _MARGIN * support[Arrangement.RIGHT]):
        return ()
    if support[best] < _CLEARLY_MORE * support[Arrangement.SWAPPED]:
        best = Arrangement.SWAPPED  # without a rig the three cannot be told apart; its remedy names them all
    return (_named(best, source),)


def _with_direction(concern: Concern, evidence: Evidence) -> Concern:
    """Add by how many quarters one camera is turned against the other, if that is the mistake."""
    if concern.arrangement is not Arrangement.TURNED_BY_QUARTER:
        return concern
    return replace(concern, quarters=max(item.quarters for item in evidence.supports))
