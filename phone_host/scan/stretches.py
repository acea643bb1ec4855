"""A model as stretches of the camera's way: each is rigid, and tied to others by tracking and by loops. Pure.

A stretch is some views that follow each other. Within it tracking is believed; between two of them it has an error that grows with the way. A loop
says where one stretch is as seen from another that was seen long before. All ties together put the stretches (`graph`); none is ever warped.
"""

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from phone_host.geometry.se3 import SE3
from phone_host.scan.graph import Loop, settled

_VIEWS: Final = 10
"""Of a stretch: two seconds at five pairs a second. On a room's clip the drift within so many is 3 mm; with 20 a third of the loops were found."""

_WAY_SHARE, _TURN_SHARE = 0.06, 0.02
_LEAST_VOXELS, _LEAST_TURN = 0.1, 0.0005
"""Standard deviations of tracking along a stretch: shares of its way and of its turn, and voxels and rad at least. On a room's clip the end is off by
2.5 % of the way and half a percent of the turn; with half of these shares a third of the loops were looked for, and the trajectory was worse."""

_LOOP_VOXELS, _LOOP_TURN = 1.0, 0.006
"""Standard deviations of a loop, voxels and rad: with a room's voxels of 10 mm, those of a loop between pieces."""

_BELIEVED_SHARE: Final = 0.05
"""Of the way and of the turn since then by which tracking may be off, beside the loop's own error: more is another place that looks alike."""

_SIGMAS: Final = 4.0
_UNSURE: Final = 0.5
"""Of a loop's variance: with less, two loops say no more than tracking does."""

_LOOPS: Final = 3
"""Of a stretch: more tell nothing new."""


@dataclass(frozen=True, slots=True, eq=False)
class Placed:
    """A view, and where it was taken.

    Attributes:
        number: of the view.
        world_camera: where.
    """

    number: int
    world_camera: SE3


@dataclass(frozen=True, slots=True)
class _Way:
    """How far the camera has gone and turned, m and rad, and the variances of tracking along that."""

    length_m: float = 0.0
    turned: float = 0.0
    shift_variance: float = 0.0
    turn_variance: float = 0.0


class _Stretch:
    """Where its first view was taken, its views in its own axes, and the way until its beginning."""

    def __init__(self, world_stretch: SE3, way: _Way) -> None:
        self.world_stretch, self.way = world_stretch, way
        self.views: list[Placed] = []


