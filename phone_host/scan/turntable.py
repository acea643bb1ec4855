"""A scan of a thing that turns before cameras that stand still, on a turntable or by hand, without a mat. Pure.

While pairs come, the thing is told from the background and tracked like any scene: in its own axes the cameras go around it. The views are kept. In the
end one axis and all angles are fitted to them (`full_turn`), the background is learnt from all of them, and the model is made again from the start. A box
around it is carved by all views, those of an earlier pass, too, and closed; what is below the table is empty.

Views are kept in memory, cropped to the thing, one every two degrees, some 0.3 MB each, and never more than `_MOST_BYTES`; folders are not read twice.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.geometry.se3 import SE3, vectors_of
from phone_host.model import Processed
from phone_host.scan.box import Box
from phone_host.scan.carving import Carved, Carving
from phone_host.scan.cells import Cells
from phone_host.scan.fineness import fineness_for, thinner
from phone_host.scan.full_turn import LEAST_VIEWS, FullTurn, TurnView, full_turn
from phone_host.scan.ground import Ground
from phone_host.scan.map_fragment import Joined
from phone_host.scan.merged_field import merged
from phone_host.scan.piece import PoseGate
from phone_host.scan.scan import Scan
from phone_host.scan.scan_model import ScanModel, closed_model, open_model
from phone_host.scan.scan_wanted import ScanWanted
from phone_host.scan.scanned import ScannedPair
from phone_host.scan.surface_error import FusedDepths, PoseErrors
from phone_host.scan.surface_match import Match, SurfaceMatch, matched_surfaces
from phone_host.scan.table_cut import above, ground_of, points_of, table_height_m
from phone_host.scan.taken_view import require_size, view_of
from phone_host.scan.tracker import Tracker
from phone_host.scan.tracking_words import Tracking, Weakness, unless_flat
from phone_host.scan.turning_background import Background
from phone_host.scan.turning_mask import Turning, TurningMask
from phone_host.scan.view import View
from phone_host.scan.volume import Volume
from phone_host.stereo.images import size_px

_LEAST_TURN: Final = 0.035
"""rad from one kept view to the next, 2 degrees."""

_MOST_TURN: Final = 2 * np.pi + 0.6
"""rad after which no more views are kept: a whole turn, and enough to see that it is closed."""

_MOST_BYTES: Final = 200_000_000

_TRUNCATION_SHARE: Final = 2 / 3
"""Of the truncation with which the thing is tracked: in the end the poses are exact. A rendered thing then lies 0.44 mm off on average in place of 0.48, and
is 1.0 % too large in place of 2.5; with half, 0.45 mm, and where it was seen 1.8 % too small in place of 1.0."""

_MARGIN_VOXELS: Final = 4.0
"""Around the thing, as around one on a table."""

_WORDS: Final = {
    Turning.NOTHING: Weakness.NOTHING_TURNS,
    Turning.EVERYTHING: Weakness.ALL_TURNS,
    Turning.OUTSIDE: Weakness.OUTSIDE,
}


@dataclass(frozen=True, slots=True, eq=False)
class _Station:
    """A view that is kept: the pair's number, the view with the depths of the background, the thing's pixels, where tracking puts the camera, and how surely."""

    pair: int
    view: View
    mask: NDArray[np.bool_]
    world_camera: SE3
    is_sure: bool

    @property
    def thing(self) -> View:
        """The view without the depths of the background."""
        return self.view.masked(self.mask)


@dataclass(frozen=True, slots=True, eq=False)
class _Finished:
    """The end of a scan: how many pairs were taken, the turn, the background, the volume made again, what the thing stands on, and how it lies on that of an earlier pass."""

    taken: int
    turn: FullTurn | None = None
    background: Background | None = None
    volume: Volume | None = None
    ground: Ground | None = None
    match: SurfaceMatch | None = None

    @property
    def model_own(self) -> SE3:
        """Takes the axes of this pass to those of the model: to the earlier pass's, if it lies on that."""
        is_laid = self.match is not None and self.match.match is Match.FOUND
        return self.match.first_second if self.match is not None and is_laid else SE3.identity()

    @property
    def model_ground(self) -> Ground | None:
        """What the thing stood on, in the axes of the model."""
        return None if self.ground is None else self.ground.moved(self.model_own)


