"""Whether a rigid camera made a film is told from followed points: here made of numbers, without images."""

from collections.abc import Callable

import numpy as np
import pytest

from phone_host.doctor.camera_check.bundle import Floats, Tracks
from phone_host.doctor.camera_check.look import RIGID, WARPED, excess_of
from phone_host.doctor.camera_check.rigid import Compared, compare, still_points
from phone_host.geometry.lens import project, rays_through
from phone_host.geometry.se3 import rotations_of
from phone_host.model import CameraModel

_FRAMES, _POINTS, _NOISE_PX, _READOUT = 11, 60, 0.04, 0.6
_CLOSE = 8
_SIZE = np.array([640, 480])
_LENS = CameraModel(
    width_px=640,
    height_px=480,
    matrix=np.array([[560.0, 0, 322], [0, 561, 238], [0, 0, 1]]),
    distortion=np.array([-0.08, 0.02, 0.0004, -0.0003, 0.0]),
)

Warp = Callable[[Floats, float], Floats]


def hand(frame: Floats) -> Floats:
    """How a hand turns and moves a camera, (N, 6): some degrees and centimetres, with a tremor of 5 Hz; time in frames of 1/30 s."""
    t_s = np.asarray(frame)[:, np.newaxis] / 30
    slow = np.array([0.05, 0.06, 0.02, 0.03, 0.02, 0.02]) * np.sin(2 * np.pi * 0.7 * t_s + np.arange(6))
    return np.asarray(
        slow + 0.003 * np.sin(2 * np.pi * 5 * t_s + 2 * np.arange(6)) * [1, 1, 1, 0.3, 0.3, 0.3], np.float64
    )


def unwarped(points: Floats, frame: float) -> Floats:
    """What a plain camera does."""
    del frame
    return points


def filmed(warp: Warp = unwarped, close: float = 1.0) -> Tracks:
    """Points of a room as a camera with a rolling shutter shows them, then warped; the first ones closer than the others."""
    random = np.random.default_rng(3)
    home = random.uniform(20, _SIZE - 20, (_POINTS, 2))
    places = rays_through(home, _LENS) * random.uniform(0.8, 2.5, (_POINTS, 1))
    places[:_CLOSE] *= close
    frames = []
    for frame in range(_FRAMES):
        points = home
        for _ in range(4):  # the moment of a point's row depends on its row
            motion = hand(frame + (points[:, 1] / 480 - 0.5) * _READOUT)
            points = project(np.einsum("nij,nj->ni", rotations_of(motion[:, :3]), places - motion[:, 3:]), _LENS)
        frames.append(warp(points, float(frame)) + random.normal(0, _NOISE_PX, points.shape))
    points = np.array(frames)
    inside = (points > 0) & (points < _SIZE)
    return Tracks(points, np.asarray(inside.all(axis=2)), _FRAMES // 2)


def told(tracks: Tracks) -> Compared:
    """Both bundles, with the calibrated lens."""
    return compare(tracks, _LENS, knows_lens=True)


def shifted(points: Floats, frame: float) -> Floats:
    """A stabiliser that shifts the image against two thirds of the turns."""
    turn = hand(np.array([frame]))[0]
    return points - 0.67 * 560 * np.array([turn[1], -turn[0]])


def turned(points: Floats, frame: float) -> Floats:
    """One that turns the view, as if there were no distortion, and leaves the rows as they rolled."""
    back = rotations_of(-0.67 * hand(np.array([frame]))[0, :3])
    rays = np.column_stack([points, np.ones(len(points))]) @ np.linalg.inv(_LENS.matrix).T @ back.T @ _LENS.matrix.T
    return np.asarray(rays[:, :2] / rays[:, 2:], np.float64)


def cropped(points: Floats, frame: float) -> Floats:
    """One that shows a tenth less, enlarged."""
    del frame
    return (points - _SIZE / 2) / 0.9 + _SIZE / 2


def test_a_rolling_shutter_and_a_trembling_hand_are_no_warp() -> None:
    """What a rigid camera films is rigid, down to the noise that was added; and the readout is found to a tenth."""
    found = told(filmed())
    assert excess_of(found) < RIGID
    assert found.noise_px == pytest.approx(_NOISE_PX, rel=0.3)
    assert found.common[4] == pytest.approx(_READOUT, abs=0.06)


_WALKING = 2 * _POINTS // 5


def walked(points: Floats, frame: float) -> Floats:
    """Somebody walks through two fifths of the picture."""
    moved = points.copy()
    moved[:_WALKING] += (frame - _FRAMES // 2) * np.array([9.0, 1.0])
    return moved


def test_what_moves_by_itself_is_no_warp() -> None:
    """Somebody who walks by is left out; the readout is found without him."""
    found = told(filmed(walked))
    assert excess_of(found) < RIGID
    assert found.trust[:, :_WALKING].mean() < 0.3 < found.trust[:, _WALKING:].mean()
    assert found.common[4] == pytest.approx(_READOUT, abs=0.06)


def test_the_scene_is_what_most_points_turn_with() -> None:
    """Before depth is known, the walker's points are told from the others, and the turns are the camera's, to two degrees."""
    still, turns = still_points(filmed(walked), _LENS)
    assert not still[:_WALKING].any()
    assert still[_WALKING:].mean() > 0.8
    true = rotations_of(hand(np.arange(_FRAMES, dtype=np.float64))[:, :3])
    off = turns @ np.swapaxes(true @ true[_FRAMES // 2].T, 1, 2)
    assert np.degrees(np.arccos(np.clip((np.trace(off, axis1=1, axis2=2) - 1) / 2, -1, 1))).max() < 2.0


def test_a_point_left_out_at_first_is_tried_again() -> None:
    """A thing close to the camera moves unlike the turn says. It is left out at first, and trusted in the end."""
    tracks = filmed(close=0.3)
    still, _ = still_points(tracks, _LENS)
    found = told(tracks)
    assert still[:_CLOSE].mean() < 0.5
    assert found.trust[:, :_CLOSE][tracks.seen[:, :_CLOSE]].mean() > 0.5
    assert excess_of(found) < RIGID


@pytest.mark.parametrize("warp", [shifted, turned, cropped])
def test_a_stabiliser_is_told(warp: Warp) -> None:
    """A shift, a turn and a crop are no rigid camera with this lens."""
    assert excess_of(told(filmed(warp))) > WARPED
