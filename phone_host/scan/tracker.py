"""Where each view was taken, and whether that is sure enough to fuse it: odometry, then the model. Pure.

Odometry says how the camera moved since the last view; the depth is then laid against the model's surface as seen from there. A view that does
not fit there is compared with the places that were seen. A gate judges what comes out. Only what passes it is fused, so a wrong pose never spoils the model. Nothing that a view shows raises an exception.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from phone_host.geometry.se3 import SE3, rotations_of, vectors_of
from phone_host.scan.mat_pose import MatSaid
from phone_host.scan.odometry import Moved, Odometry, OdometrySettings
from phone_host.scan.places import Place, Places
from phone_host.scan.registration import Registered, RegistrationSettings, registered
from phone_host.scan.tracking_words import Tracking, Weakness
from phone_host.scan.view import Camera, View, halved, reduced
from phone_host.scan.volume import Volume
from phone_host.scan.volume_settings import VolumeSettings
from phone_host.stereo.native.library import Library, Missing, native

_ODOMETRY: Final = OdometrySettings(corners=400, apart_px=8, keyframe_share=0.6, keyframe_after=5)
"""The model carries the accuracy; odometry, on half the image, only has to start near it. At VGA that saves 20 of 30 ms of processor time."""

_ODOMETRY_PX: Final = 1.0
"""How far off a view's pixels are after odometry, px: 3 mm at 2 m, as measured on real rooms and streets."""

_ALIGNED_PX: Final = 240
"""Width up to which depth is laid against the model. Twice that costs 11 of 49 ms of processor time at VGA, and gives the same poses."""

