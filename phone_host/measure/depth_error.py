"""How wrong a depth is if its disparity is wrong. Pure."""

from phone_host.model import StereoGeometry


def depth_error_m(geometry: StereoGeometry, depth_m: float, error_px: float) -> float:
    """Compute how wrong a depth is, m: |dz/dd| e = z^2 e / (f b), the derivative of z = f b / (d + doffs).

    Args:
        geometry: of the rectified pair.
        depth_m: the depth, m.
        error_px: error of its disparity, px.
    """
    return depth_m * depth_m * error_px / (geometry.focal_px * geometry.baseline_m)
