"""What a run has computed of a pair, as messages of a recording. Pure."""

import numpy as np

from common.recording.ros_messages import POINT_BYTES
from phone_host.model import CloudImage, Image


def cloud_data(cloud: CloudImage, colours: Image) -> bytes:
    """Return the points of a cloud as a recording has them.

    Args:
        cloud: (H, W, 3) float32, m; NaN: none.
        colours: (H, W) grey or (H, W, 3) BGR, uint8: of each point.

    Returns:
        x, y, z, m, and 0x00RRGGBB of each point that is there, `POINT_BYTES` each, little endian.
    """
    there = ~np.isnan(cloud[..., 2])
    points = np.empty((int(np.count_nonzero(there)), POINT_BYTES // 4), "<f4")
    points[:, :3] = cloud[there]
    seen = colours[there].astype("<u4")
    blue, green, red = seen.T if seen.ndim > 1 else (seen, seen, seen)
    points[:, 3] = (red << 16 | green << 8 | blue).view("<f4")
    return points.tobytes()
