"""A map fragment: a piece of a scan whose place against the model is not known yet, and what comes of it. Pure."""

from dataclasses import dataclass

from phone_host.geometry.se3 import SE3
from phone_host.scan.piece import Piece
from phone_host.scan.registration import Registered
from phone_host.scan.tracking_words import Tracking, Weakness


@dataclass(frozen=True, slots=True, eq=False)
class Joined:
    """A view that was lost and has become part of the model.

    Attributes:
        number: of the view: 1 is the first that was tracked.
        world_camera: where it was taken.
        state: how sure that is.
        weakness: why it is not surer.
    """

    number: int
    world_camera: SE3
    state: Tracking
    weakness: Weakness


@dataclass(frozen=True, slots=True)
class Joining:
    """What came of joining a piece to the model.

    Attributes:
        views: its views, which are part of the model now; none: it stays apart.
        is_refused: whether the piece's own surface does not fit the model where it would lie, or fits, but does not confirm it.
    """

    views: tuple[Joined, ...] = ()
    is_refused: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """A piece to which a view belongs, where it was taken in its axes, and how it lies there."""

    piece: Piece
    pose: SE3
    fit: Registered

    @property
    def weakness(self) -> Weakness:
        """FLAT if the view could slide along the surface, else NONE."""
        return Weakness.NONE if self.fit.is_determined else Weakness.FLAT


@dataclass(frozen=True, slots=True, eq=False)
class FragmentView:
    """A view of a piece: its number, where it was taken in the piece's axes, and why that is not surer."""

    number: int
    pose: SE3
    weakness: Weakness


class MapFragment:
    """A piece beside the model, where it is believed to be in the world, and its views.

    Attributes:
        piece: its field and places.
        world_piece: takes its points to the world, as far as is known.
        views: those that were fused in it.
        unconfirmed: poses, in its axes and in the model's, of views that show the model where it can hardly be.

    Args:
        piece: its field and places.
        world_piece: where it is believed to be.
    """

    def __init__(self, piece: Piece, world_piece: SE3) -> None:
        self.piece, self.world_piece = piece, world_piece
        self.views: list[FragmentView] = []
        self.unconfirmed: list[tuple[SE3, SE3]] = []
