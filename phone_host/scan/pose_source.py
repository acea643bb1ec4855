"""What tells where each view was taken: the camera's own way, a table under it, or whatever comes next. Pure.

A source takes the views of one scan in order, fuses those that it is sure of into its volume, and says what became of each. There is one class for each
way to know a pose, and only `scan.scan_for` knows them all: a printed mat's is in `mat_tracker`, that of an object that turns in `turntable`.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from common.errors import SettingsError
from phone_host.scan.blocks import Box, Cells
from phone_host.scan.piece import PoseGate
from phone_host.scan.scan_wanted import ScanWanted
from phone_host.scan.scanned import ScannedPair, Submap
from phone_host.scan.stretches import Placed, WayCertainty
from phone_host.scan.surface_error import FusedView, PoseErrors
from phone_host.scan.table import Table, find_table
from phone_host.scan.tracked import Tracked, lost
from phone_host.scan.tracker import Tracker, TrackerState
from phone_host.scan.tracking_words import Weakness
from phone_host.scan.view import View
from phone_host.scan.volume import Volume
from phone_host.scan.volume_settings import VolumeSettings, fineness_for, thinner

_TABLE_TRUNCATION_SHARE: Final = 2 / 3
"""Of the usual truncation: a rendered figure then lies 0.59 mm off in place of 0.68, and is 3.7 % too large in place of 5.3. Half of it gives 0.56 mm and
2.7 %, but a table that is seen at a slant would find too little of the surface that it is laid against."""


class PoseSource(ABC):
    """Says where each view was taken, and fuses those that it is sure of.

    Attributes:
        is_resumable: whether another scan can go on from its `state`.
        begun_voxel_m: distance of two values of the field when it was begun, m; NaN: it was not, or it is made again in the end.
    """

    is_resumable = True
    begun_voxel_m = math.nan

    @property
    @abstractmethod
    def volume(self) -> Volume | None:
        """The model; None before the first view that could begin it."""

    @property
    def has_size(self) -> bool:
        """Whether all further views must have the size of the last one."""
        return self.volume is not None

    @property
    def pose_errors(self) -> PoseErrors:
        """How the errors of the poses are related."""
        return PoseErrors.DRIFT

    @property
    def certainty(self) -> WayCertainty | None:
        """How sure the camera's way is; None: something else than the way tells where it is, or nobody knows."""
        return None

    @abstractmethod
    def track(self, number: int, view: View) -> Tracked:
        """Take the next view.

        Args:
            number: of its pair; those in what is returned are such numbers, too.
            view: of the size and the geometry of those before.
        """

    def crop(self, box: Box | None) -> None:
        """Note the box that counts from now on, where it matters to what is fused.

        Args:
            box: m; None: everything.
        """
        del box

    def settle(self) -> Sequence[Placed]:
        """Put the poses, and the model with them, where all that is known agrees best, before the surface is made; return those that have moved."""
        return ()

    def final(self, number: int, pair: ScannedPair) -> ScannedPair:
        """Return a pair with the pose that it has after `settle`, where that does not come from `Placed`."""
        del number
        return pair

    def fused_views(self, kept: Sequence[FusedView]) -> Sequence[FusedView] | None:
        """Return the depths by which the surface's error is judged; None: those of a part of it are missing."""
        return kept

    def state(self, places_before: int) -> TrackerState:
        """Return what another scan needs to go on, beside the volume's blocks."""
        raise NotImplementedError

    def go_on(self, submaps: Sequence[Submap]) -> None:
        """Go on where the last of some submaps was closed. Nothing was taken yet.

        Raises:
            SettingsError: such a scan cannot be resumed.
        """
        del submaps
        raise SettingsError("such a scan cannot be resumed", "scan again from the beginning")


