"""Stretches: drift is shared out over the way, a loop that tracking cannot have missed so far is not believed; and the bounded copies of views."""

from dataclasses import replace
from itertools import pairwise

import numpy as np

from phone_host.geometry.se3 import SE3
from phone_host.run.scan_result import way_remarks
from phone_host.scan.loop_closing import KeptViews
from phone_host.scan.stretches import Placed, Stretches
from phone_host.scan.volume import Volume
from phone_host.scan.volume_settings import VolumeSettings
from tests.support.plane_films import CORNER, distance, plane_view, texture

VIEW = plane_view(SE3.identity(), texture(), CORNER)


def along(x_m: float) -> SE3:
    """Somewhere along a straight way."""
    return SE3(np.eye(3), np.array([x_m, 0.0, 0.0]))


def there_and_back() -> Stretches:
    """Fifty views 1 m there, fifty back, of which tracking has seen 6 cm less: it ends 6 cm before the beginning."""
    stretches = Stretches(0.02)
    for number in range(100):
        x_m = 0.02 * number if number < 50 else 1.0 - 0.94 * 0.02 * (number - 49)
        stretches.add(Placed(number, along(x_m)))
    return stretches


def test_drift_is_shared_out() -> None:
    """A loop from the end to the beginning: the first stretch stays, the others move the more the later they are, the last by what ties and loops are sure of."""
    stretches = there_and_back()
    last = stretches.count - 1
    end = stretches.views(last)[-1].world_camera
    assert [stretches.close(0, end, along(0.0)) for _ in range(3)] == [False, True, True]  # one alone may err
    by = stretches.settled()
    ways_m = [-motion.t_m[0] for motion in by]
    assert ways_m[0] == 0
    assert all(one < other for one, other in pairwise(ways_m))
    # Nineteen ties of 6.3 mm each against three loops of 20 mm: 85 %, less the loops' loss by Cauchy's weight.
    assert 0.047 < ways_m[last] < 0.052
    turn, shift_m = stretches.farthest(by)
    assert turn < 1e-9
    assert np.isclose(shift_m, ways_m[last])
    before = [view.world_camera.t_m[0] for view in stretches.views(4)]
    stretches.move(by)
    after = [view.world_camera.t_m[0] for view in stretches.views(4)]
    assert np.allclose(np.array(before) - after, ways_m[4])  # as a whole


def test_a_loop_farther_off_than_tracking_can_be_is_not_believed() -> None:
    """After 2 m, 0.3 m beside tracking or turned by 20 degrees: another place that looks alike."""
    stretches = there_and_back()
    end = stretches.views(stretches.count - 1)[-1].world_camera
    assert not stretches.close(0, end, end @ along(0.3))
    assert not stretches.close(0, end, end @ SE3.of(np.array([0.0, 0.35, 0.0, 0.0, 0.0, 0.0])))
    assert not stretches.close(0, end, SE3(np.full((3, 3), np.nan), np.zeros(3)))
    assert all(np.array_equal(motion.pose(), np.zeros(6)) for motion in stretches.settled())


def test_loops_are_looked_for_where_they_tell_more_than_tracking() -> None:
    """First with those that are least known; not with the neighbour, not after three of the same stretch, and not at rest, where tracking is sure."""
    stretches = there_and_back()
    far, near = stretches.older()
    assert 0 in far
    assert near
    assert stretches.count - 2 not in (*far, *near)
    end = stretches.views(stretches.count - 1)[-1].world_camera
    for _ in range(3):
        stretches.close(0, end, end)
    assert stretches.older() == ([], [])
    stretches.add(Placed(100, end))
    assert 0 not in stretches.older()[0]  # it is known from the loop of the stretch before
    still = Stretches(0.02)
    for number in range(100):
        still.add(Placed(number, along(0.0)))
    assert still.older() == ([], [])


def test_long_ways_have_longer_stretches() -> None:
    """The first fifty have five views, the next fifty ten, then twenty. Where every fourth view is kept, the first has twenty, too."""
    stretches, thin = Stretches(0.02), Stretches(0.02)
    for number in range(1000):
        stretches.add(Placed(number, along(0.0)))
        thin.add(Placed(number, along(0.0)), kept_of=4)
    assert [len(stretches.views(at)) for at in (0, 49, 50, 99, 100)] == [5, 5, 10, 10, 20]
    assert len(thin.views(0)) == 20


