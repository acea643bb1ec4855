"""A model as stretches of the camera's way: each is rigid, and tied to others by tracking and by loops. Pure.

A stretch is some views that follow each other. Within it tracking is believed; between two of them it has an error that grows with the way. A loop
says where one stretch is as seen from another that was seen long before. All ties together put the stretches (`graph`); none is ever warped.
"""

import heapq
import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.geometry.se3 import SE3
from phone_host.scan.graph import Loop, without_outliers
from phone_host.scan.relocalisation import MotionBound

_VIEWS: Final = 5
"""Of a stretch: one second at five pairs a second. With ten, every third view of a room's clip had steps of 10 mm between its stretches."""

_LONGER: Final = 50
"""After so many stretches the next ones are twice as long, so that twelve minutes have 200: to put 400 takes 12 s of processor time."""

_WAY_SHARE, _TURN_SHARE = 0.06, 0.02
_LEAST_VOXELS, _LEAST_TURN = 0.1, 0.0005
"""Standard deviations of tracking along a stretch: shares of its way and of its turn, and voxels and rad at least. On a room's clip the end is off by
2.5 % of the way and half a percent of the turn; with half of these shares a third of the loops were looked for, and the trajectory was worse."""

_LOOP_VOXELS, _LOOP_TURN = 1.0, 0.006
"""Standard deviations of a loop, voxels and rad: with a room's voxels of 10 mm, those of a loop between pieces."""

