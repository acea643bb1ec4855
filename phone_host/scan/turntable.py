"""A scan of a thing that turns before cameras that stand still, on a turntable or by hand, without a mat. Pure.

While pairs come, the thing is told from the background and tracked like any scene: in its own axes the cameras go around it. The views are kept. In the
end one axis and all angles are fitted to them (`full_turn`), the background is learnt from all of them, and the model is made again from the start. A box
around it is carved by all views, those of an earlier pass, too, and closed; what is below the table is empty.

Views are kept in memory, cropped to the thing, one every two degrees, some 0.3 MB each, and never more than `_MOST_BYTES`; folders are not read twice.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.geometry.se3 import SE3, vectors_of
from phone_host.scan.blocks import Box, Cells
from phone_host.scan.carving import Carving
from phone_host.scan.field_bytes import KeptField
from phone_host.scan.field_sample import merged
from phone_host.scan.full_turn import LEAST_VIEWS, FullTurn, TurnView, full_turn
from phone_host.scan.fusion import Fusion
from phone_host.scan.ground import Ground, above, ground_of, table_height_m
from phone_host.scan.piece import Joined, PoseGate
from phone_host.scan.pose_source import PoseSource
from phone_host.scan.scan_model import ScanModel, closed_model, open_model
from phone_host.scan.scan_wanted import ScanWanted
from phone_host.scan.scanned import ScannedPair
from phone_host.scan.stretches import Placed
from phone_host.scan.surface_error import FusedView
from phone_host.scan.surface_match import Match, SurfaceMatch, matched_surfaces
from phone_host.scan.tracked import Tracked, lost
from phone_host.scan.tracker import Tracker
from phone_host.scan.tracking_words import Tracking, Weakness
from phone_host.scan.turning_mask import Background, Turning, TurningMask
from phone_host.scan.view import View, points_of
from phone_host.scan.volume import Volume
from phone_host.scan.volume_settings import fineness_for, thinner

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
class _Keyframe:
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
class TurnFit:
    """The end of a scan.

    Attributes:
        taken: pairs so far.
        turn: that was fitted; None: too few views agree on an axis.
        poses: where the views on the circle were taken, by the numbers of their pairs, in the axes of this pass.
        background: that was learnt.
        volume: made again from the views of the turn.
        ground: what the thing stands on.
        match: how this pass lies on the earlier one; None: there is none.
    """

    taken: int
    turn: FullTurn | None = None
    poses: Mapping[int, SE3] = field(default_factory=dict)
    background: Background | None = None
    volume: Volume | None = None
    ground: Ground | None = None
    match: SurfaceMatch | None = None

    @property
    def is_on_earlier_pass(self) -> bool:
        """Whether this pass lies on an earlier one."""
        return self.match is not None and self.match.match is Match.FOUND

    @property
    def model_own(self) -> SE3:
        """Takes the axes of this pass to those of the model: to the earlier pass's, if it lies on that."""
        return self.match.first_second if self.match is not None and self.is_on_earlier_pass else SE3.identity()

    @property
    def model_ground(self) -> Ground | None:
        """What the thing stood on, in the axes of the model."""
        return None if self.ground is None else self.ground.moved(self.model_own)


