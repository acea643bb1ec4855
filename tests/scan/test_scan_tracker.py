"""The tracker: poses against the truth, what is not believed is not fused, and words for each case."""

from dataclasses import replace

import numpy as np
import pytest

from common.diagnostic import Diagnostic
from phone_host.geometry.se3 import SE3
from phone_host.native.library import Library, native
from phone_host.scan.piece import Piece, PoseGate
from phone_host.scan.tracked import Tracked
from phone_host.scan.tracker import Tracker
from phone_host.scan.tracking_words import Tracking, Weakness
from phone_host.scan.view import View
from phone_host.scan.volume_settings import VolumeSettings
from tests.support.plane_films import CORNER, WALL, distance, path, plane_view, texture

PICTURE = texture()
SETTINGS = VolumeSettings(voxel_m=0.02, far_m=3.0)
STEP = np.array([0.008, 0.012, -0.006, 0.012, -0.006, 0.01])
POSES = path(8, STEP)


def film(poses: list[SE3]) -> list[View]:
    """The corner from several places."""
    return [plane_view(pose, PICTURE, CORNER) for pose in poses]


def run(views: list[View], tracker: Tracker | None = None) -> list[Tracked]:
    """Track all views."""
    tracker = tracker or Tracker(SETTINGS)
    return [tracker.track(view) for view in views]


def states(told: list[Tracked]) -> list[Tracking]:
    """Of each view."""
    return [each.state for each in told]


@pytest.mark.parametrize("library", [native(), Diagnostic(message="not built", remedy="")])
def test_a_camera_is_tracked_against_the_model(library: Library | Diagnostic) -> None:
    """Every pose within 1 mm and 0.1 degrees of the truth, all fused, with the library and with numpy."""
    told = run(film(POSES[:4]), Tracker(SETTINGS, 2, library=library))
    assert states(told) == [Tracking.TRACKING] * 4
    assert all(
        (distance(each.world_camera, pose) < (2e-3, 1e-3)).all() for each, pose in zip(told, POSES, strict=False)
    )
    assert all(each.is_fused for each in told)


@pytest.mark.skipif(not isinstance(native(), Library), reason="the native library is not built")
def test_threads_change_no_bit() -> None:
    """The same poses with one thread and with three."""
    one, three = (run(film(POSES[:3]), Tracker(SETTINGS, threads)) for threads in (1, 3))
    assert all(np.array_equal(a.world_camera.pose(), b.world_camera.pose()) for a, b in zip(one, three, strict=True))


def test_a_covered_camera_is_lost_and_comes_back() -> None:
    """Black views are lost and not fused; when the camera shows the same place again, it is relocalised at the right pose."""
    views, tracker = film(POSES[:4]), Tracker(SETTINGS)
    black = replace(views[3], grey=np.zeros_like(views[3].grey), depth_m=np.full_like(views[3].depth_m, np.nan))
    told = run([*views[:3], black, black, views[2], views[3]], tracker)
    assert states(told)[3:] == [Tracking.LOST, Tracking.LOST, Tracking.RELOCALISED, Tracking.TRACKING]
    assert told[3].weakness is Weakness.NO_DEPTH
    assert not told[3].is_fused
    assert (distance(told[-1].world_camera, POSES[3]) < (2e-3, 2e-3)).all()


def test_a_jump_is_not_fused() -> None:
    """A camera that is suddenly elsewhere is lost, in words that help, and the model stays as it was."""
    tracker = Tracker(SETTINGS)
    run(film(POSES[:3]), tracker)
    before = tracker.volume.blocks.weights.copy()
    away = SE3.of(np.array([0.0, 0.5, 0.0, 0.4, 0.0, 0.3]))
    told = tracker.track(plane_view(away, PICTURE[::-1].copy(), CORNER))
    assert told.state is Tracking.LOST
    assert "move" in told.weakness.advice
    assert np.array_equal(tracker.volume.blocks.weights, before)


