"""A piece of a scan: a field with axes of its own, the places seen in it, and what a view must fulfil to belong to it. Pure.

A scan is one piece as long as the camera is tracked. A camera that was lost goes on in another, whose place against the others is not known yet.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from common.diagnostic import Diagnostic
from phone_host.geometry.se3 import SE3
from phone_host.native.library import Library
from phone_host.scan.odometry import Moved
from phone_host.scan.places import Places
from phone_host.scan.registration import Registered, RegistrationSettings, registered
from phone_host.scan.tracking_words import Tracking, Weakness
from phone_host.scan.view import Camera, View, narrowed
from phone_host.scan.volume import Volume
from phone_host.scan.volume_settings import VolumeSettings

_ALIGNED_PX: Final = 240
"""Width up to which depth is laid against the model. Twice that costs 11 of 49 ms of processor time at VGA, and gives the same poses."""

_PARTNER_VOXELS: Final = 10
_FLOOR_VOXELS: Final = 0.3
"""The surface's own noise: what is left of a voxel between its values."""

_BY_PLACE: Final = 2.0
"""Times as much as odometry, a place's pose may be corrected: of a room's places, 88 mm and 2.3 degrees."""

STANDING: Final = Moved(world_camera=SE3.identity(), before_now=SE3.identity(), is_known=True, followed=0, inliers=0)
"""What odometry says of a view that is compared with a place: nothing that lets it pass more easily."""

_ROUNDING_VOXELS: Final = 0.05
"""A surface is no more exact: without noise, views of one plane are 0.2 mm off voxels of 20 mm, and those of the next plane twice that."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PoseGate:
    """What a pose must fulfil to be believed.

    Attributes:
        most_shift_m: the model may correct odometry by this much, m.
        most_turn: and by this much, rad.
        least_overlap: share of the pixels in view that must have a partner in the model.
        sure_overlap: the same where corners enough agree on the motion: a street seen at 9 degrees gives 0.25.
        least_near: share of the partners that must lie within 3 standard deviations.
        most_off: times the usual mean distance to the model, where the depths are as noisy.
        least_depths: share of the pixels that must have a depth.
        weak_inliers: corners that agree; with fewer the pose is weak.
        is_turned_by_others: whether what is seen may have turned to anywhere while it was not followed: a thing on a turntable, whose axis
            judges its views afterwards. Then no pose is too far from the last one.
    """

    most_shift_m: float = 0.08
    most_turn: float = 0.105
    least_overlap: float = 0.35
    sure_overlap: float = 0.15
    least_near: float = 0.5
    most_off: float = 2.0
    least_depths: float = 0.02
    weak_inliers: int = 30
    is_turned_by_others: bool = False


_STREET_GATE: Final = PoseGate(most_shift_m=0.25, least_overlap=0.2)
"""In a street a place tells the pose to some decimetres, and of what a car sees a fifth to a third lies on the model 1.2 m farther on; near 1.00 of it fits."""


def pose_gate_for(settings: VolumeSettings) -> PoseGate:
    """Choose what a pose must fulfil to be believed."""
    return _STREET_GATE if settings.is_of_street else PoseGate()


@dataclass(frozen=True, slots=True, eq=False)
class Lying:
    """Where a view was taken in a piece's axes, and how it lies there."""

    pose: SE3
    fit: Registered


