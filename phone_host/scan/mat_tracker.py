"""Where each view was taken, from a printed mat in it. Pure.

Only the mat counts, so it is the same whether the cameras go around it or it is turned before them, and the background may do what it likes. The world's axes
are the mat's: the model stands upright on its middle. A view that shows too little of the mat is followed by
its corners from the last one and laid against the model.

What lies outside the box above the sheet gets no room in the model. It still tells that nothing is before it.

Where a thing is, each depth is moved along its ray until both images agree around it. A matcher that sweeps an image one way only carries disparities on
from row to row. Where they change along the columns it lags, by up to 0.15 px: a table lies too far, what stands on it too near. That is the same in all
views of a thing, so that no number of views averages it out. Here nothing is carried on: the right image is laid onto the left one by the disparities that
are known, and what is left between both tells the rest.

Source: B. D. Lucas and T. Kanade, "An Iterative Image Registration Technique with an Application to Stereo Vision", 1981.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from common.diagnostic import Diagnostic
from phone_host.geometry.se3 import SE3
from phone_host.model import Image
from phone_host.native.library import Library, native
from phone_host.scan.blocks import Box
from phone_host.scan.mat import ABOVE_M, Mat, mat_corners
from phone_host.scan.mat_pose import MatPose, MatScale, fit_mat
from phone_host.scan.odometry import Odometry, OdometrySettings
from phone_host.scan.piece import PoseGate
from phone_host.scan.pose_source import PoseSource
from phone_host.scan.registration import Registered, RegistrationSettings, registered
from phone_host.scan.scan_wanted import ScanWanted
from phone_host.scan.scanned import Submap
from phone_host.scan.surface_error import PoseErrors
from phone_host.scan.tracked import NOT_MOVED, Tracked, lost
from phone_host.scan.tracker import TrackerState
from phone_host.scan.tracking_words import Tracking, Weakness
from phone_host.scan.view import Camera, Depth, View, narrowed, reduced
from phone_host.scan.volume import Volume
from phone_host.scan.volume_settings import VolumeSettings, fineness_for, thinner
from phone_host.stereo.reproject import least_in_front_px

Floats = NDArray[np.float32]
F: Final = np.float32

_AROUND_PX: Final = 9
"""Side of the window in which both images must agree: with half of it the surface is as exact, and has more holes."""

_SMOOTH_PX: Final = 5
"""Before that, disparities are averaged in a window so wide: a matcher's sixteenths are rough."""

_SAME_SURFACE_PX: Final = 1.0
_MOST_STEP_PX, _MOST_IN_ALL_PX = 0.5, 0.7
"""One step suffices, as the start is near. What moves farther has not found the same place again, and stays where the matcher saw it."""

_NOISE_LEVELS2: Final = F(1)
"""Variance of the grey levels' slopes at which the images tell no more than the matcher did."""

_CONTRAST_LEVELS2: Final = F(4)
_MOST_CONTRAST: Final = F(4)
_RIM_PX: Final = 12


def with_exact_depths(view: View, wanted: Depth) -> View:
    """Make the depths of a view with a right image more exact around those that are wanted, (H, W), NaN = not wanted; known are those that were known before."""
    known = np.isfinite(wanted)
    if view.right is None or not known.any():
        return view
    rows, columns = (np.flatnonzero(known.any(axis=axis)) for axis in (1, 0))
    part = tuple(
        slice(max(int(at[0]) - _RIM_PX, 0), min(int(at[-1]) + _RIM_PX + 1, size))
        for at, size in zip((rows, columns), known.shape, strict=True)
    )
    of, depth = view.geometry, view.depth_m.copy()
    scale = F(of.focal_px * of.baseline_m)
    disparity = scale / depth[part] - F(of.doffs_px)
    moved = _moved(view, view.right, part, disparity) + F(of.doffs_px)
    is_before = moved > least_in_front_px(of)  # not what is so far away that it would move behind the cameras
    depth[part] = np.where(is_before, scale / np.where(is_before, moved, F(1)), depth[part])
    return replace(view, depth_m=depth)


@dataclass(frozen=True, slots=True)
class _Around:
    """Means around each pixel of those whose disparity is known."""

    known: Floats
    share: Floats

    @staticmethod
    def of(known: Floats) -> "_Around":
        """Return means over the pixels that are 1."""
        return _Around(known, np.maximum(_blurred(known, _AROUND_PX), F(1e-6)))

    def mean(self, values: Floats) -> Floats:
        """Return the mean of values."""
        return np.asarray(_blurred(values * self.known, _AROUND_PX) / self.share, F)


