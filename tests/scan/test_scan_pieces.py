"""A camera that is lost goes on in a piece of its own; where a view shows the model again, the piece becomes part of it."""

from dataclasses import replace

import numpy as np
import pytest

from phone_host.geometry.se3 import SE3
from phone_host.native.library import Library, native
from phone_host.scan.blocks import BLOCK_BYTES, Box, Cells
from phone_host.scan.carving import Carving
from phone_host.scan.fusion import KeptDepths
from phone_host.scan.loop_closing import LoopSettings
from phone_host.scan.odometry import Moved
from phone_host.scan.piece import Found, Joining, Piece, PoseGate
from phone_host.scan.pieces import Pieces
from phone_host.scan.scan import scan_for
from phone_host.scan.scan_wanted import ScanWanted
from phone_host.scan.tracked import Tracked
from phone_host.scan.tracker import Tracker
from phone_host.scan.tracking_words import Tracking, Weakness
from phone_host.scan.view import View
from phone_host.scan.volume_settings import VolumeSettings
from tests.support.plane_films import CORNER, WALL, distance, plane_view, texture
from tests.support.turning_things import processed_of

pytestmark = pytest.mark.skipif(not isinstance(native(), Library), reason="numpy alone takes minutes")

PICTURE = texture()
SETTINGS = VolumeSettings(voxel_m=0.02, far_m=3.0)
SEEN = [SE3.of(np.array([0.0, 0.03 * at, 0.0, 0.01 * at, 0.0, 0.0])) for at in range(3)]
BACK = [SE3.of(np.array([0.0, turn, 0.0, 0.3 * turn, 0.0, 0.0])) for turn in np.linspace(1.1, 0.3, 9)]
"""From where nothing is seen of what was: 63 degrees turned, and back."""


def film(poses: list[SE3]) -> list[View]:
    """The corner from several places."""
    return [plane_view(pose, PICTURE, CORNER) for pose in poses]


def run(tracker: Tracker) -> list[Tracked]:
    """Three views, and then, without a way between them, nine that lead back."""
    return [tracker.track(view) for view in film([*SEEN, *BACK])]


@pytest.mark.parametrize("loops", [None, LoopSettings()])
def test_a_piece_is_joined_where_a_view_shows_the_model(loops: LoopSettings | None) -> None:
    """Lost at first, followed apart, relocalised; the views between are in the model then, within 6 mm and 0.4 degrees of the truth."""
    told = run(Tracker(SETTINGS, loops=loops))
    at = next(number for number, each in enumerate(told) if each.joined)
    assert [each.state for each in told[3:at]] == [Tracking.LOST] * (at - 3)
    assert told[4].weakness is Weakness.APART
    assert told[at].state is Tracking.RELOCALISED
    assert [view.number for view in told[at].joined] == list(range(4, at + 1))
    truth = [*SEEN, *BACK]
    assert all((distance(view.world_camera, truth[view.number - 1]) < (6e-3, 7e-3)).all() for view in told[at].joined)
    assert (distance(told[-1].world_camera, BACK[-1]) < (6e-3, 7e-3)).all()


def test_the_model_is_as_it_was_until_then() -> None:
    """What is seen apart changes no voxel of the model; joined, it is in it."""
    tracker = Tracker(SETTINGS)
    views = film([*SEEN, *BACK])
    for view in views[:3]:
        tracker.track(view)
    before, count = tracker.volume.blocks.weights.copy(), tracker.volume.blocks.count
    for view in views[3:]:
        told = tracker.track(view)
        if told.is_fused:
            break
        assert np.array_equal(tracker.volume.blocks.weights, before)
    assert tracker.volume.blocks.count > 1.3 * count


def test_the_same_views_give_the_same_bits() -> None:
    """Poses and field, twice, with one thread and with three."""
    one, three = Tracker(SETTINGS), Tracker(SETTINGS, 3)
    here, there = (np.array([each.world_camera.pose() for each in run(tracker)]) for tracker in (one, three))
    assert np.array_equal(here, there)
    assert np.array_equal(one.volume.blocks.field, three.volume.blocks.field)


def test_without_memory_no_piece_is_begun() -> None:
    """The model has all blocks there are: a view that does not fit is lost, as ever, and nothing grows."""
    tracker = Tracker(replace(SETTINGS, most_bytes=256 * BLOCK_BYTES))
    told = run(tracker)
    assert not any(each.joined for each in told)
    assert all(each.weakness is not Weakness.APART for each in told)


def test_a_piece_that_is_given_up_while_it_is_tracked_leaves_the_model_tracked() -> None:
    """Four pieces, the last with the fewest views, and no memory left: the next jump is where it is believed to be in the world."""
    settings = replace(SETTINGS, most_bytes=8000 * BLOCK_BYTES)
    pieces = Pieces(settings, 1, PoseGate(), native())
    view = film(SEEN[:1])[0]
    for number in range(4):
        pieces.begin(number, view, SEEN[1], Weakness.TOO_FAST)
        if number < 3:
            pieces.fuse_apart(number, view, SEEN[0], Weakness.NONE, None)
    pieces.model.volume.blocks = pieces.model.volume.blocks.grown(7800)
    world = pieces.in_world(SEEN[2])
    assert pieces.begin(5, view, SEEN[2], Weakness.TOO_FAST) is world or pieces.active is pieces.model
    assert pieces.active is pieces.model