_SIGMAS: Final = 4.0
"""Of ties and loops, by which a view may be off; and most of a loop's residual after all were settled."""

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
        by: motion of the world by which loops have just brought it there.
    """

    number: int
    world_camera: SE3
    by: SE3 = field(default_factory=SE3.identity)


@dataclass(frozen=True, slots=True, eq=False)
class ClosedLoop:
    """A loop that moves the model.

    Attributes:
        here: number of a view of the older part.
        there: number of a view of the newer part.
        here_there: takes points in the newer view's axes to the older one's, as the loop has it.
    """

    here: int
    there: int
    here_there: SE3


@dataclass(frozen=True, slots=True)
class WayCertainty:
    """How sure the camera's way is.

    Attributes:
        length_m: of the way, m.
        loops: that hold it together.
        sigma_m: standard deviation of the part that is known least, as seen from the beginning, m.
    """

    length_m: float
    loops: int
    sigma_m: float


@dataclass(frozen=True, slots=True)
class _Way:
    """How far the camera has gone and turned, m and rad."""

    length_m: float = 0.0
    turned: float = 0.0


class _Stretch:
    """Where its first view was taken, its views in its own axes, and the way until its beginning."""

    def __init__(self, world_stretch: SE3, way: _Way) -> None:
        self.world_stretch, self.way = world_stretch, way
        self.views: list[Placed] = []


class Stretches:
    """All stretches of a model."""

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

    @property
    def closed(self) -> tuple[ClosedLoop, ...]:
        """The loops that count, each between the first views of two stretches; a lost camera that was found by an older stretch closes one, too."""
        result, found_again = [], [tie for tie in self._ties if not tie.is_tracked and tie.there - tie.here > 1]
        for loop in (*found_again, *filter(self._is_confirmed, self._loops)):
            here, there = self._all[loop.here].views[0], self._all[loop.there].views[0]
            between = here.world_camera.inverse() @ loop.here_there @ there.world_camera
            result.append(ClosedLoop(here.number, there.number, between))
        return tuple(result)

    @property
    def certainty(self) -> WayCertainty:
        """How sure the way is, by the surest ties and loops to each stretch."""
        variance = max(self._unsure_of(0), default=0.0) if self._all else 0.0
        return WayCertainty(self._way.length_m, len(self.closed), math.sqrt(variance) * self._loop_shift_m)

    def views(self, number: int) -> list[Placed]:
        """Return a stretch's views, and where they were taken in the world."""
        of = self._all[number]
        return [Placed(view.number, (of.world_stretch @ view.world_camera).exact()) for view in of.views]

    def around(self, number: int) -> list[Placed]:
        """Return the views of a stretch and of those before and after it, but not of the last one."""
        near = range(max(number - 1, 0), min(number + 2, self.count - 1))
        return [view for each in near for view in self.views(each)]

    def add(self, view: Placed, beside: int | None = None, kept_of: int = 1) -> None:
        """Take the next view, into the last stretch or a new one.

        Args:
            view: where it was taken.
            beside: the stretch by which it was found again after the camera was lost; None: it was not lost.
            kept_of: one of so many views is kept; a stretch has at least five of these.
        """
        self._go(view.world_camera)
        if (
            not self._all
            or beside is not None
            or len(self._all[-1].views) >= _VIEWS * max(kept_of, 2 ** ((self.count - 1) // _LONGER))
        ):
            self._begin(view.world_camera, self.count - 1 if beside is None else beside, is_loop=beside is not None)
        of = self._all[-1]
        of.views.append(Placed(view.number, of.world_stretch.inverse() @ view.world_camera))

    def add_piece(self, views: list[Placed], beside: int) -> None:
        """Take a piece that was joined, as a stretch of its own."""
        self._begin(views[0].world_camera, beside, is_loop=True)
        of = self._all[-1]
        of.views = [Placed(view.number, of.world_stretch.inverse() @ view.world_camera) for view in views]

    def older(self) -> tuple[list[int], list[int]]:
        """Return the stretches with which the last one may close a loop, those first of which ties and loops are least sure.

        Not its neighbour, and none of which they are surer than two loops would be.
        """
        last = self.count - 1
        if sum(loop.there == last for loop in self._loops) >= _LOOPS:
            return [], []
        unsure = self._unsure_of(self.count - 1)
        asked = [number for number in range(last - 1) if unsure[number] > _UNSURE]
        most = max((unsure[number] for number in asked), default=0.0)
        far = [number for number in asked if unsure[number] > most / 2]
        return far, [number for number in asked if unsure[number] <= most / 2]

    def bounds(self) -> list[MotionBound]:
        """Return, for each stretch, how far the last view may be off as seen from it: by tracking since then, or by the surest way of ties and loops."""
        result = []
        for of, variance in zip(self._all, self._unsure_of(self.count - 1), strict=True):
            drift = MotionBound.drift(self._way.length_m - of.way.length_m, self._way.turned - of.way.turned)
            sigmas = _SIGMAS * math.sqrt(variance)
            result.append(
                MotionBound(min(drift.shift_m, sigmas * self._loop_shift_m), min(drift.turn, sigmas * _LOOP_TURN))
            )
        return result

    def close(self, here: int, tracked: SE3, found: SE3) -> bool:
        """Note a loop between an older stretch and the last one.

        Returns:
            Whether it counts now: it is believed, for tracking may be so far off, and another loop of the same stretch or the one before stands beside it.
        """
        of, last = self._all[here], self._all[-1]
        if not self.bounds()[here].admits(tracked, found, self._loop_shift_m):
            return False
        measured = of.world_stretch.inverse() @ found @ tracked.inverse() @ last.world_stretch
        self._loops.append(
            Loop(here=here, there=self.count - 1, here_there=measured, turn=_LOOP_TURN, shift_m=self._loop_shift_m)
        )
        return self._is_confirmed(self._loops[-1])

    def settled(self) -> list[SE3]:
        """Return by which motion of the world each stretch comes to where ties and loops agree best; the first one stays.

        Loops that contradict the others even then are taken out.
        """
        now = {number: of.world_stretch for number, of in enumerate(self._all)}
        used = list(filter(self._is_confirmed, self._loops))
        graph = without_outliers(now, [*self._ties, *used], 0, _SIGMAS)
        wrong = {id(loop) for loop in used} - {id(loop) for loop in graph.loops}
        self._loops = [loop for loop in self._loops if id(loop) not in wrong]
        return [(graph.poses[number] @ now[number].inverse()).exact() for number in now]

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

    def _is_confirmed(self, loop: Loop) -> bool:
        """Return whether a loop is not the only one thereabouts: one view may err by some centimetres."""
        return sum(abs(other.there - loop.there) <= 1 for other in self._loops) > 1

    def _unsure_of(self, number: int) -> list[float]:
        """Return, for each stretch, the variance of where one is as seen from it, by the surest way of ties and loops, in that of a loop."""
        ways: dict[int, list[tuple[int, float]]] = {number: [] for number in range(self.count)}
        loops = Counter((loop.here, loop.there) for loop in filter(self._is_confirmed, self._loops))
        told = [(tie.here, tie.there, self._in_loops(tie)) for tie in self._ties]
        for here, there, variance in (*told, *((here, there, 1 / count) for (here, there), count in loops.items())):
            ways[here].append((there, variance))
            ways[there].append((here, variance))
        found, waiting = [math.inf] * self.count, [(0.0, number)]
        while waiting:
            variance, at = heapq.heappop(waiting)
            if variance < found[at]:
                found[at] = variance
                for other, more in ways[at]:
                    heapq.heappush(waiting, (variance + more, other))
        return found

    def _in_loops(self, tie: Loop) -> float:
        return max((tie.shift_m / self._loop_shift_m) ** 2, (tie.turn / _LOOP_TURN) ** 2)

    def _begin(self, world_stretch: SE3, beside: int, *, is_loop: bool) -> None:
        """Begin a stretch, tied to one before it by tracking, or by the place that both show."""
        if self._all:
            of = self._all[beside]
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
        self._all.append(_Stretch(world_stretch, self._way))

    def _go(self, world_camera: SE3) -> None:
        if self._last is not None:
            step = (self._last.inverse() @ world_camera).pose()
            length_m, turned = float(np.linalg.norm(step[3:])), float(np.linalg.norm(step[:3]))
            way = self._way
            self._way = replace(way, length_m=way.length_m + length_m, turned=way.turned + turned)
        self._last = world_camera


@dataclass(frozen=True, slots=True, eq=False)
class ModelMotion:
    """A motion of a model, each part of which moves as a whole.

    Attributes:
        before_m: (N, 3) where its views were taken before, m.
        by: of the world, for each of them.
    """

    before_m: NDArray[np.float64]
    by: tuple[SE3, ...]

    @staticmethod
    def of(views: Sequence[Placed]) -> "ModelMotion":
        """Return the motion after which views are where they are now; there is at least one."""
        before = [view.by.inverse().apply(view.world_camera.t_m) for view in views]
        return ModelMotion(np.array(before).reshape(-1, 3), tuple(view.by for view in views))

    def carry(self, pose: SE3) -> SE3:
        """Move a pose in the model's axes as the view that was taken nearest to it has moved: the last one of several."""
        away_m = np.linalg.norm(self.before_m - pose.t_m, axis=1)[::-1]
        return (self.by[len(away_m) - 1 - int(np.argmin(away_m))] @ pose).exact()
