"""Watches a recording's images for what tells the time: how the whole image shifts, how bright it is, how much changes."""

import math
from collections.abc import Callable, Sequence
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from common.frame import SpoiledImageError
from common.recording.recorded import Shown, size_px
from phone_host.recording.sight import QUANTITIES, Sight
from phone_host.stereo.images import to_grey
from phone_host.stereo.raw_images import EncodedImage, decode_frame

_LONG_PX: Final = 96
"""Longer side of the small image: 0.6 ms a pair; twice that is not twice as exact."""

_DARKEST: Final = 1.0


def watch(shown: Sequence[Shown], zero_ns: int, advance: Callable[[float], None]) -> Sight:
    """Watch a camera's images. Spoiled ones are left out.

    Args:
        shown: the images in the order of their exposure.
        zero_ns: from when the sight counts, ns.
        advance: called with the share that is done, 0 to 1.
    """
    at_s: list[float] = []
    rows: list[NDArray[np.float64]] = []
    before: NDArray[np.float32] | None = None
    window = np.empty((0, 0), np.float32)
    for done, one in enumerate(shown):
        advance(done / len(shown))
        small, moment_s = _small(one), (one.image.stamp_ns - zero_ns) / 1e9
        if small is None or (before is not None and (small.shape != before.shape or moment_s <= at_s[-1])):
            continue
        if before is None:
            window = np.asarray(cv2.createHanningWindow(small.shape[::-1], cv2.CV_32F), np.float32)
            rows.append(np.zeros(QUANTITIES))
        else:
            rows.append(rows[-1] + _change(before, small, window))
        before = small
        at_s.append(moment_s)
    return Sight(np.array(at_s, np.float64), np.array(rows, np.float64).reshape(-1, QUANTITIES))


def _small(shown: Shown) -> NDArray[np.float32] | None:
    """Return an image in grey, small, (H, W) float32; None: it is spoiled."""
    image = shown.image
    try:
        width, height = size_px(image)
        encoded = EncodedImage(
            payload=memoryview(image.payload),
            pixel_format=image.pixel_format,
            width_px=width,
            height_px=height,
            name="an image",
        )
        reduction = max(1, min(8, 1 << int(math.log2(max(1, max(width, height) // _LONG_PX)))))
        grey = to_grey(decode_frame(encoded, reduction=reduction))
    except SpoiledImageError:
        return None
    share = min(1.0, _LONG_PX / max(width, height))
    size = max(8, round(width * share)), max(8, round(height * share))
    return np.asarray(cv2.resize(grey, size, interpolation=cv2.INTER_AREA), np.float32)


def _change(before: NDArray[np.float32], now: NDArray[np.float32], window: NDArray[np.float32]) -> NDArray[np.float64]:
    """Return shift along x and y, px, change of the brightness's logarithm, and mean change of a pixel in shares of the brightness."""
    levels = max(_DARKEST, float(before.mean())), max(_DARKEST, float(now.mean()))
    one, other = before / levels[0] - 1, now / levels[1] - 1
    (x, y), _ = cv2.phaseCorrelate(one, other, window)
    return np.array([x, y, math.log(levels[1] / levels[0]), float(np.abs(other - one).mean())])
