"""Pairs go in one after another, a model comes out. Pure: no files, no clock.

The world's axes are those of the rectified left camera at the first pair that has depth; with a mat, the mat's; of a thing on a table, the table's.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Final

import numpy as np

from common.errors import SettingsError
from phone_host.geometry.se3 import SE3
from phone_host.model import Processed, StereoGeometry
from phone_host.scan.box import Box
from phone_host.scan.carving import Carving
from phone_host.scan.cells import Cells
from phone_host.scan.fineness import fineness_for
from phone_host.scan.kept_depths import KeptDepths
from phone_host.scan.map_fragment import Joined
from phone_host.scan.mat_tracker import MatTracker, begun_on_mat
from phone_host.scan.piece import PoseGate
from phone_host.scan.scan_model import ScanModel, closed_model, open_model
from phone_host.scan.scan_wanted import ScanWanted
from phone_host.scan.scanned import ScannedPair, Submap, begun_on_table
from phone_host.scan.stretches import Placed
from phone_host.scan.surface_error import FusedDepths, PoseErrors
from phone_host.scan.taken_view import require_size, view_of
from phone_host.scan.tracker import Tracker
from phone_host.scan.tracking_words import Tracking, Weakness
from phone_host.scan.view import View
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
    """Takes pairs and grows a model. `ways.scan_for` begins one: a thing that turns or stands on a table has a class of its own.

    Attributes:
        tracker: of the pairs since the first that has depth; None before it.
        geometry: of these.
        size_px: width and height of their rectified images.
        begun_voxel_m: distance of two values of the field when it was begun, m; greater now where the memory was full. NaN before the first pair.

    Args:
        wanted: what for.

    Raises:
        SettingsError: that needs another class.
    """

    def __init__(self, wanted: ScanWanted) -> None:
        if type(self) is Scan and (wanted.turntable or wanted.on_table):
            raise SettingsError(
                "Scan alone takes neither turntable nor on_table", "call scan_for(wanted) in place of Scan(wanted)"
            )
        self._wanted = wanted
        self.tracker: Tracker | MatTracker | None = None
        self._carving: Carving | None = None
        self._depths = KeptDepths()
        self.geometry: StereoGeometry | None = None
        self.size_px = (0, 0)
        self._pairs: list[ScannedPair] = []
        self._closed, self._is_resumed = _Closed(), False
        self._untracked = 0  # pairs before the first that this tracker took
        self._later: dict[str, ScannedPair] = {}  # pairs of which something else has become, by name
        self._missing = Weakness.NO_MAT  # why the last pair that has depth did not begin the model
        self._is_changed = False  # whether submaps that are closed do not hold any more
        self._voxel_m = self.begun_voxel_m = math.nan  # of the field as of the last pair, and of the first

    @property
    def wanted(self) -> ScanWanted:
        """What for; with the box that was chosen since."""
        return self._wanted

    @property
    def pairs(self) -> tuple[ScannedPair, ...]:
        """What became of each pair, in order."""
        return tuple(self._pairs)

    @property
    def fused(self) -> int:
        """Pairs that became part of the model."""
        return sum(pair.is_fused for pair in self._pairs)

    @property
    def volume(self) -> Volume | None:
        """The model; None before the first pair that has depth."""
        return None if self.tracker is None else self.tracker.volume

    @property
    def settings(self) -> VolumeSettings | None:
        """How the model is made; None before the first pair that has depth."""
        return None if self.volume is None else self.volume.settings

    def take(self, name: str, stamp_s: float, processed: Processed, skew_s: float = 0.0) -> ScannedPair:
        """Take the next pair.

        Args:
            name: of the pair.
            stamp_s: when it was taken, s.
            processed: with disparity and cloud.
            skew_s: by how much its two images were not taken at the same moment, s; a moving camera's depths count for less then.

        Returns:
            What became of it.

        Raises:
            DataError: its size is not that of the pairs before it.
        """
        view = replace(view_of(processed, self._wanted.mat), stamp_s=stamp_s, skew_s=skew_s)
        density = float(np.isfinite(view.depth_m).mean())
        if self.tracker is None and density >= PoseGate().least_depths:
            self.geometry, self.size_px = view.geometry, size_px(view.grey)
            self.tracker, self._untracked = self._begun(view), len(self._pairs)
            self._carving = self._carving_of(self._wanted.model_box)
        if self.tracker is None:
            pair = ScannedPair(
                name=name,
                stamp_s=stamp_s,
                world_camera=SE3.identity(),
                state=Tracking.LOST,
                weakness=Weakness.NO_DEPTH if density < PoseGate().least_depths else self._missing,
                density=density,
            )
        else:
            if view.geometry != self.geometry and self._closed.pairs == len(self._pairs):
                raise SettingsError(
                    "the resumed scan has another calibration, size or crop",
                    "give the same options as before, or start a new scan",
                )
            require_size(name, view, self.size_px)
            self._note_fineness(self.tracker.volume.settings.voxel_m)
            told = self.tracker.track(view)
            self._note_fineness(self.tracker.volume.settings.voxel_m)
            self._joined(told.joined)
            self._moved(told.moved_views)
            if told.is_fused:
                used = view if told.used is None else told.used
                self._depths.remember(len(self._pairs), used, told.world_camera)
                if self._carving is not None:
                    self._carving.see(used, told.world_camera)
            elif isinstance(self.tracker, Tracker):  # its piece may be joined later
                self._depths.keep_apart(len(self._pairs), view)
            state, weakness = self._judged(told.state, told.weakness)
            if state is Tracking.TRACKING and told.moved.others:
                state, weakness = Tracking.WEAK, Weakness.RESTLESS
            pair = ScannedPair(
                name=name,
                stamp_s=stamp_s,
                world_camera=told.world_camera,
                state=state,
                weakness=weakness,
                density=density,
                corners=told.moved.inliers,
                overlap=math.nan if told.fit is None else told.fit.overlap,
                off_m=math.nan if told.fit is None else told.fit.off_m,
                mat=told.mat,
                is_followed=told.is_followed,
            )
        self._pairs.append(pair)
        return pair

    def _note_fineness(self, voxel_m: float) -> None:
        """Note that the field has become coarser: closed submaps do not hold any more, and the box is carved in as coarse cells."""
        if math.isnan(self._voxel_m):
            self.begun_voxel_m = voxel_m
        elif voxel_m != self._voxel_m:
            before, self._carving = self._carving, self._carving_of(self._wanted.model_box)
            if before is not None and self._carving is not None:
                self._carving.take_in(before.carved)
            self._is_changed = True
        self._voxel_m = voxel_m

    def _joined(self, views: Sequence[Joined]) -> None:
        """Note that pairs that were lost have become part of the model; what they saw carves, too."""
        for view in views:
            at = self._untracked + view.number - 1
            state, weakness = self._judged(view.state, view.weakness)
            self._pairs[at] = replace(self._pairs[at], world_camera=view.world_camera, state=state, weakness=weakness)
            self._later[self._pairs[at].name] = self._pairs[at]
            self._is_changed = self._is_changed or at < self._closed.pairs
            seen = self._depths.joined(at, view.world_camera)
            if seen is not None and self._carving is not None:
                self._carving.see(seen, view.world_camera)

    def _moved(self, views: Sequence[Placed]) -> None:
        """Note where pairs were taken after a loop has moved them; they carve from there."""
        if not views:
            return
        poses = {self._untracked + view.number - 1: view.world_camera for view in views}
        by = SE3.identity()
        for at in range(self._untracked, len(self._pairs)):  # the pair after these is told so itself
            pair = self._pairs[at]
            if at in poses:
                by = poses[at] @ pair.world_camera.inverse()
            elif not pair.is_followed:
                continue
            # What is tracked only moves with the last pair in the model before it.
            self._pairs[at] = replace(pair, world_camera=poses[at] if at in poses else (by @ pair.world_camera).exact())
            self._later[pair.name] = self._pairs[at]
        self._is_changed = True
        self._depths.move(poses)
        if self._carving is not None:
            self._carving = Carving(self._carving.cells, self._wanted.threads)
            self._depths.carve(self._carving)

    def _judged(self, state: Tracking, weakness: Weakness) -> tuple[Tracking, Weakness]:
        """Return what is told of a pair that the tracker judges so."""
        return state, weakness

    def _begun(self, view: View) -> Tracker | MatTracker | None:
        """Begin with a view that has depth; None: mat or table are not seen in it."""
        wanted = self._wanted
        if wanted.mat is not None and wanted.model_box is not None:
            fineness = partial(fineness_for, voxel_m=wanted.voxel_m, most_bytes=wanted.most_bytes)
            begun = begun_on_mat(view, wanted.mat, wanted.model_box, fineness, wanted.threads)
            if isinstance(begun, Weakness):
                self._missing = begun
                return None
            return begun
        return self._tracker(fineness_for(view, wanted.voxel_m, wanted.most_bytes))

    def _tracker(self, settings: VolumeSettings) -> Tracker:
        """Return one that makes the model coarser when its memory is full, unless a fineness was asked for."""
        wanted = self._wanted
        return Tracker(settings, wanted.threads, loops=wanted.loops, coarsens=math.isnan(wanted.voxel_m))

    def final(self, pair: ScannedPair) -> ScannedPair:
        """Return what has become of a pair since it was taken.

        Args:
            pair: as it was told then.
        """
        return self._later.get(pair.name, pair)

    @property
    def is_submap_due(self) -> bool:
        """Whether enough pairs were fused since the last submap was closed that losing them would hurt."""
        return self.fused - self._closed.fused >= _SUBMAP_PAIRS

    @property
    def is_submap_open(self) -> bool:
        """Whether pairs were fused since the last submap was closed."""
        return self.fused > self._closed.fused

    def close_submap(self, *, whole: bool = False) -> Submap:
        """Close a submap: give what was learnt since the last one. Some pair had depth.

        Where submaps hold the same blocks again and again, it is one that holds everything.

        Args:
            whole: whether it is one in any case.
        """
        assert self.tracker is not None
        assert self.geometry is not None
        before, volume = self._closed, self.tracker.volume
        blocks = volume.changed_blocks()
        is_coarser = volume.settings.voxel_m != self._voxel_m
        is_whole = (
            whole
            or is_coarser
            or self._is_changed
            or before.blocks + len(blocks.places) > _MOST_COPIES * volume.blocks.count
        )
        if is_whole:
            before, blocks = _Closed(), volume.changed_blocks(every=True)
        self._is_changed = False
        tracker = self.tracker.kept(before.places)
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
            carved=None if self._carving is None else self._carving.carved,
        )

    def go_on(self, submaps: Sequence[Submap]) -> None:
        """Go on where the last of some submaps was closed. Nothing was taken yet.

        Args:
            submaps: of another scan, from its last whole one on, in order.

        Raises:
            SettingsError: that had another box, or a mat where this one has none.
        """
        if begun_on_table(submaps) != self._wanted.on_table:
            raise SettingsError(
                f"the resumed scan was started {'without' if self._wanted.on_table else 'with'} --object",
                "give the same options as before, or start a new scan",
            )
        first = submaps[0]
        self.geometry, self.size_px = first.geometry, first.size_px
        settings, wanted = replace(first.settings, most_bytes=self._wanted.most_bytes), self._wanted
        self.tracker = (
            MatTracker(wanted.mat, wanted.model_box, settings, wanted.threads)
            if wanted.mat is not None and wanted.model_box is not None
            else self._tracker(settings)
        )
        places = 0
        for each in submaps:
            self._pairs.extend(each.pairs)
            self.tracker.volume.put(each.blocks)
            self.tracker.go_on(each.tracker)
            places += len(each.tracker.places)
        said = [pair.mat for pair in self._pairs if pair.mat is not None]
        if bool(said) != (wanted.mat is not None):
            raise SettingsError(
                f"the resumed scan had {'a' if said else 'no'} mat",
                "give the same --mat as before, or start a new scan",
            )
        if isinstance(self.tracker, MatTracker):
            self.tracker.know(said[-1].scale)
        carved, self._carving = submaps[-1].carved, self._carving_of(wanted.model_box)
        if (None if carved is None else carved.cells) != (None if self._carving is None else self._carving.cells):
            raise SettingsError(
                "the resumed scan had another box",
                "give the same --box and --mat as before, or start a new scan",
            )
        if carved is not None and self._carving is not None:
            self._carving.go_on(carved)
        written, self._untracked = sum(len(each.blocks.places) for each in submaps), len(self._pairs)
        self._closed, self._is_resumed = _Closed(len(self._pairs), self.fused, places, written), True

    def crop(self, box: Box | None) -> None:
        """Keep only what lies in a box, and close it: when the model is made, for the field holds it all.

        Args:
            box: m; None: everything.
        """
        self._wanted = replace(self._wanted, box=box)

    def model(self) -> ScanModel:
        """Return the surface so far: with a box the closed one in it, else what was seen; without triangles before any was."""
        model, volume = self._surface(), self.volume
        if volume is None or self._lacks_views:
            return model
        return model.judged(volume, self._fused_views(), self._pose_errors)

    @property
    def _lacks_views(self) -> bool:
        """Whether views of the model are missing, those before a resumption, so that the others cannot show its drift."""
        return self._is_resumed and not isinstance(self.tracker, MatTracker)

    @property
    def _pose_errors(self) -> PoseErrors:
        """How the errors of the poses are related."""
        return PoseErrors.INDEPENDENT if isinstance(self.tracker, MatTracker) else PoseErrors.DRIFT

    def _fused_views(self) -> Sequence[FusedDepths]:
        """Return the depths of views that are in the model, in order."""
        return self._depths.fused

    def _surface(self) -> ScanModel:
        """Return the surface so far, with the noise of its points."""
        volume, wanted = self.volume, self._wanted
        if volume is None:
            return ScanModel.empty()
        if isinstance(self.tracker, Tracker):
            self._moved(self.tracker.settled())
        box = wanted.model_box
        if box is None:
            return open_model(volume)
        carving = self._carving
        if carving is None or carving.cells != Cells.of(box, volume.settings.voxel_m):  # it was chosen after some views
            carving = Carving(Cells.of(box, volume.settings.voxel_m), wanted.threads)
            self._depths.carve(carving)
        return closed_model(volume, carving, box, wanted.floor)

    def _carving_of(self, box: Box | None) -> Carving | None:
        """Return what a box is carved by; None: there is none, or no model yet."""
        settings = self.settings
        return (
            None if box is None or settings is None else Carving(Cells.of(box, settings.voxel_m), self._wanted.threads)
        )
