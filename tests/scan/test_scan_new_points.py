"""Points that odometry begins at a keyframe: they lie where that keyframe saw them, also when the fit moves it."""

import numpy as np

from phone_host.model import RectifiedPair
from phone_host.scan.odometry import Odometry, odometry_for
from phone_host.scan.view import View, reduced
from phone_host.scan.volume_settings import VolumeSettings
from phone_host.stereo.match import MatchSettings, create_matcher
from tests.bench.ring_corridor import GEOMETRY, Ring, RingScene
from tests.support.plane_films import distance

FIRST, LAST = 20, 25
"""At the view before the last one, close to a wall, some 20 corners are left (19 measured), and a keyframe begins."""


def test_a_motion_from_a_poorly_known_keyframe_is_exact() -> None:
    """The fit moves a keyframe that few corners tell, and its new points with it: the next motion, which hundreds of these tell, is 3 mm off at most."""
    scene, matcher = RingScene(Ring(seed=6)), create_matcher(MatchSettings(disparities=96))
    moves = []
    odometry = Odometry(odometry_for(VolumeSettings()))
    for number in range(FIRST, LAST + 1):
        left, right = scene.pair(number)
        disparity = matcher.match(RectifiedPair(left, right))
        depth_m = GEOMETRY.focal_px * GEOMETRY.baseline_m / np.where(disparity > 0, disparity, np.float32(np.nan))
        colours = np.repeat(left[..., np.newaxis], 3, axis=2)
        view = View(grey=left, colours=colours, depth_m=depth_m.astype(np.float32), geometry=GEOMETRY, noise_px=0.5)
        moves.append(odometry.step(reduced(view)))
    before, truth = (scene.poses[number] for number in (LAST - 1, LAST))
    assert 10 < moves[-2].inliers < 30
    assert moves[-1].inliers > 200
    assert distance(moves[-1].before_now, before.inverse() @ truth).max() < 3e-3
