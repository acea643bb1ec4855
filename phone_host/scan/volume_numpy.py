"""What is computed on a volume's blocks in numpy: what the native library does, for machines without it and to judge it; and the gain of a view's colours. Pure.

The operations are those of native/src/volume.c, fuse_kernel.c and cast_kernel.c, float32 in the same order.
One field is taken into another (absorb.c) at a rigid motion: values are interpolated between the voxels of the one and averaged into the other, each by
its weight. A field moves as a whole and is never warped.
"""

from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.geometry.se3 import SE3
from phone_host.model import Image, StereoGeometry
from phone_host.scan.blocks import CORNERS, INSIDE, ONE, SIDE, VOXELS, Blocks
from phone_host.scan.view import Camera, Depth, View
from phone_host.scan.volume_settings import LEAST_WEIGHT, MOST_WEIGHT, WEIGHT_ONE, VolumeSettings

Floats = NDArray[np.float32]
F: Final = np.float32

_SAMPLES: Final = 5
_AT_ONCE: Final = 64
"""Blocks that are computed together: they fit the cache."""

_SEED_TRUNCATIONS: Final = F(1.5)
_JUMP: Final = F(0.025)
_KNOWN: Final = F(0.75)
_ROOT_STEPS: Final = 2
_MAX_STEPS: Final = 1 << 17
_MEMORY: Final = 2


def _turned(pose: Floats, x: Floats, y: Floats, z: Floats) -> Floats:
    """Return the three coordinates (3, N) of turned and shifted points."""
    return np.stack([row[0] * x + row[1] * y + row[2] * z + row[3] for row in pose])


def _rows(pose: SE3) -> Floats:
    return np.column_stack([pose.R, pose.t_m]).astype(F)


def _slopes(geometry: StereoGeometry, shape: tuple[int, int]) -> tuple[Floats, Floats]:
    """Return x / z of the columns, (1, W), and y / z of the rows, (H, 1)."""
    height, width = shape
    focal = F(geometry.focal_px)
    columns = (np.arange(width, dtype=F) - F(geometry.cx_px)) / focal
    rows = (np.arange(height, dtype=F) - F(geometry.cy_px)) / focal
    return columns[np.newaxis], rows[:, np.newaxis]


def touch(blocks: Blocks, settings: VolumeSettings, depth: Depth, camera: Camera, step: int) -> int:
    """Add the blocks that a depth image shows, as far as there is room; return how many found none."""
    dx, dy = (np.broadcast_to(slope, depth.shape)[::step, ::step] for slope in _slopes(camera.geometry, depth.shape))
    seen = depth[::step, ::step]
    usable = (seen > 0) & (seen <= F(settings.far_m))
    scale = F(1) / (F(SIDE) * F(settings.voxel_m))
    places = []
    for sample in range(_SAMPLES):
        z = seen[usable] + (F(sample) * F(0.5) - F(1)) * F(settings.truncation_m)
        world = _turned(_rows(camera.world_camera), dx[usable] * z, dy[usable] * z, z)
        places.append(np.floor(world * scale).astype(np.int32).T)
    wanted = np.unique(np.concatenate(places), axis=0)
    new = wanted[blocks.find(wanted) < 0]
    room = blocks.room - blocks.count
    blocks.add(new[:room])
    return max(len(new) - room, 0)


def fuse(blocks: Blocks, settings: VolumeSettings, view: View, camera_world: SE3) -> NDArray[np.uint8]:
    """Fuse a view into all blocks; return which got something, (count,)."""
    changed = np.zeros(blocks.count, np.uint8)
    for first in range(0, blocks.count, _AT_ONCE):
        part = slice(first, min(first + _AT_ONCE, blocks.count))
        changed[part] = _fuse_some(blocks, part, settings, view, _rows(camera_world))
    return changed


