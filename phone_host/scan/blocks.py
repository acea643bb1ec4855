"""Where the numbers of a volume lie: blocks of 8 x 8 x 8 voxels, and the hash table that finds them. Pure.

Value number x + 8 y + 64 z of a block belongs to the voxel at (8 place + (x, y, z)) voxel_m in the world. The native library works on
the same arrays (native/src/volume.h). Memory grows by doubling, up to a limit; what finds no room then is counted, not fused.
"""

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

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
