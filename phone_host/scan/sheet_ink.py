"""Finds surface that is the ink of a printed mat at a wrong depth, and specks of measured surface. Pure.

Ink has no texture. Where an object hangs over it, the matcher takes its depth from the object's edge: the sheet is fused up to 8 mm too high,
as a dark curtain below the edge. Few views see in there, so no other view contradicts.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.scan.blocks import ONE, SIDE, Blocks
from phone_host.scan.mesh import Mesh
from phone_host.scan.mesh_parts import Flags, pieces_of
from phone_host.scan.volume_settings import LEAST_WEIGHT

_REACH_M: Final = 0.010
"""Ink that was fused too high lies below this; measured below caps 9 and 20 mm above the sheet."""

_MARGIN: Final = 0.03
"""Share of the step from ink to paper by which a point may be brighter than ink. In shadow, ink is darker: of the wrong points 95 % are within it."""

_LEAST_VOXELS: Final = 500
_LEAST_CONTRAST: Final = 40.0
"""Grey levels between ink and paper. Sheet that shows less, or fewer voxels, does not tell how dark ink is."""

_SPECK_SHARE: Final = 0.002
"""Of the triangles of the largest piece that was measured. Smaller pieces amid unseen surface are wrong matches."""


def ink_points(mesh: Mesh, weights: NDArray[np.uint16], blocks: Blocks) -> Flags:
    """Return which points cannot be told from the mat's ink, (V,): low, as dark as ink, and measured less often than half of the surface.

    Args:
        mesh: the surface in the mat's axes, with the colours of the volume.
        weights: (V,) of the voxels at its points.
        blocks: of the volume, with those of the sheet.
    """
    level = _ink_level(blocks)
    if not len(weights) or np.isnan(level):
        return np.zeros(len(weights), np.bool_)
    usual = np.median(weights[weights >= LEAST_WEIGHT]) if (weights >= LEAST_WEIGHT).any() else 0.0
    is_low = mesh.points_m[:, 2] < _REACH_M
    return np.asarray(is_low & (weights < usual) & (mesh.colours.mean(axis=1) < level), np.bool_)


def specks(mesh: Mesh, seen: Flags) -> Flags:
    """Return which points belong to no piece of measured surface of some size, (V,).

    Args:
        mesh: the surface.
        seen: (V,) whether a view measured its points.
    """
    whole = mesh.triangles[np.logical_and.reduce(seen[mesh.triangles], axis=1)]
    if not len(whole):
        return np.zeros(len(seen), np.bool_)
    piece = pieces_of(Mesh(mesh.points_m, mesh.colours, whole))
    sizes = np.bincount(piece[whole[:, 0]], minlength=len(seen))
    return np.asarray(sizes[piece] < _SPECK_SHARE * sizes.max(), np.bool_)


def _ink_level(blocks: Blocks) -> float:
    """Return the grey level below which a point is as dark as ink; NaN: too little of the sheet was seen."""
    number = np.flatnonzero(blocks.places[: blocks.count, 2] == 0)
    lowest = np.s_[: SIDE * SIDE]  # the voxels of a block at z = 0 come first
    on_sheet = (blocks.weights[number, lowest] >= LEAST_WEIGHT) & (np.abs(blocks.field[number, lowest]) < ONE // 2)
    greys = blocks.colours[number, lowest][on_sheet].mean(axis=-1)
    if len(greys) < _LEAST_VOXELS:
        return float("nan")
    ink, paper = np.percentile(greys, (10, 90)).tolist()
    return float(ink + _MARGIN * (paper - ink)) if paper - ink >= _LEAST_CONTRAST else float("nan")
