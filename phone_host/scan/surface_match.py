"""How two surfaces of one thing lie to each other, though nothing is known of it: an object that was scanned, turned over, and scanned again. Pure.

Many turns are tried at once, on few points, each followed by registration point to plane with the nearest point of the other surface; the best are refined in
the field of the first. A place where one surface passes through what the other has seen to be empty or full counts against it. What fits in several
ways is decided by the colours, or not at all.

Source: P. J. Besl and N. D. McKay, "A Method for Registration of 3-D Shapes", 1992; S. Geman and D. McClure, 1985 (the robust weight).
"""

from dataclasses import dataclass
from enum import Enum
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.geometry.se3 import SE3, rotations_of, vectors_of
from phone_host.scan.field_sample import sampled, slopes
from phone_host.scan.mesh import Mesh, mesh_of, without_crumbs
from phone_host.scan.volume import Volume

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

LEAST_WEIGHT: Final = 8
_DIRECTIONS, _SPINS = 60, 12
"""720 turns: none is farther than 20 degrees from one of them."""

_FEW, _SOME, _MANY = 160, 900, 3000
"""Points of the second surface for all turns, for the better ones, and for the best."""
_LEAST: Final = 60
_CELLS: Final = 30
_MARGIN: Final = 0.3
_COARSE_STEPS: Final = 20
_ROUGH_STEPS, _FINE_STEPS = 10, 12
_KEPT: Final = 32
_SAME_TURN: Final = 0.2
"""rad: two results nearer than this are one."""

_NEAR_VOXELS: Final = 1.25
_LEAST_SHARE: Final = 0.25
"""Of the second surface's points that lie on the first: both passes see the sides of a thing."""

_MOST_AGAINST: Final = 0.3
"""Share of the points that are compared at all, which contradict the first surface."""

_RIVAL, _ROUGHLY = 0.08, 0.2
"""By so much more may contradict another way to put them together: in the end, and before it was refined."""

_COLOUR_LEAD: Final = 0.15
"""By which the colours of one must agree better than those of the other, -1 to 1."""

_COLOURS_AGREE: Final = 0.5
"""And so well at least: the lamp lights the sides of a thing that lies another way unlike."""

_ROUND: Final = 3e-4
"""Share of the largest by the smallest information about a direction: below it the thing can be turned within itself."""


class Match(Enum):
    """What came of it: FOUND; NONE, no turn fits; SEVERAL, they fit in several ways that the colours do not tell apart."""

    FOUND = "found"
    NONE = "none"
    SEVERAL = "several"


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class SurfaceMatch:
    """How two surfaces lie.

    Attributes:
        match: whether it is known.
        first_second: takes the second's points to the first.
        share: of the second's points that lie on the first, 0..1.
        off_m: mean distance of these, m; NaN without any.
    """

    match: Match
    first_second: SE3
    share: float
    off_m: float


@dataclass(frozen=True, slots=True, eq=False)
class _Surface:
    """Points (N, 3), m, normals (N, 3), brightness (N,), and whether each lies near the border of what was seen (N,)."""

    points_m: Floats
    normals: Floats
    grey: Floats
    at_border: Flags

    def some(self, most: int) -> "_Surface":
        """Return at most so many points, evenly."""
        at = np.unique(np.linspace(0, len(self.points_m) - 1, most).round().astype(np.int64))
        return _Surface(self.points_m[at], self.normals[at], self.grey[at], self.at_border[at])


def matched_surfaces(first: Volume, second: Volume) -> SurfaceMatch:
    """Find how the second volume's surface lies on the first's."""
    one, other = _surface_of(first), _surface_of(second)
    nothing = SurfaceMatch(match=Match.NONE, first_second=SE3.identity(), share=0.0, off_m=float("nan"))
    if min(len(one.points_m), len(other.points_m)) < _SOME:
        return nothing
    nearest = _Nearest(one.some(_SOME))
    rough, fine = other.some(_SOME), other.some(_MANY)
    tried = [_refined(start, first, nearest, rough, _ROUGH_STEPS) for start in _starts(nearest, other.some(_FEW))]
    better = _rivals(_distinct(tried), _ROUGHLY)
    results = _distinct([_refined(each.motion, first, nearest, fine, _FINE_STEPS) for each in better])
    rivals = [each for each in _rivals(results, _RIVAL) if each.off_m <= first.settings.voxel_m]
    if not rivals:
        return nothing
    best = max(rivals, key=lambda each: each.colours)
    leads = all(best.colours - each.colours >= _COLOUR_LEAD for each in rivals if each is not best)
    known = best.least_told >= _ROUND and (len(rivals) == 1 or (leads and best.colours >= _COLOURS_AGREE))
    return SurfaceMatch(
        match=Match.FOUND if known else Match.SEVERAL, first_second=best.motion, share=best.share, off_m=best.off_m
    )


