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
"""Longer side of the small image: its shift is found in 0.5 ms, to 0.02 px."""

_DARKEST: Final = 1.0
_COARSE: Final = (4, 2, 1)
_ROUNDS: Final = 2
_FLAT: Final = 1e-3
"""Keeps an image without texture from moving."""

Picture = NDArray[np.float32]


def watch(shown: Sequence[Shown], zero_ns: int, advance: Callable[[float], None]) -> Sight:
    """Watch a camera's images. Spoiled ones are left out.

    Args:
        shown: the images in the order of their exposure.
        zero_ns: from when the sight counts, ns.
        advance: called with the share that is done, 0 to 1.
    """
    at_s: list[float] = []
    rows: list[NDArray[np.float64]] = []
    before: Picture | None = None
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


def _small(shown: Shown) -> Picture | None:
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


def _change(before: Picture, now: Picture, window: Picture) -> NDArray[np.float64]:
    """Return shift along x and y, px, change of the brightness's logarithm, and mean change of a pixel in shares of the brightness."""
    levels = max(_DARKEST, float(before.mean())), max(_DARKEST, float(now.mean()))
    one, other = np.asarray(before / levels[0] - 1, np.float32), np.asarray(now / levels[1] - 1, np.float32)
    x, y = _shift(one, other, window)
    return np.array([x, y, math.log(levels[1] / levels[0]), float(np.abs(other - one).mean())])


def _shift(one: Picture, other: Picture, window: Picture) -> tuple[float, float]:
    """Return how far an image has moved as a whole, px: found from coarse to fine, and from where its phases correlate; the better of the two.

    The first is exact to 0.02 px and fails for fast turns, the second begins well there and, without texture, anywhere.
    Source: Lucas and Kanade 1981; Kuglin and Hines 1975.
    """
    slow, left = (0.0, 0.0), math.inf
    for by in _COARSE:
        size = one.shape[1] // by, one.shape[0] // by
        small = [np.asarray(cv2.resize(each, size, interpolation=cv2.INTER_AREA), np.float32) for each in (one, other)]
        slow = slow[0] / by, slow[1] / by
        for _ in range(_ROUNDS):
            slow, left = _step(small[0], small[1], slow)
        slow = slow[0] * by, slow[1] * by
    (x, y), _ = cv2.phaseCorrelate(one, other, window)
    fast, left_fast = (x, y), math.inf
    for _ in range(_ROUNDS):
        fast, left_fast = _step(one, other, fast)
    return slow if left <= left_fast else fast


def _step(one: Picture, other: Picture, shift: tuple[float, float]) -> tuple[tuple[float, float], float]:
    """Return a better shift by the slopes of both images, and what the given one leaves, mean square."""
    height, width = one.shape
    moved = np.array([[1, 0, shift[0]], [0, 1, shift[1]]], np.float32)
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    back = cv2.warpAffine(other, moved, (width, height), flags=flags, borderMode=cv2.BORDER_REPLICATE)
    edge = max(1, width // 10)
    rows, columns = slice(edge, height - edge), slice(edge, width - edge)
    middle, left = (one + back) / 2, (one - back)[rows, columns].ravel()
    slopes = [
        middle[rows, edge + 1 : width - edge + 1] - middle[rows, edge - 1 : width - edge - 1],
        middle[edge + 1 : height - edge + 1, columns] - middle[edge - 1 : height - edge - 1, columns],
    ]
    design = np.column_stack([*(slope.ravel() / 2 for slope in slopes), np.ones(left.size, np.float32)])
    x, y, _ = np.linalg.solve(design.T @ design + _FLAT * np.eye(3), design.T @ left)
    return (shift[0] + float(x), shift[1] + float(y)), float(np.mean(left**2))