class TurntablePoses(PoseSource):
    """Poses of cameras that stand still, in the axes of a thing that turns before them.

    Attributes:
        fit: the end of the scan, once the model was asked for.
    """

    is_resumable = False

    def __init__(self, wanted: ScanWanted) -> None:
        self._wanted = wanted
        self.fit = TurnFit(0)
        self._tracker: Tracker | None = None
        self._mask = TurningMask()
        self._taken = 0
        self._waiting: tuple[int, View] | None = None
        self._last: Tracked | None = None
        self._window: tuple[slice, slice] | None = None
        self._keyframes: list[_Keyframe] = []
        self._tracked_pairs: list[int] = []
        self._least_turn = _LEAST_TURN
        self._turned = 0.0
        self._direction = np.zeros(3)

    @property
    def volume(self) -> Volume | None:
        """The model; in the end the one that was made again."""
        tracked = None if self._tracker is None else self._tracker.volume
        return tracked if self.fit.volume is None else self.fit.volume

    @property
    def has_size(self) -> bool:
        """Whether there was a view to which others are compared."""
        return self._taken > 0

    @property
    def views(self) -> int:
        """How many views are kept."""
        return len(self._keyframes)

    def track(self, number: int, view: View) -> Tracked:
        """See `PoseSource.track`. Times do not count: between the pairs that do, the object rests."""
        self._taken = number + 1
        view = replace(view, stamp_s=math.nan, skew_s=0.0)
        found, before = self._mask.take(view.grey, view.depth_m, view.geometry), tuple[Joined, ...]()
        if found.turning is Turning.THING and self._waiting is not None:
            before = self._take_waiting(*self._waiting)
        if view.density < PoseGate().least_depths:
            told = lost(Weakness.NO_DEPTH)
        elif found.turning is Turning.NOTHING and self._last is not None:
            told = replace(self._last, joined=())  # it pauses, or turns slowly
        elif found.turning is not Turning.THING:
            if not self._keyframes:
                self._waiting = number, view
            told = lost(_WORDS[found.turning])
        else:
            told = self._tracked(number, view, found.mask)
        if told.is_fused:
            self._last = told
        return replace(told, joined=(*before, *told.joined))

    def settle(self) -> Sequence[Placed]:
        """Fit the turn, and make the model again from all views together once there are enough of them; `final` tells the poses."""
        if not self._taken or self.fit.taken != self._taken:
            self.fit = self._fitted()
        return ()

    def final(self, number: int, pair: ScannedPair) -> ScannedPair:
        """See `PoseSource.final`: the views of the turn lie on its circle, in the axes of the model."""
        pose = self.fit.poses.get(number)
        if pose is not None:
            pair = replace(pair, world_camera=pose)
            if not pair.is_fused:  # the others have shown where it belongs
                pair = replace(pair, state=Tracking.RELOCALISED, weakness=Weakness.NONE)
        is_moved = self.fit.match is not None and pair.is_fused
        return replace(pair, world_camera=self.fit.model_own @ pair.world_camera) if is_moved else pair

    def fused_views(self, kept: Sequence[FusedView]) -> Sequence[FusedView] | None:
        """See `PoseSource.fused_views`: those of the thing alone; if an earlier pass is part of the model, its views are not here."""
        del kept
        if self.fit.is_on_earlier_pass:
            return None
        used = [True] * self.views if self.fit.turn is None else self.fit.turn.used.tolist()
        return [
            (each.thing, pose)
            for each, is_used in zip(self._keyframes, used, strict=True)
            if is_used and (pose := self._pose_of(each)) is not None
        ]

    def carve(self, carving: Carving) -> None:
        """Let the kept views carve, from where they are known to lie in the end; what shows the background tells that nothing is before it."""
        background = self.fit.background
        for each in self._keyframes:
            pose = self._pose_of(each)
            if pose is not None:
                carving.see(each.view if background is None else background.opened(each.view), pose)

    def _pose_of(self, of: _Keyframe) -> SE3 | None:
        """Return where a kept view was taken, in the axes of the model; None: it is lost."""
        pose = self.fit.poses.get(of.pair, of.world_camera if of.is_sure else None)
        return pose if pose is None or self.fit.match is None else self.fit.model_own @ pose

    def _tracked(self, number: int, view: View, mask: NDArray[np.bool_]) -> Tracked:
        """Track a view of the thing; keep it if it is fused and shows it from a new side."""
        rows, columns = self._window_of(view)
        cropped = view.cropped(rows, columns)
        own = np.ascontiguousarray(mask[rows, columns])
        thing = cropped.masked(own)
        if self._tracker is None:
            self._tracker = Tracker(
                fineness_for(thing, self._wanted.voxel_m, self._wanted.most_bytes),
                self._wanted.threads,
                gate=PoseGate(is_turned_by_others=True),
            )
        self._tracked_pairs.append(number)
        told = self._tracker.track(thing).unless_flat()
        joined = tuple(replace(each, number=self._tracked_pairs[each.number - 1]) for each in told.joined)
        for view_again in joined:
            self._keyframes = [
                replace(each, world_camera=view_again.world_camera, is_sure=True)
                if each.pair == view_again.number
                else each
                for each in self._keyframes
            ]
        self._keep(_Keyframe(number, cropped, own, told.world_camera, told.is_fused))
        # Kept depths and followed motions are not asked for: the keyframes carve in the end, and their fit tells the poses.
        return replace(told, joined=joined, used=None, is_followed=False)

    def _take_waiting(self, number: int, view: View) -> tuple[Joined, ...]:
        """Take the view before the first one in which something had turned: now it is known what."""
        self._waiting = None
        told = self._tracked(number, view, self._mask.before(view.depth_m, view.geometry))
        return Joined(number, told.world_camera, told.state, told.weakness), *told.joined

    def _window_of(self, view: View) -> tuple[slice, slice]:
        if self._window is None:
            assert self._mask.ball is not None
            self._window = self._mask.ball.window(view.grey.shape, view.geometry)
        return self._window

    def _keep(self, keyframe: _Keyframe) -> None:
        if self._keyframes:
            step = vectors_of((self._keyframes[-1].world_camera.inverse() @ keyframe.world_camera).R)
            self._direction = self._direction + (step if step @ self._direction >= 0 else -step)
            along = float(step @ self._direction) / max(float(np.linalg.norm(self._direction)), 1e-9)
            if np.linalg.norm(step) < self._least_turn or self._turned > _MOST_TURN:
                return
            self._turned += along
        self._keyframes.append(keyframe)
        if sum(each.view.grey.nbytes * 8 + each.mask.nbytes for each in self._keyframes) > _MOST_BYTES:
            self._keyframes, self._least_turn = self._keyframes[::2], 2 * self._least_turn

    def _fitted(self) -> TurnFit:
        """Fit the turn, and make the model again."""
        taken, keyframes, wanted = self._taken, self._keyframes, self._wanted
        if self._tracker is None or len(keyframes) < LEAST_VIEWS:
            return TurnFit(taken)
        tracked = self._tracker.volume.settings
        settings = thinner(tracked, _TRUNCATION_SHARE)
        background = Background([each.view.grey for each in keyframes], [each.view.depth_m for each in keyframes])
        things = [
            each.view.masked(each.mask & ~background.is_seen(each.view.grey, each.view.depth_m)) for each in keyframes
        ]
        given = [
            TurnView(thing, each.world_camera, each.is_sure) for thing, each in zip(things, keyframes, strict=True)
        ]
        turn = full_turn(given, tracked, wanted.threads)
        if turn is None:
            return TurnFit(taken)
        volume, poses = Volume(settings, wanted.threads), dict[int, SE3]()
        still = points_of(background.depth_m, keyframes[0].view.geometry)
        seen = np.concatenate([points_of(thing.depth_m, thing.geometry) for thing in things[:LEAST_VIEWS]])
        height_m = table_height_m(still, seen, turn.axis, settings.voxel_m)
        for keyframe, thing, angle, is_used in zip(keyframes, things, turn.angles, turn.used, strict=True):
            if is_used:
                pose = poses[keyframe.pair] = turn.axis.camera_world(float(angle)).inverse()
                volume.fuse(above(thing, turn.axis, height_m, settings.voxel_m), pose)
        ground = ground_of(turn.axis, height_m, open_model(volume).mesh.points_m.astype(np.float64))
        if ground is not None:
            ground.forget_below(volume.blocks, settings.voxel_m)
        fit = TurnFit(taken, turn, poses, background, volume, ground)
        if wanted.onto is None:
            return fit
        first = wanted.onto.volume(wanted.threads)
        match = matched_surfaces(first, volume)
        both = merged(first, volume, match.first_second, wanted.threads) if match.match is Match.FOUND else volume
        return replace(fit, volume=both, match=match)