def _surface_of(volume: Volume) -> _Surface:
    mesh = without_crumbs(mesh_of(volume.blocks, volume.settings.voxel_m, LEAST_WEIGHT))
    points = mesh.points_m.astype(np.float64)
    border = _border(mesh)
    near = np.zeros(len(points), np.bool_)
    cells = np.floor(points / (4 * volume.settings.voxel_m)).astype(np.int64)
    if border.any():
        edge = {(x, y, z) for x, y, z in np.unique(cells[border], axis=0).tolist()}
        near = np.array([(x, y, z) in edge for x, y, z in cells.tolist()], np.bool_)
    return _Surface(points, _normals(mesh), mesh.colours.astype(np.float64) @ (0.3, 0.59, 0.11), near | border)


def _border(mesh: Mesh) -> Flags:
    """Return (V,): which points lie on an edge with one triangle only."""
    edges = np.sort(mesh.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1).astype(np.int64)
    keys, counts = np.unique(edges[:, 0] * max(len(mesh.points_m), 1) + edges[:, 1], return_counts=True)
    at_border, open_ = np.zeros(len(mesh.points_m), np.bool_), keys[counts == 1]
    at_border[open_ // max(len(mesh.points_m), 1)] = at_border[open_ % max(len(mesh.points_m), 1)] = True
    return at_border


def _normals(mesh: Mesh) -> Floats:
    points = mesh.points_m.astype(np.float64)
    a, b, c = (points[mesh.triangles[:, corner]] for corner in range(3))
    across, normals = np.cross(b - a, c - a), np.zeros_like(points)
    for corner in range(3):
        np.add.at(normals, mesh.triangles[:, corner], across)
    return np.asarray(normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-18), np.float64)


