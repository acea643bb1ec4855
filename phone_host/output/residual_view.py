"""Shows how far disparities lie off a plane as a picture: nearer is red, farther is blue, no value is black; a scale on the right."""

from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.model import Crop, Image
from phone_host.output.scale_bar import Tick, with_scale

# Vermillion and blue of Okabe and Ito's palette, which colour-blind readers tell apart, with near white between them.
_NEAR_BGR: Final = (0, 94, 213)
_FAR_BGR: Final = (178, 114, 0)
_ON_PLANE_BGR: Final = (245, 245, 245)
_LEVELS: Final = 255
_FRAME_BGR: Final = (0, 0, 0)
_JPEG_QUALITY: Final = 88


def residual_jpeg(residual_px: NDArray[np.float32], roi: Crop, range_px: float, widest_px: int) -> bytes:
    """Colour the distances from a plane, with the region of interest as a frame and a scale.

    Args:
        residual_px: (H, W), px, NaN = none.
        roi: the region that counts.
        range_px: distance of the strongest colours, px.
        widest_px: the picture is made smaller if it is wider, px.
    """
    width = residual_px.shape[1]
    share = min(1.0, widest_px / width)
    shown = cv2.resize(residual_px, None, fx=share, fy=share, interpolation=cv2.INTER_NEAREST)
    levels = np.clip((np.nan_to_num(shown) / range_px + 1) / 2 * (_LEVELS - 1), 0, _LEVELS - 1).round().astype(np.int64)
    image: Image = _table()[levels]
    image[np.isnan(shown)] = 0
    corners = [(roi.x_px, roi.y_px), (roi.x_px + roi.width_px - 1, roi.y_px + roi.height_px - 1)]
    first, last = ((int(x * share), int(y * share)) for x, y in corners)
    cv2.rectangle(image, first, last, _FRAME_BGR, 1)
    marks = tuple(Tick((way + 1) / 2, f"{way * range_px:+.3g}" if way else "0") for way in (-1, 0, 1))
    scaled = with_scale(np.ascontiguousarray(image), _table(), lambda _: marks, "px")
    return cv2.imencode(".jpg", scaled, [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY])[1].tobytes()


def _table() -> Image:
    """Return (255, 3) BGR from far to near."""
    at = np.linspace(-1, 1, _LEVELS)[:, np.newaxis]
    middle = np.array(_ON_PLANE_BGR)
    end = np.where(at < 0, _FAR_BGR, _NEAR_BGR)
    return np.asarray((middle + (end - middle) * np.sqrt(np.abs(at))).round(), np.uint8)