class TurnSurface:
    """The thing, closed in a box around it and down to what it stands on, carved by all views together once they are known to lie on a circle."""

    def __init__(self, poses: TurntablePoses, onto: KeptField | None) -> None:
        self._poses, self._onto = poses, onto

    def cells(self, box: Box | None, voxel_m: float) -> None:
        """See `Surface.cells`: nothing is carved before the end."""
        del box, voxel_m

    def model(self, volume: Volume, fusion: Fusion, box: Box | None) -> ScanModel:
        """See `Surface.model`."""
        fit = self._poses.fit
        box = box or _box_around(fit.volume)
        if box is None:
            return open_model(volume)
        fusion.carve(None)
        fusion.carve(Cells.of(box, volume.settings.voxel_m))
        assert fusion.carving is not None
        self._poses.carve(fusion.carving)
        if fit.model_ground is not None:
            fusion.carving.take_empty(fit.model_ground.below(fusion.carving.cells))
        if self._onto is not None and self._onto.carved is not None and fit.is_on_earlier_pass:
            fusion.carving.take_in(self._onto.carved)
        return closed_model(volume, fusion.carving, box, fit.model_ground)


def _box_around(volume: Volume | None) -> Box | None:
    """Return a box around the thing; None: it is not known how it has turned."""
    points = np.zeros((0, 3)) if volume is None else open_model(volume).mesh.points_m.astype(np.float64)
    if volume is None or not len(points):
        return None
    margin_m = _MARGIN_VOXELS * volume.settings.voxel_m
    (x, y, z), (far_x, far_y, far_z) = (
        (points.min(axis=0) - margin_m).tolist(),
        (points.max(axis=0) + margin_m).tolist(),
    )
    return Box((x, y, z), (far_x, far_y, far_z))