def test_pieces_give_way_to_the_model() -> None:
    """A model that needs their memory gets it: all together never hold more than was allowed."""
    settings = replace(SETTINGS, voxel_m=0.01, most_bytes=600 * BLOCK_BYTES)
    pieces = Pieces(settings, 1, PoseGate(), native())
    view = film(SEEN[:1])[0]
    pieces.begin(1, view, SEEN[1], Weakness.TOO_FAST)
    apart = pieces.active
    pieces.go_on_in(pieces.model)
    pieces.fuse(view, SEEN[0], None)
    assert pieces.model.volume.blocks.room > 256
    pieces.go_on_in(apart)
    assert pieces.active is pieces.model


def test_what_a_joined_piece_saw_carves_too() -> None:
    """Every view in the model has looked through the box, those that were lost at first as well; a box that is chosen later is carved by them all, too."""
    box = Box((-0.4, -0.4, 0.4), (0.4, 0.1, 1.2))
    scan = scan_for(ScanWanted(voxel_m=0.02, box=box))
    pairs = [
        scan.take(str(number), float(number), processed_of(view)) for number, view in enumerate(film([*SEEN, *BACK]))
    ]
    assert Tracking.LOST in {pair.state for pair in pairs}
    assert scan.fused == len(pairs)
    carved = scan.close_submap().carved
    assert carved is not None
    assert carved.views == scan.fused
    scan.crop(Box((-0.3, -0.4, 0.4), (0.4, 0.1, 1.2)))
    assert scan.model().is_closed


def test_kept_depths_take_back_what_was_apart() -> None:
    """A view that is joined carves where it is put; one that is unknown, or was taken back, does not."""
    kept, view = KeptDepths(), film(SEEN[:1])[0]
    kept.keep_apart(7, view)
    assert kept.joined(6, SEEN[0]) is None
    seen = kept.joined(7, SEEN[0])
    assert seen is not None
    assert seen.depth_m.shape[1] <= 160
    assert kept.joined(7, SEEN[0]) is None
    carving = Carving(Cells.of(Box((-0.1, -0.1, 0.3), (0.1, 0.1, 0.5)), 0.02))
    kept.carve(carving)
    assert carving.views == 1


def test_pieces_that_nobody_meets_do_not_grow_in_number() -> None:
    """Ten jumps, each to another picture: all lost, the model as it was, and no exception."""
    tracker = Tracker(SETTINGS)
    for view in film(SEEN):
        tracker.track(view)
    before = tracker.volume.blocks.weights.copy()
    far = SE3.of(np.array([0.0, 1.2, 0.0, 0.5, 0.0, 0.0]))
    told = [tracker.track(plane_view(far, texture(seed), CORNER)) for seed in range(10, 20)]
    assert {each.state for each in told} == {Tracking.LOST}
    assert np.array_equal(tracker.volume.blocks.weights, before)


PAPERS = (PICTURE, texture(21), texture(22))


def papered(paper: int, pose: SE3 = SEEN[0]) -> View:
    """The corner with one of the papers."""
    return plane_view(pose, PAPERS[paper], CORNER)


UNKNOWN = Moved(world_camera=SEEN[0], before_now=SEEN[0], is_known=False, followed=0, inliers=0)
"""What odometry says where it has lost the camera."""


def three_papers() -> tuple[Pieces, list[Piece]]:
    """A model and two pieces that know the same corner, each by a paper of its own; their axes are those of their first views. The last one is tracked."""
    pieces = Pieces(SETTINGS, 1, PoseGate(), native())
    pieces.fuse(papered(0), SEEN[0], None)
    known = [pieces.model]
    for number in (1, 2):
        pieces.moved(UNKNOWN, 1.0)
        pieces.begin(number, papered(number, SEEN[number]), SE3.identity(), Weakness.TOO_FAST)
        known.append(pieces.active)
    return pieces, known


def in_axes(number: int, pose: SE3) -> SE3:
    """Where a view from a pose in the world is in the axes of a piece."""
    return SEEN[number].inverse() @ pose


def near(found: SE3, truth: SE3) -> bool:
    """Within 6 mm and 0.4 degrees."""
    return bool((distance(found, truth) < (6e-3, 7e-3)).all())


