"""The cells of an image: features that lie near each other see the same part of a lens, and share what its model leaves. Pure."""

from collections.abc import Iterator
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.calibration.drift.rows import RowModel, Vector
from phone_host.stereo.evidence_points import Points

CELLS: Final = (6, 4)
"""The image is cut into 6 x 4 cells."""

_FEWEST: Final = 3
"""A cell's median speaks for it from so many features on."""

Cells = NDArray[np.intp]
"""(N,) number of each feature's cell."""


def cells_of(model: RowModel, slopes: Points) -> Cells:
    """Return the number of each feature's cell.

    Args:
        model: of the rig.
        slopes: (N, 2) of points of the right image.
    """
    made, geometry = model.rectification, model.rectification.geometry
    places = slopes * geometry.focal_px + np.array([geometry.cx_px, geometry.cy_px])
    share = (places + 0.5) / np.array([made.width_px, made.height_px])
    column, row = np.clip(share * np.array(CELLS), 0, np.array(CELLS) - 1).astype(np.intp).T
    return np.asarray(row * CELLS[0] + column, np.intp)


def medians(cell: Cells, values: Vector) -> Iterator[tuple[NDArray[np.bool_], float]]:
    """Yield which features lie in a cell and their median, for each cell that has enough of them.

    Args:
        cell: number of each feature's.
        values: (N,).
    """
    for number in np.unique(cell):
        here = cell == number
        if here.sum() >= _FEWEST:
            yield here, float(np.median(values[here]))


def typical_px(cell: Cells, off_px: Vector) -> float:
    """Return how far features lie beside their rows: the mean over all cells of their medians, px; 0 without features.

    Args:
        cell: number of each feature's.
        off_px: (N,) across the lines.
    """
    found = [abs(median_px) for _, median_px in medians(cell, off_px)]
    return float(np.mean(found)) if found else 0.0
