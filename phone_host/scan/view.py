"""One pair as the scan takes it: the rectified left image, its depth, and how sure that is. Pure."""

from dataclasses import dataclass, replace
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from common.errors import DataError
from common.imagesize.head import size_text
from phone_host.geometry.se3 import SE3
from phone_host.model import Confidence, Epipolar, Image, Processed, StereoGeometry
from phone_host.scan.mat import Mat
from phone_host.stereo.images import size_px, to_grey

Depth = NDArray[np.float32]

_LEAST_WIDTH_PX: Final = 480
"""Narrower images have no corners to spare."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class View:
    """What one pair shows.

    A depth camera is one, too: its baseline and disparity noise are those of its projector.

    Attributes:
        grey: (H, W) uint8, the rectified left image.
        colours: (H, W, 3) BGR uint8, the same.
        depth_m: (H, W) float32, m, NaN = none.
        geometry: of the rectified pair.
        noise_px: standard deviation of a disparity, px, > 0.
        patch_px: side of the patches whose depths err together, px; a depth camera's window is smaller. A matcher smooths over 40 px, but the
            rectification's errors reach over half of the image: with 320 a rig at rest stays within 2 mm, with 40 it wanders 6.
        right: (H, W) uint8, the rectified right image, for those who look for a mat in both; None: nobody does.
        epipolar: which way the epipolar lines run.
        stamp_s: when it was taken, s, from any beginning; NaN: nobody knows.
        skew_s: by how much its left and its right image were not taken at the same moment, s.
        confidence: (H, W) uint8, how sure the matcher is of each depth, 0 = no value; None: it does not tell.
    """

    grey: Image
    colours: Image
    depth_m: Depth
    geometry: StereoGeometry
    noise_px: float
    patch_px: float = 320.0
    right: Image | None = None
    epipolar: Epipolar = Epipolar.LEFT
    stamp_s: float = float("nan")
    skew_s: float = 0.0
    confidence: Confidence | None = None

    @property
    def noise_per_m(self) -> float:
        """Standard deviation of the depth 1 m away, m; it grows with the depth squared."""
        return self.noise_px / (self.geometry.focal_px * self.geometry.baseline_m)

    @property
    def density(self) -> float:
        """Share of the pixels that have a depth, 0..1."""
        return float(np.isfinite(self.depth_m).mean())

    def observed(self, pixels: NDArray[np.floating[Any]]) -> NDArray[np.float64]:
        """Return u, v and the disparity of the nearest pixel, (N, 3), px, NaN = none, at pixels (N, 2) inside the image."""
        geometry, places = self.geometry, np.rint(pixels).astype(np.int64)
        depth = self.depth_m[places[:, 1], places[:, 0]].astype(np.float64)
        disparity = geometry.focal_px * geometry.baseline_m / depth - geometry.doffs_px
        return np.column_stack([pixels.astype(np.float64), disparity])

    def masked(self, mask: NDArray[np.bool_]) -> "View":
        """Return the view without the depths where the mask, (H, W), is false."""
        return replace(self, depth_m=np.where(mask, self.depth_m, np.float32(np.nan)))

    def cropped(self, rows: slice, columns: slice) -> "View":
        """Return a part of the view, packed, with the geometry of its pixels."""
        geometry = self.geometry
        return replace(
            self,
            grey=self.grey[rows, columns].copy(),
            colours=self.colours[rows, columns].copy(),
            depth_m=self.depth_m[rows, columns].copy(),
            geometry=replace(geometry, cx_px=geometry.cx_px - columns.start, cy_px=geometry.cy_px - rows.start),
        )


@dataclass(frozen=True, slots=True, eq=False)
class Camera:
    """A camera at a place.

    Attributes:
        geometry: of its images.
        shape: height and width of these, px.
        world_camera: where it is.
    """

    geometry: StereoGeometry
    shape: tuple[int, int]
    world_camera: SE3


def points_of(depth_m: Depth, geometry: StereoGeometry) -> NDArray[np.float64]:
    """Return the points (N, 3), m, in the camera's axes, of all pixels with a depth."""
    rows, columns = np.nonzero(np.isfinite(depth_m))
    z = depth_m[rows, columns].astype(np.float64)
    x, y = (columns - geometry.cx_px) / geometry.focal_px * z, (rows - geometry.cy_px) / geometry.focal_px * z
    return np.column_stack([x, y, z])


