"""Where the numbers of a volume lie: blocks of 8 x 8 x 8 voxels, and the hash table that finds them. Pure.

Value number x + 8 y + 64 z of a block belongs to the voxel at (8 place + (x, y, z)) voxel_m in the world. The native library works on
the same arrays (native/src/volume.h). Memory grows by doubling, up to a limit; what finds no room then is counted, not fused.

A box in the world bounds what belongs to the model; a grid of cells lies in it, in whole voxels.
"""

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Box:
    """A box with its edges along the world's axes.

    Attributes:
        low_m: x, y, z of its lowest corner, m.
        high_m: of the highest, m; each is greater.
    """

    low_m: tuple[float, float, float]
    high_m: tuple[float, float, float]

    def holds(self, points_m: NDArray[np.float32]) -> NDArray[np.bool_]:
        """Return (N,): which of the points (N, 3), m, lie inside."""
        inside = (points_m >= np.array(self.low_m, np.float32)) & (points_m <= np.array(self.high_m, np.float32))
        return np.asarray(inside.all(axis=1), np.bool_)


_MOST_CELLS: Final = 4_000_000
"""A box of 0.3 m has cells of 2 mm: 5 ms of a processor a view."""


@dataclass(frozen=True, slots=True)
class Cells:
    """How a grid lies: cell number n along an axis has the voxels from n * voxels on.

    Attributes:
        low: number of the lowest cell along x, y, z.
        counts: of cells along x, y, z.
        voxels: of a cell's side.
        voxel_m: distance of two voxels, m.
    """

    low: tuple[int, int, int]
    counts: tuple[int, int, int]
    voxels: int
    voxel_m: float

    @property
    def side_m(self) -> float:
        """A cell's side, m."""
        return self.voxels * self.voxel_m

    @property
    def first_m(self) -> NDArray[np.float32]:
        """Middle of the lowest cell, (3,) m."""
        return ((np.array(self.low) * self.voxels + (self.voxels - 1) / 2) * self.voxel_m).astype(np.float32)

    @staticmethod
    def of(box: Box, voxel_m: float) -> "Cells":
        """Choose cells for a box: a voxel wide or, where that would be more than 4 million, some voxels."""
        voxels = 1
        while True:
            low, high = (np.floor(np.array(side) / (voxels * voxel_m)) for side in (box.low_m, box.high_m))
            counts = (high - low + 1).astype(np.int64)
            if counts.prod() <= _MOST_CELLS:
                x, y, z = low.astype(int).tolist()
                wide, deep, tall = counts.tolist()
                return Cells((x, y, z), (wide, deep, tall), voxels, voxel_m)
            voxels += 1


SIDE: Final = 8
VOXELS: Final = SIDE**3
ONE: Final = 32000
"""The field one truncation before the surface, and farther."""

BLOCK_BYTES: Final = VOXELS * (2 + 2 + 3) + 12 + 16
"""Memory of a block: field, weight, colour, place, and its share of the table."""

CORNERS: Final = np.array([[n & 1, n >> 1 & 1, n >> 2] for n in range(8)])
"""(8, 3) of the cube: corner n lies at x = bit 0, y = bit 1, z = bit 2 of n."""

INSIDE: Final = np.stack(np.meshgrid(*[np.arange(SIDE)] * 3, indexing="ij")[::-1], axis=-1).reshape(-1, 3)
"""(512, 3) x, y, z of a block's voxels, in the order of its values."""

_FIRST_ROOM: Final = 256
_PRIMES: Final = (73856093, 19349663, 83492791)


class Blocks:
    """The arrays of a volume; they are changed in place.

    Attributes:
        slots: (S,) int32 table: number of a block + 1, 0 = free; S is a power of two.
        places: (R, 3) int32 of the blocks, in blocks.
        field: (R, 512) int16 distance from the surface, 32000 = one truncation, positive before it.
        weights: (R, 512) uint16, 0 = nothing was seen.
        colours: (R, 512, 3) uint8, BGR.
        count: blocks in use; the others wait.

    Args:
        room: R, how many blocks the arrays hold.
    """

    def __init__(self, room: int = _FIRST_ROOM) -> None:
        self.slots = np.zeros(1 << (4 * room - 1).bit_length(), np.int32)
        self.places = np.zeros((room, 3), np.int32)
        self.field = np.full((room, VOXELS), ONE, np.int16)
        self.weights = np.zeros((room, VOXELS), np.uint16)
        self.colours = np.zeros((room, VOXELS, 3), np.uint8)
        self.count = 0

    @property
    def room(self) -> int:
        """Blocks that the arrays hold."""
        return len(self.places)

    def grown(self, room: int) -> "Blocks":
        """Return the same blocks with room for more."""
        made = Blocks(room)
        count = self.count
        made.field[:count], made.weights[:count] = self.field[:count], self.weights[:count]
        made.colours[:count] = self.colours[:count]
        made.add(self.places[:count])
        return made

    def add(self, places: NDArray[np.int32]) -> None:
        """Add blocks, (N, 3), that are not there yet, each once; there is room for them."""
        first, slots = self.count, self._hashed(places)
        self.places[first : first + len(places)] = places
        self.count += len(places)
        waiting = np.arange(len(places))
        while len(waiting):
            free = waiting[self.slots[slots[waiting]] == 0]
            # Of those that want the same slot the first gets it.
            taken, winners = np.unique(slots[free], return_index=True)
            self.slots[taken] = first + free[winners] + 1
            waiting = np.setdiff1d(waiting, free[winners])
            slots[waiting] = (slots[waiting] + 1) & (len(self.slots) - 1)

    def find(self, places: NDArray[np.int32]) -> NDArray[np.int64]:
        """Return the numbers (N,) of blocks at places (N, 3); -1 = there is none."""
        numbers, slots = np.full(len(places), -1, np.int64), self._hashed(places)
        open_ = np.arange(len(places))
        while len(open_):
            there = self.slots[slots[open_]].astype(np.int64) - 1
            same = (there >= 0) & (self.places[there] == places[open_]).all(axis=1)
            numbers[open_[same]] = there[same]
            open_ = open_[(there >= 0) & ~same]
            slots[open_] = (slots[open_] + 1) & (len(self.slots) - 1)
        return numbers

    def locate(self, voxels: NDArray[np.integer[Any]]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return the numbers (N,) of the blocks of voxels (N, 3), -1 = there is none, and which of a block's values are theirs (N,)."""
        return self.find((voxels >> 3).astype(np.int32)), (voxels & (SIDE - 1)) @ np.array([1, SIDE, SIDE**2])

    def _hashed(self, places: NDArray[np.int32]) -> NDArray[np.int64]:
        parts = places.astype(np.int64) * np.array(_PRIMES)
        return np.asarray((parts[:, 0] ^ parts[:, 1] ^ parts[:, 2]) & (len(self.slots) - 1), np.int64)
