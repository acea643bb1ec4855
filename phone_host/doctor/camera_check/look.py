"""Looks at one stretch of film: could a rigid camera have made it? Pure, and slow: some seconds.

Points are followed from the middle frame outwards. Every frame is compared with the middle one itself, so that nothing drifts from frame to
frame; where a point was in the frame between says where to look. What is followed there and back and does not return was covered, or lay on
an edge: it is left out.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.doctor.camera_check.bundle import Flags, Floats, Tracks
from phone_host.doctor.camera_check.rigid import Compared, compare
from phone_host.model import CameraModel, Image
from phone_host.model.capture import Unseen
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
_LEAST_FOLLOWED: Final = 0.6
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
    kept = seen.mean(axis=0) >= _LEAST_FOLLOWED
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


FRAMES: Final = 20
"""Two thirds of a second at 30 frames/s: a hand trembles several times in it."""

_FEWEST_POINTS: Final = 60
_FEWEST_CELLS: Final = 12
_LEAST_SHARE: Final = 0.5
_LEAST_MOTION: Final = 0.01
_MOTION: Final = 0.03
_ACROSS: Final = 0.004
"""Shares of the width by which the picture must move to say anything, and to be called rigid: along and across."""

RIGID: Final = 0.42
WARPED: Final = 0.45
"""Excess of a warp over noise. Rendered films of rigid cameras leave 0.1 to 0.4, stabilised ones 0.4 to 7 (bench_capture)."""

_FLAT_PX: Final = 3.0
_FLAT_OFF_PX: Final = 0.14
_FLAT_NOISE: Final = 3.5
"""A scene whose parallax is larger than the first, but leaves a plane by less than the second, or so many times the noise, tells nothing: a
plane's film fits many cameras. Rendered posters leave 0.05 to 0.13 px, the flattest scenes with depth 0.2."""

_COUNTS: Final = 0.3
_GLANCE_PX: Final = 160
_GUESSED_VIEW: Final = 64.0
"""Horizontal angle of view of phones' main cameras in video, degrees."""


@dataclass(frozen=True, slots=True, eq=False)
class Window:
    """Frames without a gap between them.

    Attributes:
        frames: `FRAMES` images (H, W) uint8, grey.
        period_ms: time between two of them.
        lens: the camera's, for this size; None: not calibrated.
    """

    frames: tuple[Image, ...]
    period_ms: float
    lens: CameraModel | None


@dataclass(frozen=True, slots=True)
class Reading:
    """What a window tells.

    Attributes:
        unseen: why it tells nothing; None: it does.
        excess: by how much a warp explains more than noise, in standard deviations of it; NaN: not computed.
        noise_px: standard deviation of the noise.
        readout_ms: rolling shutter, first to last row.
        readout_sigma_ms: its standard uncertainty.
        along: share of the width by which the picture moved.
    """

    unseen: Unseen | None
    excess: float = math.nan
    noise_px: float = math.nan
    readout_ms: float = math.nan
    readout_sigma_ms: float = math.nan
    along: float = 0.0

    @property
    def is_warped(self) -> bool:
        """Whether no rigid camera made it."""
        return self.excess >= WARPED


def may_tell(window: Window) -> bool:
    """Tell, quickly, whether the picture moves enough in a window for a look."""
    by = min(1.0, _GLANCE_PX / window.frames[0].shape[1])
    some = [
        cv2.resize(frame, None, fx=by, fy=by, interpolation=cv2.INTER_AREA).astype(np.float32)
        for frame in window.frames[:: FRAMES // 4]
    ]
    moved = [math.hypot(*cv2.phaseCorrelate(some[0], other)[0]) for other in some[1:]]
    return bool(max(moved) >= _LEAST_MOTION * some[0].shape[1] / 2)


def look(window: Window) -> Reading:
    """Look at a window."""
    height, width = window.frames[0].shape
    tracks = follow(window.frames)
    if tracks.points_px.shape[1] < _FEWEST_POINTS or filled_cells(tracks, (width, height)) < _FEWEST_CELLS:
        return Reading(Unseen.PLAIN)
    along, across = (moved / width for moved in motion_px(tracks))
    if along < _LEAST_MOTION:
        return Reading(Unseen.STILL, along=along)
    try:
        compared = compare(tracks, window.lens or guessed_lens(width, height), knows_lens=window.lens is not None)
    except np.linalg.LinAlgError:
        return Reading(Unseen.PLAIN, along=along)
    return judged(compared, tracks.seen, window.period_ms, along, across)


def excess_of(compared: Compared) -> float:
    """Return by how much warps explain more than noise does, in standard deviations of the noise."""
    counted = int((compared.trust > _COUNTS).sum())
    return math.sqrt(max(compared.rigid - compared.warped, 0.0) / max(2 * counted, 1))


def judged(compared: Compared, seen: Flags, period_ms: float, along: float, across: float) -> Reading:
    """Judge what the flow of two pictures shows, `period_ms` apart, with motion along and across the rows."""
    excess, unseen = excess_of(compared), None
    if (compared.trust > _COUNTS)[seen].mean() < _LEAST_SHARE:
        unseen = Unseen.LIVELY
    elif compared.parallax_px > _FLAT_PX and compared.off_plane_px < max(_FLAT_OFF_PX, _FLAT_NOISE * compared.noise_px):
        unseen = Unseen.FLAT
    elif excess < WARPED:
        if along < _MOTION or across < _ACROSS:
            unseen = Unseen.STILL
        elif excess > RIGID:
            unseen = Unseen.VAGUE
    return Reading(
        unseen,
        excess,
        compared.noise_px,
        compared.common[4] * period_ms,
        compared.readout_sigma * period_ms,
        along,
    )


def guessed_lens(width_px: int, height_px: int) -> CameraModel:
    """Return a lens as phones and webcams have it, for a camera that was never calibrated."""
    focal = width_px / 2 / math.tan(math.radians(_GUESSED_VIEW) / 2)
    matrix = np.array([[focal, 0, (width_px - 1) / 2], [0, focal, (height_px - 1) / 2], [0, 0, 1.0]])
    return CameraModel(width_px=width_px, height_px=height_px, matrix=matrix, distortion=np.zeros(5))
