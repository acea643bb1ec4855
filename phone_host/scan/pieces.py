"""The pieces of a scan, and what becomes of them: the model, and those whose place against it is not known yet. Pure.

A camera that is lost begins a piece. A view that belongs to one and shows a place of another is a loop between the two. Pieces that loops connect
with the model are put where all loops agree best (`graph`), and taken into its field; they move as a whole and are never warped.
"""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from phone_host.geometry.se3 import SE3
from phone_host.scan.blocks import BLOCK_BYTES
from phone_host.scan.graph import Loop, connected, settled
from phone_host.scan.piece import STANDING, Piece, PoseGate
from phone_host.scan.registration import Registered
from phone_host.scan.tracking_words import Tracking, Weakness
from phone_host.scan.view import Camera, View, half_view
from phone_host.scan.volume_settings import VolumeSettings
from phone_host.stereo.native.library import Library, Missing

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
        is_refused: whether the piece's own surface does not fit the model where it would lie.
    """

    views: tuple[Joined, ...] = ()
    is_refused: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """A piece to which a view belongs, where it was taken in its axes, and how it lies there."""

    piece: Piece
    pose: SE3
    fit: Registered


@dataclass(frozen=True, slots=True, eq=False)
class _Fused:
    """A view of a piece: its number, where it was taken in the piece's axes, and why that is not surer."""

    number: int
    pose: SE3
    weakness: Weakness


class _Apart:
    """A piece, where it is believed to be in the world, and its views."""

    def __init__(self, piece: Piece, world_piece: SE3) -> None:
        self.piece, self.world_piece = piece, world_piece
        self.views: list[_Fused] = []


