"""The way back into a field: a place that only looks alike is not believed where the camera cannot be, nor where two places explain a view as well."""

from dataclasses import replace

import numpy as np
import pytest

from phone_host.geometry.se3 import SE3
from phone_host.native.library import native
from phone_host.scan.graph import Loop, without_outliers
from phone_host.scan.odometry import Moved
from phone_host.scan.piece import Piece, PoseGate
from phone_host.scan.pieces import Pieces
from phone_host.scan.relocalisation import Belief, Evidence, PoseSupport, UsualStep, pose_support, sighted
from phone_host.scan.tracker import Tracker
from phone_host.scan.tracking_words import Weakness
from phone_host.scan.view import View
from phone_host.scan.volume_settings import VolumeSettings
from tests.support.papered_room import WALLS, room_view, station
from tests.support.plane_films import CORNER, WALL, distance, plane_view, texture

PICTURE = texture()
SETTINGS = VolumeSettings(voxel_m=0.02, far_m=3.0)
HERE = SE3.identity()
STEP = UsualStep(0.1, 0.05)


def along(x_m: float, turn: float = 0.0) -> SE3:
    """A pose beside the first one, turned about the vertical."""
    return SE3.of(np.array([0.0, turn, 0.0, x_m, 0.0, 0.0]))


def corner(pose: SE3 = HERE) -> View:
    """What a camera sees of the corner from a pose in the corner's own axes."""
    return plane_view(pose, PICTURE, CORNER)


def piece_with(*corners: SE3) -> Piece:
    """A field in which the same corner stands several times: seen from each of some poses as it is from the first."""
    piece = Piece(SETTINGS, 1, PoseGate(), native())
    for pose in corners:
        piece.fuse(corner(), pose, None)
    piece.usual_off_sigmas = 0.6
    return piece


def lost_at(pose: SE3) -> Belief:
    """Where a camera can be that was in the field a moment ago, and was not followed since."""
    return Belief.at(pose).jumped(STEP)


def test_of_places_that_look_alike_the_one_in_reach_is_believed() -> None:
    """The same corner stands 4 m farther and a quarter turned: the camera is found at that beside which it was lost, at either."""
    there = along(4.0, np.pi / 2)
    piece = piece_with(HERE, there)
    for pose in (HERE, there):
        found = sighted(piece, corner(along(0.05)), lost_at(pose))
        assert found.evidence is Evidence.BELIEVED
        assert found.lying is not None
        assert (distance(found.lying.pose, pose @ along(0.05)) < (5e-3, 8e-3)).all()


def test_a_look_alike_out_of_reach_is_not_believed() -> None:
    """The camera was fused 4 m away a moment ago, or odometry has followed it to there: the corner that it shows is another one."""
    followed = Belief.at(along(2.0)).moved(along(2.0)).moved(along(0.1))
    for belief in (lost_at(along(4.0)), lost_at(along(0.0, 2.0)), Belief.at(along(4.0)), followed):
        assert sighted(piece_with(HERE), corner(), belief).evidence is Evidence.NONE


def test_two_places_in_reach_are_ambiguous() -> None:
    """Lost for long, the camera may have come to either of two corners: neither is believed, though one is where it was."""
    piece, belief = piece_with(HERE, along(1.9)), lost_at(HERE)
    for _ in range(8):
        belief = belief.jumped(STEP)
    assert belief.bound.shift_m > 1.9
    assert sighted(piece, corner(), belief).evidence is Evidence.AMBIGUOUS


def test_a_scan_that_goes_on_later_is_where_it_was_only_if_no_other_place_looks_so() -> None:
    """Nobody knows what happened since: with one corner it goes on there, by surface or by place; with a second one, however far away, by neither."""
    pieces = Pieces(SETTINGS, 1, PoseGate(), native())
    pieces.fuse(corner(), HERE, None)
    pieces.model.usual_off_sigmas = 0.6
    pieces.go_on(HERE)
    fit = pieces.model.laid(corner(), HERE)
    assert pieces.is_here(corner(), HERE, fit)
    assert pieces.recognised(corner()) is not None
    pieces.model.fuse(corner(), along(6.0), None)
    assert not pieces.is_here(corner(), HERE, fit)
    assert pieces.recognised(corner()) is None
    assert pieces.is_ambiguous


