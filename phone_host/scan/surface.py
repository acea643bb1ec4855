"""How the surface of a scan is made: of all that was seen, closed in a box, or closed around what stands on a table. Pure.

There is one class for each way to make one; that of an object that turns is in `turntable`, and only `scan.scan_for` knows them all.
"""

from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from phone_host.scan.blocks import INSIDE, ONE, SIDE, Blocks, Box, Cells
from phone_host.scan.closing import Floor
from phone_host.scan.fusion import Fusion
from phone_host.scan.mat import ABOVE_M
from phone_host.scan.pose_source import TablePoses
from phone_host.scan.scan_model import ScanModel, closed_model, open_model
from phone_host.scan.volume import Volume
from phone_host.scan.volume_settings import LEAST_WEIGHT, VolumeSettings

Mask = NDArray[np.bool_]

_CELLS: Final = 64
"""Along the room's longest side: things closer together than a cell or two count as connected."""

_LEAST_CELL_VOXELS: Final = 3.0
_NEAR: Final = 0.35
"""Of the field's range: a voxel with a smaller value is at the surface."""

_MARGIN_VOXELS: Final = 4.0
_LEAST_VOXELS: Final = 1.5
"""Above the table: what is lower may be its surface."""


class Surface(Protocol):
    """Makes the surface of a scan."""

    def cells(self, box: Box | None, voxel_m: float) -> Cells | None:
        """Return the cells that are carved as the views come.

        Args:
            box: that was asked for; None: there is none.
            voxel_m: distance of two values of the field, m.
        """
        ...

    def model(self, volume: Volume, fusion: Fusion, box: Box | None) -> ScanModel:
        """Make the surface.

        Args:
            volume: of the scan.
            fusion: what its views tell beside that.
            box: outside of which nothing belongs to the model, and in which it is closed; None: it is open, unless the class closes it by itself.
        """
        ...


class BoxSurface:
    """All that was seen; closed in a box where there is one."""

    def __init__(self, floor: Floor | None) -> None:
        self._floor = floor

    def cells(self, box: Box | None, voxel_m: float) -> Cells | None:
        """See `Surface.cells`."""
        return None if box is None else Cells.of(box, voxel_m)

    def model(self, volume: Volume, fusion: Fusion, box: Box | None) -> ScanModel:
        """See `Surface.model`."""
        if box is None:
            return open_model(volume)
        carving = fusion.carving_in(Cells.of(box, volume.settings.voxel_m))
        return closed_model(volume, carving, box, self._floor)


class TableSurface(BoxSurface):
    """What stands on the table in the room and is connected to the object, closed down to the table; or what is in a box that was asked for."""

    def __init__(self, poses: TablePoses, floor: Floor | None) -> None:
        super().__init__(floor)
        self._poses = poses

    def cells(self, box: Box | None, voxel_m: float) -> Cells | None:
        """See `Surface.cells`: the room's, without a box."""
        return self._poses.cells if box is None else super().cells(box, voxel_m)

    def model(self, volume: Volume, fusion: Fusion, box: Box | None) -> ScanModel:
        """See `Surface.model`."""
        room, cells = self._poses.room, self._poses.cells
        if box is not None or room is None or cells is None:
            return super().model(volume, fusion, box)
        above_m = max(ABOVE_M, _LEAST_VOXELS * volume.settings.voxel_m)
        around = thing_box(volume.blocks, volume.settings, room, above_m)
        if around is None:
            return ScanModel.empty()
        return closed_model(volume, fusion.carving_in(cells), around, Floor(skip_m=above_m))


def thing_box(blocks: Blocks, settings: VolumeSettings, room: Box, above_m: float) -> Box | None:
    """Return the box of the thing that stands nearest to the room's middle, inside the room and down to `above_m`; None: there is none."""
    low, high = np.array(room.low_m), np.array(room.high_m)
    cell_m = max(float((high - low).max()) / _CELLS, _LEAST_CELL_VOXELS * settings.voxel_m)
    points = _surface_m(blocks, settings, room, above_m)
    if not len(points):
        return None
    at = ((points - low) / cell_m).astype(np.int64)
    occupied = np.zeros(((high - low) / cell_m).astype(np.int64) + 1, np.bool_)
    occupied[tuple(at.T)] = True
    thing = _connected(occupied, _nearest(occupied, low, cell_m))
    own = points[thing[tuple(at.T)]]
    margin = _MARGIN_VOXELS * settings.voxel_m
    least, most = np.maximum(own.min(axis=0) - margin, low), np.minimum(own.max(axis=0) + margin, high)
    x, y, _ = least.tolist()
    return Box((x, y, above_m), (float(most[0]), float(most[1]), float(most[2])))


def _surface_m(blocks: Blocks, settings: VolumeSettings, room: Box, above_m: float) -> NDArray[np.float64]:
    """Return the voxels (N, 3), m, at the surface, in the room and above the table."""
    low, high = np.array(room.low_m), np.array(room.high_m)
    low[2] = max(low[2], above_m)
    places, side_m = blocks.places[: blocks.count], SIDE * settings.voxel_m
    numbers = np.flatnonzero(((places * side_m <= high) & ((places + 1) * side_m >= low)).all(axis=1))
    near = np.abs(blocks.field[numbers].astype(np.int32)) < _NEAR * ONE
    block, voxel = np.nonzero(near & (blocks.weights[numbers] >= LEAST_WEIGHT))
    points = (SIDE * places[numbers[block]].astype(np.int64) + INSIDE[voxel]) * settings.voxel_m
    return np.asarray(points[((points >= low) & (points <= high)).all(axis=1)], np.float64)


def _nearest(occupied: Mask, low: NDArray[np.float64], cell_m: float) -> Mask:
    """Return the cells of the columns in the middle, or of the nearest one that holds something."""
    columns = np.argwhere(occupied.any(axis=2))
    aside = np.linalg.norm((columns + 0.5) * cell_m + low[:2], axis=1)
    chosen = columns[aside <= aside.min() + cell_m]
    seed = np.zeros_like(occupied)
    seed[chosen[:, 0], chosen[:, 1]] = occupied[chosen[:, 0], chosen[:, 1]]
    return seed


def _connected(occupied: Mask, seed: Mask) -> Mask:
    """Return the cells that are connected to some, also over an edge or a corner."""
    found = seed
    while True:
        wider = found
        for axis in range(3):
            padded = np.pad(wider, [(1, 1) if each == axis else (0, 0) for each in range(3)])
            count = wider.shape[axis]
            wider = np.logical_or.reduce([padded.take(range(first, first + count), axis=axis) for first in range(3)])
        wider = wider & occupied
        if wider.sum() == found.sum():
            return found
        found = wider