_DIRECTIONS: Final = 6
_PARTNER_VOXELS: Final = 10
_FLOOR_VOXELS: Final = 0.3
"""The surface's own noise: what is left of a voxel between its values."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PoseGate:
    """What a pose must fulfil to be believed.

    Attributes:
        most_shift_m: the model may correct odometry by this much, m.
        most_turn: and by this much, rad.
        least_overlap: share of the pixels in view that must have a partner in the model.
        sure_overlap: the same where corners enough agree on the motion: a street seen at 9 degrees gives 0.25.
        least_near: share of the partners that must lie within 3 standard deviations.
        most_off: times the usual mean distance to the model.
        least_depths: share of the pixels that must have a depth.
        weak_inliers: corners that agree; with fewer the pose is weak.
    """

    most_shift_m: float = 0.08
    most_turn: float = 0.105
    least_overlap: float = 0.35
    sure_overlap: float = 0.15
    least_near: float = 0.5
    most_off: float = 2.0
    least_depths: float = 0.02
    weak_inliers: int = 30


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Tracked:
    """What the tracker says of a view.

    Attributes:
        world_camera: where it was taken; where it is lost, as far as is known. The world's axes are the first view's.
        state: how sure that is.
        weakness: why it is not surer.
        moved: what odometry says.
        fit: how the depth lies against the model; None where it was not compared.
        mat: what a mat told; None: there is none, or it was not seen.
    """

    world_camera: SE3
    state: Tracking
    weakness: Weakness
    moved: Moved
    fit: Registered | None
    mat: MatSaid | None = None

    @property
    def is_fused(self) -> bool:
        """Whether the view became part of the model."""
        return self.state is not Tracking.LOST


@dataclass(frozen=True, slots=True, eq=False)
class TrackerState:
    """What a tracker knows beside the model.

    Attributes:
        pose: of the last view.
        usual_off_m: usual distance of a view from the model, m; NaN: none was compared yet.
        places: that were seen.
    """

    pose: SE3
    usual_off_m: float
    places: tuple[Place, ...]


class Tracker:
    """Follows a camera and builds the model.

    Args:
        settings: of the model.
        threads: that compute, >= 1; results do not depend on them.
        gate: what is believed.
        library: computes; None: that of this installation.
    """

    def __init__(
        self,
        settings: VolumeSettings,
        threads: int = 1,
        gate: PoseGate = PoseGate(),
        library: Library | Missing | None = None,
    ) -> None:
        found = native() if library is None else library
        self.volume = Volume(settings, threads, found)
        self._library = found if isinstance(found, Library) else None
        self._threads, self._gate = threads, gate
        self._odometry = Odometry(_ODOMETRY)
        self._pose, self._usual_off_m = SE3.identity(), float("nan")
        self._was_lost = False
        self._places = Places()

    def track(self, view: View) -> Tracked:
        """Take the next view; all have one size and one geometry.

        Returns:
            Where it was taken, and how sure that is.
        """
        moved = self._odometry.step(reduced(view))
        believed = _orthonormal(self._pose @ moved.before_now)
        if not np.isfinite(view.depth_m).mean() >= self._gate.least_depths:
            return self._lost(believed, moved, Weakness.NO_DEPTH, None)
        if self.volume.blocks.count == 0:
            return self._fused(view, believed, moved, Weakness.NONE, None)
        fit = self._laid(view, believed, moved.inliers if moved.is_known else 0)
        doubt = self._doubt(moved, fit)
        if doubt is Weakness.NONE:
            return self._fused(view, _orthonormal(believed @ fit.start_now), moved, self._weakness(moved, fit), fit)
        return self._found_again(view, moved) or self._lost(believed, moved, doubt, fit)

    def kept(self, places_before: int) -> TrackerState:
        """Return what a later tracker needs to go on, beside the model's blocks.

        Args:
            places_before: how many of the places are known there already.
        """
        return TrackerState(self._pose, self._usual_off_m, self._places.since(places_before))

    def go_on(self, state: TrackerState) -> None:
        """Go on where another tracker stood. How the camera has moved since is not known: the next view is looked for like a lost one.

        Args:
            state: of the other one; its places are added to those that are known.
        """
        self._pose, self._usual_off_m, self._was_lost = state.pose, state.usual_off_m, True
        self._places.add(state.places)

    def _found_again(self, view: View, moved: Moved) -> Tracked | None:
        """Look whether a view that does not fit where it was expected shows another place that was seen."""
        place = self._places.recognised(view)
        if place is None:
            return None
        fit = self._laid(view, place.world_camera, place.inliers)
        if self._doubt(moved, fit) is not Weakness.NONE:
            return None
        self._was_lost = True
        weakness = Weakness.NONE if fit.told == _DIRECTIONS else Weakness.FLAT
        return self._fused(view, _orthonormal(place.world_camera @ fit.start_now), moved, weakness, fit)

    def _laid(self, view: View, believed: SE3, inliers: int) -> Registered:
        """Lay a view's depth against the model as seen from where the camera is believed to be, by so many corners."""
        depth, geometry, step = view.depth_m, view.geometry, 1
        while depth.shape[1] > _ALIGNED_PX:
            (depth, geometry), step = halved(depth, geometry), 2 * step
        # Beyond its reach the model has no partners.
        depth = np.where(depth <= self.volume.settings.far_m, depth, np.float32(np.nan))
        voxel_m = self.volume.settings.voxel_m
        surface = self.volume.cast(Camera(geometry, depth.shape, believed), depth)
        turn = _ODOMETRY_PX / view.geometry.focal_px if inliers >= self._gate.weak_inliers else float("inf")
        settings = RegistrationSettings(
            most_m=_PARTNER_VOXELS * voxel_m,
            floor_m=_FLOOR_VOXELS * voxel_m,
            noise_per_m=view.noise_per_m,
            geometry=geometry,
            patch_px=view.patch_px / step,
            start_turn=turn,
            start_shift_m=turn * float(np.nanmedian(depth)),
            threads=self._threads,
        )
        return registered(depth, surface, settings, self._library)

    def _doubt(self, moved: Moved, fit: Registered) -> Weakness:
        """Return why a pose is not believed; NONE: it is."""
        gate, correction = self._gate, fit.start_now.pose()
        is_sure = moved.is_known and moved.inliers >= gate.weak_inliers
        least = gate.sure_overlap if is_sure else gate.least_overlap
        if not np.isfinite(correction).all() or fit.overlap < least:
            return Weakness.LITTLE_OVERLAP if moved.is_known else Weakness.TOO_FAST
        far = np.linalg.norm(correction[3:]) > gate.most_shift_m or np.linalg.norm(correction[:3]) > gate.most_turn
        if far:
            return Weakness.TOO_FAST
        if fit.near < gate.least_near or fit.off_m > gate.most_off * self._usual_off_m:
            return Weakness.POOR_FIT
        return Weakness.NONE

    def _weakness(self, moved: Moved, fit: Registered) -> Weakness:
        """Return what is wrong with a pose that is believed."""
        if moved.inliers < self._gate.weak_inliers:
            return Weakness.FEW_CORNERS
        return Weakness.FLAT if fit.told < _DIRECTIONS else Weakness.NONE

    def _lost(self, pose: SE3, moved: Moved, why: Weakness, fit: Registered | None) -> Tracked:
        """Go on by odometry alone; nothing is fused."""
        self._pose, self._was_lost = pose, True
        return Tracked(world_camera=pose, state=Tracking.LOST, weakness=why, moved=moved, fit=fit)

    def _fused(self, view: View, pose: SE3, moved: Moved, weakness: Weakness, fit: Registered | None) -> Tracked:
        self._pose = pose
        self.volume.fuse(view, pose)
        self._places.remember(view, pose)
        if fit is not None:
            # Slow, so that one blurred view does not make the next one pass.
            usual = self._usual_off_m
            self._usual_off_m = fit.off_m if np.isnan(usual) else 0.9 * usual + 0.1 * fit.off_m
        state = Tracking.TRACKING if weakness is Weakness.NONE else Tracking.WEAK
        if self._was_lost and fit is not None:
            state = Tracking.RELOCALISED
        self._was_lost = False
        return Tracked(world_camera=pose, state=state, weakness=weakness, moved=moved, fit=fit)


def _orthonormal(pose: SE3) -> SE3:
    """Return the pose with an exact rotation: products of many drift away from one."""
    return SE3(rotations_of(vectors_of(pose.R)), pose.t_m)
