"""A model as a printer wants it: in millimetres, z up."""

from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.output.axes import Axes
from phone_host.output.model_file import Model, read_model

_UP: Final = {"z": ((1, 0, 0), (0, 1, 0), (0, 0, 1)), "y": ((1, 0, 0), (0, 0, -1), (0, 1, 0)), "-y": ((1, 0, 0), (0, 0, 1), (0, -1, 0))}  # fmt: skip
"""Rows of the rotation that puts this axis up."""

_UP_OF: Final = {Axes.CAMERA: "-y", Axes.Y_UP: "y", Axes.MAT: "z", Axes.TABLE: "z", Axes.GLTF: "y", None: "z"}


@dataclass(frozen=True, slots=True, eq=False)
class Upright:
    """A model with z up.

    Attributes:
        model: as it was read.
        points_mm: (V, 3) float64.
    """

    model: Model
    points_mm: NDArray[np.float64]


def upright_model(path: Path, unit: str | None, up: str | None) -> Upright:
    """Read a model and put it upright.

    Args:
        path: the folder of a scan, or a mesh.
        unit: m or mm; None: as the file says, else m.
        up: the axis that points up: z, y or -y; None: as its axes say.

    Raises:
        DataError: it is none, or cannot be read.
    """
    model = read_model(path, unit)
    turn = np.array(_UP[up or _UP_OF[model.axes]], np.float64)
    return Upright(model, model.solid.points_m.astype(np.float64) * 1000 @ turn.T)