def _moved(view: View, right: Image, part: tuple[slice, ...], disparity: Floats) -> Floats:
    """Return a part's disparities (h, w), px, moved until both images agree; NaN stays."""
    is_known = np.isfinite(disparity)
    known, before = is_known.astype(F), np.where(is_known, disparity, F(0))
    around, left = _Around.of(known), view.grey[part].astype(F)
    left_mean = around.mean(left)
    left_spread = around.mean(left * left) - left_mean * left_mean
    along, across = (F(step) for step in view.epipolar.way)
    other = right.astype(F)
    ramp = np.array([-0.5, 0, 0.5])
    slopes = cv2.filter2D(other, -1, ramp[np.newaxis] * along if along else ramp[:, np.newaxis] * across)
    rows, columns = (at.astype(F) for at in np.mgrid[part])
    found = _smoothed(before, known)
    at = columns + along * found, rows + across * found
    seen, slope = (np.asarray(cv2.remap(each, *at, cv2.INTER_LINEAR), F) for each in (other, slopes))
    seen_mean, slope_mean = around.mean(seen), around.mean(slope)
    spread = around.mean(seen * seen) - seen_mean * seen_mean
    contrast = np.sqrt((left_spread + _CONTRAST_LEVELS2) / (spread + _CONTRAST_LEVELS2))
    contrast = np.clip(contrast, 1 / _MOST_CONTRAST, _MOST_CONTRAST)
    # Both sensors have levels of their own: what differs by a factor and a constant agrees.
    own = around.mean(slope * left) - slope_mean * left_mean
    others = around.mean(slope * seen) - slope_mean * seen_mean
    told = around.mean(slope * slope) - slope_mean * slope_mean
    step = (own - contrast * others) / (contrast * told + _NOISE_LEVELS2)
    found = found + np.clip(step, -_MOST_STEP_PX, _MOST_STEP_PX)
    stays = np.abs(found - before) > _MOST_IN_ALL_PX
    return np.where(is_known, np.where(stays, before, found), F(np.nan)).astype(F)


def _smoothed(disparity: Floats, known: Floats) -> Floats:
    """Average disparities with those around them on the same surface."""
    mean = _blurred(disparity * known, _SMOOTH_PX) / np.maximum(_blurred(known, _SMOOTH_PX), F(1e-6))
    same = known * (np.abs(disparity - mean) < _SAME_SURFACE_PX)
    total = _blurred(disparity * same, _SMOOTH_PX) / np.maximum(_blurred(same, _SMOOTH_PX), F(1e-6))
    return np.where(same > 0, total, disparity).astype(F)


def _blurred(values: Floats, side_px: int) -> Floats:
    return np.asarray(cv2.blur(values, (side_px, side_px), borderType=cv2.BORDER_CONSTANT), F)


_BRIGHT_PERCENT: Final = 80.0
"""Of a thing's pixels so many are darker. What is bright of its own, and sure, stays."""

_BRIGHT_RIM_PX: Final = 5
_SURE: Final = 128
"""Confidence, of 255: surer depths of a shiny thing are off by more than a pixel at most three times in a hundred, less sure ones eight times and more."""


def without_reflections(view: View, wanted: Depth) -> View:
    """Leave out the depths of a thing that are bright and unsure, where a lamp may be reflected: both cameras see its image, which lies behind the surface.

    What is reflected comes on top of a surface's own light, and lies elsewhere for each camera, so the matcher is not sure of it.

    Args:
        view: with the matcher's confidence; one without stays as it is.
        wanted: (H, W) its depths that show the thing, NaN elsewhere.
    """
    is_thing = np.isfinite(wanted)
    if view.confidence is None or not is_thing.any():
        return view
    blue, green, red = cv2.split(view.colours)
    darkest = np.minimum(np.minimum(blue, green), red)  # a lamp's light is white, whatever the colour of the thing
    is_bright = darkest > np.percentile(darkest[is_thing], _BRIGHT_PERCENT)
    around = cv2.dilate(is_bright.astype(np.uint8), np.ones((_BRIGHT_RIM_PX, _BRIGHT_RIM_PX), np.uint8)) > 0
    is_out = is_thing & around & (view.confidence < _SURE)
    return view.masked(~is_out)


_TRUNCATION_SHARE: Final = 1 / 2
"""Of the usual truncation. Poses are exact, so the field need not bridge their errors, and a surface seen from one side only is fattened by less. With two
thirds, 4 voxels, rendered things are too large where they were seen: a figure by 0.4 %, one without texture 1.1 %, one with vanes of 3 mm 7.2 %; so by
-0.1, 0.4 and 1.8 %, and the vanes lie 0.36 mm off on average in place of 0.49. With 2.5 voxels, the figure gets 0.4 % too small."""

_FAR_M: Final = 10.0
"""The background tells what is empty however far it is: its depths weigh little."""

