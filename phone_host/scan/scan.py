"""Pairs go in one after another, a model comes out. Pure: no files, no clock.

`scan_for` puts a scan together of a `PoseSource`, which tells where each pair was taken and fuses it into its volume, a `Fusion` of what the pairs tell
beside that, and a `Surface`. The world's axes are those of the rectified left camera at the first pair that has depth; with a mat, the mat's; of an object
on a table, the table's.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final

from common.errors import SettingsError
from phone_host.geometry.se3 import SE3
from phone_host.model import Processed, StereoGeometry
from phone_host.scan.blocks import Box
from phone_host.scan.carving import Carved
from phone_host.scan.fusion import Fusion
from phone_host.scan.mat import MatDetector, MatInView
from phone_host.scan.mat_tracker import MatPoses
from phone_host.scan.piece import Joined
from phone_host.scan.pose_source import PoseSource, TablePoses, VisualPoses
from phone_host.scan.scan_model import ScanModel
from phone_host.scan.scan_wanted import ScanWanted
from phone_host.scan.scanned import ScannedPair, Submap, begun_on_table
from phone_host.scan.stretches import Placed
from phone_host.scan.surface import BoxSurface, Surface, TableSurface
from phone_host.scan.turntable import TurnSurface, TurntablePoses
from phone_host.scan.view import require_size, view_of
from phone_host.scan.volume import Volume
from phone_host.scan.volume_settings import VolumeSettings
from phone_host.stereo.images import size_px

_SUBMAP_PAIRS: Final = 20
"""Fused pairs after which a submap is closed: four seconds at five pairs a second."""

_MOST_COPIES: Final = 3
"""Submaps hold no more than this many times the model's blocks."""


@dataclass(frozen=True, slots=True)
class _Closed:
    """What is in submaps: pairs, how many of these are fused, places, and blocks, those that were written several times counted so."""

    pairs: int = 0
    fused: int = 0
    places: int = 0
    blocks: int = 0


