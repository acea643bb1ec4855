"""Where a camera was, as text: one line a view, as evaluation tools read it. Pure.

Source: J. Sturm et al., "A Benchmark for the Evaluation of RGB-D SLAM Systems", 2012 (the format of TUM's data sets).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True, eq=False)
class Station:
    """Where a camera was.

    Attributes:
        stamp_s: when, s.
        R_world_camera: (3, 3) float64.
        t_m: (3,) float64 its centre in the world, m.
    """

    stamp_s: float
    R_world_camera: NDArray[np.float64]
    t_m: NDArray[np.float64]


def tum_text(stations: Sequence[Station]) -> str:
    """Write stations: stamp, place (m), rotation (x, y, z, w), from the camera to the world."""
    lines = ["# timestamp tx ty tz qx qy qz qw"]
    for station in stations:
        w, x, y, z = quaternion_of(station.R_world_camera)
        places = " ".join(f"{value:.6f}" for value in station.t_m)
        lines.append(f"{station.stamp_s:.6f} {places} {x:.8f} {y:.8f} {z:.8f} {w:.8f}")
    return "\n".join(lines) + "\n"


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