def _fuse_some(blocks: Blocks, part: slice, settings: VolumeSettings, view: View, pose: Floats) -> NDArray[np.bool_]:
    seen, pixels, z = _seen_at(blocks.places[part], F(settings.voxel_m), pose, view.geometry, view.depth_m)
    distance, truncation = seen - z, F(settings.truncation_m)
    with np.errstate(invalid="ignore", divide="ignore"):
        got = (seen > 0) & (seen <= F(settings.far_m)) & (distance >= -truncation)
        sure = F(settings.sure_m) / (F(view.noise_per_m) * seen[got] * seen[got])
    share = np.minimum(distance[got] / truncation, F(1))
    value = np.floor(share * F(ONE) + F(0.5)).astype(np.int32)
    weight = np.maximum((F(WEIGHT_ONE) * np.minimum(sure * sure, F(1)) + F(0.5)).astype(np.int32), 1)
    held = blocks.weights[part][got].astype(np.int32)
    total = (held + weight).astype(F)
    mean = np.floor((blocks.field[part][got] * held + value * weight).astype(F) / total + F(0.5)).astype(np.int16)
    blocks.field[part][got] = np.where(mean == 0, np.int16(1), mean)
    near = got.copy()
    near[got] = share < 1
    of = share < 1
    tint = view.colours.reshape(-1, 3)[pixels[near]].astype(np.int32) * weight[of, np.newaxis]
    old = blocks.colours[part][near].astype(np.int32) * held[of, np.newaxis]
    blocks.colours[part][near] = ((old + tint).astype(F) / total[of, np.newaxis] + F(0.5)).astype(np.uint8)
    blocks.weights[part][got] = np.minimum(held + weight, MOST_WEIGHT)
    return np.asarray(got.any(axis=1), np.bool_)


