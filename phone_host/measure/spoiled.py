"""A run in which no image is whole: it goes on, since a cable may be pushed in again, but says so early. Pure."""

from dataclasses import dataclass

from phone_host.measure.trust import Concern, Doubt

_ENOUGH = 10
"""So many spoiled images before the first pair are no single hitch: a third of a second of video."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SpoiledCounts:
    """Images that were not whole, by where that was found.

    Attributes:
        pairs: pairs processed.
        on_board: dropped by the board before sending.
        own: of this machine's camera.
        decoded: pairs with an image that could not be decoded.
    """

    pairs: int
    on_board: int
    own: int
    decoded: int

    @property
    def nothing_whole(self) -> bool:
        """Whether there is no pair because images are spoiled."""
        return not self.pairs and self.on_board + self.own + self.decoded >= _ENOUGH


def spoiled_concerns(counts: SpoiledCounts) -> tuple[Concern, ...]:
    """Say that there is no pair because images are spoiled; empty if there is one, or too few images to tell."""
    if not counts.nothing_whole:
        return ()
    places = (
        (counts.on_board, "from the board's camera"),
        (counts.own, "from this machine's camera"),
        (counts.decoded, "found when pairs were decoded"),
    )
    where = ", ".join(f"{count} {words}" for count, words in places if count)
    remedy = "check the cable, the camera and its format on that side; phone-host doctor and board-agent doctor look at one image"
    return (Concern(Doubt.NO_WHOLE_IMAGE, f"no pair so far, because images are not whole ({where})", remedy),)
