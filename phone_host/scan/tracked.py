"""What is said of a view that was tracked. Pure."""

from dataclasses import dataclass, replace
from typing import Final

from phone_host.geometry.se3 import SE3
from phone_host.scan.mat_pose import MatSaid
from phone_host.scan.odometry import Moved
from phone_host.scan.piece import Joined
from phone_host.scan.registration import Registered
from phone_host.scan.stretches import Placed
from phone_host.scan.tracking_words import Tracking, Weakness
from phone_host.scan.view import View


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Tracked:
    """What the tracker says of a view.

    Attributes:
        world_camera: where it was taken; where it is lost, as far as is known. The world's axes are the first view's, if the tracker began in the origin.
        state: how sure that is.
        weakness: why it is not surer.
        moved: what odometry says.
        fit: how the depth lies against the model; None where it was not compared.
        joined: earlier views that were lost, and have become part of the model with this one.
        moved_views: where the views in the model were taken, this one too, if a loop has moved them; else none.
        mat: what a mat told; None: there is none, or it was not seen.
        used: the view with the depths that went into the model, or may do so later; None: there are none.
        is_followed: whether odometry tells the pose of a view that is not fused, without a gap since one that is.
    """

    world_camera: SE3
    state: Tracking
    weakness: Weakness
    moved: Moved
    fit: Registered | None
    joined: tuple[Joined, ...] = ()
    moved_views: tuple[Placed, ...] = ()
    mat: MatSaid | None = None
    used: View | None = None
    is_followed: bool = False

    @property
    def is_fused(self) -> bool:
        """Whether the view became part of the model."""
        return self.state is not Tracking.LOST

    def unless_flat(self) -> "Tracked":
        """Return it where something else tells what a flat or round thing does not: the axis of a turn, the corners on a table."""
        state, weakness = _unless_flat(self.state, self.weakness)
        joined = []
        for each in self.joined:
            its_state, its_weakness = _unless_flat(each.state, each.weakness)
            joined.append(replace(each, state=its_state, weakness=its_weakness))
        return replace(self, state=state, weakness=weakness, joined=tuple(joined))

    def unless_restless(self) -> "Tracked":
        """Return it as weak where something moves against the rest."""
        if self.state is not Tracking.TRACKING or not self.moved.others:
            return self
        return replace(self, state=Tracking.WEAK, weakness=Weakness.RESTLESS)


NOT_MOVED: Final = Moved(world_camera=SE3.identity(), before_now=SE3.identity(), is_known=False, followed=0, inliers=0)
"""What is known of the motion of a view for which odometry was not asked."""


def lost(why: Weakness) -> Tracked:
    """Return what is said of a view of whose place nothing is known."""
    return Tracked(world_camera=SE3.identity(), state=Tracking.LOST, weakness=why, moved=NOT_MOVED, fit=None)


def _unless_flat(state: Tracking, weakness: Weakness) -> tuple[Tracking, Weakness]:
    if weakness is not Weakness.FLAT:
        return state, weakness
    return Tracking.TRACKING if state is Tracking.WEAK else state, Weakness.NONE
