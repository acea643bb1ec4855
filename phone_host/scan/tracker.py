"""Where each view was taken, and whether that is sure enough to fuse it: odometry, then the model. Pure.

Odometry says how the camera moved since the last view; the depth is then laid against the model's surface as seen from there. A view that does
not fit there is compared with the places that were seen. A gate judges what comes out. Only what passes it is fused, so a wrong pose never spoils the model.
A camera that is lost goes on in a piece of its own, until one of its views shows a place of the model: then the piece is joined to it
(`pieces`). Where the piece's own surface refuses that place, the next view decides: two in a row whose places agree with the motion between them
belong to the model, and the piece stays apart (decision 0084). Nothing that a view shows raises an exception.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from common.diagnostic import Diagnostic
from phone_host.geometry.se3 import SE3
from phone_host.native.library import Library, native
from phone_host.scan.loop_closing import LoopCloser, LoopSettings
from phone_host.scan.odometry import Moved, Odometry, odometry_for
from phone_host.scan.piece import Found, Joined, Joining, Piece, PoseGate, pose_gate_for
from phone_host.scan.pieces import Pieces
from phone_host.scan.places import Place
from phone_host.scan.registration import Registered
from phone_host.scan.stretches import ClosedLoop, ModelMotion, Placed, WayCertainty
from phone_host.scan.tracked import Tracked
from phone_host.scan.tracking_words import Tracking, Weakness
from phone_host.scan.view import View, reduced
from phone_host.scan.volume import Volume
from phone_host.scan.volume_settings import VolumeSettings

_SURE_SHARE, _SUREST_PX, _LEAST_SURE_PX = 0.1, 0.25, 1.0
"""How far off a view's pixels are after odometry: a share of the way of the corners, px, between the two. On real rooms and streets 1 px, 3 mm at 2 m. A camera at
rest is surer: with 1 px, fifty times the same twelve views wander by 1.9 mm, with 0.25 px by 0.9 mm."""

_SKEWED_PX: Final = 0.5
"""By how much the picture may move between the moments of its left and its right image: less is within a matcher's noise."""

_CONFIRMED: Final = 1
"""Views of a piece that must fit the model where the one that leaves it tells its place by corners alone."""


@dataclass(frozen=True, slots=True, eq=False)
class _Waiting:
    """A view that shows a place of the model and waits for the next one to agree: its number, the view, and how it lies in the model."""

    number: int
    view: View
    found: Found


@dataclass(frozen=True, slots=True, eq=False)
class TrackerState:
    """What a tracker knows beside the model.

    Attributes:
        pose: of the last view.
        usual_off_sigmas: usual distance of a view from the model, by the noise of its depths there; NaN: none was compared yet.
        places: that were seen.
    """

    pose: SE3
    usual_off_sigmas: float
    places: tuple[Place, ...]


