"""What the uncertainty of a rig's parameters does to disparity and depth. Pure.

The covariance of the parameters is carried through to first order:

    variance of a disparity = J C J^T,  J = its derivative by the parameters.

J is exact (`geometry.rig_pixels`). A point at infinity has D = d + doffs = 0 in an exact rig; in a
calibrated one its sigma, the noise of zero, decides how far the rig can see, because depth is f b / D.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.geometry.rig_pixels import pixel_derivatives
from phone_host.model import Epipolar, Rectification, Rig

Floats = NDArray[np.float64]

DEPTHS_M: Final = (0.3, 0.5, 1.0, 2.0)
"""Depths at which a calibration states its depth error."""

_COLUMNS, _ROWS = 9, 7
"""Points over the image. The error bends as slowly as the lens: a finer grid changes the result by less than a tenth."""


def zero_sigma_px(rig: Rig, rectification: Rectification) -> float:
    """Return the standard uncertainty of the disparity of infinitely far points.

    Args:
        rig: with its covariance.
        rectification: of that rig.

    Returns:
        Root mean square over the rectified image, px of that image; NaN if the covariance is not known.
    """
    return _disparity_sigma_px(rig, rectification, np.inf)


def depth_sigma_m(rig: Rig, rectification: Rectification, depth_m: float) -> float:
    """Return the standard uncertainty of depths that the calibration alone leaves, m.

    Args:
        rig: with its covariance.
        rectification: of that rig.
        depth_m: of the points, m.

    Returns:
        Root mean square over the rectified image, m; NaN if the covariance is not known or both cameras see nothing so near.
    """
    geometry = rectification.geometry
    sigma_px = _disparity_sigma_px(rig, rectification, depth_m)
    return depth_m**2 / (geometry.focal_px * geometry.baseline_m) * sigma_px


def _disparity_sigma_px(rig: Rig, rectification: Rectification, depth_m: float) -> float:
    if not np.isfinite(rig.covariance).all():
        return float("nan")
    jacobian = disparity_derivatives(rig, rectification, depth_m)
    variances = np.einsum("ni,ij,nj->n", jacobian, rig.covariance, jacobian)
    return float(np.sqrt(variances.clip(min=0).mean())) if len(variances) else float("nan")


def disparity_derivatives(rig: Rig, rectification: Rectification, depth_m: float) -> Floats:
    """Return the derivatives of disparities by the true parameters, (N, 30), px per unit, at points spread over what both cameras see.

    Args:
        rig: the cameras as they are estimated.
        rectification: of that rig.
        depth_m: of the points, m; may be infinite.
    """
    slopes = _slopes(rectification)
    axis = 1 if rectification.epipolar.is_vertical else 0
    if np.isfinite(depth_m):  # what the right camera does not see has no disparity
        geometry = rectification.geometry
        pixels = slopes[:, axis] * geometry.focal_px + (geometry.cy_px if axis else geometry.cx_px)
        towards = -1.0 if rectification.epipolar is Epipolar.DOWN else 1.0
        matched = pixels - towards * geometry.focal_px * geometry.baseline_m / depth_m
        slopes = slopes[(matched >= 0) & (matched < (rectification.height_px if axis else rectification.width_px))]
    both = pixel_derivatives(slopes, np.full(len(slopes), 1 / depth_m), rig, rectification)[:, :, axis]
    return np.asarray(both[:, 0] - both[:, 1], np.float64)


def _slopes(rectification: Rectification) -> Floats:
    """Return slopes (N, 2) spread evenly over the rectified image."""
    geometry = rectification.geometry
    columns = (np.arange(_COLUMNS) + 0.5) / _COLUMNS * rectification.width_px
    rows = (np.arange(_ROWS) + 0.5) / _ROWS * rectification.height_px
    x, y = (axis.ravel() for axis in np.meshgrid(columns, rows))
    return np.column_stack([x - geometry.cx_px, y - geometry.cy_px]) / geometry.focal_px