_FIRST_SCALE: Final = MatScale(1.0, 0.05)
"""Printed "fit to page" a sheet is up to 7 % smaller."""

_SCALE_DRIFT: Final = 1e-4
"""What a view tells of the squares is off by so much in the same way as the next one: the lens, the paper."""

_MOST_SIGMA_VOXELS: Final = 1.0
"""Standard deviation of the pose where the object stands, 50 mm above the sheet: surer than a voxel, or not believed."""

STANDS_M: Final = np.array([0.0, 0.0, 0.05])

_PARTNER_VOXELS, _FLOOR_VOXELS = 10, 0.3
_ALIGNED_PX: Final = 320
_LEAST_OVERLAP, _LEAST_NEAR, _LEAST_DIRECTIONS = 0.35, 0.5, 6
_ODOMETRY: Final = OdometrySettings(corners=400)
_LEAST_CORNERS: Final = 15
_FUSED_OFF_VOXELS: Final = 2.0
"""Mean distance to the model beyond which a view without a mat is not believed."""


class MatFinder:
    """Finds the mat in one view after another, and learns how large its squares are.

    Attributes:
        mat: which one.
        scale: of its squares, as far as is known.
    """

    def __init__(self, mat: Mat) -> None:
        self.mat, self._points_m = mat, mat.points_m()
        self.scale = _FIRST_SCALE

    def find(self, view: View) -> MatPose | None:
        """Find it in a view that holds its right image, too; None: too little of it is seen."""
        assert view.right is not None
        corners = mat_corners(view.grey, view.right, self.mat)
        known = MatScale(self.scale.value, float(np.hypot(self.scale.sigma, _SCALE_DRIFT)))
        found = fit_mat(self._points_m, corners, view.geometry, view.epipolar, known)
        if found is not None:
            self.scale = found.scale
        return found


