"""Remaps the images of a rig as its rectification says: the maps are made once, and each pair goes through them.

The native library remaps where it has the form for it, else OpenCV; both give the same bits. A rig may have departed since it was
calibrated: its right camera has turned or changed its focal length. The left camera, the baseline and so the whole geometry of the
rectified pair stay; only the right image is seen through other maps. Left images, crops, disparities and metres of pairs before and
after a correction mean the same.
"""

from copy import copy
from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from common.diagnostic import Diagnostic
from common.errors import DataError
from common.imagesize.head import size_text
from phone_host.geometry.se3 import rotations_of
from phone_host.model import AS_CALIBRATED, CameraModel, Departure, Image, Lens, Rectification, RectifiedPair, Rig, Side
from phone_host.native.library import Library, RemapJob, Simd, native
from phone_host.stereo.images import size_px
from phone_host.stereo.rectify import rectify_rig
from phone_host.stereo.two_threads import in_two_threads

Maps = tuple["cv2.typing.MatLike", "cv2.typing.MatLike"]
"""(H, W, 2) int16 and (H, W) uint16, as `cv2.convertMaps` makes them for CV_16SC2. Only OpenCV's wheels have `cv2.typing`: Termux's and Debian's packages lack it."""

_FASTER = frozenset({Simd.AVX512, Simd.AVX2, Simd.SSE41})
"""Sets for which the kernel has code of its own: two thirds of OpenCV's time. Elsewhere OpenCV is the faster one."""

_MOST_SIDE_PX = 32767  # places are int16


def remap(image: Image, maps: Maps, library: Library | Diagnostic | None = None) -> Image:
    """Interpolate an image where a map points, to 1/32 px; beyond its edge the edge goes on.

    Args:
        image: (h, w) grey or (h, w, 3) BGR, uint8.
        maps: where each pixel of the result lies in the image.
        library: computes coloured images; None: that of this installation.

    Returns:
        (H, W) or (H, W, 3) uint8.
    """
    library = native() if library is None else library
    if isinstance(library, Library) and library.simd in _FASTER:
        return remap_by(library, image, maps)
    return _by_opencv(image, maps)


def remap_by(library: Library, image: Image, maps: Maps) -> Image:
    """Do the same with the library's kernel on any instruction set; images that it cannot read go to OpenCV."""
    places, fractions = np.asarray(maps[0]), np.asarray(maps[1])
    if not _has_its_form(image, places, fractions):
        return _by_opencv(image, maps)
    out = np.empty((*fractions.shape, 3), np.uint8)
    library.run(
        RemapJob(
            image=image.ctypes.data,
            places=places.ctypes.data,
            fractions=fractions.ctypes.data,
            out=out.ctypes.data,
            image_stride=image.strides[0],
            out_pixels=fractions.size,
            image_width=image.shape[1],
            image_height=image.shape[0],
        )
    )
    return out


