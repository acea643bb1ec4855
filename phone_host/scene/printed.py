"""A printed sheet as a texture: its ink as sums over areas, so that a pixel of any size reads the exact mean. Pure.

The pattern is that of `calibration.target.sheet_layout`, which the printer gets, too: what is seen is what was printed.
"""

from typing import Final

import cv2
import numpy as np

from phone_host.calibration.target.sheet import Ink, Sheet
from phone_host.scene.scene_model import Floats, Print, Vector

_TEXELS_PER_MM: Final = 7
"""With four strokes a texel, all edges of the usual mat (squares of 25 mm, cells of 18/7 mm) lie between two strokes."""

_STROKES: Final = 4
_M: Final = 1000.0


def printed_sheet(sheet: Sheet) -> Print:
    """Print the rectangles of a sheet; its words are left out.

    Args:
        sheet: what is printed. An edge that is no multiple of 1/28 mm moves to the next one.
    """
    fine = _TEXELS_PER_MM * _STROKES
    width, height = (round(side * _TEXELS_PER_MM) for side in (sheet.width_mm, sheet.height_mm))
    page = np.zeros((height * _STROKES, width * _STROKES), dtype=np.uint8)
    for each in sheet.rectangles:
        left, top = round(each.x_mm * fine), round(each.y_mm * fine)
        right, bottom = round((each.x_mm + each.width_mm) * fine), round((each.y_mm + each.height_mm) * fine)
        page[top:bottom, left:right] = 255 if each.ink is Ink.BLACK else 0
    texels = cv2.resize(page, (width, height), interpolation=cv2.INTER_AREA)
    ink = np.asarray(cv2.integral(texels, sdepth=cv2.CV_64F), dtype=np.float64) / 255.0
    return Print(ink=ink, texels_per_m=_TEXELS_PER_MM * _M)


def printed_albedo(sheet: Print, points: Floats, footprint_m: Floats) -> Floats:
    """Compute the reflectance of a printed plane: the mean over a square as large as a pixel's footprint.

    Args:
        sheet: what is printed on it.
        points: (3, N) in the body's axes, m; z is not used.
        footprint_m: (N,) side of the square.

    Returns:
        (3, N) float32 BGR, 0..1.
    """
    height, width = (side - 1 for side in sheet.ink.shape)
    u = points[0].astype(np.float64) * sheet.texels_per_m + width / 2.0
    v = height / 2.0 - points[1].astype(np.float64) * sheet.texels_per_m
    half = np.maximum(footprint_m.astype(np.float64) * sheet.texels_per_m, 1.0) / 2.0
    total = _ink_before(sheet, u + half, v + half) - _ink_before(sheet, u - half, v + half)
    total += _ink_before(sheet, u - half, v - half) - _ink_before(sheet, u + half, v - half)
    share = (total / (4.0 * half * half)).astype(np.float32)
    paper, ink = (_column(colour) for colour in (sheet.paper_bgr, sheet.ink_bgr))
    bgr: Floats = paper + (ink - paper) * np.clip(share, 0.0, 1.0)
    return bgr


def _ink_before(sheet: Print, u: Floats, v: Floats) -> Floats:
    """Return the ink above and to the left of places (N,) in texels; between texel corners it is bilinear, exactly."""
    height, width = (side - 1 for side in sheet.ink.shape)
    u, v = np.clip(u, 0.0, width), np.clip(v, 0.0, height)
    column, row = np.minimum(u.astype(np.intp), width - 1), np.minimum(v.astype(np.intp), height - 1)
    right, down = u - column, v - row
    above = sheet.ink[row, column] * (1.0 - right) + sheet.ink[row, column + 1] * right
    below = sheet.ink[row + 1, column] * (1.0 - right) + sheet.ink[row + 1, column + 1] * right
    total: Floats = above * (1.0 - down) + below * down
    return total


def _column(colour: Vector) -> Floats:
    return np.array(colour, dtype=np.float32)[:, None]
