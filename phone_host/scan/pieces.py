"""The pieces of a scan, and what becomes of them: the model, and those whose place against it is not known yet. Pure.

A camera that is lost begins a piece. A view that belongs to one and shows a place of another is a loop between the two. Pieces that loops connect
with the model are put where all loops agree best (`graph`), and taken into its field; they move as a whole and are never warped.
"""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from common.diagnostic import Diagnostic
from phone_host.geometry.se3 import SE3
from phone_host.native.library import Library
from phone_host.scan.blocks import BLOCK_BYTES
from phone_host.scan.graph import Loop, chained, connected, without_outliers
from phone_host.scan.odometry import Moved
from phone_host.scan.piece import STANDING, Found, FragmentView, Joined, Joining, MapFragment, Piece, PoseGate
from phone_host.scan.registration import Registered
from phone_host.scan.relocalisation import (
    Belief,
    Evidence,
    PoseSupport,
    Sighting,
    UsualStep,
    are_independent,
    pose_support,
    sighted,
)
from phone_host.scan.stretches import ModelMotion
from phone_host.scan.tracking_words import Tracking, Weakness
from phone_host.scan.view import Camera, View, half_view
from phone_host.scan.volume_settings import VolumeSettings

_MODEL: Final = 0
_MOST_APART: Final = 4
"""Pieces beside the model that are kept: of more, the one with the fewest views is given up."""

_LEAST_SHARE: Final = 0.05
"""Of the model's memory that must be left for a piece."""

_ALSO: Final = 8
"""Views of a piece that are laid against the model before it is joined."""

_SMALL_PX: Final = 320
_LOOP_SHIFT_M: Final = 0.01
_LOOP_TURN: Final = 0.006
"""Standard deviations of a loop, m and rad: two registrations, each some 5 mm and 0.2 degrees off on real rooms."""

_MOST_SIGMAS: Final = 12.0
"""Of a loop that contradicts the others after they were settled: pieces are rigid, and true loops of one that drifted by 0.1 m are as far off."""

_MOST_SIGHTINGS: Final = 32
"""Of a piece that wait for a second one which agrees."""


@dataclass(frozen=True, slots=True, eq=False)
class _Surface:
    """How a piece's surface lies on the model: where that puts the piece, whether it fits, and whether it confirms that.

    What a surface can be slid along takes up a part of its error. One that leaves a direction open confirms nothing unless it lies as near as views usually do.
    """

    model_piece: SE3
    is_lying: bool
    is_confirming: bool