def test_a_moved_scene_does_not_fit() -> None:
    """Where the pictures say that nothing moved and the depths say otherwise, nothing is fused."""
    view, tracker, strict = film(POSES[:1])[0], Tracker(SETTINGS), Tracker(SETTINGS, gate=PoseGate(most_shift_m=0.02))
    run([view, view], tracker)
    run([view, view], strict)
    nearer = replace(view, depth_m=(view.depth_m * np.float32(0.93)))
    assert strict.track(nearer).weakness is Weakness.TOO_FAST
    bumpy = view.depth_m + np.random.default_rng(1).normal(0, 0.06, view.depth_m.shape).astype(np.float32)
    assert tracker.track(replace(view, depth_m=bumpy)).weakness is Weakness.POOR_FIT


def test_a_plane_is_told_and_followed_by_odometry() -> None:
    """On one wall the model tells three directions; along it the corners carry the pose, 2 mm off over 8 cm at most."""
    told = run([plane_view(pose, PICTURE, WALL) for pose in POSES[:6]])
    assert {each.weakness for each in told[1:]} == {Weakness.FLAT}
    assert {each.state for each in told[1:]} == {Tracking.WEAK}
    assert (distance(told[-1].world_camera, POSES[5]) < (4e-3, 3e-3)).all()


def test_without_texture_the_model_carries_the_pose() -> None:
    """A grey corner has no features; its shape still tells where the camera is, and that is called weak."""
    views = [replace(view, grey=np.full_like(view.grey, 90)) for view in film(path(4, STEP / 4))]
    told = run(views)
    assert {each.weakness for each in told[1:]} == {Weakness.FEW_CORNERS}
    assert (distance(told[-1].world_camera, path(4, STEP / 4)[3]) < (4e-3, 4e-3)).all()


def test_depths_beyond_the_reach_are_no_model_and_no_fault() -> None:
    """A view of nothing but what is too far to be fused is lost without a warning; the next one is found again."""
    views, tracker = film(POSES[:3]), Tracker(SETTINGS)
    far = replace(views[2], depth_m=np.full_like(views[2].depth_m, 50.0))
    told = run([*views[:2], far, far, views[2]], tracker)
    assert states(told)[2:] == [Tracking.LOST, Tracking.LOST, Tracking.RELOCALISED]


def test_every_weakness_has_advice() -> None:
    """One line each, and none where nothing is wrong."""
    assert all(bool(each.advice) is (each is not Weakness.NONE) for each in Weakness)
    assert not any("\n" in each.advice for each in Weakness)


@pytest.mark.parametrize(("skew_s", "share"), [(0.0004, 1.0), (-0.02, 0.5)])
def test_images_of_two_moments_count_for_less(skew_s: float, share: float) -> None:
    """The camera moves by some px in 0.1 s: 0.4 ms between left and right change nothing; 20 ms let the second view weigh half or less."""
    weights = []
    for skewed in (0.0, skew_s):
        tracker, grown = Tracker(SETTINGS), 0
        for number, view in enumerate(film(POSES[:2])):
            before = tracker.volume.blocks.weights.sum(dtype=np.int64)
            tracker.track(replace(view, stamp_s=number / 10, skew_s=skewed * number))
            grown = tracker.volume.blocks.weights.sum(dtype=np.int64) - before
        weights.append(grown)
    assert weights[1] <= share * weights[0]
    assert share < 1 or weights[1] == weights[0]


def test_at_rest_the_corners_are_believed_more() -> None:
    """Where the corners stayed, the depth moves the camera as little as if they were 0.25 px off, half as far as with 1 px; where they went 20 px, as far as that."""
    view, moved = film([POSES[0], SE3.of(np.array([0.0, 0.0, 0.0, 0.1, 0.0, 0.0]))])
    for seen, sure_px in ((view, 0.25), (moved, 1.0)):
        tracker, model = Tracker(SETTINGS), Piece(SETTINGS, 1, PoseGate(), native())
        deeper = replace(seen, depth_m=seen.depth_m + np.float32(0.01))
        model.fuse(view, SE3.identity(), None)
        told = run([view, deeper], tracker)[1]
        assert told.fit is not None
        believed = (told.world_camera @ told.fit.start_now.inverse()).exact()
        laid = {px: _shift_m(model.laid(deeper, believed, px).start_now) for px in (0.25, 1.0)}
        assert _shift_m(told.fit.start_now) == pytest.approx(laid[sure_px], rel=1e-6)
        assert laid[0.25] < 0.5 * laid[1.0]


def _shift_m(motion: SE3) -> float:
    return float(np.linalg.norm(motion.t_m))