@pytest.mark.parametrize("tracked", [1, 2])
def test_pieces_that_met_each_other_are_joined_together(tracked: int) -> None:
    """A view of the second piece shows the first one; whichever of them meets the model then, both are in it, where they were taken."""
    pieces, known = three_papers()
    assert pieces.met(plane_view(SEEN[0], texture(23), CORNER), in_axes(2, SEEN[0])) is None
    assert pieces.met(papered(1), in_axes(2, SEEN[0])) is None
    pieces.go_on_in(known[tracked])
    met = pieces.met(papered(0), in_axes(tracked, SEEN[0]))
    assert met is not None
    assert near(met.pose, SEEN[0])
    joined = pieces.join(papered(0), in_axes(tracked, SEEN[0]), met, is_strict=True).views
    assert [view.number for view in joined] == [1, 2]
    assert all(near(view.world_camera, SEEN[view.number]) for view in joined)
    assert pieces.active is pieces.model


def test_a_piece_that_contradicts_the_model_stays_apart() -> None:
    """Its views put the corner 12 cm beside that of the model: it is not taken in, and is tracked on."""
    pieces, known = three_papers()
    beside = in_axes(2, SEEN[0]) @ SE3.of(np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.12]))
    met = pieces.met(papered(0), beside)
    assert met is not None
    before = pieces.model.volume.blocks.weights.copy()
    assert pieces.join(papered(0), beside, met) == Joining(is_refused=True)
    assert pieces.active is known[2]
    assert np.array_equal(pieces.model.volume.blocks.weights, before)


def test_a_view_that_belongs_to_the_model_leaves_its_piece() -> None:
    """The model is tracked then; if the piece is joined later, the view is not counted a second time."""
    pieces, known = three_papers()
    pieces.fuse_apart(3, papered(2), in_axes(2, SEEN[0]), Weakness.NONE, None)
    pieces.leave(3)
    assert pieces.active is pieces.model
    pieces.go_on_in(known[2])
    pose = in_axes(2, SEEN[0])
    met = pieces.met(papered(0), pose)
    assert met is not None
    assert [view.number for view in pieces.join(papered(0), pose, met).views] == [2]


def test_only_surfaces_confirm_a_piece() -> None:
    """Of two views of a piece one has hardly any depth: one of them confirms it, in wide pictures as well, and two that are asked for are not there."""
    pieces, _ = three_papers()
    blind = papered(2)
    blind.depth_m[20:] = blind.depth_m[:, 20:] = np.nan
    away = SE3.of(np.array([0.0, np.pi, 0.0, 0.0, 0.0, 0.0]))
    pieces.fuse_apart(3, blind, away, Weakness.NONE, None)
    pose = in_axes(2, SEEN[0])
    met = pieces.met(papered(0), pose)
    assert met is not None
    assert pieces.join(doubled(papered(0)), pose, met, least=2) == Joining()
    joined = pieces.join(doubled(papered(0)), pose, met, least=1).views
    assert [view.number for view in joined] == [2, 3]
    assert near(joined[0].world_camera, SEEN[2])


@pytest.mark.parametrize(("times", "is_joined"), [(0.8, True), (1.5, False)])
def test_a_surface_that_leaves_directions_open_confirms_only_what_it_lies_on(times: float, *, is_joined: bool) -> None:
    """A wall can be slid along itself, which takes up a part of any error: where a surface must confirm a piece it has to lie as near as views usually do, not twice as far off."""
    pieces = Pieces(SETTINGS, 1, PoseGate(), native())
    flat = plane_view(SEEN[0], PICTURE, WALL)
    waves_m = 0.01 * np.sin(np.arange(flat.depth_m.shape[1], dtype=np.float32) / 12)
    wall = replace(flat, depth_m=(flat.depth_m + waves_m).astype(np.float32))
    pieces.fuse(flat, SEEN[0], None)
    pieces.moved(UNKNOWN, 1.0)
    pieces.begin(1, wall, SEEN[0], Weakness.TOO_FAST)
    fit = pieces.model.laid(wall, SEEN[0])
    assert fit.told < 6
    pieces.model.usual_off_sigmas = fit.off_m / fit.noise_m / times
    joining = pieces.join(wall, SEEN[0], Found(pieces.model, SEEN[0], fit), least=1, is_strict=True)
    assert (len(joining.views), joining.is_refused) == ((1, False) if is_joined else (0, True))


def doubled(view: View) -> View:
    """The same view in pixels half as wide."""
    of, two = view.geometry, np.ones((2, 2))
    return replace(
        view,
        grey=np.kron(view.grey, two).astype(np.uint8),
        colours=np.repeat(np.repeat(view.colours, 2, axis=0), 2, axis=1),
        depth_m=np.kron(view.depth_m, two).astype(np.float32),
        geometry=replace(of, focal_px=2 * of.focal_px, cx_px=2 * of.cx_px + 0.5, cy_px=2 * of.cy_px + 0.5),
    )


def test_a_view_without_depth_belongs_nowhere() -> None:
    """Its picture shows a place of the model, but no surface says where it was taken."""
    pieces, _ = three_papers()
    view = papered(0)
    assert pieces.recognised(view) is not None
    assert pieces.recognised(replace(view, depth_m=np.full_like(view.depth_m, np.nan))) is None