class Pieces:
    """All pieces of a scan.

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
        library: Library | Missing,
        *,
        coarsens: bool = False,
    ) -> None:
        self._settings, self._threads, self._gate, self._library = settings, threads, gate, library
        self._coarsens = coarsens
        self.model = Piece(settings, threads, gate, library)
        self._apart: dict[int, _Apart] = {}
        self._loops: list[Loop] = []
        self._active, self._next = _MODEL, _MODEL + 1

    @property
    def active(self) -> Piece:
        """The piece that is tracked."""
        return self.model if self._active == _MODEL else self._apart[self._active].piece

    @property
    def held_bytes(self) -> int:
        """Memory of all fields."""
        volumes = [self.model.volume, *(of.piece.volume for of in self._apart.values())]
        return sum(volume.blocks.room for volume in volumes) * BLOCK_BYTES

    def in_world(self, pose: SE3) -> SE3:
        """Return a pose in the axes of the piece that is tracked, in the world's; where that is not known, as far as odometry tells."""
        return pose if self._active == _MODEL else self._apart[self._active].world_piece @ pose

    def begin(self, number: int, view: View, believed: SE3, why: Weakness) -> SE3 | None:
        """Begin a piece.

        Args:
            number: of its first view.
            view: the first one.
            believed: where it was taken, in the axes of the piece that is tracked.
            why: it belongs to no piece.

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
        self._apart[self._active] = _Apart(piece, world)
        self.fuse_apart(number, view, SE3.identity(), why, None)
        return SE3.identity()

    def fuse_apart(self, number: int, view: View, pose: SE3, weakness: Weakness, fit: Registered | None) -> None:
        """Take a view into the piece that is tracked, which is not the model.

        Args:
            number: of the view.
            view: with depth.
            pose: where it was taken, in the piece's axes.
            weakness: why that is not surer.
            fit: how it lay there before; None: it is the first.
        """
        of = self._apart[self._active]
        of.piece.fuse(view, pose, fit)
        of.views.append(_Fused(number, pose, weakness))

    def fuse(self, view: View, pose: SE3, fit: Registered | None) -> None:
        """Take a view into the model, which is tracked. Where it needs the memory of the pieces beside it, they are given up, the one with the fewest views first.

        Args:
            view: with depth.
            pose: where it was taken.
            fit: how it lay there before; None: it is the first.
        """
        volume, left_out = self.model.volume, self.model.volume.left_out
        self.model.fuse(view, pose, fit)
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

    def recognised(self, view: View) -> Found | None:
        """Find a piece, the model first, one of whose places a view shows, and lay it there."""
        for piece in (self.model, *(of.piece for of in self._apart.values())):
            found = self._found_in(piece, view)
            if found is not None:
                return found
        return None

    def met(self, view: View, pose: SE3) -> Found | None:
        """Find where a view of the piece that is tracked belongs in the model.

        Where it belongs to another piece, that loop is remembered.

        Args:
            view: with depth.
            pose: where it was taken, in the piece's axes.
        """
        found = self._found_in(self.model, view)
        others = [number for number in self._apart if number != self._active]
        for number in others if found is None else []:
            other = self._found_in(self._apart[number].piece, view)
            if other is not None:
                self._loops.append(self._loop(number, other.pose @ pose.inverse()))
        return found

    def leave(self, number: int) -> None:
        """Track the model from now on: a view of the piece that was tracked turned out to belong there, and the piece does not.

        Args:
            number: of the view.
        """
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
            least: earlier views of the piece that must fit the model, too.
            is_strict: whether a single view of the piece that does not fit refuses; else as many must as fit, and one more.

        Returns:
            Their views; none: the piece stays apart, or the model is tracked already.
        """
        if self._active == _MODEL:
            return Joining()
        loop = self._loop(_MODEL, met.pose @ pose.inverse())
        others, refused = self._also(view, loop)
        is_refused = refused > (0 if is_strict else len(others))
        if is_refused or len(others) < least:
            return Joining(is_refused=is_refused)
        self._loops += [loop, *others]
        self._start(loop)
        poses = settled(
            {_MODEL: SE3.identity()} | {at: of.world_piece for at, of in self._apart.items()}, self._loops, _MODEL
        )
        joined: list[Joined] = []
        for number in sorted(connected(self._loops, _MODEL) - {_MODEL}):
            joined += self._taken_in(self._apart[number], poses[number])
            self._give_up(number)
        self._active = _MODEL
        return Joining(tuple(sorted(joined, key=lambda each: each.number)))

    def _also(self, view: View, loop: Loop) -> tuple[list[Loop], int]:
        """Lay the piece's own surface, as its views saw it, against the model; return the loops of the views that fit, and how many lie there and do not."""
        of = self._apart[self._active]
        while view.grey.shape[1] > _SMALL_PX:
            view = half_view(view)
        loops, refused = [], 0
        for seen in of.views[:: max(len(of.views) // _ALSO, 1)]:
            camera = Camera(view.geometry, view.grey.shape, seen.pose)
            shown = replace(view, depth_m=np.ascontiguousarray(of.piece.volume.cast(camera).points_m[..., 2]))
            if not np.isfinite(shown.depth_m).mean() >= self._gate.least_depths:
                continue
            start = loop.here_there @ seen.pose
            fit = self.model.laid(shown, start)
            if fit.overlap < self._gate.least_overlap:
                continue
            if self.model.doubt(STANDING, fit) is Weakness.NONE:
                loops.append(self._loop(_MODEL, start @ fit.start_now @ seen.pose.inverse()))
            else:
                refused += 1
        return loops, refused

    def _loop(self, here: int, here_active: SE3) -> Loop:
        return Loop(here=here, there=self._active, here_there=here_active, turn=_LOOP_TURN, shift_m=_LOOP_SHIFT_M)

    def _start(self, first: Loop) -> None:
        """Put the pieces where the loops, one after another, put them: the graph goes on from there."""
        self._apart[first.there].world_piece, known, waiting = first.here_there, {_MODEL, first.there}, [first.there]
        while waiting:
            at = waiting.pop()
            for loop in self._loops:
                if loop.here == at and loop.there not in known:
                    other, there = loop.there, self._apart[at].world_piece @ loop.here_there
                elif loop.there == at and loop.here not in known:
                    other, there = loop.here, self._apart[at].world_piece @ loop.here_there.inverse()
                else:
                    continue
                self._apart[other].world_piece = there
                known.add(other)
                waiting.append(other)

    def _coarsen(self) -> None:
        """Make all fields coarser: a piece is averaged into the model, so their voxels are as wide."""
        for piece in (self.model, *(of.piece for of in self._apart.values())):
            piece.volume.coarsen()
        self._settings = self._settings.coarser

    def _taken_in(self, of: _Apart, world_piece: SE3) -> list[Joined]:
        self.model.volume.take_in(of.piece.volume, world_piece)
        self.model.places.add(of.piece.places.moved(world_piece))
        result = []
        for view in of.views:
            exact = (world_piece @ view.pose).exact()
            state = Tracking.TRACKING if view.weakness is Weakness.NONE else Tracking.WEAK
            result.append(Joined(view.number, exact, state, view.weakness))
        return result

    def _found_in(self, piece: Piece, view: View) -> Found | None:
        place = piece.places.recognised(view)
        if place is None:
            return None
        lying = piece.confirmed(view, place.world_camera)
        return None if lying is None else Found(piece, lying.pose, lying.fit)

    def _give_up_one(self) -> None:
        self._give_up(min(self._apart, key=lambda each: (len(self._apart[each].views), each)))

    def _give_up(self, number: int) -> None:
        del self._apart[number]
        self._loops = [loop for loop in self._loops if number not in (loop.here, loop.there)]
