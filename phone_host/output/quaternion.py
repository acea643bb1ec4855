"""Rotations as the four numbers that other programs' files hold. Pure."""

import numpy as np
from numpy.typing import NDArray


def quaternion_of(rotation: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return w, x, y, z of a rotation, w >= 0: the eigenvector of Bar-Itzhack's matrix (2000), which no angle divides by 0.

    Args:
        rotation: (3, 3) float64.
    """
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = rotation
    matrix = np.array(
        [
            [xx - yy - zz, 0, 0, 0],
            [yx + xy, yy - xx - zz, 0, 0],
            [zx + xz, zy + yz, zz - xx - yy, 0],
            [zy - yz, xz - zx, yx - xy, xx + yy + zz],
        ]
    )
    _, vectors = np.linalg.eigh(matrix, UPLO="L")
    x, y, z, w = vectors[:, -1]
    return np.array([w, x, y, z]) * (1.0 if w >= 0 else -1.0)
