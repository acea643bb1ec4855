"""Which followed points belong to the scene that stands still, and how the camera turned, before anything is known of depth. Pure.

Most of what a hand-held camera sees moves as its turn says; depth moves it by some pixels more. Somebody who walks by moves by far
more. A bundle that begins with all points may take him for the scene: then the scene is infinitely far, he alone has depth, and what the
scene's own depth leaves looks like a warp. So it begins without him. A thing that is close to the camera may be left out, too: the
bundle tries those again.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from phone_host.doctor.camera_check.bundle import Flags, Floats, Tracks
from phone_host.geometry.lens import rays_through
from phone_host.geometry.se3 import rotations_of
from phone_host.model import CameraModel

_TRIALS: Final = 48
_OF_TRIAL: Final = 3
_STEPS: Final = 4
_TUKEY: Final = 4.7
_FAR: Final = 4.0
"""Standard deviations of what the turns leave of points, beyond which one is left out."""

_LEAST_PX: Final = 2.0
_ROLLED: Final = 0.02
"""By how much a camera turns while its rows are read, radians."""


@dataclass(frozen=True, slots=True, eq=False)
class _Sights:
    """Where points are seen: at home (N, 3), in frames (F, N, 2), both in units of the focal length; row of each (F, N), -0.5 to 0.5."""

    home: Floats
    places: Floats
    rows: Floats


def still_points(tracks: Tracks, model: CameraModel) -> tuple[Flags, Floats]:
    """Find the largest part of the points that moves as one turning camera says, nearly.

    The turns of the best of some triples of points, then all points with robust weights.

    Args:
        tracks: at least three points in frames.
        model: the lens, or a guess.

    Returns:
        (N,) which points, and the turns (F, 3, 3) from the home frame's axes to each frame's.
    """
    frames, count = tracks.points_px.shape[:2]
    rays = rays_through(tracks.points_px.reshape(-1, 2), model).reshape(frames, count, 3)
    places = rays[..., :2] / rays[..., 2:]
    row = (tracks.points_px[..., 1] - (model.height_px - 1) / 2) / model.height_px
    sights = _Sights(np.column_stack([places[tracks.home], np.ones(count)]), places, row)
    seen, far_px = tracks.seen, np.full(count, np.inf)
    turns, rolled = np.tile(np.eye(3), (frames, 1, 1)), np.zeros((frames, 3))
    random = np.random.default_rng(count)  # the same film gives the same answer
    for _ in range(_TRIALS):
        some = random.choice(count, _OF_TRIAL, replace=False)
        few = _Sights(sights.home[some], places[:, some], row[:, some])
        tried = _turned(
            few, np.asarray(seen[:, some], np.float64), np.tile(np.eye(3), (frames, 1, 1)), np.zeros((frames, 3))
        )
        off_px = model.mean_focal_px * _off(sights, seen, *tried)
        if np.median(off_px) < np.median(far_px):
            (turns, rolled), far_px = tried, off_px
    for _ in range(_STEPS):
        off = np.linalg.norm(_left(sights, turns, rolled)[0], axis=2)
        sigma = max(float(np.median(far_px)) / 1.177, _LEAST_PX / _FAR) / model.mean_focal_px
        trust = np.asarray(np.where(seen, np.clip(1 - (off / (_TUKEY * sigma)) ** 2, 0, None) ** 2, 0.0), np.float64)
        turns, rolled = _turned(sights, trust, turns, rolled)
        far_px = model.mean_focal_px * _off(sights, seen, turns, rolled)
    limit_px = max(_FAR * float(np.median(far_px)) / 1.177, _LEAST_PX)
    return far_px <= limit_px, turns @ turns[tracks.home].T


def _off(sights: _Sights, seen: Flags, turns: Floats, rolled: Floats) -> Floats:
    """Return by how much each point is beside its place, (N,), in units of the focal length: root mean square of the frames that show it."""
    square = (_left(sights, turns, rolled)[0] ** 2).sum(axis=2)
    return np.asarray(np.sqrt((square * seen).sum(axis=0) / np.maximum(seen.sum(axis=0), 1)), np.float64)


def _turned(sights: _Sights, trust: Floats, turns: Floats, rolled: Floats) -> tuple[Floats, Floats]:
    """Return the turns, and the turns over the rows, that fit best: Gauss and Newton."""
    prior = np.array([1e-6, 1e-6, 1e-6, *3 * [(0.002 / _ROLLED) ** 2]])
    for _ in range(_STEPS):
        rest, columns = _left(sights, turns, rolled)
        frames, count = trust.shape
        wide = columns.reshape(frames, 2 * count, 6)
        heavy = np.swapaxes(wide * np.repeat(trust, 2, axis=1)[..., np.newaxis], 1, 2)
        right = (heavy @ rest.reshape(frames, 2 * count, 1))[..., 0]
        right[:, 3:] -= prior[3:] * rolled
        solved = np.linalg.solve(heavy @ wide + np.diag(prior), right[..., np.newaxis])
        step = np.asarray(solved[..., 0], np.float64)
        turns, rolled = rotations_of(step[:, :3]) @ turns, rolled + step[:, 3:]
    return turns, rolled


def _left(sights: _Sights, turns: Floats, rolled: Floats) -> tuple[Floats, Floats]:
    """Return what turns, and turns over the rows, leave (F, N, 2), and the derivatives by both (F, N, 2, 6)."""
    moved = sights.home @ np.swapaxes(turns, 1, 2)
    row = sights.rows[..., np.newaxis]
    moved = moved + np.cross(rolled[:, np.newaxis] * row, moved)
    x, y = moved[..., 0] / moved[..., 2], moved[..., 1] / moved[..., 2]
    columns = np.empty((*x.shape, 2, 6))
    columns[..., 0, :3] = np.stack([-x * y, 1 + x**2, -y], axis=-1)
    columns[..., 1, :3] = np.stack([-1 - y**2, x * y, x], axis=-1)
    columns[..., 3:] = columns[..., :3] * row[..., np.newaxis]
    return sights.places - np.stack([x, y], axis=-1), columns