class Pieces:
    """All pieces of a scan. Poses are in the axes of the piece that is tracked, unless another one is named; views have depth.

    Args:
        settings: of the model.
        threads: that compute, >= 1; results do not depend on them.
        gate: what is believed.
        library: computes.
        coarsens: whether voxels become twice as wide when the memory is full; else what does not fit is left out.
    """

    def __init__(
        self,
        settings: VolumeSettings,
        threads: int,
        gate: PoseGate,
        library: Library | Diagnostic,
        *,
        coarsens: bool = False,
    ) -> None:
        self._settings, self._threads, self._gate, self._library = settings, threads, gate, library
        self._coarsens = coarsens
        self.model = Piece(settings, threads, gate, library)
        self._apart: dict[int, MapFragment] = {}
        self._loops: list[Loop] = []
        self._active, self._next = _MODEL, _MODEL + 1
        self._beliefs = {_MODEL: Belief.at(SE3.identity())}  # in the axes of each piece
        self._last: dict[
            int, tuple[SE3, dict[int, Belief]]
        ] = {}  # where the camera was last in each piece, and what was believed then
        self._usual = UsualStep()
        self.is_ambiguous = False  # whether the last view shows a place, but not surely
        self._is_held = False  # whether a plain surface alone holds the last view: that tells no motion along it

    @property
    def active(self) -> Piece:
        """The piece that is tracked."""
        return self._piece(self._active)

    @property
    def held_bytes(self) -> int:
        """Memory of all fields."""
        volumes = [self.model.volume, *(of.piece.volume for of in self._apart.values())]
        return sum(volume.blocks.room for volume in volumes) * BLOCK_BYTES

    def in_world(self, pose: SE3) -> SE3:
        """Return a pose in the axes of the piece that is tracked, in the world's; where that is not known, as far as odometry tells."""
        return pose if self._active == _MODEL else self._apart[self._active].world_piece @ pose

    def moved(self, moved: Moved, views: float) -> None:
        """Note how the camera has moved, while so many of the usual steps may have passed, >= 1."""
        self.is_ambiguous = self._is_held = False
        is_followed = moved.is_known and moved.inliers >= self._gate.weak_inliers
        if is_followed:
            self._usual = self._usual.after(moved.before_now)
        for number, belief in self._beliefs.items():
            self._beliefs[number] = belief.moved(moved.before_now) if is_followed else belief.jumped(self._usual, views)

    def followed(self, pose: SE3) -> None:
        """Note where the camera is in the piece that is tracked: that tells how it has moved since it was last there, also where odometry does not.

        A plain surface that only holds the view tells neither.
        """
        if self._is_held:
            return
        before, beliefs = self._last.get(self._active, (pose, {}))
        step = (before.inverse() @ pose).exact()
        for number in beliefs.keys() & self._beliefs.keys() - {self._active}:
            self._beliefs[number] = beliefs[number].moved(step)
        self._beliefs[self._active] = Belief.at(pose)

    def _note(self, pose: SE3) -> None:
        if self._is_held:
            return
        self._beliefs[self._active] = Belief.at(pose)
        self._last[self._active] = pose, dict(self._beliefs)

    def go_on(self, pose: SE3) -> None:
        """Note that the camera was last at a pose in the model, and that nobody knows what has happened since."""
        self._beliefs = {_MODEL: replace(Belief.at(pose).jumped(UsualStep()), is_open=True)}

    def is_here(self, view: View, believed: SE3, fit: Registered) -> bool:
        """Return whether a view that fits where it is expected in the piece that is tracked may be taken into it there."""
        belief = self._belief(self._active)
        if not belief.is_broken:
            return True
        support = pose_support(self.active, view, belief, believed @ fit.start_now, fit.told)
        self._is_held = support is PoseSupport.SURFACE
        return support is not PoseSupport.NONE

    def begin(self, number: int, view: View, believed: SE3, why: Weakness) -> SE3 | None:
        """Begin a piece.

        Returns:
            The pose in the axes of the piece that is tracked now, the new one; None: there is no memory for another, and nothing has changed.
        """
        world = self.in_world(believed)
        while len(self._apart) >= _MOST_APART:
            self._give_up_one()
        room = self._settings.most_bytes - self.held_bytes
        if room < _LEAST_SHARE * self._settings.most_bytes:
            if self._active in {_MODEL, *self._apart}:
                return None
            self._active = _MODEL  # the piece that was tracked is one of those that were given up
            return world
        piece = Piece(replace(self._settings, most_bytes=room), self._threads, self._gate, self._library)
        self._active, self._next = self._next, self._next + 1
        self._apart[self._active] = MapFragment(piece, world)
        self.fuse_apart(number, view, SE3.identity(), why, None)
        return SE3.identity()

    def fuse_apart(self, number: int, view: View, pose: SE3, weakness: Weakness, fit: Registered | None) -> None:
        """Take a view into the piece that is tracked, which is not the model."""
        of = self._apart[self._active]
        of.piece.fuse(view, pose, fit)
        self._note(pose)
        of.views.append(FragmentView(number, pose, weakness))

    def fuse(self, view: View, pose: SE3, fit: Registered | None) -> None:
        """Take a view into the model, which is tracked. Where it needs the memory of the pieces beside it, they are given up, the one with the fewest views first."""
        volume, left_out = self.model.volume, self.model.volume.left_out
        self.model.fuse(view, pose, fit)
        self.followed(pose)
        self._note(pose)
        while self._coarsens and volume.is_nearly_full:
            self._coarsen()
            if volume.left_out > left_out:  # what the view showed beyond the memory has room now
                volume.left_out = left_out
                volume.fuse(view, pose)
        while self._apart and self.held_bytes > self._settings.most_bytes:
            self._give_up_one()

    def go_on_in(self, piece: Piece) -> None:
        """Track in another piece from now on."""
        self._active = next((number for number, of in self._apart.items() if of.piece is piece), _MODEL)

    def model_moved(self, motion: ModelMotion) -> None:
        """Carry everything that is known in the model's axes along with a model that loops have moved.

        Loops between fragments are not in these axes, and none with the model outlasts `join`.
        """

        def carried(beliefs: dict[int, Belief]) -> dict[int, Belief]:
            of = beliefs.get(_MODEL)
            return beliefs if of is None else {**beliefs, _MODEL: replace(of, anchor=motion.carry(of.anchor))}

        self._beliefs = carried(self._beliefs)
        self._last = {
            number: (motion.carry(pose) if number == _MODEL else pose, carried(beliefs))
            for number, (pose, beliefs) in self._last.items()
        }
        for of in self._apart.values():
            of.world_piece = motion.carry(of.world_piece)
            of.unconfirmed = [(here, motion.carry(there)) for here, there in of.unconfirmed]

    def recognised(self, view: View) -> Found | None:
        """Find a piece, one of whose places a view shows, and lay it there: first that which is tracked, where the camera is known best, then the model."""
        known_best = _MODEL if self._gate.is_turned_by_others else self._active
        for number in dict.fromkeys((known_best, _MODEL, *self._apart)):
            found = self._sighted(number, view)
            if found.evidence is Evidence.BELIEVED and found.lying is not None:
                return Found(self._piece(number), found.lying.pose, found.lying.fit)
        return None

    def met(self, view: View, pose: SE3) -> Found | None:
        """Find where a view of the piece that is tracked belongs in the model.

        Where it belongs to another piece, that loop is remembered.
        """
        found = self._sighted(_MODEL, view)
        if found.lying is not None and (found.evidence is Evidence.BELIEVED or self._is_seen_twice(found, pose)):
            return Found(self.model, found.lying.pose, found.lying.fit)
        for number in [number for number in self._apart if number != self._active]:
            other = self._sighted(number, view)
            if other.evidence is Evidence.BELIEVED and other.lying is not None:
                self._loops.append(self._loop(number, other.lying.pose @ pose.inverse()))
        return None

    def _is_seen_twice(self, found: Sighting, pose: SE3) -> bool:
        """Return whether a view that shows the model after a long loss agrees with an independent one before it."""
        if found.evidence is not Evidence.UNCONFIRMED or found.lying is None:
            return False
        of, there = self._apart[self._active], found.lying.pose
        for before, was_there in of.unconfirmed:
            expected = Belief.at(was_there).moved(before.inverse() @ pose)
            if are_independent(before, pose) and expected.admits(there, self._settings.voxel_m):
                return True
        of.unconfirmed = [*of.unconfirmed, (pose, there)][-_MOST_SIGHTINGS:]
        return False

    def leave(self, number: int) -> None:
        """Track the model from now on: a view of the piece that was tracked turned out to belong there, and the piece does not."""
        of = self._apart.get(self._active)
        if of is not None:
            of.views = [each for each in of.views if each.number != number]
        self._active = _MODEL

    def join(self, view: View, pose: SE3, met: Found, *, least: int = 0, is_strict: bool = False) -> Joining:
        """Take the piece that is tracked, and those connected with it, into the model; that is tracked from now on.

        Args:
            view: that belongs to both.
            pose: where it was taken, in the piece's axes.
            met: the same in the model's.
            least: surfaces of the piece that must confirm where it lies.
            is_strict: whether a single view of the piece that does not fit refuses; else as many must as fit, and one more.

        Returns:
            Their views; none: the piece stays apart, or the model is tracked already.
        """
        if self._active == _MODEL:
            return Joining()
        loop = self._loop(_MODEL, met.pose @ pose.inverse())
        also = self._also(view, loop)
        others = [self._loop(_MODEL, each.model_piece) for each in also if each.is_lying]
        is_refused = len(also) - len(others) > (0 if is_strict else len(others))
        confirming = sum(each.is_confirming for each in also)
        if is_refused or confirming < least:
            return Joining(is_refused=is_refused or confirming < len(others))
        loops = [loop, *self._loops, *others]
        believed = {_MODEL: SE3.identity()} | {at: of.world_piece for at, of in self._apart.items()}
        graph = without_outliers(chained(believed, loops, _MODEL), loops, _MODEL, _MOST_SIGMAS)
        if loop not in graph.loops:
            return Joining()
        self._loops = list(graph.loops)
        joined: list[Joined] = []
        for number in sorted(connected(self._loops, _MODEL) - {_MODEL}):
            joined += self._taken_in(self._apart[number], graph.poses[number])
            self._give_up(number)
        self._active = _MODEL
        return Joining(tuple(sorted(joined, key=lambda each: each.number)))

    def _also(self, view: View, loop: Loop) -> list[_Surface]:
        """Lay the piece's own surface, as its views saw it, against the model; return how those lie that show the same."""
        of = self._apart[self._active]
        while view.grey.shape[1] > _SMALL_PX:
            view = half_view(view)
        surfaces = []
        for seen in of.views[:: max(len(of.views) // _ALSO, 1)]:
            camera = Camera(view.geometry, view.grey.shape, seen.pose)
            shown = replace(view, depth_m=np.ascontiguousarray(of.piece.volume.cast(camera).points_m[..., 2]))
            if not np.isfinite(shown.depth_m).mean() >= self._gate.least_depths:
                continue
            start = loop.here_there @ seen.pose
            fit = self.model.laid(shown, start)
            if fit.overlap >= self._gate.least_overlap:
                is_lying = self.model.doubt(STANDING, fit) is Weakness.NONE
                is_tight = fit.is_determined or 0 < self.model.times_usual(fit) <= 1
                model_piece = start @ fit.start_now @ seen.pose.inverse()
                surfaces.append(_Surface(model_piece, is_lying, is_lying and is_tight))
        return surfaces

    def _loop(self, here: int, here_active: SE3) -> Loop:
        return Loop(here=here, there=self._active, here_there=here_active, turn=_LOOP_TURN, shift_m=_LOOP_SHIFT_M)

    def _coarsen(self) -> None:
        """Make all fields coarser: a piece is averaged into the model, so their voxels are as wide."""
        for piece in (self.model, *(of.piece for of in self._apart.values())):
            piece.volume.coarsen()
        self._settings = self._settings.coarser

    def _taken_in(self, of: MapFragment, world_piece: SE3) -> list[Joined]:
        self.model.volume.take_in(of.piece.volume, world_piece)
        self.model.places.add(of.piece.places.moved(world_piece))
        result = []
        for view in of.views:
            exact = (world_piece @ view.pose).exact()
            state = Tracking.TRACKING if view.weakness is Weakness.NONE else Tracking.WEAK
            result.append(Joined(view.number, exact, state, view.weakness))
        return result

    def _sighted(self, number: int, view: View) -> Sighting:
        found = sighted(self._piece(number), view, self._belief(number))
        self.is_ambiguous |= found.evidence in {Evidence.AMBIGUOUS, Evidence.UNCONFIRMED}
        return found

    def _belief(self, number: int) -> Belief:
        belief = self._beliefs[number]
        return replace(belief, is_open=True, is_broken=False) if self._gate.is_turned_by_others else belief

    def _piece(self, number: int) -> Piece:
        return self.model if number == _MODEL else self._apart[number].piece

    def _give_up_one(self) -> None:
        self._give_up(min(self._apart, key=lambda each: (len(self._apart[each].views), each)))

    def _give_up(self, number: int) -> None:
        del self._apart[number], self._beliefs[number], self._last[number]
        self._loops = [loop for loop in self._loops if number not in (loop.here, loop.there)]
