"""How far a model's surface is expected to be off, from how well the parts of the camera's path agree on it. Pure.

The noise of single depths tells too little: depths of neighbouring views err together, by the matcher and by the drift of the path. So the path is cut
into segments that look from different places. Where several of them saw a piece of the surface, the spread of their mean distances from it tells by how
much their mean is off (batch means). What the matcher does alike in all views comes on top, as far as it moves the surface along its normal.

Source: J. M. Flegal and G. L. Jones, "Batch means and spectral variance estimators in Markov chain Monte Carlo", 2010.
"""

from collections.abc import Sequence
from enum import Enum
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.geometry.se3 import SE3, vectors_of
from phone_host.scan.blocks import SIDE
from phone_host.scan.view import Camera, View, narrowed
from phone_host.scan.volume import Volume

Floats = NDArray[np.float64]
Numbers = NDArray[np.int64]
FusedView = tuple[View, SE3]
"""One that became part of the model, of which only the depths count, and where it was taken."""


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
"""Error of the mean of all segments as a multiple of what their spread tells: neighbours err together, too. This and the next ones were fitted together to
rendered sequences; decision 0147 has them, and others that were only tested."""

_EVEN, _BENT = 0.2, 0.45
"""Error that all views share, by the matcher, which no spread shows, as a share of a depth's noise, 0.5 px: that of an even piece, and what comes on top where
it is bent, as a matcher smooths edges and curves. On a mat both images were laid onto each other again (`mat_tracker.with_exact_depths`): nothing comes on top."""

_BENT_RAD: Final = 0.3
"""Spread of the normals of a piece, root mean square, from which on it is bent; below, in proportion."""

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


def surface_error(
    volume: Volume,
    views: Sequence[FusedView],
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
    seen, pixels, sums = _seen(volume, views, segments)
    enough = pixels >= _MIN_PIXELS
    pieces, at = np.unique(seen[enough] >> 7, return_inverse=True)
    off_m, *of_segments = sums[:, enough] / pixels[enough]
    times = np.bincount(at, minlength=len(pieces))
    means_m, noise_m2, *normals = (np.bincount(at, each) / times for each in (off_m, *of_segments))
    spreads = np.bincount(at, (off_m - means_m[at]) ** 2) / np.maximum(times - 1, 1) / times
    bends = np.clip((1 - np.square(normals).sum(axis=0)) / _BENT_RAD**2, 0, 1)
    smoothed = _BENT**2 * bends * (pose_errors is not PoseErrors.INDEPENDENT)
    variances_m2 = _DRIFT**2 * spreads + (_EVEN**2 + smoothed) * noise_m2
    known = np.isfinite(noise_m)
    of_point = _pieces(points_m[known].astype(np.float64), volume)
    place = np.minimum(np.searchsorted(pieces, of_point), max(len(pieces) - 1, 0))
    covered = (pieces[place] == of_point) & (times[place] > 1) if len(pieces) else np.zeros(len(of_point), np.bool_)
    if not covered.any() or covered.mean() < _LEAST_COVERED:
        return noise_m, ErrorScope.NOISE
    if pose_errors is not PoseErrors.INDEPENDENT and times[place[covered]].mean() < _LEAST_SHARE * count:
        return noise_m, ErrorScope.NOISE
    mean_m2 = variances_m2[place[covered]].mean()
    error_m = np.full(noise_m.shape, np.nan, np.float32)
    # Few segments tell a spread badly: half of it is the mean of all.
    error_m[known] = np.sqrt(np.where(covered, (variances_m2[place] + mean_m2) / 2, _UNSHOWN * mean_m2))
    return error_m, ErrorScope.DRIFT


def _segments(views: Sequence[FusedView]) -> Numbers:
    """Return the number of the segment to which each view belongs, (N,), from 0 on without gaps."""
    path, numbers = 0.0, [0] * len(views)
    for at in range(1, len(views)):
        step = views[at - 1][1].inverse() @ views[at][1]
        depth = views[at][0].depth_m
        depth = depth[np.isfinite(depth)]
        away_m = float(np.median(depth)) if depth.size else np.inf
        path += max(float(np.linalg.norm(vectors_of(step.R))), float(np.linalg.norm(step.t_m)) / away_m)
        numbers[at] = int(path / _SEGMENT)
    return np.unique(numbers, return_inverse=True)[1].astype(np.int64)


def _seen(volume: Volume, views: Sequence[FusedView], segments: Numbers) -> tuple[Numbers, Floats, Floats]:
    """Compare the depths of views with the surface.

    Returns:
        (M,) number of a piece times 128 and that of a segment which saw it; (M,) how many pixels that is; (5, M) sums over them: the distance of the depth
        from the surface, m, the variance of a depth along the normal, m^2, and the three parts of the normal.
    """
    most_m = _MAX_VOXELS * volume.settings.voxel_m
    keys, sums = list[Numbers](), list[Floats]()
    for (view, pose), segment in zip(views, segments, strict=True):
        depth, geometry, _ = narrowed(view.depth_m, view.geometry, _WIDTH_PX)
        surface = volume.cast(Camera(geometry, depth.shape, pose), depth)
        rows, columns = np.indices(depth.shape, np.float32)
        seen_m = np.stack(
            [(columns - geometry.cx_px) * depth, (rows - geometry.cy_px) * depth, geometry.focal_px * depth], axis=-1
        )
        off_m = ((seen_m / geometry.focal_px - surface.points_m) * surface.normals).sum(axis=-1)
        near = np.abs(off_m) < most_m  # NaN is not
        key = (_pieces(pose.apply(surface.points_m[near].astype(np.float64)), volume) << 7) | segment
        found, at = np.unique(key, return_inverse=True)
        normals = surface.normals[near].astype(np.float64)
        # Of a depth's error the part along the normal moves the surface.
        noise_m = view.noise_per_m * depth[near] * (seen_m[near] * normals).sum(axis=-1) / geometry.focal_px
        of_pixel = np.ones(len(key)), off_m[near], noise_m**2, *(pose.R @ normals.T)
        keys.append(found)
        sums.append(np.array([np.bincount(at, each, len(found)) for each in of_pixel]))
    every, at = np.unique(np.concatenate(keys), return_inverse=True)
    totals = np.array([np.bincount(at, each, len(every)) for each in np.concatenate(sums, axis=1)], np.float64)
    return every, totals[0], totals[1:]


def _pieces(points_m: Floats, volume: Volume) -> Numbers:
    """Return which piece of the surface points (N, 3), m, lie on: the number of a cube as wide as a block, (N,)."""
    x, y, z = np.floor(points_m / (SIDE * volume.settings.voxel_m)).astype(np.int64).T + _FAR
    return np.asarray((x << 34) | (y << 17) | z, np.int64)
