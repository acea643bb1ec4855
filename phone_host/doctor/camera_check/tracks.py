"""Follows points of a still scene through the frames of a window, from the middle frame outwards. Pure.

Every frame is compared with the middle one itself, so that nothing drifts from frame to frame; where a point was in the frame
between says where to look. What is followed there and back and does not return was covered, or lay on an edge: it is left out.
"""

from collections.abc import Sequence
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.doctor.camera_check.bundle import Flags, Floats, Tracks
from phone_host.model import Image
from phone_host.stereo.match_align import with_levels_of

_MOST: Final = 240
_CELLS: Final = (6, 4)
"""Points are taken from 6 x 4 cells of the image, as many from each, for what a warp does shows at the edges."""

_WINDOW: Final = (21, 21)
_LEVELS: Final = 3
_BACK_PX: Final = 0.3
_QUALITY: Final = 0.01
_APART_PX: Final = 9
_EDGE_PX: Final = 12
_LEAST_SHARE: Final = 0.6
"""A point that is seen in fewer of the frames tells little of how they follow each other."""


def follow(frames: Sequence[Image]) -> Tracks:
    """Follow points through frames.

    Args:
        frames: (H, W) uint8 grey each, in their order.

    Returns:
        The points that most frames show; there may be none.
    """
    home = len(frames) // 2
    here = frames[home]
    start = _chosen(here)
    if not len(start):
        return Tracks(np.zeros((len(frames), 0, 2)), np.zeros((len(frames), 0), bool), home)
    points = np.repeat(start[np.newaxis].astype(np.float64), len(frames), axis=0)
    seen = np.ones((len(frames), len(start)), bool)
    for way in (range(home + 1, len(frames)), range(home - 1, -1, -1)):
        guess = start
        for at in way:
            guess, seen[at] = _followed(here, with_levels_of(here, frames[at]), start, guess)
            points[at] = guess
    kept = seen.mean(axis=0) >= _LEAST_SHARE
    return Tracks(points[:, kept], seen[:, kept], home)


def _chosen(image: Image) -> NDArray[np.float32]:
    """Return corners (N, 2), the best of each cell."""
    height, width = image.shape
    found = []
    each = _MOST // (_CELLS[0] * _CELLS[1])
    strongest = cv2.cornerMinEigenVal(image, 5)
    floor = _QUALITY * float(strongest.max())
    for row in range(_CELLS[1]):
        for column in range(_CELLS[0]):
            top, left = row * height // _CELLS[1], column * width // _CELLS[0]
            cell = image[top : (row + 1) * height // _CELLS[1], left : (column + 1) * width // _CELLS[0]]
            corners = cv2.goodFeaturesToTrack(cell, each, 0.05, _APART_PX, blockSize=5)
            if corners is not None:
                found.append(corners.reshape(-1, 2) + np.array([left, top], np.float32))
    points = np.concatenate(found) if found else np.zeros((0, 2), np.float32)
    inside = (np.minimum(points, np.array([width, height]) - 1 - points) >= _EDGE_PX).all(axis=1)
    points = points[inside]
    strong = strongest[points[:, 1].round().astype(int), points[:, 0].round().astype(int)] >= floor
    return np.asarray(points[strong], np.float32)


def _followed(
    here: Image, there: Image, start: NDArray[np.float32], guess: NDArray[np.float32]
) -> tuple[NDArray[np.float32], Flags]:
    flags = cv2.OPTFLOW_USE_INITIAL_FLOW
    stop = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 30, 0.003)
    ahead, found, _ = cv2.calcOpticalFlowPyrLK(
        here, there, start, guess.copy(), winSize=_WINDOW, maxLevel=_LEVELS, flags=flags, criteria=stop
    )
    back, again, _ = cv2.calcOpticalFlowPyrLK(
        there, here, ahead, start.copy(), winSize=_WINDOW, maxLevel=1, flags=flags, criteria=stop
    )
    off = np.linalg.norm(back - start, axis=1)
    size = np.array([here.shape[1], here.shape[0]])
    inside = (np.minimum(ahead, size - 1 - ahead) >= _EDGE_PX / 2).all(axis=1)
    return np.asarray(ahead, np.float32), (found.ravel() == 1) & (again.ravel() == 1) & (off <= _BACK_PX) & inside


def motion_px(tracks: Tracks) -> tuple[float, float]:
    """Return by how much the image moved in its main direction and across it, px: the extents of the mean point's path."""
    path = _path(tracks)
    if len(path) < 2:
        return 0.0, 0.0
    axes = np.linalg.svd(path - path.mean(axis=0), full_matrices=False)[2]
    along, across = np.ptp(path @ axes.T, axis=0).tolist()
    return along, across


def _path(tracks: Tracks) -> Floats:
    """Return the median displacement of the points from the middle frame, (F, 2) px."""
    off = tracks.points_px - tracks.points_px[tracks.home]
    off = np.where(tracks.seen[..., np.newaxis], off, np.nan)
    enough = tracks.seen.sum(axis=1) >= 8
    return np.asarray(np.nanmedian(off[enough], axis=1), np.float64) if enough.any() else np.zeros((0, 2))


def filled_cells(tracks: Tracks, size_px: tuple[int, int]) -> int:
    """Return how many of 24 cells of the image hold points."""
    share = (tracks.points_px[tracks.home] + 0.5) / np.array(size_px)
    column, row = np.clip(share * np.array(_CELLS), 0, np.array(_CELLS) - 1).astype(int).T
    return len(np.unique(row * _CELLS[0] + column))