class _Nearest:
    """The point of a surface that is nearest to any place near it, from a grid of cells.

    Attributes:
        surface: whose points.
        middle_m: (3,) of its box, m.
        size_m: its longest side, m.
    """

    def __init__(self, surface: _Surface) -> None:
        low, high = surface.points_m.min(axis=0), surface.points_m.max(axis=0)
        self.surface, self.middle_m, self.size_m = surface, (low + high) / 2, float((high - low).max())
        margin = _MARGIN * self.size_m
        self.cell_m = self.size_m / _CELLS
        self._low = low - margin
        self._counts = np.ceil((high - low + 2 * margin) / self.cell_m).astype(np.int64)
        grid = np.stack(np.meshgrid(*(np.arange(count) for count in self._counts), indexing="ij"), axis=-1)
        centres = (self._low + (grid.reshape(-1, 3) + 0.5) * self.cell_m).astype(np.float32)
        points = surface.points_m.astype(np.float32)
        squares = (points * points).sum(axis=1)
        self._index = np.concatenate(
            [
                (squares - 2 * part @ points.T).argmin(axis=1)
                for part in np.array_split(centres, len(centres) // 4096 + 1)
            ]
        )

    def at(self, points_m: Floats) -> NDArray[np.int64]:
        """Return the numbers (...,) of the nearest points; those far outside find one of the border."""
        cells = np.clip(((points_m - self._low) / self.cell_m).astype(np.int64), 0, self._counts - 1)
        _, wide, deep = self._counts
        return np.asarray(self._index[(cells[..., 0] * wide + cells[..., 1]) * deep + cells[..., 2]], np.int64)


def _turns() -> Floats:
    """Return rotations (720, 3, 3) spread over all."""
    number = np.arange(_DIRECTIONS)
    z = 1 - (2 * number + 1) / _DIRECTIONS
    around = number * np.pi * (3 - np.sqrt(5))
    to = np.column_stack([np.sqrt(1 - z * z) * np.cos(around), np.sqrt(1 - z * z) * np.sin(around), z])
    across = np.cross([0.0, 0.0, 1.0], to)
    length = np.linalg.norm(across, axis=1, keepdims=True)
    tips = rotations_of(across / np.maximum(length, 1e-12) * np.arccos(np.clip(to[:, 2:], -1, 1)))
    spins = rotations_of(np.outer(np.arange(_SPINS) * 2 * np.pi / _SPINS, [0.0, 0.0, 1.0]))
    return np.asarray((tips[:, np.newaxis] @ spins[np.newaxis]).reshape(-1, 3, 3), np.float64)


def _starts(nearest: _Nearest, other: _Surface) -> list[SE3]:
    """Try all turns on few points; return the best, each of its own kind."""
    turns = _turns()
    turned = np.einsum("sij,nj->sni", turns, other.points_m)
    shifts = nearest.middle_m - (turned.min(axis=1) + turned.max(axis=1)) / 2
    for step in range(_COARSE_STEPS):
        reach = nearest.size_m * (0.12 * (1 - step / _COARSE_STEPS) + 0.02)
        points = np.einsum("sij,nj->sni", turns, other.points_m) + shifts[:, np.newaxis]
        normals = np.einsum("sij,nj->sni", turns, other.normals)
        at = nearest.at(points)
        there, facing = nearest.surface.points_m[at], nearest.surface.normals[at]
        difference = there - points
        off = (difference * facing).sum(axis=-1)
        square = (difference**2).sum(axis=-1)
        weight = (reach**2 / (reach**2 + square)) ** 2 * np.clip((normals * facing).sum(axis=-1), 0, 1)
        jacobian = np.concatenate([np.cross(points - nearest.middle_m, facing), facing], axis=-1)
        matrix = np.einsum("sn,sni,snj->sij", weight, jacobian, jacobian, optimize=True)
        matrix += 1e-4 * np.trace(matrix, axis1=1, axis2=2)[:, np.newaxis, np.newaxis] * np.diag(
            [nearest.size_m**2 / 10] * 3 + [1.0] * 3
        ) + 1e-12 * np.eye(6)
        right = np.einsum("sn,sni->si", weight * off, jacobian)
        move = np.linalg.solve(matrix, right[..., np.newaxis])[..., 0]
        turn = rotations_of(move[:, :3])
        turns = turn @ turns
        moved = (turn @ (shifts - nearest.middle_m)[..., np.newaxis])[..., 0]
        shifts = moved + nearest.middle_m + move[:, 3:]
    scores = _coarse_scores(nearest, other, turns, shifts)
    chosen: list[SE3] = []
    for number in np.argsort(-scores, kind="stable"):
        pose = SE3(turns[number], shifts[number])
        if len(chosen) < _KEPT and all(_turn_between(pose, each) > _SAME_TURN for each in chosen):
            chosen.append(pose)
    return chosen


def _turn_between(one: SE3, other: SE3) -> float:
    return float(np.linalg.norm(vectors_of(one.R.T @ other.R)))


def _coarse_scores(nearest: _Nearest, other: _Surface, turns: Floats, shifts: Floats) -> Floats:
    points = np.einsum("sij,nj->sni", turns, other.points_m) + shifts[:, np.newaxis]
    at = nearest.at(points)
    difference = nearest.surface.points_m[at] - points
    off = (difference * nearest.surface.normals[at]).sum(axis=-1)
    near = (np.linalg.norm(difference, axis=-1) < 2 * nearest.cell_m) & (np.abs(off) < nearest.cell_m)
    agree = (np.einsum("sij,nj->sni", turns, other.normals) * nearest.surface.normals[at]).sum(axis=-1) > 0.6
    against = ~(near & agree) & ~nearest.surface.at_border[at]
    return np.asarray((near & agree).mean(axis=1) - against.mean(axis=1), np.float64)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class _Result:
    motion: SE3
    against: float
    share: float
    off_m: float
    colours: float
    least_told: float


def _refined(start: SE3, first: Volume, nearest: _Nearest, other: _Surface, steps: int) -> _Result:
    """Lay points into the first's field, and judge how they lie."""
    settings, pose, middle = first.settings, start, nearest.middle_m
    told = np.zeros(6)
    for step in range(steps):
        points = pose.apply(other.points_m)
        off = sampled(first.blocks, settings.voxel_m, points, LEAST_WEIGHT).values * settings.truncation_m
        # The nearest point's normal is good enough to come near.
        is_rough = steps == _ROUGH_STEPS
        rise = (
            nearest.surface.normals[nearest.at(points)]
            if is_rough
            else slopes(first.blocks, settings.voxel_m, points, LEAST_WEIGHT)
        )
        usable = np.isfinite(off) & np.isfinite(rise).all(axis=1)
        usable &= (other.normals @ pose.R.T * np.nan_to_num(rise)).sum(axis=1) > 0.5
        if np.count_nonzero(usable) < _LEAST:
            break
        scale = settings.voxel_m * (3.0 if step < steps // 2 else 1.0)
        weight = (scale**2 / (scale**2 + off[usable] ** 2)) ** 2
        lever = points[usable] - middle
        jacobian = np.column_stack([np.cross(lever, rise[usable]), rise[usable]])
        matrix = (jacobian * weight[:, np.newaxis]).T @ jacobian
        scales = np.repeat([nearest.size_m / 3, 1.0], 3)
        told = np.linalg.eigvalsh(matrix / np.outer(scales, scales))
        move = np.linalg.lstsq(matrix, -jacobian.T @ (weight * off[usable]), rcond=1e-8)[0]
        turn = rotations_of(move[:3])
        pose = SE3(turn @ pose.R, turn @ (pose.t_m - middle) + middle + move[3:])
        if np.abs(move[:3]).max() < 1e-5 and np.abs(move[3:]).max() < 1e-6:
            break
    return _judged(pose, first, nearest, other, float(told[0] / max(told[-1], 1e-18)))


def _judged(pose: SE3, first: Volume, nearest: _Nearest, other: _Surface, least_told: float) -> _Result:
    settings, points = first.settings, pose.apply(other.points_m)
    found = sampled(first.blocks, settings.voxel_m, points, LEAST_WEIGHT)
    off = found.values * settings.truncation_m
    normals = other.normals @ pose.R.T
    at = nearest.at(points)
    agree = (normals * nearest.surface.normals[at]).sum(axis=1) > 0.5
    on = np.isfinite(off) & (np.abs(np.nan_to_num(off)) < _NEAR_VOXELS * settings.voxel_m) & agree
    against = ~on & ~nearest.surface.at_border[at]
    colours = 0.0
    if np.count_nonzero(on) > _LEAST:
        here, there = other.grey[on], found.colours[on] @ (0.11, 0.59, 0.3)
        spread = here.std() * there.std()
        colours = float(((here - here.mean()) * (there - there.mean())).mean() / spread) if spread > 1 else 0.0
    return _Result(
        motion=pose,
        against=float(against.sum() / max(on.sum() + against.sum(), 1)),
        share=float(on.mean()),
        off_m=float(np.abs(off[on]).mean()) if on.any() else float("nan"),
        colours=colours,
        least_told=least_told,
    )


def _distinct(results: list[_Result]) -> list[_Result]:
    """Return the results, of those that are nearly the same turn the best; the best first."""
    chosen: list[_Result] = []
    for each in sorted(results, key=lambda result: result.against - result.share):
        if all(_turn_between(each.motion, other.motion) > _SAME_TURN for other in chosen):
            chosen.append(each)
    return chosen


def _rivals(results: list[_Result], more: float) -> list[_Result]:
    """Return the results that are about as good as the best: a thing that is alike on two sides lies well in several ways."""
    share = max((each.share for each in results), default=0.0)
    least = max(_LEAST_SHARE, share / 2)
    usable = [each for each in results if each.share >= least and each.against <= _MOST_AGAINST]
    against = min((each.against for each in usable), default=0.0)
    return [each for each in usable if each.against <= against + more]