def test_a_piece_and_a_camera_that_was_lost_begin_stretches_of_their_own() -> None:
    """Tied to where they were found again; a drift before that moves them along."""
    stretches = Stretches(0.02)
    for number in range(3):
        stretches.add(Placed(number, along(0.1 * number)))
    stretches.add_piece([Placed(4, along(0.5)), Placed(5, along(0.6))], 0)
    stretches.add(Placed(6, along(0.2)), 1)
    assert [len(stretches.views(at)) for at in range(stretches.count)] == [3, 2, 1]
    assert np.allclose(distance(stretches.views(1)[1].world_camera, along(0.6)), 0)
    assert all(np.allclose(motion.pose(), 0) for motion in stretches.settled())


def test_copies_of_views_are_bounded() -> None:
    """Of ten views in the room of four every fourth is left, with depths to a thousandth and colours to 8 of 255 of the mean; of too many none."""
    room = KeptViews(1 << 30)
    room.remember(0, VIEW)
    kept = KeptViews(4 * room.bytes + 1000)
    for number in range(10):
        kept.remember(number, VIEW)
    assert [number for number, _ in kept.of(range(10))] == [0, 4, 8]
    assert [number for number, _ in kept.of(range(10), 2)] == [0, 8]
    assert kept.count == 3
    _, view = next(kept.of([4]))
    assert np.allclose(view.depth_m, VIEW.depth_m, rtol=1e-3)
    assert np.abs(view.colours.astype(float) - VIEW.colours).mean() < 8
    assert view.geometry == VIEW.geometry
    kept.bound(2 * room.bytes)
    assert (kept.count, kept.are_enough) == (2, True)
    kept.bound(0)
    assert (kept.count, kept.bytes, kept.are_enough) == (0, 0, False)
    kept.remember(10, VIEW)
    assert kept.count == 0


def test_wide_views_are_kept_smaller() -> None:
    """Of 960 px every fourth pixel: 240 px, with the geometry and the noise of these."""
    wide = replace(
        VIEW,
        grey=np.kron(VIEW.grey, np.ones((4, 4), np.uint8)),
        colours=np.repeat(np.repeat(VIEW.colours, 4, axis=0), 4, axis=1),
        depth_m=np.kron(VIEW.depth_m, np.ones((4, 4), np.float32)),
        geometry=replace(VIEW.geometry, focal_px=4 * VIEW.geometry.focal_px),
        noise_px=0.4,
    )
    kept = KeptViews(1 << 30)
    kept.remember(7, wide)
    _, view = next(kept.of([7]))
    assert view.depth_m.shape == VIEW.depth_m.shape
    assert np.isclose(view.geometry.focal_px, VIEW.geometry.focal_px)
    assert np.isclose(view.noise_px, 0.1)


def test_an_emptied_volume_is_as_new() -> None:
    """What goes in afterwards gives the surface of a new one, and whoever copies its blocks gets all that have changed."""
    settings = VolumeSettings(voxel_m=0.04, far_m=3.0)
    used, new = Volume(settings), Volume(settings)
    used.fuse(VIEW, along(0.3))
    used.changed_blocks()
    used.emptied()
    assert not used.blocks.weights.any()
    assert len(used.changed_blocks().places) == used.blocks.count
    for volume in (used, new):
        volume.fuse(VIEW, SE3.identity())
    there = used.blocks.find(new.blocks.places[: new.blocks.count])
    assert np.array_equal(used.blocks.field[there], new.blocks.field[: new.blocks.count])
    assert np.array_equal(used.blocks.weights[there], new.blocks.weights[: new.blocks.count])


def test_it_is_said_how_sure_a_long_way_is() -> None:
    """The end of a way is known the less the longer it is, and better with loops; of a short one nothing is said."""
    stretches = there_and_back()
    before = stretches.certainty
    assert np.isclose(before.length_m, 1.92, atol=0.05)
    assert before.loops == 0
    end = stretches.views(stretches.count - 1)[-1].world_camera
    for _ in range(3):
        stretches.close(0, end, along(0.0))
    after = stretches.certainty
    assert after.loops == 3
    assert 0 < after.sigma_m < before.sigma_m
    assert way_remarks(None) == way_remarks(before) == ()
    (open_way,), (closed_way,) = (way_remarks(replace(each, length_m=20.0)) for each in (before, after))
    assert "no loop was closed" in open_way.message
    assert open_way.remedy
    assert "3 loops were closed" in closed_way.message
