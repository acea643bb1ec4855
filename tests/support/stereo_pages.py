"""A stereo result whose every figure follows from geometry: a wall at 2 m, before it a box at 1 m, some pixels cut or unmatched."""

from typing import Any

import numpy as np

from common.ledger import StageTimes
from phone_host.model import CutCounts, DepthLimits, Processed, RectifiedPair, StereoGeometry
from phone_host.report.report_page import Headline
from phone_host.report.stereo_page import StereoPageData

GEOMETRY = StereoGeometry(focal_px=400.0, baseline_m=0.1, cx_px=79.5, cy_px=59.5)
"""Disparity is 40 px m / z: 20 px at the wall, 40 px at the box. With 0.5 px, 2 m are known to 2^2 / 40 * 0.5 = 0.05 m."""

LIMITS = DepthLimits(near_m=0.5, far_m=4.0, disparity_error_px=0.5, from_rig=True)


def processed(width: int = 160, height: int = 120) -> Processed:
    """Make the result. The leftmost eighth has no match; a strip above is at 8 m and was cut; a box in the middle is at 1 m."""
    depth = np.full((height, width), 2.0, dtype=np.float32)
    depth[height // 3 : 2 * height // 3, width // 3 : 2 * width // 3] = 1.0
    depth[: height // 6] = 8.0
    disparity = (GEOMETRY.focal_px * GEOMETRY.baseline_m / depth).astype(np.float32)
    disparity[:, : width // 8] = np.nan
    depth[np.isnan(disparity) | (depth > LIMITS.far_m)] = np.nan
    row, column = np.mgrid[:height, :width]
    across = (column - GEOMETRY.cx_px) * depth / GEOMETRY.focal_px
    down = (row - GEOMETRY.cy_px) * depth / GEOMETRY.focal_px
    tile = np.random.default_rng(7).integers(0, 255, (100, 100, 3), dtype=np.uint8)
    texture = np.tile(tile, (height // 100 + 1, width // 100 + 1, 1))[:height, :width]
    kept, unmatched = int(np.isfinite(depth).sum()), int(np.isnan(disparity).sum())
    return Processed(
        RectifiedPair(texture, np.roll(texture, -20, axis=1)),
        disparity,
        np.dstack([across, down, depth]).astype(np.float32),
        StageTimes(decode=0, interpolate=0, rectify=0, match=1, reproject=1, write=0),
        geometry=GEOMETRY,
        limits=LIMITS,
        cut=CutCounts(kept=kept, unmatched=unmatched, too_far=width * height - kept - unmatched),
    )


def page_data(**changes: Any) -> StereoPageData:
    """Make a page's content with some fields changed."""
    fields: dict[str, Any] = {
        "title": "A pair",
        "subtitle": "today",
        "verdict": Headline.GOOD,
        "sentence": "The depth is right.",
        "processed": processed(),
    }
    return StereoPageData(**(fields | changes))
