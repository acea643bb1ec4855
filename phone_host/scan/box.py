"""A box in the world, outside of which nothing belongs to the model. Pure."""

from dataclasses import dataclass

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
