"""The whole turn of a thing: from poses that were tracked one after another to one axis and angles that agree all around. Pure."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.geometry.se3 import SE3, vectors_of
from phone_host.native.library import Library, native
from phone_host.scan.camera_pose import Observer
from phone_host.scan.circle_bundle import Circle, Seen, TurnAxis, axis_of, fitted_circle, misfits, tracks_of, unwrapped
from phone_host.scan.registration import RegistrationSettings, registered
from phone_host.scan.view import Camera, View
from phone_host.scan.volume import Volume
from phone_host.scan.volume_settings import VolumeSettings

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

LEAST_VIEWS: Final = 8
"""Of a thing that turns, for an axis that is worth its name."""

_SPANS: Final = (1, 3, 8)
"""Views between two that tell the axis: far ones tell it better, near ones are there when a turn is short."""

_MOST_TILT: Final = 0.09
"""rad by which the turn between two views may lean away from the axis: 5 degrees."""

_OUTLIER_SIGMAS: Final = 4.0
_LEAST_SEEN: Final = 3
_LEAST_CLOSING: Final = 40
"""Sightings of points of one turn in views of another, that close it."""

_LEAST_SIGHTINGS: Final = 20
"""Of points of other views where they should be, for a view that tracking has lost."""

_CLOSING_VIEWS: Final = 5
_BESIDE: Final = 2
_CLOSED_OVERLAP: Final = 0.3
_CLOSED_VOXELS: Final = 3.0
"""After the fit, the depths of the end must lie on those of the beginning within this, or what closed the turn was something else."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class FullTurn:
    """A turn that was fitted.

    Attributes:
        axis: about which the thing turns.
        angles: (N,) how far it has turned at each view, rad.
        used: (N,) whether a view fits the axis.
        is_closed: whether its end was recognised as its beginning.
        gap: by how much the end missed the beginning before the fit, rad; NaN: it is not closed.
        closed_m: how far apart depths of end and beginning lie after it, m; NaN: it is not closed.
    """

    axis: TurnAxis
    angles: Floats
    used: Flags
    is_closed: bool
    gap: float
    closed_m: float

    @property
    def span(self) -> float:
        """How far the thing has turned in all, rad."""
        return float(np.ptp(self.angles[self.used])) if self.used.any() else 0.0


@dataclass(frozen=True, slots=True, eq=False)
class TurnView:
    """A view of a thing that turns.

    Attributes:
        view: of the thing alone: what does not belong to it has no depth.
        world_camera: where it was taken in the thing's axes, as tracking has it.
        is_sure: whether tracking believes that; if not, the fit decides.
    """

    view: View
    world_camera: SE3
    is_sure: bool


def full_turn(given: Sequence[TurnView], settings: VolumeSettings, threads: int) -> FullTurn | None:
    """Fit a turn to views in the order in which they were taken; None: too few agree on an axis."""
    cameras_world = [each.world_camera.inverse() for each in given]
    sure = [pose for pose, each in zip(cameras_world, given, strict=True) if each.is_sure]
    axis = axis_of(
        [after @ before.inverse() for span in _SPANS for before, after in zip(sure, sure[span:], strict=False)]
    )
    if axis is None:
        return None
    used = _leans_little(cameras_world, axis)
    if np.count_nonzero(used) < LEAST_VIEWS:
        return None
    chosen = [each.view for each, fits in zip(given, used, strict=True) if fits]
    start = unwrapped([axis.angle_of(pose) for pose, fits in zip(cameras_world, used, strict=True) if fits])
    shift = start[0]
    fit = _fitted(chosen, axis, start - shift)
    closed_m = float("nan")
    if fit.is_closed:
        closed_m = _closed_m(chosen, fit.axis, fit.angles, settings, threads)
        if not closed_m <= _CLOSED_VOXELS * settings.voxel_m:
            fit, closed_m = _fitted(chosen, axis, start - shift, may_close=False), float("nan")
    every = np.full(len(given), np.nan)
    every[used] = fit.angles
    used[used] = _linked(fit.seen, np.array([each.is_sure for each in given])[used])
    gap = float(np.ptp(start) - np.ptp(fit.angles)) if fit.is_closed else float("nan")
    return FullTurn(axis=fit.axis, angles=every, used=used, is_closed=fit.is_closed, gap=gap, closed_m=closed_m)


def _leans_little(cameras_world: Sequence[SE3], axis: TurnAxis) -> Flags:
    """Return (N,): whose turn since the first view has the axis's direction."""
    used = np.ones(len(cameras_world), np.bool_)
    for at, pose in enumerate(cameras_world):
        rest = pose.R @ axis.camera_world(axis.angle_of(pose)).R.T
        used[at] = np.linalg.norm(vectors_of(rest)) <= _MOST_TILT + 0.02 * at
    return used


