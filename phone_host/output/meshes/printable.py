"""Whether a mesh can be printed: what is wrong with it, where, and what helps. Pure. Lengths are mm, z is up.

A slicer takes a mesh that is closed and all of whose triangles face outwards. A printer lays lines as wide as its nozzle on what is below them, on
a bed of some size.
"""

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Final

import numpy as np
from numpy.typing import NDArray

from common.words import counted
from phone_host.output.meshes.nearby import Grid, hits

Points = NDArray[np.float64]
Triangles = NDArray[np.int32]

_FLAT_MM: Final = 0.2
"""A layer: what lies within it of the lowest point is pressed onto the bed."""

_LEAST_BASE: Final = 0.02
"""Share of the bed's area under the thing that must touch the bed."""

_STEEP: Final = 0.9
_CHUNK: Final = 200_000
_LEAST_OVERHANG: Final = 0.01
_LEAST_THIN: Final = 0.001
_CLEARANCE: Final = 1e-4
"""Share of a line next to its own triangle in which nothing is hit."""


class Flaw(Enum):
    """What can be wrong."""

    OPEN = "open"
    TANGLED = "tangled"
    INSIDE_OUT = "inside out"
    CROSSING = "crossing itself"
    CROWDED = "crowded"
    CRUMBS = "several bodies"
    THIN = "thin"
    OVERHANG = "overhanging"
    NO_BASE = "no flat base"
    TOO_LARGE = "larger than the bed"


@dataclass(frozen=True, slots=True, kw_only=True)
class Printer:
    """What the mesh shall be printed by.

    Attributes:
        bed_mm: what fits along x, y and z.
        least_wall_mm: of a wall; two lines of a usual nozzle are 0.8.
        overhang_deg: from the vertical, beyond which a surface needs supports.
    """

    bed_mm: tuple[float, float, float] = (220.0, 220.0, 250.0)
    least_wall_mm: float = 0.8
    overhang_deg: float = 45.0


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Problem:
    """Something that is wrong.

    Attributes:
        flaw: its kind.
        sentence: what it is.
        remedy: what helps.
        triangles: (T,) bool: where.
        blocks: whether it cannot be printed as it is; otherwise it can, but not well.
    """

    flaw: Flaw
    sentence: str
    remedy: str
    triangles: NDArray[np.bool_]
    blocks: bool