def test_a_plane_alone_does_not_hold_a_camera_that_is_not_followed() -> None:
    """Its depth fits wherever it is slid along the wall: only features tell where it is, and without them it is not believed."""
    piece = Piece(SETTINGS, 1, PoseGate(), native())
    wall = plane_view(HERE, PICTURE, WALL)
    piece.fuse(wall, HERE, None)
    fit = piece.laid(wall, HERE)
    assert fit.told < 6
    assert pose_support(piece, wall, lost_at(HERE), HERE @ fit.start_now, fit.told) is PoseSupport.NONE
    assert sighted(piece, plane_view(HERE, texture(5), WALL), lost_at(HERE)).evidence is Evidence.NONE


def test_what_odometry_does_not_know_stays_where_it_was_lost() -> None:
    """A quarter of a metre and 40 degrees at the moment of the loss are believed after 5 m of way, where they are 3 m; 3 m more are not."""
    gap, way = along(0.25, 0.7), along(5.0)
    belief = lost_at(HERE)
    for _ in range(50):
        belief = belief.moved(along(0.1))
    assert np.linalg.norm((gap @ way).t_m - way.t_m) > 3
    assert belief.admits(gap @ way, 0.02)
    assert not belief.admits(along(3.0) @ way, 0.02)
    followed = Belief.at(HERE).moved(way)
    assert followed.admits(along(5.15), 0.02)
    assert not followed.admits(along(5.4), 0.02)


PAPERS = tuple(texture(seed) for seed in range(30, 31 + WALLS))
ALIKE = [*PAPERS[: WALLS // 2], *PAPERS[: WALLS // 2], PAPERS[-1]]
"""Opposite walls of a room have the same picture."""


def test_a_lost_camera_is_not_put_where_the_opposite_wall_looks_alike() -> None:
    """It turns by 153 degrees, is covered for a moment and goes on 36 degrees farther, where it sees what it saw at first: no pair in the model is half a turn off."""
    tracker, start, step = Tracker(SETTINGS), station(0), np.radians(9.0)
    for number in (*range(18), 18, *range(22, 25)):
        view = room_view(station(number * step), ALIKE)
        if number == 18:
            view = replace(view, grey=np.zeros_like(view.grey), depth_m=np.full_like(view.depth_m, np.nan))
        told = tracker.track(view)
        assert number == 18 or number > 21 or told.is_fused
        truth = start.inverse() @ station(number * step)
        assert not told.is_fused or (distance(told.world_camera, truth) < (0.1, 0.1)).all()


LOST = Moved(world_camera=HERE, before_now=HERE, is_known=False, followed=0, inliers=0)


@pytest.mark.parametrize("second", [along(0.0), along(0.2)])
def test_after_a_long_loss_two_independent_views_must_agree(second: SE3) -> None:
    """A camera that went 4 m unseen shows a corner of the model: one view may err, the same again tells nothing new, one from elsewhere confirms it."""
    pieces = Pieces(SETTINGS, 1, PoseGate(), native())
    pieces.fuse(corner(), along(4.0), None)
    pieces.fuse(corner(along(0.2)), along(4.2), None)
    pieces.fuse(plane_view(HERE, texture(9), CORNER), HERE, None)
    pieces.model.usual_off_sigmas = 0.6
    pieces.moved(replace(LOST, before_now=along(0.1), is_known=True, inliers=100), 1.0)
    pieces.moved(LOST, 30.0)
    pieces.begin(3, corner(), HERE, Weakness.TOO_FAST)
    assert pieces.met(corner(), HERE) is None
    assert pieces.is_ambiguous
    found = pieces.met(corner(second), second)
    assert (found is not None) is bool(second.t_m[0])


def test_a_loop_that_contradicts_the_rest_is_taken_out() -> None:
    """Four parts in a row, tied by tracking; three loops agree, one says that the last part is a metre aside: it is gone, and the parts stand as without it."""

    def loop(here: int, there: int, x_m: float, *, is_tracked: bool = False) -> Loop:
        return Loop(here=here, there=there, here_there=along(x_m), turn=0.006, shift_m=0.01, is_tracked=is_tracked)

    ties = [loop(at, at + 1, 1.0, is_tracked=True) for at in range(3)]
    right, wrong = [loop(0, 3, 3.01), loop(0, 2, 2.0), loop(1, 3, 2.0)], loop(0, 3, 4.0)
    believed = {at: along(float(at)) for at in range(4)}
    found = without_outliers(believed, [*ties, *right, wrong], 0, 4.0)
    assert wrong not in found.loops
    assert set(right) <= set(found.loops)
    assert np.allclose(found.poses[3].t_m, without_outliers(believed, [*ties, *right], 0, 4.0).poses[3].t_m, atol=1e-6)
