"""A scan of a thing on a table, without a mat: the first pair tells the table, the model the thing's box. Pure.

Table and background carry the tracking, as in any scan. The world's axes are the table's: z up, the origin below the middle of the thing as the
first pair shows it. A room around it is carved as the views come; the model is what stands on the table in it and is connected to the
thing, closed down to the table.
"""

from collections.abc import Sequence
from typing import Final

import numpy as np

from phone_host.scan.box import Box
from phone_host.scan.carving import Carving
from phone_host.scan.cells import Cells
from phone_host.scan.closing import Floor
from phone_host.scan.fineness import fineness_for, thinner
from phone_host.scan.scan import Scan
from phone_host.scan.scan_model import ScanModel, closed_model
from phone_host.scan.scan_wanted import ScanWanted
from phone_host.scan.scanned import Submap
from phone_host.scan.table import ABOVE_M, Table, find_table
from phone_host.scan.table_box import thing_box
from phone_host.scan.tracker import Tracker
from phone_host.scan.tracking_words import Tracking, Weakness, unless_flat
from phone_host.scan.view import View
from phone_host.scan.volume_settings import VolumeSettings

_TRUNCATION_SHARE: Final = 2 / 3
"""Of the usual truncation: a rendered figure then lies 0.59 mm off in place of 0.68, and is 3.7 % too large in place of 5.3. Half of it gives 0.56 mm and
2.7 %, but a table that is seen at a slant would find too little of the surface that it is laid against."""

_LEAST_VOXELS: Final = 1.5
"""Above the table: what is lower may be its surface."""


class TableScan(Scan):
    """Takes pairs of a thing on a table and grows a model of it.

    Args:
        wanted: what for.
    """

    def __init__(self, wanted: ScanWanted) -> None:
        super().__init__(wanted)
        self._room: Box | None = None
        self._cells: Cells | None = None

    def _begun(self, view: View) -> Tracker | None:
        """Begin with a view that shows a table and a thing on it; None: it does not."""
        wanted, found = self._wanted, find_table(view)
        if not isinstance(found, Table):
            self._missing = found
            return None
        settings = thinner(fineness_for(view, wanted.voxel_m, wanted.most_bytes), _TRUNCATION_SHARE)
        self._room, self._cells = found.room, Cells.of(found.room, settings.voxel_m)
        return Tracker(settings, wanted.threads, start=found.world_camera)

    def _tracker(self, settings: VolumeSettings) -> Tracker:
        """Return one that keeps its fineness: the room is carved in cells of it."""
        return Tracker(settings, self._wanted.threads)

    def _judged(self, state: Tracking, weakness: Weakness) -> tuple[Tracking, Weakness]:
        """Return what is told of a pair. The table is always flat; corners on it tell what its plane does not, or the pair is weak for want of them."""
        return unless_flat(state, weakness)

    def _carving_of(self, box: Box | None) -> Carving | None:
        """Return what the room is carved by, or the box that was asked for."""
        if box is not None or self._cells is None:
            return super()._carving_of(box)
        return Carving(self._cells, self._wanted.threads)

    def go_on(self, submaps: Sequence[Submap]) -> None:
        """See `Scan.go_on`. The room is the one that was carved."""
        carved = submaps[-1].carved
        if carved is not None:
            self._cells, self._room = carved.cells, _room_of(carved.cells)
        super().go_on(submaps)

    def _surface(self) -> ScanModel:
        """Return the closed surface of the thing, or of what is in the box that was asked for."""
        volume, wanted = self.volume, self._wanted
        if volume is None or wanted.box is not None or self._room is None or self._cells is None:
            return super()._surface()
        above_m = max(ABOVE_M, _LEAST_VOXELS * volume.settings.voxel_m)
        box = thing_box(volume.blocks, volume.settings, self._room, above_m)
        if box is None:
            return ScanModel.empty()
        carving = self._carving
        if carving is None or carving.cells != self._cells:  # there was a box meanwhile
            carving = Carving(self._cells, wanted.threads)
            self._depths.carve(carving)
        return closed_model(volume, carving, box, Floor(skip_m=above_m))


def _room_of(cells: Cells) -> Box:
    low = (np.array(cells.low) + 0.5) * cells.side_m
    high = low + (np.array(cells.counts) - 1) * cells.side_m
    (x, y, z), (far_x, far_y, far_z) = low.tolist(), high.tolist()
    return Box((x, y, z), (far_x, far_y, far_z))