class Tracker:
    """Follows a camera and builds the model.

    Args:
        settings: of the model.
        threads: that compute, >= 1; results do not depend on them.
        start: where the first view is taken; None: in the origin.
        gate: what is believed; None: what usually is.
        library: computes; None: that of this installation.
        loops: how loops of a camera that is not lost are closed; None: they are not.
        coarsens: whether the model becomes coarser when its memory is full; else what does not fit is left out.
    """

    def __init__(
        self,
        settings: VolumeSettings,
        threads: int = 1,
        start: SE3 | None = None,
        gate: PoseGate | None = None,
        library: Library | Diagnostic | None = None,
        *,
        loops: LoopSettings | None = None,
        coarsens: bool = False,
    ) -> None:
        found = native() if library is None else library
        self._gate = pose_gate_for(settings) if gate is None else gate
        self._pieces = Pieces(settings, threads, self._gate, found, coarsens=coarsens)
        self._loops = None if loops is None else LoopCloser(loops, self._pieces.model, threads, self._gate, found)
        self._settings = settings
        self._odometry = Odometry(odometry_for(settings))
        self._pose = SE3.identity() if start is None else start  # in the axes of the piece that is tracked
        self._step = SE3.identity()  # takes points of the last view to the one before
        self._was_lost = False
        self._waiting: _Waiting | None = None
        self._is_followed = True  # whether odometry has told every motion since the last view in the model
        self._was_sure = True  # whether odometry has told the last motion: the next one begins where that ends
        self._count = 0
        self._stamp_s = self._usual_s = float("nan")

    @property
    def volume(self) -> Volume:
        """The model."""
        return self._model.volume

    @property
    def closed_loops(self) -> tuple[ClosedLoop, ...]:
        """Loops that have moved the model, or will; none where none are looked for."""
        return () if self._loops is None else self._loops.closed

    @property
    def certainty(self) -> WayCertainty | None:
        """How sure the camera's way is; None where no loops are looked for."""
        return None if self._loops is None else self._loops.certainty

    @property
    def _model(self) -> Piece:
        return self._pieces.model

    def track(self, view: View) -> Tracked:
        """Return where the next view was taken, and how sure that is; all have one size and one geometry."""
        piece, before = self._pieces.active, self._pose
        tracked = self._track(view)
        if self._pieces.active is piece:
            self._step = (before.inverse() @ self._pose).exact()
        return replace(tracked, used=view)

    def _track(self, view: View) -> Tracked:
        self._count += 1
        small = view if self._settings.is_of_street else reduced(view)
        moved = self._odometry.step(small)
        self._is_followed &= self._count == 1 or (self._is_sure(moved) and self._was_sure)
        self._was_sure = self._count == 1 or self._is_sure(moved)
        shift_px = moved.shift_px * view.grey.shape[1] / small.grey.shape[1]
        self._pieces.moved(moved, self._steps_since(view))
        view = self._as_sure_as_timed(view, shift_px)
        believed = (self._pose @ self._motion_since(moved)).exact()
        if view.density < self._gate.least_depths:
            return self._lost(believed, moved, Weakness.NO_DEPTH, None)
        if self.volume.blocks.count == 0:
            return self._fused(view, believed, moved, Weakness.NONE, None)
        active = self._pieces.active
        fit = active.laid(view, believed, self._sure_px(moved, shift_px))
        doubt = active.doubt(moved, fit)
        if doubt is Weakness.LITTLE_OVERLAP and self.volume.left_out and self.volume.is_nearly_full:
            doubt = Weakness.FULL
        if doubt is Weakness.NONE and not self._pieces.is_here(view, believed, fit):
            doubt = Weakness.TOO_FAST
        if doubt is Weakness.NONE:
            pose, weakness = (believed @ fit.start_now).exact(), self._weakness(moved, fit)
            if active is self._model:
                return self._fused(view, pose, moved, weakness, fit)
            return self._apart(view, pose, moved, weakness, fit)
        return self._found_again(view, believed, moved) or self._begun(view, believed, moved, doubt, fit)

    def _motion_since(self, moved: Moved) -> SE3:
        """Return the motion since the last view, as far as it is known: a thing on a turntable goes on turning, elsewhere nothing is known where odometry is lost."""
        return self._step if self._gate.is_turned_by_others and not moved.is_known else moved.before_now

    def settled(self) -> tuple[Placed, ...]:
        """Move the model to where its loops agree best, before it is looked at; return where all views in it were taken then, none: nothing moved."""
        if self._loops is None:
            return ()
        placed = self._loops.settled()
        if placed and self._pieces.active is self._model:
            self._pose = (placed[-1].by @ self._pose).exact()
        self._carry(placed)
        return placed

    def _carry(self, placed: Sequence[Placed]) -> None:
        """Carry what is known in the model's axes along with a model that loops have moved; no views: they have not."""
        if not placed:
            return
        motion = ModelMotion.of(placed)
        self._pieces.model_moved(motion)
        if self._waiting is not None:
            found = self._waiting.found
            self._waiting = replace(self._waiting, found=replace(found, pose=motion.carry(found.pose)))

    def kept(self, places_before: int) -> TrackerState:
        """Return what a later tracker needs to go on, beside the model's blocks."""
        model = self._model
        return TrackerState(
            self._pieces.in_world(self._pose), model.usual_off_sigmas, model.places.since(places_before)
        )

    def go_on(self, state: TrackerState) -> None:
        """Go on where another tracker stood. How the camera has moved since is not known: the next view is looked for like a lost one."""
        self._loops = None  # of what came before there are no copies to build the field again
        self._pose, self._was_lost, self._is_followed = state.pose, True, False
        self._pieces.go_on(state.pose)
        self._model.usual_off_sigmas = state.usual_off_sigmas
        self._model.places.add(state.places)

    def _found_again(self, view: View, believed: SE3, moved: Moved) -> Tracked | None:
        """Look whether a view that does not fit where it was expected shows another place that was seen."""
        found = self._pieces.recognised(view)
        if found is None:
            return None
        if found.piece is self._model:
            # The corners still tell where the view is in the piece that it leaves: its surface has to confirm that.
            joining = self._pieces.join(view, believed, found, least=_CONFIRMED) if self._is_sure(moved) else Joining()
            if joining.is_refused and not self._is_agreed(found, moved):
                self._waiting = _Waiting(self._count, view, found)
                return None
            return self._back(view, found, moved, joining.views)
        self._pieces.go_on_in(found.piece)
        self._is_followed = False  # where that piece is may not be known
        return self._apart(view, found.pose, moved, found.weakness, found.fit)

    def _apart(self, view: View, pose: SE3, moved: Moved, weakness: Weakness, fit: Registered) -> Tracked:
        """Go on in a piece that is not part of the model yet; join it where the view shows a place of the model."""
        self._pieces.followed(pose)
        met = None if weakness is Weakness.FEW_CORNERS else self._pieces.met(view, pose)
        if met is None:
            return self._still_apart(view, pose, moved, weakness, fit)
        is_agreed = self._is_agreed(met, moved)
        joining = Joining()
        if met.fit.is_determined:
            joining = self._pieces.join(view, pose, met)
        elif is_agreed:  # depths that leave a direction open do not tell alone where the piece is
            joining = self._pieces.join(view, pose, met, least=_CONFIRMED, is_strict=True)
        if joining.views or (joining.is_refused and is_agreed):
            return self._back(view, met, moved, joining.views)
        self._waiting = _Waiting(self._count, view, met)
        return self._still_apart(view, pose, moved, weakness, fit)

    def _is_agreed(self, found: Found, moved: Moved) -> bool:
        """Return whether the view before showed a place of the model, too, from where odometry has led to this one."""
        before = self._waiting
        if before is None or before.number != self._count - 1:
            return False
        if not self._is_sure(moved):
            return False
        apart = (moved.before_now.inverse() @ before.found.pose.inverse() @ found.pose).pose()
        gate = self._gate
        return bool(np.linalg.norm(apart[3:]) <= gate.most_shift_m and np.linalg.norm(apart[:3]) <= gate.most_turn)

    def _back(self, view: View, found: Found, moved: Moved, joined: tuple[Joined, ...]) -> Tracked:
        """Go on in the model with a view that shows a place of it, and with the view before that has waited for it."""
        before = self._waiting
        if before is not None and self._is_agreed(found, moved) and before.number not in {one.number for one in joined}:
            self._pieces.leave(before.number)
            self._pieces.fuse(before.view, before.found.pose, before.found.fit)
            weakness = before.found.weakness
            joined = (*joined, Joined(before.number, before.found.pose, Tracking.RELOCALISED, weakness))
        self._pieces.go_on_in(found.piece)
        self._was_lost = True
        return self._fused(view, found.pose, moved, found.weakness, found.fit, joined=joined)

    def _still_apart(self, view: View, pose: SE3, moved: Moved, weakness: Weakness, fit: Registered) -> Tracked:
        self._pieces.fuse_apart(self._count, view, pose, weakness, fit)
        self._keep(view)
        return self._lost(pose, moved, Weakness.AMBIGUOUS if self._pieces.is_ambiguous else Weakness.APART, fit)

    def _begun(self, view: View, believed: SE3, moved: Moved, why: Weakness, fit: Registered) -> Tracked:
        """Begin a piece with a view that belongs to none."""
        why = Weakness.AMBIGUOUS if self._pieces.is_ambiguous else why
        pose = self._pieces.begin(self._count, view, believed, why)
        self._keep(view)
        return self._lost(believed if pose is None else pose, moved, why, fit)

    def _steps_since(self, view: View) -> float:
        """Return how many times longer than usual the last view lies back, >= 1."""
        since_s = view.stamp_s - self._stamp_s
        if not since_s > 0:
            return 1.0
        if math.isnan(self._usual_s):
            self._usual_s = since_s
        steps = since_s / self._usual_s
        self._usual_s = 0.9 * self._usual_s + 0.1 * min(since_s, 2 * self._usual_s)
        return max(steps, 1.0)

    def _as_sure_as_timed(self, view: View, shift_px: float) -> View:
        """Return a view with the noise that it gets where its images were not taken at the same moment and the camera moved."""
        since_s, self._stamp_s = view.stamp_s - self._stamp_s, view.stamp_s
        if not (view.skew_s and since_s > 0):
            return view
        skewed_px = abs(view.skew_s) / since_s * shift_px
        return replace(view, noise_px=math.hypot(view.noise_px, skewed_px)) if skewed_px > _SKEWED_PX else view

    def _sure_px(self, moved: Moved, shift_px: float) -> float:
        """Return the standard deviation of the view's pixels where odometry puts it."""
        if not self._is_sure(moved):
            return math.inf
        if self._was_lost:  # the way since then adds up
            return _LEAST_SURE_PX
        return min(max(_SURE_SHARE * shift_px, _SUREST_PX), _LEAST_SURE_PX)

    def _is_sure(self, moved: Moved) -> bool:
        """Return whether enough corners agree on a motion."""
        return moved.is_known and moved.inliers >= self._gate.weak_inliers

    def _weakness(self, moved: Moved, fit: Registered) -> Weakness:
        """Return what is wrong with a pose that is believed."""
        if moved.inliers < self._gate.weak_inliers:
            return Weakness.FEW_CORNERS
        return Weakness.NONE if fit.is_determined else Weakness.FLAT

    def _lost(self, pose: SE3, moved: Moved, why: Weakness, fit: Registered | None) -> Tracked:
        """Go on; the model stays as it is."""
        self._pose, self._was_lost = pose, True
        world = self._pieces.in_world(pose)
        state, is_followed = Tracking.LOST, self._is_followed
        return Tracked(world_camera=world, state=state, weakness=why, moved=moved, fit=fit, is_followed=is_followed)

    def _fused(
        self,
        view: View,
        pose: SE3,
        moved: Moved,
        weakness: Weakness,
        fit: Registered | None,
        *,
        joined: tuple[Joined, ...] = (),
    ) -> Tracked:
        self._pieces.fuse(view, pose, fit)
        state = Tracking.TRACKING if weakness is Weakness.NONE else Tracking.WEAK
        if self._was_lost and fit is not None:
            state = Tracking.RELOCALISED
        placed = self._looped(view, pose, joined)
        self._was_lost, self._pose = False, placed[-1].world_camera if placed else pose
        self._is_followed = True
        self._carry(placed)
        return Tracked(
            world_camera=self._pose,
            state=state,
            weakness=weakness,
            moved=moved,
            fit=fit,
            joined=joined,
            moved_views=placed,
        )

    def _looped(self, view: View, pose: SE3, joined: tuple[Joined, ...]) -> tuple[Placed, ...]:
        """Look whether a view in the model closes a loop; return where all views are then, if that has moved them."""
        if self._loops is None:
            return ()
        if joined:
            self._loops.joined([Placed(each.number, each.world_camera) for each in joined])
        self._keep(view)
        return self._loops.fused(self._count, view, pose, was_lost=self._was_lost)

    def _keep(self, view: View) -> None:
        if self._loops is not None:
            self._loops.keep(self._count, view, self._settings.most_bytes - self._pieces.held_bytes)
