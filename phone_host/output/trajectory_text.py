"""Where a camera was, as text: one line a view, as evaluation tools read it. Pure.

Source: J. Sturm et al., "A Benchmark for the Evaluation of RGB-D SLAM Systems", 2012 (the format of TUM's data sets).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from phone_host.output.quaternion import quaternion_of


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