class Stretches:
    """All stretches of a model.

    Args:
        voxel_m: of the model, m: about as wide as views are off a surface.
    """

    def __init__(self, voxel_m: float) -> None:
        self._loop_shift_m, self._least_shift_m = _LOOP_VOXELS * voxel_m, _LEAST_VOXELS * voxel_m
        self._all: list[_Stretch] = []
        self._ties: list[Loop] = []
        self._loops: list[Loop] = []
        self._way = _Way()
        self._last: SE3 | None = None

    @property
    def count(self) -> int:
        """How many there are."""
        return len(self._all)

    def views(self, number: int) -> list[Placed]:
        """Return a stretch's views, and where they were taken in the world."""
        of = self._all[number]
        return [Placed(view.number, (of.world_stretch @ view.world_camera).exact()) for view in of.views]

    def add(self, view: Placed, beside: int | None = None) -> None:
        """Take the next view, into the last stretch or a new one.

        Args:
            view: where it was taken.
            beside: the stretch by which it was found again after the camera was lost; None: it was not lost.
        """
        self._go(view.world_camera)
        if not self._all or beside is not None or len(self._all[-1].views) >= _VIEWS:
            self._begin(view.world_camera, self.count - 1 if beside is None else beside, is_loop=beside is not None)
        of = self._all[-1]
        of.views.append(Placed(view.number, of.world_stretch.inverse() @ view.world_camera))

    def add_piece(self, views: list[Placed], beside: int) -> None:
        """Take a piece that was joined, as a stretch of its own.

        Args:
            views: its views, where they were taken in the world.
            beside: the stretch to which it was joined.
        """
        self._begin(views[0].world_camera, beside, is_loop=True)
        of = self._all[-1]
        of.views = [Placed(view.number, of.world_stretch.inverse() @ view.world_camera) for view in views]

    def older(self) -> list[int]:
        """Return the stretches with which the last one may close a loop: not its neighbour; tracking since them and the last loop is less sure than two loops."""
        last = self.count - 1
        if sum(loop.there == last for loop in self._loops) >= _LOOPS:
            return []
        known = max((loop.there for loop in self._loops if loop.there < last), default=0)
        return [number for number in range(last - 1) if self._is_unsure(self._all[max(number, known)].way)]

    def _is_unsure(self, since: _Way) -> bool:
        now = self._all[-1].way
        shift, turn = now.shift_variance - since.shift_variance, now.turn_variance - since.turn_variance
        return shift > _UNSURE * self._loop_shift_m**2 or turn > _UNSURE * _LOOP_TURN**2

    def close(self, here: int, tracked: SE3, found: SE3) -> bool:
        """Note a loop between an older stretch and the last one.

        Args:
            here: the older one.
            tracked: where a view of the last one was taken as tracking has it.
            found: where it was taken as seen from the older one.

        Returns:
            Whether it is believed: tracking cannot be so far off that a place which looks alike would be another one.
        """
        of, last = self._all[here], self._all[-1]
        off = (tracked.inverse() @ found).pose()
        shift_m = _SIGMAS * self._loop_shift_m + _BELIEVED_SHARE * (self._way.length_m - of.way.length_m)
        turn = _SIGMAS * _LOOP_TURN + _BELIEVED_SHARE * (self._way.turned - of.way.turned)
        if not (np.linalg.norm(off[3:]) <= shift_m and np.linalg.norm(off[:3]) <= turn):
            return False
        measured = of.world_stretch.inverse() @ found @ tracked.inverse() @ last.world_stretch
        self._loops.append(
            Loop(here=here, there=self.count - 1, here_there=measured, turn=_LOOP_TURN, shift_m=self._loop_shift_m)
        )
        return True

    def settled(self) -> list[SE3]:
        """Return by which motion of the world each stretch comes to where all ties agree best; the first one stays."""
        now = {number: of.world_stretch for number, of in enumerate(self._all)}
        found = settled(now, [*self._ties, *self._loops], 0)
        return [(found[number] @ now[number].inverse()).exact() for number in now]

    def farthest(self, by: list[SE3]) -> tuple[float, float]:
        """Return by how much, rad and m, such motions turn and shift a stretch at most."""
        turns = [float(np.linalg.norm(motion.pose()[:3])) for motion in by]
        places = [of.world_stretch.t_m for of in self._all]
        shifts_m = [float(np.linalg.norm(motion.apply(at) - at)) for motion, at in zip(by, places, strict=True)]
        return max(turns), max(shifts_m)

    def move(self, by: list[SE3]) -> None:
        """Move each stretch by a motion of the world."""
        for of, motion in zip(self._all, by, strict=True):
            of.world_stretch = (motion @ of.world_stretch).exact()
        if self._last is not None:
            self._last = by[-1] @ self._last

    def _begin(self, world_stretch: SE3, beside: int, *, is_loop: bool) -> None:
        """Begin a stretch, tied to one before it by tracking, or by the place that both show."""
        if self._all:
            of, last = self._all[beside], self._all[-1].way
            shift_m, turn = self._loop_shift_m, _LOOP_TURN
            if not is_loop:
                shift_m = math.hypot(self._least_shift_m, _WAY_SHARE * (self._way.length_m - of.way.length_m))
                turn = math.hypot(_LEAST_TURN, _TURN_SHARE * (self._way.turned - of.way.turned))
            measured = of.world_stretch.inverse() @ world_stretch
            tie = Loop(
                here=beside,
                there=self.count,
                here_there=measured,
                turn=turn,
                shift_m=shift_m,
                is_tracked=not is_loop,
            )
            self._ties.append(tie)
            self._way = replace(
                self._way,
                shift_variance=last.shift_variance + shift_m**2,
                turn_variance=last.turn_variance + turn**2,
            )
        self._all.append(_Stretch(world_stretch, self._way))

    def _go(self, world_camera: SE3) -> None:
        if self._last is not None:
            step = (self._last.inverse() @ world_camera).pose()
            length_m, turned = float(np.linalg.norm(step[3:])), float(np.linalg.norm(step[:3]))
            way = self._way
            self._way = replace(way, length_m=way.length_m + length_m, turned=way.turned + turned)
        self._last = world_camera
