"""A rig at another resolution: the same two cameras, whose images came out larger or smaller than in the calibration.

A scaling of the whole image can be told from its size. A crop may have been cut anywhere. But a camera that keeps its
pixels and leaves out rows (4:3 becomes 16:9) or columns cuts as much on either side. So an image that is smaller in one
direction only is taken for the middle, and `Rig.is_cropped` says so: depth has the right scale wherever the cut was, as
long as it was the same in both cameras.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from common.errors import DataError
from common.imagesize.head import size_text
from phone_host.model import RIG_PARAMETERS, CameraModel, Rig, Side, StereoGeometry

_ROUNDING_PX = 1.0
"""A scaled size is whole pixels. Cameras round either way, so the smaller of two sizes may be off by less than this."""


def scaled_rig(rig: Rig, left_px: tuple[int, int], right_px: tuple[int, int]) -> Rig:
    """Scale or crop a rig to the sizes of its images; each camera may have a scale of its own.

    Args:
        rig: two calibrated cameras.
        left_px: width and height of the left image, px.
        right_px: width and height of the right image, px.

    Returns:
        The rig for these sizes, with its uncertainty at infinity; the rig itself if they are those of the calibration.

    Raises:
        DataError: a size is neither a scaling nor a crop of the size that its camera was calibrated for.
    """
    left, right = scaled_camera(rig.left, left_px, Side.LEFT), scaled_camera(rig.right, right_px, Side.RIGHT)
    if left is rig.left and right is rig.right:
        return rig
    # Disparities are in px of the rectified images, whose focal length is that of the coarser camera (`rectify`).
    finer = coarser_focal_px(left, right) / coarser_focal_px(rig.left, rig.right)
    is_cropped = any(
        _is_middle((model.width_px, model.height_px), size_px)
        for model, size_px in ((rig.left, left_px), (rig.right, right_px))
    )
    return replace(
        rig,
        left=left,
        right=right,
        zero_sigma_px=rig.zero_sigma_px * finer,
        covariance=_scaled_covariance(rig, left, right),
        is_cropped=is_cropped,
    )


def _scaled_covariance(rig: Rig, left: CameraModel, right: CameraModel) -> NDArray[np.float64]:
    """Return the covariance of the scaled parameters: focal lengths and middles are in pixels, a crop only shifts."""
    factors = np.ones(RIG_PARAMETERS)
    for at, model, own in ((0, left, rig.left), (RIG_PARAMETERS // 2 - 3, right, rig.right)):
        scale = model.matrix[(0, 1), (0, 1)] / own.matrix[(0, 1), (0, 1)]
        factors[at : at + 4] = np.tile(scale, 2)
    return rig.covariance * np.outer(factors, factors)


def scaled_geometry(
    geometry: StereoGeometry, from_px: tuple[int, int], to_px: tuple[int, int], name: str
) -> StereoGeometry:
    """Scale the geometry of rectified images to a copy of another size.

    Args:
        geometry: for images of the first size.
        from_px: width and height for which it holds, px.
        to_px: width and height of the copies, px.
        name: of its file, for errors.

    Raises:
        DataError: the second size is no scaling of the first.
    """
    if not is_scaling(from_px, to_px):
        raise DataError(
            f"the images are {size_text(to_px)} px, no scaling of the {size_text(from_px)} px that {name} is for",
            "give the calibration of these images",
        )
    scale_x, scale_y = (new / old for new, old in zip(to_px, from_px, strict=True))
    return replace(
        geometry,
        focal_px=geometry.focal_px * scale_x,
        cx_px=(geometry.cx_px + 0.5) * scale_x - 0.5,
        cy_px=(geometry.cy_px + 0.5) * scale_y - 0.5,
        doffs_px=geometry.doffs_px * scale_x,
    )


def coarser_focal_px(left: CameraModel, right: CameraModel) -> float:
    """Return the smaller mean focal length of two cameras, px: that of their rectified images."""
    return min(left.mean_focal_px, right.mean_focal_px)


def scaled_camera(model: CameraModel, size_px: tuple[int, int], side: Side) -> CameraModel:
    """Scale or crop one camera of a rig to the size of its images.

    Args:
        model: as it was calibrated.
        size_px: width and height of the images, px.
        side: which camera it is, for errors.

    Raises:
        DataError: the size is neither a scaling nor a crop of the size that it was calibrated for.
    """
    own_px = (model.width_px, model.height_px)
    if size_px == own_px:
        return model
    if _is_middle(own_px, size_px):
        cut = np.array(
            [[1, 0, (size_px[0] - own_px[0]) / 2], [0, 1, (size_px[1] - own_px[1]) / 2], [0, 0, 1]], np.float64
        )
        return replace(model, width_px=size_px[0], height_px=size_px[1], matrix=cut @ model.matrix)
    if not is_scaling(own_px, size_px):
        differ = f"the {side.value} image is {size_text(size_px)} px, neither a scaling nor a crop of the {size_text(own_px)} px that the rig was calibrated for"
        if is_scaling(own_px, size_px[::-1]):
            raise DataError(
                f"{differ}: it lies on its side",
                f"turn it upright: rotate=90 or 270 in the camera's address; for files, --rotate-{side.value} 90 or 270",
            )
        raise DataError(
            differ,
            "use a size of the calibration's shape, or calibrate at this size",
        )
    scale_x, scale_y = (new / old for new, old in zip(size_px, own_px, strict=True))
    # Pixel centres are integers, so an image begins at -0.5: x' + 0.5 = (x + 0.5) s.
    to_scaled = np.array([[scale_x, 0, (scale_x - 1) / 2], [0, scale_y, (scale_y - 1) / 2], [0, 0, 1]], np.float64)
    return replace(model, width_px=size_px[0], height_px=size_px[1], matrix=to_scaled @ model.matrix)


def fits_rig(rig_px: tuple[int, int], size_px: tuple[int, int]) -> bool:
    """Return whether a rig holds for images of a size.

    Args:
        rig_px: width and height of the calibration, px.
        size_px: those of the images, px.
    """
    return is_scaling(rig_px, size_px) or _is_middle(rig_px, size_px)


def _is_middle(rig_px: tuple[int, int], size_px: tuple[int, int]) -> bool:
    """Return whether a size is the calibration's but for rows or columns that are left out, and no scaling of it."""
    fewer = [own - new for own, new in zip(rig_px, size_px, strict=True)]
    return min(fewer) == 0 < max(fewer) and min(size_px) > 0 and not is_scaling(rig_px, size_px)


def is_scaling(one_px: tuple[int, int], other_px: tuple[int, int]) -> bool:
    """Return whether one size (width and height, px) is the other times one number, up to the rounding of the smaller one."""
    small, large = sorted((one_px, other_px))
    by_width = large[1] * small[0] / large[0]
    return min(small) > 0 and abs(by_width - small[1]) < _ROUNDING_PX