class Piece:
    """A piece. Poses are in its axes, views have depth.

    Attributes:
        volume: its field.
        places: that were seen in it.
        usual_off_sigmas: usual distance of a view from the field, by the noise of its depths there; NaN: none was compared yet.
    """

    def __init__(self, settings: VolumeSettings, threads: int, gate: PoseGate, library: Library | Diagnostic) -> None:
        self.volume, self.places, self.usual_off_sigmas = Volume(settings, threads, library), Places(), float("nan")
        self._library = library if isinstance(library, Library) else None
        self._threads, self._gate = threads, gate

    def laid(self, view: View, believed: SE3, sure_px: float = math.inf) -> Registered:
        """Lay a view's depth against the field as seen from where the camera is believed to be; its pixels have a standard deviation there, px; infinite: nothing is known of it."""
        depth, geometry, step = narrowed(view.depth_m, view.geometry, _ALIGNED_PX)
        # Beyond its reach the field has no partners.
        of = self.volume.settings
        depth, voxel_m = np.where(depth <= of.far_m, depth, np.float32(np.nan)), of.voxel_m
        within = depth[np.isfinite(depth)]
        surface = self.volume.cast(Camera(geometry, depth.shape, believed), depth)
        turn = sure_px / view.geometry.focal_px
        settings = RegistrationSettings(
            most_m=_PARTNER_VOXELS * voxel_m,
            floor_m=_FLOOR_VOXELS * voxel_m,
            noise_per_m=view.noise_per_m,
            geometry=geometry,
            patch_px=view.patch_px / step,
            start_turn=turn,
            start_shift_m=turn * (float(np.median(within)) if len(within) else of.far_m),
            threads=self._threads,
        )
        return registered(depth, surface, settings, self._library)

    def doubt(self, moved: Moved, fit: Registered) -> Weakness:
        """Return why a pose is not believed; NONE: it is."""
        gate, correction = self._gate, fit.start_now.pose()
        is_sure = moved.is_known and moved.inliers >= gate.weak_inliers
        least = gate.sure_overlap if is_sure else gate.least_overlap
        if not np.isfinite(correction).all() or fit.overlap < least:
            return Weakness.LITTLE_OVERLAP if moved.is_known else Weakness.TOO_FAST
        far = np.linalg.norm(correction[3:]) > gate.most_shift_m or np.linalg.norm(correction[:3]) > gate.most_turn
        if far:
            return Weakness.TOO_FAST
        if fit.near < gate.least_near or self.times_usual(fit) > gate.most_off:
            return Weakness.POOR_FIT
        return Weakness.NONE

    def times_usual(self, fit: Registered) -> float:
        """Return how many times farther a view lies from the field than the views before did, each by the noise of its own depths; 0: none was compared yet."""
        usual_m = np.fmax(self.usual_off_sigmas * fit.noise_m, _ROUNDING_VOXELS * self.volume.settings.voxel_m)
        return 0.0 if np.isnan(self.usual_off_sigmas) else float(fit.off_m / usual_m)

    def confirmed(self, view: View, believed: SE3) -> "Lying | None":
        """Lay a view against the field where a place puts it; None: its surface does not lie there.

        A place tells the pose to some centimetres: the surface is cast a second time from where the first one puts the view.
        """
        first = self.laid(view, believed)
        start = believed @ first.start_now
        if not np.isfinite(start.pose()).all():
            return None
        fit = self.laid(view, start)
        whole = (first.start_now @ fit.start_now).pose()
        most_shift_m, most_turn = (_BY_PLACE * most for most in (self._gate.most_shift_m, self._gate.most_turn))
        if np.linalg.norm(whole[3:]) > most_shift_m or np.linalg.norm(whole[:3]) > most_turn:
            return None
        if self.doubt(STANDING, fit) is not Weakness.NONE:
            return None
        return Lying((start @ fit.start_now).exact(), fit)

    def fuse(self, view: View, pose: SE3, fit: Registered | None) -> None:
        """Take a view in."""
        self.volume.fuse(view, pose)
        self.places.remember(view, pose)
        if fit is not None and np.isfinite(fit.off_m / fit.noise_m):
            # Slow, so that one blurred view does not make the next one pass.
            usual, sigmas = self.usual_off_sigmas, fit.off_m / fit.noise_m
            self.usual_off_sigmas = sigmas if np.isnan(usual) else 0.9 * usual + 0.1 * sigmas


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
    """

    def __init__(self, piece: Piece, world_piece: SE3) -> None:
        self.piece, self.world_piece = piece, world_piece
        self.views: list[FragmentView] = []
        self.unconfirmed: list[tuple[SE3, SE3]] = []