class VisualPoses(PoseSource):
    """Poses from what the camera sees on its way, and from the model."""

    def __init__(self, wanted: ScanWanted) -> None:
        self._wanted = wanted
        self.tracker: Tracker | None = None
        self._first = 0  # number of the first pair that the tracker took
        self._is_resumed = False

    @property
    def volume(self) -> Volume | None:
        """The model; None before the first view that has depth."""
        return None if self.tracker is None else self.tracker.volume

    @property
    def certainty(self) -> WayCertainty | None:
        """How sure the camera's way is; None where no loops are looked for."""
        return None if self.tracker is None else self.tracker.certainty

    def track(self, number: int, view: View) -> Tracked:
        """See `PoseSource.track`. The first view that has depth begins the model."""
        if self.tracker is None:
            begun = self._begun(view) if view.density >= PoseGate().least_depths else Weakness.NO_DEPTH
            if isinstance(begun, Weakness):
                return lost(begun)
            self._began(begun, number)
        assert self.tracker is not None
        told = self.tracker.track(view)
        joined = tuple(replace(each, number=self._first + each.number - 1) for each in told.joined)
        return replace(told, joined=joined, moved_views=self._numbered(told.moved_views)).unless_restless()

    def settle(self) -> Sequence[Placed]:
        """See `PoseSource.settle`: loops move the model."""
        return () if self.tracker is None else self._numbered(self.tracker.settled())

    def fused_views(self, kept: Sequence[FusedView]) -> Sequence[FusedView] | None:
        """See `PoseSource.fused_views`: without the views before a resumption the others cannot show the drift."""
        return None if self._is_resumed else kept

    def state(self, places_before: int) -> TrackerState:
        """See `PoseSource.state`. The model was begun."""
        assert self.tracker is not None
        return self.tracker.kept(places_before)

    def go_on(self, submaps: Sequence[Submap]) -> None:
        """See `PoseSource.go_on`."""
        tracker = self._tracker(replace(submaps[0].settings, most_bytes=self._wanted.most_bytes))
        for each in submaps:
            tracker.volume.put(each.blocks)
            tracker.go_on(each.tracker)
        self._began(tracker, sum(len(each.pairs) for each in submaps))
        self._is_resumed = True

    def _began(self, tracker: Tracker, first: int) -> None:
        self.tracker, self._first, self.begun_voxel_m = tracker, first, tracker.volume.settings.voxel_m

    def _begun(self, view: View) -> Tracker | Weakness:
        """Begin with a view that has depth; or say why it cannot."""
        return self._tracker(fineness_for(view, self._wanted.voxel_m, self._wanted.most_bytes))

    def _tracker(self, settings: VolumeSettings) -> Tracker:
        """Return one that makes the model coarser when its memory is full, unless a fineness was asked for."""
        wanted = self._wanted
        return Tracker(settings, wanted.threads, loops=wanted.loops, coarsens=math.isnan(wanted.voxel_m))

    def _numbered(self, views: Sequence[Placed]) -> tuple[Placed, ...]:
        return tuple(replace(each, number=self._first + each.number - 1) for each in views)


class TablePoses(VisualPoses):
    """Poses in the axes of a table on which an object stands, without a mat: the first pair tells the table, which carries the tracking with its background.

    z is up, the origin below the middle of the object as the first pair shows it. The fineness stays: the room is carved in cells of it.

    Attributes:
        room: around the object, in the table's axes; None before a table was found.
        cells: in which the room is carved.
    """

    room: Box | None = None
    cells: Cells | None = None

    def track(self, number: int, view: View) -> Tracked:
        """See `PoseSource.track`. The table is always flat; corners on it tell what its plane does not, or the pair is weak for want of them."""
        return super().track(number, view).unless_flat().unless_restless()

    def go_on(self, submaps: Sequence[Submap]) -> None:
        """See `PoseSource.go_on`. The room is the one that was carved."""
        super().go_on(submaps)
        carved = submaps[-1].carved
        if carved is not None:
            self.cells, self.room = carved.cells, _room_of(carved.cells)

    def _begun(self, view: View) -> Tracker | Weakness:
        wanted, found = self._wanted, find_table(view)
        if not isinstance(found, Table):
            return found
        settings = thinner(fineness_for(view, wanted.voxel_m, wanted.most_bytes), _TABLE_TRUNCATION_SHARE)
        self.room, self.cells = found.room, Cells.of(found.room, settings.voxel_m)
        return Tracker(settings, wanted.threads, start=found.world_camera)

    def _tracker(self, settings: VolumeSettings) -> Tracker:
        return Tracker(settings, self._wanted.threads)


def _room_of(cells: Cells) -> Box:
    low = (np.array(cells.low) + 0.5) * cells.side_m
    high = low + (np.array(cells.counts) - 1) * cells.side_m
    (x, y, z), (far_x, far_y, far_z) = low.tolist(), high.tolist()
    return Box((x, y, z), (far_x, far_y, far_z))
