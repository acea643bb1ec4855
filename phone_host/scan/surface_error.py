"""How far a model's surface is expected to be off, from how well the parts of the camera's path agree on it. Pure.

The noise of single depths tells too little: depths of neighbouring views err together, by the matcher and by the drift of the path. So the path is cut
into segments that look from different places. Where several of them saw a piece of the surface, the spread of their mean distances from it tells by how
much their mean is off (batch means). What the matcher does alike in all views comes on top, as far as it moves the surface along its normal.

Source: J. M. Flegal and G. L. Jones, "Batch means and spectral variance estimators in Markov chain Monte Carlo", 2010.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum
from types import MappingProxyType
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.geometry.se3 import SE3, vectors_of
from phone_host.model import Image
from phone_host.scan.blocks import SIDE
from phone_host.scan.view import Camera, View, narrowed
from phone_host.scan.volume import Volume

Floats = NDArray[np.float64]
Numbers = NDArray[np.int64]
Texture = NDArray[np.float16]


class ErrorScope(Enum):
    """What the stated error of a surface covers.

    NOISE: the noise of single pairs; the drift of the camera's path comes on top. DRIFT: noise, matching errors that pairs share, and drift.
    """

    NOISE = "drift not included"
    DRIFT = "drift included"


class PoseErrors(Enum):
    """How the errors of a scan's poses are related.

    INDEPENDENT: a mat tells each pose by itself. DRIFT: they add up along the path.
    """

    INDEPENDENT = "independent"
    DRIFT = "drift"


_SEGMENT: Final = 0.6
"""rad that a segment of the path turns, or moves as seen from the surface: a matcher's errors are others then."""

_LEAST_SEGMENTS: Final = 3
"""Two have one difference, which may be small by chance."""

_LEAST_VIEWS: Final = 8
"""Six views 60 degrees apart show most of the surface at a slant only, and their spread tells too little."""

_LEAST_SHARE: Final = 1 / 3
"""Of the segments, which see a piece of the surface on average: with fewer, drift adds up from piece to piece, and no two segments show it."""

_LEAST_COVERED: Final = 0.5
"""Share of the points on pieces that two segments or more have seen."""

_DRIFT: Final = 1.1
"""Error of the mean of all segments as a multiple of what their spread tells: neighbours err together, too. This and the next two were fitted together to
rendered sequences; decision 0140 has them, and others that were only tested."""

_BIAS: Final = MappingProxyType({PoseErrors.DRIFT: 0.3, PoseErrors.INDEPENDENT: 0.2})
"""Error that all views share, by the matcher, which no spread shows, as a share of a depth's noise: 0.15 px of a disparity. On a mat, whose poses are
independent, both images were laid onto each other again (`mat_tracker.with_exact_depths`): 0.10 px."""

_TEXTURE, _MAX_BLURRED = 4.8, 3.0
"""Grey levels a pixel: where an image changes by less, the variance of that error grows in proportion, up to so many times. Not on a mat."""

_FLAT: Final = 0.01

_UNSHOWN: Final = 2.0
"""Variance where no two segments saw the surface, as a multiple of the mean elsewhere: errors there were 1.2 times as large or more on rendered things."""

_MAX_VOXELS: Final = 6.0
"""A depth that is farther from the surface belongs to another one."""

_MIN_PIXELS: Final = 4
_WIDTH_PX: Final = 160
_MAX_VIEWS: Final = 128
"""Every second one is left out, or more, until there are no more.""" ""

_FAR: Final = 1 << 16
"""Pieces to either side of the origin: half a kilometre with voxels of 1 mm."""


@dataclass(frozen=True, slots=True, eq=False)
class FusedDepths:
    """Depths that became part of the model.

    Attributes:
        view: with them; its images do not count.
        world_camera: where it was taken.
        texture: (H, W) float16, how much the image changes along a row there, grey levels a pixel.
    """

    view: View
    world_camera: SE3
    texture: Texture

    @staticmethod
    def of(view: View, world_camera: SE3) -> "FusedDepths":
        """Return those of a view, in a size that is quick to compare."""
        depth, geometry, step = narrowed(view.depth_m, view.geometry, _WIDTH_PX)
        small = replace(view, depth_m=depth, geometry=geometry, noise_px=view.noise_px / step)
        return FusedDepths(small, world_camera, texture_of(view.grey, depth.shape))


def texture_of(grey: Image, shape: tuple[int, ...]) -> Texture:
    """Return how much an image (H, W) changes along a row, grey levels a pixel, averaged to a smaller shape."""
    slope = np.abs(np.gradient(grey.astype(np.float32), axis=1)).astype(np.float32)
    return np.asarray(cv2.resize(slope, (shape[1], shape[0]), interpolation=cv2.INTER_AREA), np.float16)


@dataclass(frozen=True, slots=True, eq=False)
class _Distances:
    """What the segments of a path saw: (M,) numbers of pieces, the mean distance of the depths from the surface there, m, and the mean square of the errors that all views share, m^2."""

    pieces: Numbers
    means_m: Floats
    biases_m2: Floats