def halved(depth_m: Depth, geometry: StereoGeometry) -> tuple[Depth, StereoGeometry]:
    """Take every second depth of every second row, packed, so that none is mixed across an edge, and the geometry of their pixels."""
    half = StereoGeometry(
        focal_px=geometry.focal_px / 2,
        baseline_m=geometry.baseline_m,
        cx_px=geometry.cx_px / 2,
        cy_px=geometry.cy_px / 2,
        doffs_px=geometry.doffs_px / 2,
    )
    return depth_m[::2, ::2].copy(), half


def narrowed(depth_m: Depth, geometry: StereoGeometry, max_width_px: int) -> tuple[Depth, StereoGeometry, int]:
    """Halve depths until they are no wider than a limit; return them, the geometry of their pixels, and by how much a pixel became wider: 1, 2, 4 ..."""
    step = 1
    while depth_m.shape[1] > max_width_px:
        (depth_m, geometry), step = halved(depth_m, geometry), 2 * step
    return depth_m, geometry, step


def reduced(view: View) -> View:
    """Return a view of half the size, its grey averaged over 2 x 2 pixels; one that is small already as it is."""
    if view.grey.shape[1] < _LEAST_WIDTH_PX:
        return view
    return half_view(view)


def half_view(view: View) -> View:
    """Return a view of half the size, its grey averaged over 2 x 2 pixels."""
    depth, half = halved(view.depth_m, view.geometry)
    small = (depth.shape[1], depth.shape[0])
    return View(
        grey=np.asarray(cv2.resize(view.grey, small, interpolation=cv2.INTER_AREA), np.uint8),
        colours=view.colours[::2, ::2],
        depth_m=depth,
        # An average's centre lies half a pixel farther than its first pixel's.
        geometry=replace(half, cx_px=half.cx_px - 0.25, cy_px=half.cy_px - 0.25),
        noise_px=view.noise_px / 2,
        patch_px=view.patch_px / 2,
    )


NOISE_PX: Final = 0.5
"""Of a matcher's disparity, px of the images that it matched: 0.25 on rendered scenes, 0.7 on a street (decision 0068)."""
_STEP_PX: Final = 1.5
"""A rise of the disparity from pixel to pixel: a table 0.3 m below the cameras gives 0.3 px, the outline of a cup 5 px."""


def require_size(name: str, view: View, size: tuple[int, int]) -> None:
    """Refuse a view of another size than those before it.

    Raises:
        DataError: so it is.
    """
    if size_px(view.grey) != size:
        here, before = (size_text(each) for each in (size_px(view.grey), size))
        raise DataError(f"{name} is {here} px when rectified, the first pair {before} px", "scan with one size")


def view_of(processed: Processed, mat: Mat | None = None) -> View:
    """Return a pair with disparity and cloud as the tracker takes it, without the depths beside steps; with a mat it holds what is looked at for that."""
    assert processed.geometry is not None
    assert processed.cloud is not None
    left = processed.pair.left
    scale = 1.0 if processed.search is None else processed.search.scale
    return View(
        grey=to_grey(left),
        colours=left if left.ndim == 3 else np.repeat(left[..., np.newaxis], 3, axis=2),
        depth_m=without_edges(processed.cloud[..., 2], processed.geometry),
        geometry=processed.geometry,
        noise_px=NOISE_PX / scale,
        right=None if mat is None else to_grey(processed.pair.right),
        epipolar=processed.pair.epipolar,
        confidence=None if mat is None else processed.confidence,
    )


def without_edges(depth_m: Depth, geometry: StereoGeometry) -> Depth:
    """Leave out the depths beside a step, where a matcher's window sees both sides: NaN where a neighbour's disparity is more than 1.5 px away."""
    with np.errstate(divide="ignore"):
        disparity = np.float32(geometry.focal_px * geometry.baseline_m) / depth_m
    known, around = np.isfinite(disparity), np.ones((3, 3), np.uint8)
    highest = cv2.dilate(np.where(known, disparity, np.float32(-np.inf)), around)
    lowest = cv2.erode(np.where(known, disparity, np.float32(np.inf)), around)
    flat = known & (
        np.maximum(highest - disparity, disparity - lowest, where=known, out=np.zeros_like(disparity)) <= _STEP_PX
    )
    return np.where(flat, depth_m, np.float32(np.nan))