def _linked(seen: Sequence[Seen], sure: Flags) -> Flags:
    """Return (N,): the views that are sure, and those that see points enough of them, or of others that do.

    Views that were lost together agree among themselves wherever they are put.

    Args:
        seen: what each view sees where it should be; empty: nothing was fitted.
        sure: (N,) whether tracking believes a view.
    """
    linked = sure.copy()
    while seen and linked.any():
        known = np.unique(np.concatenate([each.points for each, is_in in zip(seen, linked, strict=True) if is_in]))
        more = np.array([np.count_nonzero(np.isin(each.points, known)) >= _LEAST_SIGHTINGS for each in seen]) & ~linked
        if not more.any():
            break
        linked |= more
    return linked


@dataclass(frozen=True, slots=True, eq=False)
class _Fit:
    """A fit: axis, (N,) angles, whether the turn was closed, and what each of the N views sees where it should be."""

    axis: TurnAxis
    angles: Floats
    is_closed: bool
    seen: tuple[Seen, ...]


def _fitted(views: Sequence[View], axis: TurnAxis, angles: Floats, *, may_close: bool = True) -> _Fit:
    """Fit twice, the second time with corners that are looked for where the first says; tell whether the turn was closed."""
    observer = Observer(views[0].geometry, views[0].noise_px)
    closing, found = False, tuple[Seen, ...]()
    for _ in range(2):
        tracks = tracks_of(views, axis, angles, across_turns=may_close)
        if not len(tracks.points_m):
            break
        closing = may_close and tracks.closing >= _LEAST_CLOSING
        circle, seen = Circle(axis, angles, tracks.points_m), list(tracks.seen)
        circle = fitted_circle(circle, seen, observer)
        circle, seen = _without_outliers(circle, seen, observer)
        if len(circle.points_m):
            circle = fitted_circle(circle, seen, observer)
        axis, angles = circle.axis, circle.angles
        found = tuple(seen)
    return _Fit(axis, angles, closing, found)


def _without_outliers(circle: Circle, seen: Sequence[Seen], observer: Observer) -> tuple[Circle, list[Seen]]:
    """Leave out sightings that do not fit, and points that few views see then."""
    fit = [misfits(circle, each, view, observer) < _OUTLIER_SIGMAS for view, each in enumerate(seen)]
    near = [Seen(each.points[good], each.observed_px[good]) for each, good in zip(seen, fit, strict=True)]
    counts = np.bincount(np.concatenate([each.points for each in near]), minlength=len(circle.points_m))
    kept = counts >= _LEAST_SEEN
    number = np.cumsum(kept) - 1
    left = [Seen(number[each.points[kept[each.points]]], each.observed_px[kept[each.points]]) for each in near]
    return replace(circle, points_m=circle.points_m[kept]), left


def _closed_m(views: Sequence[View], axis: TurnAxis, angles: Floats, settings: VolumeSettings, threads: int) -> float:
    """Lay depths of the end against those of the beginning; return how far they have to be moved, m, at the thing's middle.

    Infinite: they do not lie on each other at all.
    """
    found, moved = native(), []
    library = found if isinstance(found, Library) else None
    for end in range(len(views) - _CLOSING_VIEWS, len(views)):
        turns = np.rint((angles[end] - angles) / (2 * np.pi))
        beside = np.where(turns != 0, np.abs(angles[end] - angles - 2 * np.pi * turns), np.inf)
        partners = np.argsort(beside, kind="stable")[: 2 * _BESIDE + 1]
        partners = partners[np.isfinite(beside[partners])]
        if not len(partners):
            continue
        volume, view = Volume(settings, threads, found), views[end]
        for partner in partners.tolist():
            volume.fuse(views[partner], axis.camera_world(float(angles[partner])).inverse())
        surface = volume.cast(
            Camera(view.geometry, view.depth_m.shape, axis.camera_world(float(angles[end])).inverse()), view.depth_m
        )
        fit = registered(
            np.ascontiguousarray(view.depth_m),
            surface,
            RegistrationSettings(
                most_m=10 * settings.voxel_m,
                floor_m=0.3 * settings.voxel_m,
                noise_per_m=view.noise_per_m,
                geometry=view.geometry,
                threads=threads,
            ),
            library,
        )
        if not fit.overlap > _CLOSED_OVERLAP:
            moved.append(np.inf)
            continue
        middle = np.nanmedian(surface.points_m.reshape(-1, 3), axis=0).astype(np.float64)
        moved.append(float(np.linalg.norm(fit.start_now.apply(middle) - middle)))
    return float(np.median(moved)) if moved else float("inf")