def surface_error(
    volume: Volume,
    views: Sequence[FusedDepths],
    points_m: NDArray[np.float32],
    noise_m: NDArray[np.float32],
    pose_errors: PoseErrors,
) -> tuple[NDArray[np.float32], ErrorScope]:
    """Judge how far a surface's points may be off.

    Args:
        volume: of the model.
        views: that were fused, in order.
        points_m: (V, 3) of the surface, m.
        noise_m: (V,) their noise, m; NaN: not known.
        pose_errors: how they are related.

    Returns:
        (V,) standard deviations, m, NaN where the noise is; and what they cover. Where too few segments of the path saw the same, the noise as it is,
        without drift.
    """
    views = views[:: max(-(-len(views) // _MAX_VIEWS), 1)]
    segments = _segments(views)
    count = int(segments[-1]) + 1 if len(segments) else 0
    if len(views) < _LEAST_VIEWS or count < _LEAST_SEGMENTS or not len(points_m):
        return noise_m, ErrorScope.NOISE
    seen = _distances(volume, views, segments, pose_errors)
    pieces, at = np.unique(seen.pieces, return_inverse=True)
    times = np.bincount(at, minlength=len(pieces))
    means, biases = (np.bincount(at, of) / times for of in (seen.means_m, seen.biases_m2))
    spreads = np.bincount(at, (seen.means_m - means[at]) ** 2) / np.maximum(times - 1, 1) / times
    known = np.isfinite(noise_m)
    of_point = _pieces(points_m[known].astype(np.float64), volume)
    place = np.minimum(np.searchsorted(pieces, of_point), max(len(pieces) - 1, 0))
    covered = (pieces[place] == of_point) & (times[place] > 1) if len(pieces) else np.zeros(len(of_point), np.bool_)
    if not covered.any() or covered.mean() < _LEAST_COVERED:
        return noise_m, ErrorScope.NOISE
    if pose_errors is not PoseErrors.INDEPENDENT and times[place[covered]].mean() < _LEAST_SHARE * count:
        return noise_m, ErrorScope.NOISE
    # Few segments tell a spread badly: half of it is the mean of all.
    spread = (spreads[place] + spreads[place[covered]].mean()) / 2
    variances = np.where(covered, _DRIFT**2 * spread + biases[place], 0)
    variances[~covered] = _UNSHOWN * variances[covered].mean()
    error_m = np.full(noise_m.shape, np.nan, np.float32)
    error_m[known] = np.sqrt(variances)
    return error_m, ErrorScope.DRIFT


def _segments(views: Sequence[FusedDepths]) -> Numbers:
    """Return the number of the segment to which each view belongs, (N,), from 0 on without gaps."""
    path, numbers = 0.0, [0] * len(views)
    for at in range(1, len(views)):
        step = views[at - 1].world_camera.inverse() @ views[at].world_camera
        depth = views[at].view.depth_m
        depth = depth[np.isfinite(depth)]
        away_m = float(np.median(depth)) if depth.size else np.inf
        path += max(float(np.linalg.norm(vectors_of(step.R))), float(np.linalg.norm(step.t_m)) / away_m)
        numbers[at] = int(path / _SEGMENT)
    return np.unique(numbers, return_inverse=True)[1].astype(np.int64)


def _distances(volume: Volume, views: Sequence[FusedDepths], segments: Numbers, pose_errors: PoseErrors) -> _Distances:
    """Compare the depths of views with the surface."""
    most_m, bias = _MAX_VOXELS * volume.settings.voxel_m, _BIAS[pose_errors]
    most_blurred = 1.0 if pose_errors is PoseErrors.INDEPENDENT else _MAX_BLURRED
    keys, sums = list[Numbers](), list[Floats]()
    for each, segment in zip(views, segments, strict=True):
        view, pose, geometry = each.view, each.world_camera, each.view.geometry
        depth = np.ascontiguousarray(view.depth_m, np.float32)
        surface = volume.cast(Camera(geometry, depth.shape, pose), depth)
        rows, columns = np.indices(depth.shape, np.float32)
        seen_m = np.stack(
            [(columns - geometry.cx_px) * depth, (rows - geometry.cy_px) * depth, geometry.focal_px * depth], axis=-1
        )
        off_m = ((seen_m / geometry.focal_px - surface.points_m) * surface.normals).sum(axis=-1)
        near = np.abs(off_m) < most_m  # NaN is not
        key = (_pieces(pose.apply(surface.points_m[near].astype(np.float64)), volume) << 7) | segment
        found, at = np.unique(key, return_inverse=True)
        blurred = np.clip(_TEXTURE / np.maximum(each.texture[near].astype(np.float64), _FLAT), 1, most_blurred)
        # Of a depth's error the part along the normal moves the surface.
        along = np.abs((seen_m * surface.normals).sum(axis=-1))[near] / geometry.focal_px
        bias_m = bias * view.noise_per_m * depth[near] * along.astype(np.float64)
        of_pixel = np.ones(len(key)), off_m[near], blurred * bias_m**2
        keys.append(found)
        sums.append(np.array([np.bincount(at, each, len(found)) for each in of_pixel]))
    every, at = np.unique(np.concatenate(keys), return_inverse=True)
    pixels, off, biases = (np.bincount(at, each, len(every)) for each in np.concatenate(sums, axis=1))
    enough = pixels >= _MIN_PIXELS
    return _Distances(every[enough] >> 7, off[enough] / pixels[enough], biases[enough] / pixels[enough])


def _pieces(points_m: Floats, volume: Volume) -> Numbers:
    """Return which piece of the surface points (N, 3), m, lie on: the number of a cube as wide as a block, (N,)."""
    x, y, z = np.floor(points_m / (SIDE * volume.settings.voxel_m)).astype(np.int64).T + _FAR
    return np.asarray((x << 34) | (y << 17) | z, np.int64)