def _seen_at(
    places: NDArray[np.int32], voxel: np.float32, pose: Floats, geometry: StereoGeometry, depth: Depth
) -> tuple[Floats, NDArray[np.int64], Floats]:
    """Return what the image shows at each voxel, its pixel, and the voxel's own depth, (N, 512) each; NaN outside the image."""
    corner = (SIDE * places).astype(F) * voxel
    at = np.arange(VOXELS)
    i, y, z = (at % SIDE).astype(F), (at // SIDE % SIDE).astype(F) * voxel, (at // SIDE**2).astype(F) * voxel
    camera = []
    for row in pose:
        first = row[0] * corner[:, 0] + row[1] * corner[:, 1] + row[2] * corner[:, 2] + row[3]
        start = first[:, np.newaxis] + (row[1] * y + row[2] * z)
        camera.append(start + (row[0] * voxel) * i)
    depths = camera[2]
    safe, focal = np.maximum(depths, F(1e-3)), F(geometry.focal_px)
    u = focal * camera[0] / safe + F(geometry.cx_px) + F(0.5)
    v = focal * camera[1] / safe + F(geometry.cy_px) + F(0.5)
    height, width = depth.shape
    inside = (depths > F(1e-3)) & (u >= 0) & (v >= 0) & (u < F(width)) & (v < F(height))
    pixels = np.where(inside, v, 0).astype(np.int64) * width + np.where(inside, u, 0).astype(np.int64)
    return np.where(inside, depth.ravel()[pixels], F(np.nan)), pixels, depths


class _Field:
    """A volume's values by the place in the world, in voxels."""

    def __init__(self, blocks: Blocks) -> None:
        self._blocks = blocks

    def at(self, voxels: NDArray[np.int32]) -> tuple[Floats, NDArray[np.bool_], NDArray[np.bool_]]:
        """Return the field at voxels (N, 3), whether it is known, and whether there is a block."""
        blocks, (numbers, at) = self._blocks, self._blocks.locate(voxels)
        there = numbers >= 0
        safe = np.maximum(numbers, 0)
        return blocks.field[safe, at].astype(F), there & (blocks.weights[safe, at] > 0), there

    def between(self, points: Floats) -> Floats:
        """Return the field between voxels at (N, 3) points, trilinear among the known voxels; NaN where less than three quarters are."""
        floored = np.floor(points)
        low, share = floored.astype(np.int32), points - floored
        total, known = np.zeros(len(points), F), np.zeros(len(points), F)
        for corner in range(8):
            step = np.array([corner & 1, corner >> 1 & 1, corner >> 2], np.int32)
            values, here, _ = self.at(low + step)
            parts = np.where(step == 1, share, F(1) - share)
            whole = parts[:, 0] * parts[:, 1] * parts[:, 2]
            total += np.where(here, whole * values, F(0))
            known += np.where(here, whole, F(0))
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.where(known >= _KNOWN, total / known, F(np.nan))


def cast(blocks: Blocks, settings: VolumeSettings, camera: Camera, seeds: Depth | None) -> tuple[Floats, Floats]:
    """Return points and normals of the surface as a camera sees it, (H, W, 3) each, NaN = none."""
    dx, dy = (np.broadcast_to(slope, camera.shape).ravel() for slope in _slopes(camera.geometry, camera.shape))
    pose, reach = _rows(camera.world_camera), _SEED_TRUNCATIONS * F(settings.truncation_m)
    rays = np.stack([row[0] * dx + row[1] * dy + row[2] for row in pose], axis=1)
    start, end = np.full(dx.size, F(settings.voxel_m)), np.full(dx.size, F(settings.far_m))
    wanted = np.ones(dx.size, np.bool_)
    if seeds is not None:
        flat = seeds.ravel()
        with np.errstate(invalid="ignore"):
            wanted = flat > 0
        start = np.where(wanted, np.maximum(flat - reach, start), start)
        end = np.where(wanted, np.minimum(flat + reach, end), end)
    depth = np.full(dx.size, F(np.nan))
    depth[wanted] = _found(_Field(blocks), settings, _Rays(pose[:, 3], rays[wanted]), start[wanted], end[wanted])
    points = np.stack([dx * depth, dy * depth, depth], axis=1).reshape(*camera.shape, 3)
    return points, _normals(points)


@dataclass(frozen=True, slots=True, eq=False)
class _Rays:
    """Rays from one place, (3,), along (N, 3), m a metre of depth."""

    origin: Floats
    along: Floats

    def at(self, depth: Floats, scale: np.float32) -> Floats:
        """Return the points at (N,) depths, (N, 3), scaled."""
        return np.asarray((self.origin + depth[:, np.newaxis] * self.along) * scale, F)

    def only(self, chosen: NDArray[np.int64]) -> "_Rays":
        """Return some of them."""
        return _Rays(self.origin, self.along[chosen])


def _found(field: _Field, settings: VolumeSettings, rays: _Rays, start: Floats, end: Floats) -> Floats:
    """Return the depth of the surface on each ray, (N,), NaN = none."""
    voxel, truncation, scale = F(settings.voxel_m), F(settings.truncation_m), F(1) / F(settings.voxel_m)
    depth, before, result = start.copy(), np.zeros(len(start), np.int64), np.full(len(start), F(np.nan))
    walking = np.flatnonzero(depth < end)
    for _ in range(_MAX_STEPS):
        if not len(walking):
            break
        at = rays.only(walking).at(depth[walking], scale)
        values, known, there = field.at(np.floor(at + F(0.5)).astype(np.int32))
        values = values / F(ONE)
        behind = known & (values <= 0)
        ends = walking[behind & (before[walking] > 0)]
        result[ends] = _root(field, rays.only(ends), depth[ends] - F(2) * voxel, depth[ends] + voxel, scale)
        step = np.where(
            known, np.maximum(F(0.8) * values * truncation, voxel), np.where(there, voxel, F(0.5) * truncation)
        )
        before[walking] = np.where(known, _MEMORY, np.maximum(before[walking] - 1, 0))
        depth[walking] += step
        walking = walking[~behind]
        walking = walking[depth[walking] < end[walking]]
    return result


def _root(field: _Field, rays: _Rays, before: Floats, behind: Floats, scale: np.float32) -> Floats:
    """Return where the field is 0 between two depths of each ray, (N,), NaN = not known well enough."""

    def value(depth: Floats) -> Floats:
        return field.between(rays.at(depth, scale))

    first, second, middle = value(before), value(behind), np.full(len(before), F(np.nan))
    for _ in range(_ROOT_STEPS):
        with np.errstate(invalid="ignore", divide="ignore"):
            open_ = (first > 0) & (second <= 0)
            middle = np.where(open_, before + (behind - before) * (first / (first - second)), middle)
            here = value(np.where(open_, middle, F(0)))
            nearer = open_ & (here > 0)
        before, first = np.where(nearer, middle, before), np.where(nearer, here, first)
        behind, second = np.where(open_ & ~nearer, middle, behind), np.where(open_ & ~nearer, here, second)
    return middle


def _normals(points: Floats) -> Floats:
    """Return the normals of a point image from each point's neighbours."""
    normals = np.full(points.shape, F(np.nan))
    here = points[1:-1, 1:-1]
    with np.errstate(invalid="ignore", divide="ignore"):
        a = _slope(here, points[1:-1, :-2], points[1:-1, 2:])
        b = _slope(here, points[:-2, 1:-1], points[2:, 1:-1])
        cross = np.cross(b, a).astype(F)
        x, y, z = (cross[..., axis] for axis in range(3))
        normals[1:-1, 1:-1] = cross / np.sqrt(x * x + y * y + z * z)[..., np.newaxis]
    return normals


def _slope(here: Floats, low: Floats, high: Floats) -> Floats:
    """Return how the points go on, to the neighbours on both sides if they lie on one slope, else to the one that does; NaN: neither."""
    most = _JUMP * here[..., 2]
    both = np.abs((low[..., 2] + high[..., 2]) * F(0.5) - here[..., 2]) <= most
    after, before = (np.abs(beside[..., 2] - here[..., 2]) <= most for beside in (high, low))
    ways = [high - low, high - here, here - low]
    return np.select([flags[..., np.newaxis] for flags in (both, after, before)], ways, F(np.nan))


_STEP_PX: Final = 8
"""4800 pixels of VGA: their median is known to a thousandth, in a millisecond."""

_LEAST: Final = 200
_DARK, _BRIGHT = 16, 239
"""Outside of these a sensor tells no ratio: noise, and what is cut off."""

_MOST: Final = 2.5
"""More than a stop and a third is not exposure, but another thing."""


def gains_of(view: View, world_camera: SE3, blocks: Blocks, voxel_m: float) -> NDArray[np.float64]:
    """Return (3,) by how much a view's blue, green and red are to be multiplied to be the model's: medians over the pixels that show it; 1 where too few do."""
    depth = view.depth_m[::_STEP_PX, ::_STEP_PX].astype(np.float64)
    rows, columns = (_STEP_PX * each for each in np.nonzero(np.isfinite(depth)))
    z, of = view.depth_m[rows, columns].astype(np.float64), view.geometry
    points = np.column_stack([(columns - of.cx_px) * z / of.focal_px, (rows - of.cy_px) * z / of.focal_px, z])
    voxels = np.rint(world_camera.apply(points) / voxel_m).astype(np.int32)
    numbers, at = blocks.locate(voxels)
    safe = np.maximum(numbers, 0)
    known = (numbers >= 0) & (blocks.weights[safe, at] >= LEAST_WEIGHT) & (blocks.field[safe, at] < ONE)
    model, seen = blocks.colours[safe, at][known].astype(np.float64), view.colours[rows, columns][known]
    gains = np.ones(3)
    for channel in range(3):
        here, there = seen[:, channel], model[:, channel]
        usable = (here >= _DARK) & (here <= _BRIGHT) & (there >= _DARK) & (there <= _BRIGHT)
        if usable.sum() >= _LEAST:
            gains[channel] = np.median(there[usable] / here[usable])
    return np.asarray(np.clip(gains, 1 / _MOST, _MOST), np.float64)


def multiplied(colours: Image, gains: NDArray[np.float64]) -> Image:
    """Return colours (H, W, 3), multiplied by (3,) gains and cut off at 255."""
    table = np.clip(np.rint(np.arange(256)[:, np.newaxis] * gains), 0, 255).astype(np.uint8)
    return np.asarray(cv2.LUT(colours, table[np.newaxis]), np.uint8)


Floats64 = NDArray[np.float64]


_LOOKS: Final = np.linspace(-0.5, SIDE - 0.5, 6)
"""Places along an axis of a block, voxels, that tell which blocks it comes to lie in: at most 1.6 voxels apart."""

_NEXT_TO_NOTHING: Final = 1e-4
"""A corner with so little share may be unknown: a motion that moves nothing leaves everything as it was."""


def reached(places: NDArray[np.int32], into_of: SE3, voxel_m: float) -> NDArray[np.int32]:
    """Return the blocks (M, 3) in which moved blocks (N, 3) come to lie, in rising order."""
    looks = np.stack(np.meshgrid(_LOOKS, _LOOKS, _LOOKS, indexing="ij"), axis=-1).reshape(-1, 3) @ into_of.R.T
    found = [np.zeros((0, 3), np.int32)]
    for first in range(0, len(places), _AT_ONCE):
        corners = into_of.apply(SIDE * places[first : first + _AT_ONCE].astype(np.float64) * voxel_m) / voxel_m
        at = np.rint(corners[:, np.newaxis] + looks).astype(np.int32) >> 3
        found.append(np.unique(at.reshape(-1, 3), axis=0))
    return np.unique(np.concatenate(found), axis=0)


def absorbed(into: Blocks, of: Blocks, chosen: NDArray[np.uint8], rows: Floats64) -> NDArray[np.uint8]:
    """Average a moved field into blocks.

    Args:
        into: whose values change.
        of: the field that moves.
        chosen: (count,) 1 for each block of `into` that is looked at.
        rows: (3, 4) takes voxels of `into` to voxels of `of`.

    Returns:
        (count,) 1 for each block that got something.
    """
    changed, numbers = np.zeros_like(chosen), np.flatnonzero(chosen)
    for first in range(0, len(numbers), _AT_ONCE):
        some = numbers[first : first + _AT_ONCE]
        voxels = (SIDE * into.places[some][:, np.newaxis].astype(np.float64) + INSIDE).reshape(-1, 3)
        at = voxels @ rows[:, :3].T + rows[:, 3]
        field, weight, tint, tinted, known = _sampled(of, at)
        changed[some] = known.reshape(len(some), -1).any(axis=1)
        block, voxel = (each.ravel()[known] for each in np.broadcast_arrays(some[:, np.newaxis], np.arange(SIDE**3)))
        held, before = into.weights[block, voxel].astype(np.float64), into.field[block, voxel].astype(np.float64)
        coming, value = np.maximum(np.rint(weight[known]), 1), np.rint(field[known])
        mean = np.rint((before * held + np.where(value == 0, 1, value) * coming) / (held + coming))
        into.field[block, voxel] = np.where(mean == 0, 1, mean)
        into.weights[block, voxel] = np.minimum(held + coming, MOST_WEIGHT)
        mine, theirs = held * (np.abs(before) < ONE), coming * (tinted[known] > 0)
        share = tinted[known][:, np.newaxis]  # also next to nothing of a colour is that colour
        other = tint[known] / np.where(share > 0, share, 1)
        old, told = into.colours[block, voxel], mine + theirs > 0
        both = np.where(told, mine + theirs, 1)[:, np.newaxis]
        mixed = np.rint((old * mine[:, np.newaxis] + other * theirs[:, np.newaxis]) / both)
        into.colours[block, voxel] = np.where(told[:, np.newaxis], mixed, old)
    return changed


def _sampled(of: Blocks, at: Floats64) -> tuple[Floats64, Floats64, Floats64, Floats64, NDArray[np.bool_]]:
    """Return what a field holds at places (N, 3), voxels: value, weight, colour (N, 3) and its share, and whether all around is known."""
    low = np.floor(at).astype(np.int64)
    share, count = at - low, len(at)
    field, weight, tint, tinted = np.zeros(count), np.zeros(count), np.zeros((count, 3)), np.zeros(count)
    known = np.ones(count, np.bool_)
    for corner in CORNERS:
        by = np.where(corner, share, 1 - share).prod(axis=1)
        numbers, inside = of.locate(low + corner)
        held = np.where(numbers >= 0, of.weights[numbers, inside], 0)
        known &= (held > 0) | (by < _NEXT_TO_NOTHING)
        by = np.where(held > 0, by, 0)
        value = of.field[numbers, inside].astype(np.float64)
        field += by * value
        weight += by * held
        near = by * (np.abs(value) < ONE)  # elsewhere no colour was told
        tint += near[:, np.newaxis] * of.colours[numbers, inside]
        tinted += near
    return field, weight, tint, tinted, known