def problems(points_mm: Points, triangles: Triangles, printer: Printer, tell: Callable[[str], None]) -> list[Problem]:
    """Look for everything that is wrong.

    Args:
        points_mm: (V, 3) float64, z up.
        triangles: (T, 3) int32, anticlockwise from outside; at least one.
        printer: what it shall be printed by.
        tell: is told what is looked for next, and again while that lasts; what it raises ends the search.
    """
    corners = points_mm[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(normals, axis=1) / 2
    up = normals[:, 2] / np.where(areas > 0, 2 * areas, 1)
    tell("edges")
    found = [*_edges(triangles), *_turned(corners), *_bodies(points_mm, triangles)]
    tell("crossings")
    grid = Grid(corners)
    if grid.is_crowded:
        words = "too many triangles lie in one place to look for crossings and thin walls"
        everywhere = np.ones(len(triangles), np.bool_)
        found.append(
            _problem(Flaw.CROWDED, words, "remesh it in a mesh editor, or scan again", everywhere, blocks=False)
        )
    else:
        found += _crossings(grid, triangles, lambda: tell("crossings"))
        tell("walls")
        found += _walls(grid, normals, areas, printer.least_wall_mm, lambda: tell("walls"))
    return [*found, *_overhangs(corners, areas, up, printer), *_base(corners, areas, up), *_size(corners, printer)]


def _problem(flaw: Flaw, sentence: str, remedy: str, where: NDArray[np.bool_], *, blocks: bool = True) -> Problem:
    return Problem(flaw=flaw, sentence=sentence, remedy=remedy, triangles=where, blocks=blocks)


def _edges(triangles: Triangles) -> list[Problem]:
    """Find edges that do not belong to just two triangles, one in each direction."""
    begin, end = triangles.ravel().astype(np.int64), np.roll(triangles, -1, axis=1).ravel().astype(np.int64)
    keys = np.minimum(begin, end) << 32 | np.maximum(begin, end)
    _, edge, counts = np.unique(keys, return_inverse=True, return_counts=True)
    ahead = np.bincount(edge, begin < end, minlength=len(counts))
    lone = counts == 1
    tangled = ~lone & ((counts != 2) | (ahead != 1))
    found = []
    for flaw, bad, one, several, remedy in (
        (Flaw.OPEN, lone, "edge ends", "edges end", "scan what is missing, or make a relief of one pair"),
        (Flaw.TANGLED, tangled, "edge joins", "edges join", "scan again, or mend it in a mesh editor"),
    ):
        if number := int(bad.sum()):
            words = f"{counted(number, one, several)} {_EDGES[flaw]}"
            found.append(_problem(flaw, words, remedy, bad[edge].reshape(-1, 3).any(axis=1)))
    return found


_EDGES: Final = {
    Flaw.OPEN: "in nothing: the surface has holes",
    Flaw.TANGLED: "more than two triangles, or two that face different ways",
}
"""What they end in, or join."""


def volume_mm3(corners: Points) -> float:
    """Return what a closed mesh encloses; below zero if it is inside out.

    Args:
        corners: (T, 3, 3), mm.
    """
    middle = corners.reshape(-1, 3).mean(axis=0)
    a, b, c = np.moveaxis(corners - middle, 1, 0)
    return float((a * np.cross(b, c)).sum() / 6)


def _turned(corners: Points) -> list[Problem]:
    if volume_mm3(corners) > 0:
        return []
    everywhere = np.ones(len(corners), np.bool_)
    return [_problem(Flaw.INSIDE_OUT, "its triangles face inwards", "--fix turns them", everywhere)]


def bodies(points: int, triangles: Triangles) -> NDArray[np.int64]:
    """Return the body of each triangle, (T,) numbers from 0: triangles that share a point are of one body.

    Args:
        points: their number.
        triangles: (T, 3).
    """
    label = np.arange(points)
    while True:
        least = label[triangles].min(axis=1)
        before = label.copy()
        np.minimum.at(label, triangles.ravel(), np.repeat(least, 3))
        label = label[label]
        if np.array_equal(label, before):
            return np.unique(label[triangles[:, 0]], return_inverse=True)[1].ravel()


def _bodies(points_mm: Points, triangles: Triangles) -> list[Problem]:
    body = bodies(len(points_mm), triangles)
    sizes = np.bincount(body)
    if len(sizes) == 1:
        return []
    words = f"it is {len(sizes)} bodies; the largest has {sizes.max() / sizes.sum():.0%} of the triangles"
    return [_problem(Flaw.CRUMBS, words, "--fix keeps the largest", body != sizes.argmax(), blocks=False)]


def _crossings(grid: Grid, triangles: Triangles, tell: Callable[[], None]) -> list[Problem]:
    crossed = crossing(grid, triangles, tell)
    count = int(crossed.sum())
    remedy = "export it with --tolerance 0, or scan with a smaller --voxel"
    return [_problem(Flaw.CROSSING, f"{count} triangles cross others", remedy, crossed)] if count else []


def crossing(grid: Grid, triangles: Triangles, tell: Callable[[], None] = lambda: None) -> NDArray[np.bool_]:
    """Return (T,) bool: the triangles that cross another one without a common corner.

    Args:
        grid: of the triangles; not crowded.
        triangles: (T, 3).
        tell: called now and then.
    """
    pairs = grid.pairs()
    where = np.zeros(len(triangles), np.bool_)
    for first in range(0, len(pairs), _CHUNK):
        tell()
        one, other = pairs[first : first + _CHUNK].T
        shared = (triangles[one][:, :, np.newaxis] == triangles[other][:, np.newaxis]).any(axis=(1, 2))
        one, other = one[~shared], other[~shared]
        crossed = np.zeros(len(one), np.bool_)
        for mine, theirs in ((one, other), (other, one)):
            for corner in range(3):
                begin = grid.corners[mine, corner]
                share = hits(begin, grid.corners[mine, (corner + 1) % 3] - begin, grid.corners[theirs])
                crossed |= (share >= 0) & (share <= 1)
        where[one[crossed]] = where[other[crossed]] = True
    return where


def _walls(
    grid: Grid, normals: Points, areas: NDArray[np.float64], least_mm: float, tell: Callable[[], None]
) -> list[Problem]:
    """Find triangles behind which the surface comes again sooner than a printer can lay two lines."""
    middles = grid.corners.mean(axis=1)
    longest_mm = float(np.linalg.norm(np.ptp(grid.corners.reshape(-1, 3), axis=0)))
    reach_mm = min(least_mm, 1.01 * longest_mm)  # there is nothing farther behind any of it
    way = -normals / np.where(areas > 0, 2 * areas, 1)[:, np.newaxis] * reach_mm
    thin = np.zeros(len(middles), np.bool_)
    steps = int(np.ceil(2 * reach_mm / grid.cell)) + 1
    for first in range(0, len(middles), _CHUNK // 8):
        tell()
        rows = np.arange(first, min(len(middles), first + _CHUNK // 8))
        for share in np.linspace(0, 1, steps + 1):
            point, triangle = grid.near(middles[rows] + share * way[rows])
            ray = rows[point]
            # Most of what is near looks the same way: that is soon told, and is no far side of a wall.
            opposite = np.einsum("ij,ij->i", normals[ray], normals[triangle]) < 0
            ray, triangle = ray[opposite], triangle[opposite]
            met = hits(middles[ray], way[ray], grid.corners[triangle])
            thin[ray[(met > _CLEARANCE) & (met < 1)]] = True
    share_of_area = float(areas[thin].sum() / areas.sum()) if areas.sum() else 0.0
    if share_of_area < _LEAST_THIN:
        return []
    words = f"{share_of_area:.1%} of the surface is thinner than {least_mm:g} mm"
    return [_problem(Flaw.THIN, words, "scale it up, or print with a finer nozzle (--wall)", thin, blocks=False)]


def _overhangs(corners: Points, areas: NDArray[np.float64], up: NDArray[np.float64], printer: Printer) -> list[Problem]:
    lowest = corners[:, :, 2].min()
    hangs = (up < -np.sin(np.radians(printer.overhang_deg))) & (corners[:, :, 2].max(axis=1) > lowest + _FLAT_MM)
    share = float(areas[hangs].sum() / areas.sum()) if areas.sum() else 0.0
    if share < _LEAST_OVERHANG:
        return []
    words = f"{share:.0%} of the surface hangs over by more than {printer.overhang_deg:g} degrees"
    return [_problem(Flaw.OVERHANG, words, "switch supports on in the slicer, or turn it", hangs, blocks=False)]


def _base(corners: Points, areas: NDArray[np.float64], up: NDArray[np.float64]) -> list[Problem]:
    lowest = corners[:, :, 2].min()
    rests = (up < -_STEEP) & (corners[:, :, 2].max(axis=1) <= lowest + _FLAT_MM)
    x, y = np.ptp(corners[:, :, :2].reshape(-1, 2), axis=0)
    if areas[rests].sum() >= _LEAST_BASE * x * y:
        return []
    near = corners[:, :, 2].min(axis=1) <= lowest + 10 * _FLAT_MM
    return [_problem(Flaw.NO_BASE, "it has no flat base to stand on", "--fix cuts one", near, blocks=False)]


def _size(corners: Points, printer: Printer) -> list[Problem]:
    size = np.ptp(corners.reshape(-1, 3), axis=0)
    if fit_of(size, printer.bed_mm) >= 1:
        return []
    it, bed = (" x ".join(f"{length:.0f}" for length in lengths) for lengths in (size, printer.bed_mm))
    everywhere = np.ones(len(corners), np.bool_)
    return [_problem(Flaw.TOO_LARGE, f"it is {it} mm, the bed {bed}", "--fix scales it down; --bed names another bed", everywhere)]  # fmt: skip


def fit_of(size_mm: Points, bed_mm: tuple[float, float, float]) -> float:
    """Return how many times as large it may be, and still fit, if need be turned by 90 degrees about z.

    Args:
        size_mm: (3,) its extent, mm.
        bed_mm: what fits, mm.
    """
    x, y, z = (max(float(length), 1e-9) for length in size_mm)
    along, across, high = bed_mm
    return min(high / z, max(min(along / x, across / y), min(along / y, across / x)))