class TurntableScan(Scan):
    """Takes pairs of a thing that turns and grows a model of it.

    Args:
        wanted: what for.
    """

    def __init__(self, wanted: ScanWanted) -> None:
        super().__init__(wanted)
        self._mask = TurningMask()
        self._waiting: tuple[int, View] | None = None
        self._last: ScannedPair | None = None
        self._window: tuple[slice, slice] | None = None
        self._stations: list[_Station] = []
        self._tracked_pairs: list[int] = []
        self._least_turn = _LEAST_TURN
        self._turned = 0.0
        self._direction = np.zeros(3)
        self._finished: _Finished | None = None

    @property
    def is_submap_due(self) -> bool:
        """Never: what the end needs are the views."""
        return False

    @property
    def is_submap_open(self) -> bool:
        """Never, likewise."""
        return False

    @property
    def volume(self) -> Volume | None:
        """The model; in the end the one that was made again."""
        finished = self._finished
        return super().volume if finished is None or finished.volume is None else finished.volume

    @property
    def turn(self) -> FullTurn | None:
        """The turn, once the model was asked for; None: too few views agree on an axis."""
        return None if self._finished is None else self._finished.turn

    @property
    def match(self) -> SurfaceMatch | None:
        """How this pass lies on the earlier one, once the model was asked for; None: there is none, or no turn."""
        return None if self._finished is None else self._finished.match

    @property
    def pairs(self) -> tuple[ScannedPair, ...]:
        """What became of each pair, in order; in the axes of the model."""
        if self._finished is None or self._finished.match is None:
            return tuple(self._pairs)
        move = self._finished.model_own
        return tuple(
            replace(pair, world_camera=move @ pair.world_camera) if pair.is_fused else pair for pair in self._pairs
        )

    @property
    def carved(self) -> Carved | None:
        """What the views told of the box around the thing, once the model was asked for; None: there is none."""
        return None if self._carving is None else self._carving.carved

    @property
    def views(self) -> int:
        """How many views are kept."""
        return len(self._stations)

    def take(self, name: str, stamp_s: float, processed: Processed, skew_s: float = 0.0) -> ScannedPair:
        """Take the next pair.

        Args:
            name: of the pair.
            stamp_s: when it was taken, s.
            processed: with disparity and cloud.
            skew_s: passed over: between the pairs that count, the object rests.

        Returns:
            What became of it.

        Raises:
            DataError: its size is not that of the pairs before it.
        """
        del skew_s
        view = view_of(processed)
        if not self._pairs:
            self.geometry, self.size_px = view.geometry, size_px(view.grey)
        require_size(name, view, self.size_px)
        density = float(np.isfinite(view.depth_m).mean())
        found = self._mask.take(view.grey, view.depth_m, view.geometry)
        if found.turning is Turning.THING and self._waiting is not None:
            self._take_waiting()
        if density < PoseGate().least_depths:
            pair = _lost(name, stamp_s, density, Weakness.NO_DEPTH)
        elif found.turning is Turning.NOTHING and self._last is not None:
            pair = replace(self._last, name=name, stamp_s=stamp_s, density=density)  # it pauses, or turns slowly
        elif found.turning is not Turning.THING:
            if not self._stations:
                self._waiting = len(self._pairs), view
            pair = _lost(name, stamp_s, density, _WORDS[found.turning])
        else:
            pair = self._tracked(len(self._pairs), view, found.mask, (name, stamp_s, density))
        self._pairs.append(pair)
        if pair.is_fused:
            self._last = pair
        return pair

    def final(self, pair: ScannedPair) -> ScannedPair:
        """Return what has become of a pair in the end: the views of the turn lie on its circle.

        Args:
            pair: as it was told when it was taken.
        """
        return next((each for each in self.pairs if each.name == pair.name), pair)

    def _surface(self) -> ScanModel:
        """Return the surface so far, made from all views together once there are enough of them."""
        if self._finished is None or self._finished.taken != len(self._pairs):
            self._finished = self._end()
        volume, box = self.volume, self._wanted.box or self._box_around()
        if volume is None or box is None:
            return super()._surface()
        self._carving = self._carved_by_all(Cells.of(box, volume.settings.voxel_m), self._finished)
        return closed_model(volume, self._carving, box, self._finished.model_ground)

    @property
    def _pose_errors(self) -> PoseErrors:
        """The errors of poses on one circle, once it is fitted."""
        return super()._pose_errors if self.turn is None else PoseErrors.CIRCLE

    @property
    def _lacks_views(self) -> bool:
        """Whether an earlier pass, whose views are not here, is part of the model."""
        return self.match is not None and self.match.match is Match.FOUND

    def _fused_views(self) -> Sequence[FusedDepths]:
        """Return the depths of the views that are kept and in the model, without the background."""
        pairs, turn = self.pairs, self.turn
        used = [True] * len(self._stations) if turn is None else turn.used
        kept = [(each.thing, pairs[each.pair]) for each, is_used in zip(self._stations, used, strict=True) if is_used]
        return [FusedDepths.of(thing, pair.world_camera) for thing, pair in kept if pair.is_fused]

    def _box_around(self) -> Box | None:
        """Return a box around the thing; None: it is not known how it has turned."""
        volume = None if self._finished is None else self._finished.volume
        points = np.zeros((0, 3)) if volume is None else open_model(volume).mesh.points_m.astype(np.float64)
        if volume is None or not len(points):
            return None
        margin_m = _MARGIN_VOXELS * volume.settings.voxel_m
        (x, y, z), (far_x, far_y, far_z) = (
            (points.min(axis=0) - margin_m).tolist(),
            (points.max(axis=0) + margin_m).tolist(),
        )
        return Box((x, y, z), (far_x, far_y, far_z))

    def _carved_by_all(self, cells: Cells, finished: _Finished) -> Carving:
        """Let the views carve, from where they are known to lie in the end, and those of an earlier pass."""
        carving, pairs, onto = Carving(cells, self._wanted.threads), self.pairs, self._wanted.onto
        background = finished.background
        for station in self._stations:
            if pairs[station.pair].is_fused:
                view = station.view if background is None else background.opened(station.view)
                carving.see(view, pairs[station.pair].world_camera)
        if finished.model_ground is not None:
            carving.take_empty(finished.model_ground.below(cells))
        if (
            onto is not None
            and onto.carved is not None
            and finished.match is not None
            and finished.match.match is Match.FOUND
        ):
            carving.take_in(onto.carved)
        return carving

    def _tracked(
        self, number: int, view: View, mask: NDArray[np.bool_], told_of: tuple[str, float, float]
    ) -> ScannedPair:
        """Track a view of the thing; keep it if it is fused and shows it from a new side."""
        rows, columns = self._window_of(view)
        cropped = view.cropped(rows, columns)
        own = np.ascontiguousarray(mask[rows, columns])
        thing = cropped.masked(own)
        if self.tracker is None:
            self.tracker = Tracker(
                fineness_for(thing, self._wanted.voxel_m, self._wanted.most_bytes),
                self._wanted.threads,
                gate=PoseGate(is_turned_by_others=True),
            )
        self._tracked_pairs.append(number)
        told = self.tracker.track(thing)
        self._joined(told.joined)
        state, weakness = unless_flat(told.state, told.weakness)
        self._keep(_Station(number, cropped, own, told.world_camera, told.is_fused))
        name, stamp_s, density = told_of
        return ScannedPair(
            name=name,
            stamp_s=stamp_s,
            world_camera=told.world_camera,
            state=state,
            weakness=weakness,
            density=density,
            corners=told.moved.inliers,
            overlap=np.nan if told.fit is None else told.fit.overlap,
            off_m=np.nan if told.fit is None else told.fit.off_m,
        )

    def _joined(self, views: Sequence[Joined]) -> None:
        """Note that pairs that were lost have become part of the model, and where they were taken."""
        for view in views:
            at = self._tracked_pairs[view.number - 1]
            state, weakness = unless_flat(view.state, view.weakness)
            self._pairs[at] = replace(self._pairs[at], world_camera=view.world_camera, state=state, weakness=weakness)
            self._stations = [
                replace(each, world_camera=view.world_camera, is_sure=True) if each.pair == at else each
                for each in self._stations
            ]

    def _take_waiting(self) -> None:
        """Take the view before the first one in which something had turned: now it is known what."""
        assert self._waiting is not None
        (number, view), self._waiting = self._waiting, None
        mask = self._mask.before(view.depth_m, view.geometry)
        pair = self._pairs[number]
        self._pairs[number] = self._tracked(number, view, mask, (pair.name, pair.stamp_s, pair.density))

    def _window_of(self, view: View) -> tuple[slice, slice]:
        if self._window is None:
            assert self._mask.ball is not None
            self._window = self._mask.ball.window(view.grey.shape, view.geometry)
        return self._window

    def _keep(self, station: _Station) -> None:
        if self._stations:
            step = vectors_of((self._stations[-1].world_camera.inverse() @ station.world_camera).R)
            self._direction = self._direction + (step if step @ self._direction >= 0 else -step)
            along = float(step @ self._direction) / max(float(np.linalg.norm(self._direction)), 1e-9)
            if np.linalg.norm(step) < self._least_turn or self._turned > _MOST_TURN:
                return
            self._turned += along
        self._stations.append(station)
        if sum(each.view.grey.nbytes * 8 + each.mask.nbytes for each in self._stations) > _MOST_BYTES:
            self._stations, self._least_turn = self._stations[::2], 2 * self._least_turn

    def _end(self) -> _Finished:
        """Fit the turn, and make the model again."""
        taken = len(self._pairs)
        if self.tracker is None or len(self._stations) < LEAST_VIEWS:
            return _Finished(taken)
        tracked = self.tracker.volume.settings
        settings = thinner(tracked, _TRUNCATION_SHARE)
        background = Background(
            [each.view.grey for each in self._stations], [each.view.depth_m for each in self._stations]
        )
        things = [
            each.view.masked(each.mask & ~background.is_seen(each.view.grey, each.view.depth_m))
            for each in self._stations
        ]
        given = [
            TurnView(thing, each.world_camera, each.is_sure) for thing, each in zip(things, self._stations, strict=True)
        ]
        turn = full_turn(given, tracked, self._wanted.threads)
        if turn is None:
            return _Finished(taken)
        volume = Volume(settings, self._wanted.threads)
        still = points_of(background.depth_m, self._stations[0].view.geometry)
        seen = np.concatenate([points_of(thing.depth_m, thing.geometry) for thing in things[:LEAST_VIEWS]])
        height_m = table_height_m(still, seen, turn.axis, settings.voxel_m)
        for station, thing, angle, is_used in zip(self._stations, things, turn.angles, turn.used, strict=True):
            if is_used:
                pose = turn.axis.camera_world(float(angle)).inverse()
                volume.fuse(above(thing, turn.axis, height_m, settings.voxel_m), pose)
                pair = replace(self._pairs[station.pair], world_camera=pose)
                if not station.is_sure:  # the others have shown where it belongs
                    pair = replace(pair, state=Tracking.RELOCALISED, weakness=Weakness.NONE)
                self._pairs[station.pair] = pair
        ground = ground_of(turn.axis, height_m, open_model(volume).mesh.points_m.astype(np.float64))
        if ground is not None:
            ground.forget_below(volume.blocks, settings.voxel_m)
        if self._wanted.onto is None:
            return _Finished(taken, turn, background, volume, ground)
        first = self._wanted.onto.volume(self._wanted.threads)
        match = matched_surfaces(first, volume)
        if match.match is Match.FOUND:
            volume = merged(first, volume, match.first_second, self._wanted.threads)
        return _Finished(taken, turn, background, volume, ground, match)


def _lost(name: str, stamp_s: float, density: float, why: Weakness) -> ScannedPair:
    return ScannedPair(
        name=name, stamp_s=stamp_s, world_camera=SE3.identity(), state=Tracking.LOST, weakness=why, density=density
    )
