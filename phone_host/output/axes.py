"""The axes of points in files. Inside the programs they are the left camera's: x right, y down, z forward; those of a scan on a mat or a table, and of a GLB, are their own. Pure.

Viewers such as MeshLab and Blender take y for up and look along -z: half a turn about x. Both frames are right-handed, so nothing is mirrored.
"""

from enum import Enum
from typing import Final, assert_never

import numpy as np
from numpy.typing import NDArray


class Axes(Enum):
    """Which way the axes of a file's points go."""

    CAMERA = "camera"
    Y_UP = "y-up"
    MAT = "mat"
    TABLE = "table"
    GLTF = "gltf"

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

    @property
    def to_y_up(self) -> NDArray[np.float32]:
        """(3, 3) float32: the rotation from these axes to ones with y up, whose front looks along z, as glTF wants them."""
        match self:
            case Axes.CAMERA:
                return np.diag(Axes.Y_UP.signs)
            case Axes.MAT | Axes.TABLE:
                return np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]], np.float32)
            case Axes.Y_UP | Axes.GLTF:
                return np.eye(3, dtype=np.float32)
            case _:
                assert_never(self)


_TEXTS: Final = {
    Axes.CAMERA: "x right, y down, z forward of the left camera",
    Axes.Y_UP: "x right, y up, z backward of the left camera",
    Axes.MAT: "x along the rows of the mat, y away from its last row, z up, from its middle",
    Axes.GLTF: "x left, y up, z forward, as glTF defines them",
    Axes.TABLE: "x to the right and y away from the first left camera, z up, from the table below the object",
}
