"""A place that only looks alike is not believed, whatever has held, carried or tied the poses before: bare walls, moved models, refused loops."""

from dataclasses import replace

import numpy as np

from phone_host.geometry.se3 import SE3
from phone_host.native.library import native
from phone_host.scan.odometry import Moved
from phone_host.scan.piece import Found, Joining, Piece, PoseGate
from phone_host.scan.pieces import Pieces
from phone_host.scan.places import Place, is_bare
from phone_host.scan.stretches import ModelMotion, Placed
from phone_host.scan.tracker import Tracker
from phone_host.scan.tracking_words import Weakness
from phone_host.scan.view import View
from phone_host.scan.volume_settings import VolumeSettings
from tests.support.niches import APART_M, BARE, niches_view, station
from tests.support.plane_films import CORNER, distance, plane_view, texture

SETTINGS = VolumeSettings(voxel_m=0.02, far_m=3.0)
HERE = SE3.identity()
PAPERS = (texture(), texture(21), texture(22))
LOST = Moved(world_camera=HERE, before_now=HERE, is_known=False, followed=0, inliers=0)


def along(x_m: float, turn: float = 0.0) -> SE3:
    """A pose beside the first one, turned about the vertical."""
    return SE3.of(np.array([0.0, turn, 0.0, x_m, 0.0, 0.0]))


def corner(pose: SE3 = HERE, paper: int = 0) -> View:
    """What a camera sees of the corner with one of the papers, from a pose in the corner's own axes."""
    return plane_view(pose, PAPERS[paper], CORNER)


def model_with(*poses: SE3) -> Pieces:
    """A model in which the corner was seen from some poses."""
    pieces = Pieces(SETTINGS, 1, PoseGate(), native())
    for pose in poses:
        pieces.fuse(corner(pose), pose, None)
    pieces.model.usual_off_sigmas = 0.6
    return pieces


def test_a_bare_wall_does_not_tell_that_the_camera_stands_still() -> None:
    """Two niches look alike, 2 m apart. The camera knows both, goes from one to the other along a bare wall, which holds it: it is not believed at the first."""
    wall, first = texture(44), station(APART_M)
    there = [APART_M - 0.15 * at for at in range(14)]
    slow = [0.03, 0.0, 0.03, 0.0, 0.03, 0.06, 0.1]
    bare = [0.22 + 0.12 * at for at in range(12)]
    tracker, views = Tracker(SETTINGS), [(x_m, wall) for x_m in there]
    views += [(x_m, BARE) for x_m in (*slow, *bare, 1.95, APART_M)]
    for number, (x_m, paper) in enumerate(views):
        view = niches_view(station(x_m), paper)
        told = tracker.track(view)
        assert told.is_fused or number > len(there) + len(slow)
        if told.is_fused and not is_bare(view):
            assert (distance(told.world_camera, first.inverse() @ station(x_m)) < (0.1, 0.1)).all()


def test_a_bare_view_is_held_but_tells_no_motion() -> None:
    """Views of a plain wall, which nothing follows, go on where the camera was lost; a corner of the model 2 m away is in reach after ten of them, not after one."""
    pieces = model_with(along(2.0))
    plain = replace(corner(), grey=np.full_like(corner().grey, 128))
    pieces.fuse(plain, HERE, None)
    pieces.moved(replace(LOST, before_now=along(0.1), is_known=True, inliers=100), 1.0)
    reached = []
    for _ in range(10):
        pieces.moved(LOST, 1.0)
        assert pieces.is_here(plain, HERE, pieces.model.laid(plain, HERE))
        pieces.fuse(plain, HERE, None)
        pieces.recognised(corner(along(2.0)))
        reached.append(pieces.is_ambiguous)
    assert reached[0] is False
    assert reached[-1] is True


def test_the_pose_that_is_judged_is_that_which_was_laid() -> None:
    """Too few corners say that the camera has turned by 20 degrees: its depth is laid from there, its features agree, and it is there; not where it was before."""
    turned = along(0.0, np.radians(20.0))
    pieces, view = model_with(turned, HERE), corner(turned)
    pieces.moved(replace(LOST, before_now=turned, is_known=True, inliers=10), 1.0)
    fit = pieces.model.laid(view, turned)
    assert pieces.is_here(view, turned, fit)
    assert not pieces.is_here(view, HERE, fit)


def fragments() -> tuple[Pieces, list[Piece]]:
    """A model and two fragments that know the same corner, each by a paper of its own and with a way of its own; the last one is tracked."""
    known: list[Piece] = []
    pieces = model_with(HERE)
    for number in (1, 2):
        pieces.moved(LOST, 1.0)
        pieces.begin(10 * number, corner(HERE, number), HERE, Weakness.TOO_FAST)
        known.append(pieces.active)
        for at in range(1, 4):
            pieces.fuse_apart(10 * number + at, corner(along(0.02 * at), number), along(0.02 * at), Weakness.NONE, None)
        pieces.active.usual_off_sigmas = 0.6
    return pieces, known