class MatPoses(PoseSource):
    """Poses from a mat, and the model of what stands on it."""

    def __init__(self, wanted: ScanWanted, mat: Mat, library: Library | Diagnostic | None = None) -> None:
        self._found = native() if library is None else library
        self._library = self._found if isinstance(self._found, Library) else None
        self._wanted, self._finder, self._box = wanted, MatFinder(mat), wanted.model_box or mat.room
        self._volume: Volume | None = None
        self._room = self._box
        self._pose = SE3.identity()
        self._was_lost = False
        self._last: View | None = None

    @property
    def volume(self) -> Volume | None:
        """The model; None before the first view of the mat that shows something in the box."""
        return self._volume

    @property
    def pose_errors(self) -> PoseErrors:
        """Each pose is told by itself."""
        return PoseErrors.INDEPENDENT

    def crop(self, box: Box | None) -> None:
        """See `PoseSource.crop`. The model is begun in the box that is chosen by then."""
        if self._volume is None:
            self._box = self._room = box or self._finder.mat.room

    def track(self, number: int, view: View) -> Tracked:
        """See `PoseSource.track`."""
        del number
        if self._volume is None:
            begun = self._begun(view) if view.density >= PoseGate().least_depths else Weakness.NO_DEPTH
            if isinstance(begun, Weakness):
                return lost(begun)
            self._begin(begun)
        assert self._volume is not None
        found, voxel_m = self._finder.find(view), self._volume.settings.voxel_m
        if found is not None and found.sigma_at(STANDS_M) <= _MOST_SIGMA_VOXELS * voxel_m:
            told = self._fused(self._volume, view, found.camera_mat.inverse(), Weakness.NONE, None)
            return replace(told, mat=found.said(STANDS_M))
        start = self._followed(view)
        if start is None:
            return self._lost(None)
        fit = self._laid(self._volume, view, start)
        is_told = fit.told >= _LEAST_DIRECTIONS and fit.overlap >= _LEAST_OVERLAP and fit.near >= _LEAST_NEAR
        if not is_told or not fit.off_m <= _FUSED_OFF_VOXELS * voxel_m:
            return self._lost(fit)
        return self._fused(self._volume, view, start @ fit.start_now, Weakness.NO_MAT, fit)

    def state(self, places_before: int) -> TrackerState:
        """See `PoseSource.state`: there are no places, the mat is one."""
        del places_before
        return TrackerState(self._pose, float("nan"), ())

    def go_on(self, submaps: Sequence[Submap]) -> None:
        """See `PoseSource.go_on`; what was learnt of the printed squares is known on."""
        volume = self._begin(replace(submaps[0].settings, most_bytes=self._wanted.most_bytes))
        for each in submaps:
            volume.put(each.blocks)
            self._pose, self._was_lost = each.tracker.pose, True
            for pair in each.pairs:
                if pair.mat is not None:
                    self._finder.scale = pair.mat.scale

    def _begun(self, view: View) -> VolumeSettings | Weakness:
        """Choose how the model is made by a view of what is in the box; or say why that cannot be: too little of the mat is seen, or nothing in the box has a depth."""
        found = MatFinder(self._finder.mat).find(view)
        if found is None:
            return Weakness.NO_MAT
        inside = depths_inside(view, found.camera_mat.inverse(), room_of(self._box, ABOVE_M))
        if not np.isfinite(inside).any():
            return Weakness.EMPTY_BOX
        usual = fineness_for(replace(view, depth_m=inside), self._wanted.voxel_m, self._wanted.most_bytes)
        return replace(thinner(usual, _TRUNCATION_SHARE), far_m=_FAR_M)

    def _begin(self, settings: VolumeSettings) -> Volume:
        self._volume, self.begun_voxel_m = Volume(settings, self._wanted.threads, self._found), settings.voxel_m
        self._room = room_of(self._box, settings.truncation_m + 2 * settings.voxel_m)
        return self._volume

    def _lost(self, fit: Registered | None) -> Tracked:
        self._was_lost = True
        return replace(lost(Weakness.NO_MAT), world_camera=self._pose, fit=fit)

    def _fused(self, volume: Volume, view: View, pose: SE3, weakness: Weakness, fit: Registered | None) -> Tracked:
        self._pose = pose
        thing = depths_inside(view, pose, self._box)
        view = with_exact_depths(view, thing)
        inside = depths_inside(view, pose, self._room)
        self._last = reduced(replace(view, depth_m=inside))
        view = without_reflections(view, thing)
        inside = np.where(np.isfinite(view.depth_m), inside, np.float32(np.nan))
        volume.fuse(view, pose, inside)
        state = Tracking.TRACKING if weakness is Weakness.NONE else Tracking.WEAK
        if self._was_lost and state is Tracking.TRACKING and volume.fused > 1:
            state = Tracking.RELOCALISED
        self._was_lost = False
        return Tracked(world_camera=pose, state=state, weakness=weakness, moved=NOT_MOVED, fit=fit, used=view)

    def _followed(self, view: View) -> SE3 | None:
        """Return where a view was taken by the corners that stand on the mat; None: too few are followed from the last view.

        The shape alone does not tell: a ball fits from everywhere.
        """
        if self._last is None:
            return None
        odometry = Odometry(_ODOMETRY)
        odometry.step(self._last)
        moved = odometry.step(reduced(view))
        return self._pose @ moved.before_now if moved.is_known and moved.inliers >= _LEAST_CORNERS else None

    def _laid(self, volume: Volume, view: View, start: SE3) -> Registered:
        """Lay what a view shows near the model against it."""
        depth, geometry, step = narrowed(depths_inside(view, start, self._room), view.geometry, _ALIGNED_PX)
        surface = volume.cast(Camera(geometry, depth.shape, start), depth)
        voxel_m = volume.settings.voxel_m
        settings = RegistrationSettings(
            most_m=_PARTNER_VOXELS * voxel_m,
            floor_m=_FLOOR_VOXELS * voxel_m,
            noise_per_m=view.noise_per_m,
            geometry=geometry,
            patch_px=view.patch_px / step,
            threads=self._wanted.threads,
        )
        return registered(depth, surface, settings, self._library)


def room_of(box: Box, rim_m: float) -> Box:
    """Return a box that is larger by a rim on all sides, and reaches below the sheet: its surface closes the model from below."""
    low, high = np.array(box.low_m) - rim_m, np.array(box.high_m) + rim_m
    x, y, z = np.minimum(low, [np.inf, np.inf, -rim_m]).tolist()
    return Box((x, y, z), (float(high[0]), float(high[1]), float(high[2])))


def depths_inside(view: View, world_camera: SE3, box: Box) -> Depth:
    """Return the depths (H, W) of what lies inside a box, NaN elsewhere."""
    of, depth = view.geometry, view.depth_m
    rows, columns = np.indices(depth.shape, np.float32)
    aside = (columns - np.float32(of.cx_px)) * (depth / np.float32(of.focal_px))
    below = (rows - np.float32(of.cy_px)) * (depth / np.float32(of.focal_px))
    turn, shift = world_camera.R.astype(np.float32), world_camera.t_m.astype(np.float32)
    inside: NDArray[np.bool_] = np.isfinite(depth)
    with np.errstate(invalid="ignore"):
        for axis in range(3):
            at = turn[axis, 0] * aside + turn[axis, 1] * below + turn[axis, 2] * depth + shift[axis]
            inside &= (at >= box.low_m[axis]) & (at <= box.high_m[axis])
    return np.where(inside, depth, np.float32(np.nan))