class Scan:
    """Takes pairs and grows a model. `scan_for` puts one together.

    Attributes:
        poses: what tells where the pairs were taken.
        geometry: of the pairs since the first that counts.
        size_px: width and height of their rectified images.
        wanted: what for; with the box that was chosen since.

    Args:
        wanted: what for.
        poses: what tells where the pairs are taken.
        surface: makes the model's surface.
        on_unused_mat: is called when a printed mat is in view and none is wanted, before the pair that shows it is taken.
    """

    def __init__(
        self,
        wanted: ScanWanted,
        poses: PoseSource,
        surface: Surface,
        on_unused_mat: Callable[[MatInView], None],
    ) -> None:
        self.wanted, self.poses, self._surface = wanted, poses, surface
        self._fusion = Fusion(wanted.threads)
        self._detector, self._on_unused_mat = MatDetector() if wanted.mat is None else None, on_unused_mat
        self.geometry: StereoGeometry | None = None
        self.size_px = (0, 0)
        self._pairs: list[ScannedPair] = []
        self._numbers: dict[str, int] = {}  # of the pairs, by name
        self._closed = _Closed()
        self._is_changed = False  # whether submaps that are closed do not hold any more

    @property
    def pairs(self) -> tuple[ScannedPair, ...]:
        """What became of each pair, in order."""
        return tuple(self.poses.final(number, pair) for number, pair in enumerate(self._pairs))

    @property
    def fused(self) -> int:
        """Pairs that became part of the model."""
        return sum(pair.is_fused for pair in self.pairs)

    @property
    def volume(self) -> Volume | None:
        """The model; None before the first pair that could begin it."""
        return self.poses.volume

    @property
    def settings(self) -> VolumeSettings | None:
        """How the model is made; None before the first pair that could begin it."""
        return None if self.volume is None else self.volume.settings

    @property
    def carved(self) -> Carved | None:
        """What the views told of the box around the object, once the model was asked for; None: there is none."""
        return self._fusion.carved

    @property
    def unused_mat(self) -> MatInView | None:
        """A printed mat that is in view, though none is wanted; None: none was found."""
        return None if self._detector is None else self._detector.result

    def take(self, name: str, stamp_s: float, processed: Processed, skew_s: float = 0.0) -> ScannedPair:
        """Take the next pair.

        Args:
            name: of the pair.
            stamp_s: when it was taken, s.
            processed: with disparity and cloud.
            skew_s: by how much its two images were not taken at the same moment, s; a moving camera's depths count for less then.

        Raises:
            DataError: its size is not that of the pairs before it.
        """
        if self._detector is not None and self._detector.take(processed.pair.left) and self._detector.result:
            self._on_unused_mat(self._detector.result)
        view = replace(view_of(processed, self.wanted.mat), stamp_s=stamp_s, skew_s=skew_s)
        number, before = len(self._pairs), self.settings
        if not self.poses.has_size:
            self.geometry, self.size_px = view.geometry, size_px(view.grey)
        elif view.geometry != self.geometry and 0 < self._closed.pairs == number:
            raise SettingsError(
                "the resumed scan has another calibration, size or crop",
                "give the same options as before, or start a new scan",
            )
        require_size(name, view, self.size_px)
        told = self.poses.track(number, view)
        self._note_fineness(before, self.settings)
        for each in told.joined:
            self._joined(each)
        self._moved(told.moved_views)
        if told.used is not None and told.is_fused:
            self._fusion.add(number, told.used, told.world_camera)
        elif told.used is not None:
            self._fusion.depths.keep_apart(number, told.used)
        pair = ScannedPair(
            name=name,
            stamp_s=stamp_s,
            world_camera=told.world_camera,
            state=told.state,
            weakness=told.weakness,
            density=view.density,
            corners=told.moved.inliers,
            overlap=math.nan if told.fit is None else told.fit.overlap,
            off_m=math.nan if told.fit is None else told.fit.off_m,
            mat=told.mat,
            is_followed=told.is_followed,
        )
        self._numbers[name] = number
        self._pairs.append(pair)
        return pair

    def _note_fineness(self, before: VolumeSettings | None, now: VolumeSettings | None) -> None:
        """Note that the field was begun, or has become coarser: closed submaps do not hold any more then, and the box is carved in as coarse cells."""
        if now is None or (before is not None and before.voxel_m == now.voxel_m):
            return
        self._fusion.carve(self._surface.cells(self.wanted.model_box, now.voxel_m))
        self._is_changed = before is not None or now.voxel_m != self.poses.begun_voxel_m

    def _joined(self, view: Joined) -> None:
        """Note that a pair that was lost has become part of the model; what it saw carves, too."""
        at = view.number
        self._pairs[at] = replace(
            self._pairs[at], world_camera=view.world_camera, state=view.state, weakness=view.weakness
        )
        self._is_changed = self._is_changed or at < self._closed.pairs
        self._fusion.join(at, view.world_camera)

    def _moved(self, views: Sequence[Placed]) -> None:
        """Note where pairs were taken after a loop has moved them; they carve from there."""
        if not views:
            return
        poses = {view.number: view.world_camera for view in views}
        by = SE3.identity()
        for at, pair in enumerate(self._pairs):  # the pair after these is told so itself
            if at in poses:
                by = poses[at] @ pair.world_camera.inverse()
            elif not pair.is_followed:
                continue
            # What is tracked only moves with the last pair in the model before it.
            self._pairs[at] = replace(pair, world_camera=poses[at] if at in poses else (by @ pair.world_camera).exact())
        self._is_changed = True
        self._fusion.move(poses)

    def final(self, pair: ScannedPair) -> ScannedPair:
        """Return what has become of a pair since it was taken."""
        number = self._numbers.get(pair.name)
        return pair if number is None else self.poses.final(number, self._pairs[number])

    @property
    def is_submap_due(self) -> bool:
        """Whether enough pairs were fused since the last submap was closed that losing them would hurt."""
        return self.poses.is_resumable and self.fused - self._closed.fused >= _SUBMAP_PAIRS

    @property
    def is_submap_open(self) -> bool:
        """Whether pairs were fused since the last submap was closed."""
        return self.poses.is_resumable and self.fused > self._closed.fused

    def close_submap(self, *, whole: bool = False) -> Submap:
        """Close a submap: give what was learnt since the last one. Some pair had depth.

        Where submaps hold the same blocks again and again, it is one that holds everything.

        Args:
            whole: whether it is one in any case.
        """
        assert self.volume is not None
        assert self.geometry is not None
        before, volume = self._closed, self.volume
        blocks = volume.changed_blocks()
        is_crowded = before.blocks + len(blocks.places) > _MOST_COPIES * volume.blocks.count
        is_whole = whole or self._is_changed or is_crowded
        if is_whole:
            before, blocks = _Closed(), volume.changed_blocks(every=True)
        self._is_changed = False
        tracker = self.poses.state(before.places)
        self._closed = _Closed(
            len(self._pairs), self.fused, before.places + len(tracker.places), before.blocks + len(blocks.places)
        )
        return Submap(
            is_whole=is_whole or before.pairs == 0,
            pairs=tuple(self._pairs[before.pairs :]),
            settings=volume.settings,
            geometry=self.geometry,
            size_px=self.size_px,
            blocks=blocks,
            tracker=tracker,
            carved=self.carved,
        )

    def go_on(self, submaps: Sequence[Submap]) -> None:
        """Go on where the last of some submaps was closed. Nothing was taken yet.

        Args:
            submaps: of another scan, from its last whole one on, in order.

        Raises:
            SettingsError: that had another box, or a mat where this one has none.
        """
        if begun_on_table(submaps) != self.wanted.on_table:
            raise SettingsError(
                f"the resumed scan was started {'without' if self.wanted.on_table else 'with'} --object",
                "give the same options as before, or start a new scan",
            )
        pairs = [pair for each in submaps for pair in each.pairs]
        had_mat = any(pair.mat is not None for pair in pairs)
        if had_mat != (self.wanted.mat is not None):
            raise SettingsError(
                f"the resumed scan had {'a' if had_mat else 'no'} mat",
                "give the same --mat as before, or start a new scan",
            )
        self.poses.go_on(submaps)
        self.geometry, self.size_px, carved = submaps[0].geometry, submaps[0].size_px, submaps[-1].carved
        cells = self._surface.cells(self.wanted.model_box, submaps[0].settings.voxel_m)
        if (None if carved is None else carved.cells) != cells:
            raise SettingsError(
                "the resumed scan had another box",
                "give the same --box and --mat as before, or start a new scan",
            )
        self._fusion.carve(cells)
        if carved is not None and self._fusion.carving is not None:
            self._fusion.carving.go_on(carved)
        self._pairs, self._numbers = pairs, {pair.name: number for number, pair in enumerate(pairs)}
        places = sum(len(each.tracker.places) for each in submaps)
        self._closed = _Closed(len(pairs), self.fused, places, sum(len(each.blocks.places) for each in submaps))

    def crop(self, box: Box | None) -> None:
        """Keep only what lies in a box, and close it: when the model is made, for the field holds it all.

        Args:
            box: m; None: everything.
        """
        self.wanted = replace(self.wanted, box=box)
        self.poses.crop(self.wanted.model_box)

    def model(self) -> ScanModel:
        """Return the surface so far: with a box the closed one in it, else what was seen; without triangles before any was."""
        self._moved(self.poses.settle())
        volume = self.volume
        if volume is None:
            return ScanModel.empty()
        model = self._surface.model(volume, self._fusion, self.wanted.model_box)
        views = self.poses.fused_views(self._fusion.depths.fused)
        return model if views is None else model.judged(volume, views, self.poses.pose_errors)


def scan_for(wanted: ScanWanted, on_unused_mat: Callable[[MatInView], None] = lambda _: None) -> Scan:
    """Begin a scan: of cameras that move, around anything, a mat or an object on a table, or of an object that turns.

    Args:
        wanted: what for.
        on_unused_mat: is called when a printed mat is in view that the scan does not use, before the pair that shows it is taken.
    """
    if wanted.turntable:
        turning = TurntablePoses(wanted)
        return Scan(wanted, turning, TurnSurface(turning, wanted.onto), on_unused_mat)
    if wanted.on_table:
        on_table = TablePoses(wanted)
        return Scan(wanted, on_table, TableSurface(on_table, wanted.floor), on_unused_mat)
    poses = VisualPoses(wanted) if wanted.mat is None else MatPoses(wanted, wanted.mat)
    return Scan(wanted, poses, BoxSurface(wanted.floor), on_unused_mat)
