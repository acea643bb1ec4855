"""The axes of points in files. Inside the programs they are the left camera's: x right, y down, z forward; those of a scan on a mat or a table are its own. Pure.

Viewers such as MeshLab and Blender take y for up and look along -z: half a turn about x. Both frames are right-handed, so nothing is mirrored.
"""

from enum import Enum
from typing import Final

import numpy as np
from numpy.typing import NDArray


class Axes(Enum):
    """Which way the axes of a file's points go."""

    CAMERA = "camera"
    Y_UP = "y-up"
    MAT = "mat"
    TABLE = "table"

    @property
    def text(self) -> str:
        """The axes in words, as files and reports state them."""
        return _TEXTS[self]

    @property
    def is_upright(self) -> bool:
        """Whether z is up, from what the thing stands on."""
        return self in (Axes.MAT, Axes.TABLE)

    @property
    def signs(self) -> NDArray[np.float32]:
        """(3,) float32: factors of x, y, z that take the programs' axes to these."""
        return np.array([1, -1, -1] if self is Axes.Y_UP else [1, 1, 1], dtype=np.float32)


_TEXTS: Final = {
    Axes.CAMERA: "x right, y down, z forward of the left camera",
    Axes.Y_UP: "x right, y up, z backward of the left camera",
    Axes.MAT: "x along the rows of the mat, y away from its last row, z up, from its middle",
    Axes.TABLE: "x to the right and y away from the first left camera, z up, from the table below the object",
}