def test_a_refused_loop_leaves_everything_as_it_was() -> None:
    """A place puts a fragment 5 degrees beside where its own surface fits: it stays apart and where it was, also when another one is joined."""
    pieces, known = fragments()
    met = pieces.met(corner(HERE), HERE)
    assert met is not None
    about = SE3(np.eye(3), np.array([0.0, 0.0, 1.0]))
    off = about @ along(0.03, np.radians(4.6)) @ about.inverse()
    world = pieces.in_world(HERE)
    assert pieces.join(corner(HERE), HERE, Found(met.piece, off @ met.pose, met.fit)) == Joining()
    assert np.array_equal(pieces.in_world(HERE).pose(), world.pose())
    pieces.go_on_in(known[0])
    met = pieces.met(corner(HERE), HERE)
    assert met is not None
    assert [view.number for view in pieces.join(corner(HERE), HERE, met).views] == [10, 11, 12, 13]
    pieces.go_on_in(known[1])
    assert pieces.active is known[1]


def test_what_is_known_in_the_models_axes_moves_with_it() -> None:
    """Loops turn the model by 90 degrees and shift it by 3 m while a fragment is tracked: the fragment is believed to be there, and meets the model there."""
    by = along(3.0, np.pi / 2)
    pieces = model_with(HERE)
    pieces.moved(LOST, 1.0)
    pieces.begin(2, corner(along(0.1), 1), along(0.1), Weakness.TOO_FAST)
    model = pieces.model
    model.volume.emptied()
    model.places.move([by] * model.places.count)
    model.volume.fuse(corner(), by)
    pieces.model_moved(ModelMotion.of([Placed(1, by, by)]))
    assert (distance(pieces.in_world(HERE), by @ along(0.1)) < 1e-9).all()
    met = pieces.met(corner(along(0.1)), HERE)
    assert met is not None
    assert (distance(met.pose, by @ along(0.1)) < (6e-3, 7e-3)).all()


def test_a_view_that_waits_for_a_second_one_moves_with_the_model() -> None:
    """After a long loss one view shows the model, which loops move then by 1 m; an independent one, that shows it where it is now, agrees with the first."""
    by = along(1.0)
    pieces = model_with(along(4.0), along(4.2))
    pieces.fuse(plane_view(HERE, texture(9), CORNER), HERE, None)
    pieces.moved(replace(LOST, before_now=along(0.1), is_known=True, inliers=100), 1.0)
    pieces.moved(LOST, 30.0)
    seen = plane_view(along(4.0), PAPERS[0], CORNER)
    pieces.begin(4, seen, HERE, Weakness.TOO_FAST)
    assert pieces.met(seen, HERE) is None
    assert pieces.is_ambiguous
    model = pieces.model
    model.volume.emptied()
    model.places.move([by] * model.places.count)
    for x_m in (4.0, 4.2):
        model.volume.fuse(corner(along(x_m)), by @ along(x_m))
    pieces.model_moved(ModelMotion.of([Placed(1, by, by)]))
    assert pieces.met(plane_view(along(4.2), PAPERS[0], CORNER), along(0.2)) is not None


def test_a_pose_moves_with_the_views_around_it() -> None:
    """Each part of a model has a motion of its own: that of the nearest view, of the last one where several were taken there."""
    views = [Placed(1, along(0.1), along(0.1)), Placed(2, along(5.2), along(0.2)), Placed(3, along(5.3), along(0.3))]
    motion = ModelMotion.of(views)
    assert np.allclose([motion.carry(along(x_m)).t_m[0] for x_m in (-1.0, 1.0, 4.0, 5.0)], [-0.9, 1.1, 4.3, 5.3])


def test_a_tracker_knows_any_number_of_places() -> None:
    """With 5000 places, a million descriptors, a lost view is found where it was taken: 57 degrees from the one place that it shows."""
    before = Tracker(SETTINGS)
    before.track(corner())
    random, state = np.random.default_rng(1), before.kept(0)
    others = tuple(
        Place(along(0.04 * at), np.ones((200, 3)), random.integers(0, 256, (200, 32), np.uint8)) for at in range(4999)
    )
    tracker = Tracker(SETTINGS)
    tracker.volume.put(before.volume.changed_blocks(every=True))
    tracker.go_on(replace(state, usual_off_sigmas=0.6, places=(*others, *state.places)))
    far = SE3.of(np.array([0.02, 0.1, 1.0, -0.1, 0.02, 0.05]))
    told = tracker.track(corner(far))
    assert told.is_fused
    assert (distance(told.world_camera, far) < (5e-3, 5e-3)).all()
