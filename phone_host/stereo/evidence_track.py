"""Follows matched features to a fraction of a pixel: from the left image to the right one, and from the pair before. Pure.

What is followed there and back, and does not return to where it began, was covered by something or followed along an
edge: it is left out (Kalal et al., ICPR 2010).
"""

from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.model import Image
from phone_host.stereo.evidence_features import Matches
from phone_host.stereo.evidence_points import Points
from phone_host.stereo.match_align import with_levels_of
from phone_host.stereo.working import reduced

WIDTH_PX: Final = 1280
"""Wider images are reduced to this."""

_WINDOW_PX: Final = 15
_TRACKED_PX: Final = 4.0
"""Features found at a quarter of the size are off by less."""

_BACK_PX: Final = 0.4
"""Followed there and back, a feature of a good pair is off by 0.05 px, p95 0.3."""

_FLOW_LEVELS: Final = 3
"""From one pair to the next an image moves by up to some 60 px: hand-held at 15 pairs/s."""


@dataclass(frozen=True, slots=True, eq=False)
class Followed:
    """Features that were followed from the left image to the right one and back.

    Attributes:
        left_px: (N, 2) float64, px of the rectified left image.
        right_px: (N, 2) of the right one.
        velocity_px_s: (N, 2) how fast each moves in the left image, px/s; NaN = not measured.
    """

    left_px: Points
    right_px: Points
    velocity_px_s: Points


def tracked(left: Image, right: Image, matches: Matches) -> Matches:
    """Follow matched features to a fraction of a pixel (Lucas and Kanade, IJCAI 1981). Those that get lost stay where they are.

    Args:
        left: (H, W) uint8 grey.
        right: the same size.
        matches: roughly.
    """
    if not len(matches.left_px):
        return matches
    scale = min(1.0, WIDTH_PX / left.shape[1])
    before = reduced(left, scale)
    after = with_levels_of(before, reduced(right, scale))  # tracking takes another exposure for motion
    better, kept = _across(before, after, matches.left_px, matches.right_px, scale)
    return Matches(matches.left_px, np.where(kept[:, np.newaxis], better, matches.right_px), matches.turns_deg)


def follow(left: Image, right: Image, matches: Matches, before: Image | None, seconds: float) -> Followed:
    """Keep the matches that lead back from the right image to where they began, and tell how fast they move.

    Args:
        left: (H, W) uint8 grey.
        right: the same size.
        matches: as `tracked` gives them.
        before: left image of an earlier pair, the same size; None: there is none.
        seconds: how much earlier it was taken, s.
    """
    if not len(matches.left_px):
        return Followed(matches.left_px, matches.right_px, np.zeros((0, 2)))
    scale = min(1.0, WIDTH_PX / left.shape[1])
    here = reduced(left, scale)
    there = with_levels_of(here, reduced(right, scale))
    home, found = _across(there, here, matches.right_px, matches.left_px, scale)
    kept = found & (np.abs(home - matches.left_px).max(axis=1) <= _BACK_PX / scale)
    left_px, right_px = matches.left_px[kept], matches.right_px[kept]
    velocity = np.full(left_px.shape, np.nan)
    if before is not None and seconds > 0 and before.shape == left.shape and len(left_px):
        velocity = _velocity(here, reduced(before, scale), left_px, scale) / seconds
    return Followed(left_px, right_px, velocity)


def _across(
    source: Image, target: Image, points_px: Points, guess_px: Points, scale: float
) -> tuple[Points, NDArray[np.bool_]]:
    """Return where points of one view are in the other, px of the whole images, and whether they were found near the guess."""
    start, guess = _small(points_px, scale), _small(guess_px, scale)
    ahead, found, _ = cv2.calcOpticalFlowPyrLK(
        source,
        target,
        start,
        guess.copy(),
        winSize=(_WINDOW_PX, _WINDOW_PX),
        maxLevel=1,
        flags=cv2.OPTFLOW_USE_INITIAL_FLOW,
    )
    near = np.linalg.norm((ahead - guess).reshape(-1, 2), axis=1) <= _TRACKED_PX
    return _whole(ahead, scale), np.asarray((found.ravel() == 1) & near)


def _velocity(here: Image, earlier: Image, points_px: Points, scale: float) -> Points:
    """Return how far points have moved since an earlier image, px of the whole images; NaN where that cannot be believed."""
    start = _small(points_px, scale)
    window = (_WINDOW_PX, _WINDOW_PX)
    back, found, _ = cv2.calcOpticalFlowPyrLK(here, earlier, start, start.copy(), winSize=window, maxLevel=_FLOW_LEVELS)
    home, again, _ = cv2.calcOpticalFlowPyrLK(earlier, here, back, back.copy(), winSize=window, maxLevel=_FLOW_LEVELS)
    off = np.abs(home - start).reshape(-1, 2).max(axis=1)
    sure = (found.ravel() == 1) & (again.ravel() == 1) & (off <= _BACK_PX)
    return np.where(sure[:, np.newaxis], points_px - _whole(back, scale), np.nan)


def _small(points_px: Points, scale: float) -> NDArray[np.float32]:
    return ((points_px + 0.5) * scale - 0.5).astype(np.float32).reshape(-1, 1, 2)


def _whole(points: "cv2.typing.MatLike", scale: float) -> Points:
    return np.asarray((points.reshape(-1, 2).astype(np.float64) + 0.5) / scale - 0.5)
