"""Sees images through maps, by the native library where it has the form for it, else by OpenCV. Both give the same bits."""

import cv2
import numpy as np
from numpy.typing import NDArray

from common.diagnostic import Diagnostic
from phone_host.model import Image
from phone_host.native.library import Library, RemapJob, Simd, native

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
    library.remap(
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