def _by_opencv(image: Image, maps: Maps) -> Image:
    remapped = cv2.remap(image, *maps, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(remapped, dtype=np.uint8)


def _has_its_form(image: Image, places: NDArray[np.generic], fractions: NDArray[np.generic]) -> bool:
    """Return whether the kernel can read these arrays as they lie in memory."""
    coloured = image.dtype == np.uint8 and image.ndim == 3 and image.shape[2] == 3 and image.strides[1:] == (3, 1)
    fits = coloured and 0 < image.shape[0] <= _MOST_SIDE_PX and 0 < image.shape[1] <= _MOST_SIDE_PX
    packed = places.flags.c_contiguous and fractions.flags.c_contiguous
    made = places.dtype == np.int16 and fractions.dtype == np.uint16 and places.shape == (*fractions.shape, 2)
    return fits and packed and made and image.strides[0] >= 0


def corrected_rig(rig: Rig, departure: Departure) -> Rig:
    """Return the rig as it stands now."""
    if departure == AS_CALIBRATED:
        return rig
    turn = rotations_of(np.array(departure.turn_rad))
    matrix = rig.right.matrix.copy()
    matrix[(0, 1), (0, 1)] *= departure.focal
    return replace(
        rig,
        right=replace(rig.right, matrix=matrix),
        R_right_left=turn @ rig.R_right_left,
        t_right_left_m=turn @ rig.t_right_left_m,
    )


def corrected_rectification(made: Rectification, departure: Departure) -> Rectification:
    """Return the rectification of the corrected rig: that of the calibrated one but for the right camera's rotation."""
    if departure == AS_CALIBRATED:
        return made
    return replace(made, R_right=made.R_right @ rotations_of(np.array(departure.turn_rad)).T)


_MOST_KEPT_PIXELS = 4_000_000  # twice 1920 x 1080: what a live camera sends. The maps take 6 bytes per pixel and side.
_STRIP_ROWS = 256


class Rectifier:
    """Remaps the images of a rig to a rectified pair; the maps are computed once.

    Attributes:
        rig: the rig it was made for, as it stands now.
        rectification: rotations, projections and size.
        geometry: of the rectified pair.
        overlay: how the right camera departs from the rig that was calibrated.

    Raises:
        DataError: see `rectify_rig`.
    """

    def __init__(self, rig: Rig) -> None:
        self.rig = rig
        self.rectification = rectify_rig(rig)
        self.geometry = self.rectification.geometry
        self.overlay = AS_CALIBRATED
        self._left = _Remap(rig.left, self.rectification.R_left, self.rectification)
        self._right = _Remap(rig.right, self.rectification.R_right, self.rectification)

    def corrected(self, departure: Departure) -> "Rectifier":
        """Return a rectifier for the same rig whose right camera has turned since; the left image's maps are shared.

        Args:
            departure: how the right camera departs from the rig that was calibrated.
        """
        if departure == self.overlay:
            return self
        made = copy(self)
        made.rig = corrected_rig(self.rig, departure)
        made.rectification = corrected_rectification(self.rectification, departure)
        made.overlay = departure
        made._right = _Remap(made.rig.right, made.rectification.R_right, made.rectification, self._right.shrink)  # noqa: SLF001  # its own
        return made

    @property
    def reductions(self) -> tuple[int, int]:
        """By how much the left and the right image may be smaller, 1, 2, 4 or 8: a finer camera's image is averaged down first, which a decoder of JPEG does for less."""
        return self._left.reduction, self._right.reduction

    def require_sizes(self, left_px: tuple[int, int], right_px: tuple[int, int]) -> None:
        """Check that the images have their cameras' sizes.

        Args:
            left_px: width and height of the left image, px.
            right_px: width and height of the right image, px.

        Raises:
            DataError: an image's size differs from that of its camera in the rig.
        """
        for found_px, model, side in ((left_px, self.rig.left, Side.LEFT), (right_px, self.rig.right, Side.RIGHT)):
            if found_px != (model.width_px, model.height_px):
                raise DataError(
                    f"the {side.value} image is {size_text(found_px)} px, rig.yaml was calibrated for"
                    f" {model.width_px}x{model.height_px}",
                    "use the size of the calibration; StereoCore takes others, too",
                )

    def rectify(self, left: Image, right: Image) -> RectifiedPair:
        """Rectify a pair of images as the cameras sent them.

        Args:
            left: (H, W) grey or (H, W, 3) BGR, uint8, the left camera's size, or that divided by its reduction.
            right: the same of the right camera.

        Returns:
            The pair, both of the rectification's size, every pixel filled.

        Raises:
            DataError: an image's size differs from that of its camera in the rig.
        """
        self.require_sizes(self._left.whole_px(size_px(left)), self._right.whole_px(size_px(right)))
        first, second = in_two_threads(lambda: self._left.apply(left), lambda: self._right.apply(right))
        return RectifiedPair(first, second, self.rectification.epipolar)


class _Remap:
    """The remapping of one camera's image to the rectified one.

    The maps of large images are not kept but computed strip by strip: those of 50 megapixels would take 300 MB a side.
    """

    def __init__(
        self, model: CameraModel, rotation: NDArray[np.float64], rectification: Rectification, shrink: int | None = None
    ) -> None:
        self._model, self._rotation = model, rotation
        self._projection = rectification.P_left[:, :3]  # P_right's first three columns are the same
        self._width, self._height = rectification.width_px, rectification.height_px
        # Bilinear interpolation reads 2 x 2 pixels. A camera twice as fine as the result would alias, so average it
        # down first.
        finer = max(1, int(model.mean_focal_px / rectification.geometry.focal_px + 1e-6))
        self.shrink = finer if shrink is None else shrink  # a corrected focal length decodes as the calibrated one
        self._kept = self._maps(0, self._height) if self._width * self._height <= _MOST_KEPT_PIXELS else None

    @property
    def reduction(self) -> int:
        """The largest power of 2, up to 8, that divides the factor by which images are averaged down."""
        return min(self.shrink & -self.shrink, 8)

    def whole_px(self, size_px: tuple[int, int]) -> tuple[int, int]:
        """Return the size of the image that was decoded to this size, px; the size itself if it was not reduced."""
        width, height = (length * self.reduction for length in size_px)
        return (width, height) if (width, height) == (self._model.width_px, self._model.height_px) else size_px

    def apply(self, image: Image) -> Image:
        shrink = self.shrink if image.shape[1] == self._model.width_px else self.shrink // self.reduction
        if shrink > 1:
            height, width = (length // shrink for length in image.shape[:2])
            whole_blocks = image[: height * shrink, : width * shrink]
            image = np.asarray(cv2.resize(whole_blocks, (width, height), interpolation=cv2.INTER_AREA), dtype=np.uint8)
        # The maps stay inside the image, but the last half block of a reduced one may lie 0.5 px outside.
        if self._kept is not None:
            return remap(image, self._kept)
        result = np.empty((self._height, self._width, *image.shape[2:]), np.uint8)
        for top in range(0, self._height, _STRIP_ROWS):
            bottom = min(top + _STRIP_ROWS, self._height)
            result[top:bottom] = remap(image, self._maps(top, bottom))
        return result

    def _maps(self, top: int, bottom: int) -> Maps:
        """Return where the rows from `top` to `bottom` of the result lie in the image."""
        up = np.array([[1, 0, 0], [0, 1, -top], [0, 0, 1]], np.float64)
        size, new = (self._width, bottom - top), up @ self._projection
        k, distortion = self._model.matrix, self._model.distortion
        if self._model.lens is Lens.FISHEYE:
            x, y = cv2.fisheye.initUndistortRectifyMap(k, distortion, self._rotation, new, size, cv2.CV_32FC1)
        else:
            x, y = cv2.initUndistortRectifyMap(k, distortion, self._rotation, new, size, cv2.CV_32FC1)
        if self.shrink > 1:
            x, y = ((axis + 0.5) / self.shrink - 0.5 for axis in (x, y))
        return cv2.convertMaps(x, y, cv2.CV_16SC2)  # half the time of float maps, the same 1/32 px
