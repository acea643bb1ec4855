"""Places: a view of one is located by it, a view of another scene by none; a kidnapped camera goes on at once."""

from dataclasses import replace

import numpy as np

from phone_host.geometry.se3 import SE3
from phone_host.scan.places import LEAST_INLIERS, Places
from phone_host.scan.tracker import Tracker
from phone_host.scan.tracking_words import Tracking
from phone_host.scan.volume_settings import VolumeSettings
from tests.support.plane_films import CORNER, distance, path, plane_view, texture

PICTURE = texture()
FAR = SE3.of(np.array([0.02, 0.1, 1.0, -0.1, 0.02, 0.05]))
"""A step of 57 degrees, most of it about the optical axis: nothing can be followed over it."""


def test_a_view_is_located_by_the_place_it_shows() -> None:
    """From 57 degrees away, to 8 mm and half a degree; another picture, one without features or without depth is none."""
    places, here = Places(), plane_view(SE3.identity(), PICTURE, CORNER)
    assert places.recognised(here) is None
    places.remember(here, SE3.identity())
    found = places.recognised(plane_view(FAR, PICTURE, CORNER))
    assert found is not None
    assert found.inliers >= LEAST_INLIERS
    assert (distance(found.world_camera, FAR) < (8e-3, 8e-3)).all()
    assert places.recognised(plane_view(FAR, texture(7), CORNER)) is None
    assert places.recognised(replace(here, grey=np.full_like(here.grey, 90))) is None


def test_a_place_is_remembered_once() -> None:
    """A step of 1 cm is the same place, one of 57 degrees another; one without features is remembered, and never recognised."""
    places, here = Places(), plane_view(SE3.identity(), PICTURE, CORNER)
    places.remember(here, SE3.identity())
    places.remember(here, path(2, np.array([0.0, 0.01, 0, 0.01, 0, 0]))[1])
    assert places.count == 1
    places.remember(plane_view(FAR, PICTURE, CORNER), FAR)
    assert places.count == 2
    found = places.recognised(here)
    assert found is not None
    assert (distance(found.world_camera, SE3.identity()) < (8e-3, 8e-3)).all()  # by the nearer one of the two
    bare = Places()
    bare.remember(replace(here, grey=np.full_like(here.grey, 90)), SE3.identity())
    assert bare.recognised(here) is None


def test_a_kidnapped_camera_goes_on_at_a_place_that_was_seen() -> None:
    """It is carried to where nothing was seen, so that odometry loses it, and back, turned: relocalised there, at the right pose."""
    tracker = Tracker(VolumeSettings(voxel_m=0.02, far_m=3.0))
    poses = path(3, np.array([0.008, 0.012, -0.006, 0.012, -0.006, 0.01]))
    elsewhere = plane_view(SE3.of(np.array([0.0, 0.6, 0.0, 0.5, 0.0, 0.3])), texture(7), CORNER)
    views = [plane_view(pose, PICTURE, CORNER) for pose in poses]
    told = [tracker.track(view) for view in (*views, elsewhere, elsewhere, plane_view(FAR, PICTURE, CORNER))]
    assert [each.state for each in told[3:]] == [Tracking.LOST, Tracking.LOST, Tracking.RELOCALISED]
    assert (distance(told[-1].world_camera, FAR) < (5e-3, 5e-3)).all()


def test_a_large_step_is_tracked_by_what_both_views_show() -> None:
    """From one view to one 57 degrees away: in the model, at the right pose."""
    tracker = Tracker(VolumeSettings(voxel_m=0.02, far_m=3.0))
    tracker.track(plane_view(SE3.identity(), PICTURE, CORNER))
    told = tracker.track(plane_view(FAR, PICTURE, CORNER))
    assert told.is_fused
    assert (distance(told.world_camera, FAR) < (5e-3, 5e-3)).all()


def test_a_place_whose_shape_has_changed_is_not_believed() -> None:
    """The picture is that of the first view, the depth is not: lost, and nothing is fused."""
    tracker = Tracker(VolumeSettings(voxel_m=0.02, far_m=3.0))
    tracker.track(plane_view(SE3.identity(), PICTURE, CORNER))
    before = tracker.volume.blocks.weights.copy()
    far = plane_view(FAR, PICTURE, CORNER)
    bumpy = far.depth_m + np.random.default_rng(1).normal(0, 0.09, far.depth_m.shape).astype(np.float32)
    assert tracker.track(replace(far, depth_m=bumpy)).state is Tracking.LOST
    assert np.array_equal(tracker.volume.blocks.weights, before)
