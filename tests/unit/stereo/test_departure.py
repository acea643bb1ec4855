"""A corrected rig: what changes, what stays, and that the next pairs are rectified with it."""

import numpy as np
import pytest

from common import now
from phone_host.model import AS_CALIBRATED, Departure, Epipolar, Side
from phone_host.stereo.core import StereoCore
from phone_host.stereo.evidence import maps_of
from phone_host.stereo.evidence_points import ThroughRig
from phone_host.stereo.match import MatchSettings
from phone_host.stereo.matcher_names import MatcherName
from phone_host.stereo.rectifier import Rectifier, corrected_rectification, corrected_rig
from phone_host.stereo.rectify import rectify_rig
from phone_host.stereo.working import lying, upright_points, upright_steps
from tests.support.drift_sightings import sight, two_webcams

TURNED = Departure(turn_rad=(0.005, -0.003, 0.004), focal=1.01)


def test_nothing_changes_without_a_correction() -> None:
    """The rig, its rectification and its rectifier are the same objects."""
    rig, rectifier = two_webcams(), Rectifier(two_webcams())
    made = rectify_rig(rig)
    assert corrected_rig(rig, AS_CALIBRATED) is rig
    assert corrected_rectification(made, AS_CALIBRATED) is made
    assert rectifier.corrected(AS_CALIBRATED) is rectifier


def test_a_turned_rig_with_its_correction_has_common_rows() -> None:
    """Points projected by the turned rig lie on common rows after the corrected rectification, and at the disparities of before."""
    made = sight()
    seen, straight = made.features(1, TURNED, TURNED), made.features(1, AS_CALIBRATED)
    assert np.abs(seen.left_px - seen.right_px)[:, 1].max() < 1e-6
    assert np.abs(made.features(1, TURNED).left_px - made.features(1, TURNED).right_px)[:, 1].max() > 2
    assert np.abs(seen.right_px - straight.right_px).max() < 1e-6
    assert np.abs(seen.left_px - straight.left_px).max() < 1e-9


def test_the_camera_stays_where_it_is() -> None:
    """A turn about its own centre moves the right camera nowhere: the baseline is that of before, in the left camera's axes."""
    rig = two_webcams()
    stands = corrected_rig(rig, TURNED)
    before, after = (-each.R_right_left.T @ each.t_right_left_m for each in (rig, stands))
    assert after == pytest.approx(before, abs=1e-12)
    assert stands.right.matrix[0, 0] == pytest.approx(rig.right.matrix[0, 0] * 1.01)
    assert stands.left is rig.left


def test_the_core_rectifies_the_next_pairs_with_it() -> None:
    """The right image changes and the left one does not; the result says which correction it had; it may be taken back."""
    random = np.random.default_rng(1)
    left, right = (random.integers(0, 255, (480, 640), np.uint8) for _ in range(2))
    core = StereoCore(MatchSettings(MatcherName.BLOCK, 16), Rectifier(two_webcams()))
    plain = core.compute(left, right, now.monotonic_ns)
    core.correct(TURNED)
    turned = core.compute(left, right, now.monotonic_ns)
    core.correct(AS_CALIBRATED)
    again = core.compute(left, right, now.monotonic_ns)
    assert [each.overlay for each in (plain, turned, again)] == [AS_CALIBRATED, TURNED, AS_CALIBRATED]
    assert np.array_equal(plain.pair.left, turned.pair.left)
    assert not np.array_equal(plain.pair.right, turned.pair.right)
    assert np.array_equal(plain.pair.right, again.pair.right)
    assert turned.geometry == plain.geometry
    maps, expected = maps_of(core, turned), sight().through(TURNED)
    assert isinstance(maps, ThroughRig)
    point = np.array([[100.0, 50.0]])
    assert maps.own(point, Side.RIGHT) == pytest.approx(expected.own(point, Side.RIGHT))


def test_a_core_is_corrected_before_its_first_pair() -> None:
    """The correction of an earlier run holds for the first pair, whatever its size."""
    core = StereoCore(MatchSettings(MatcherName.BLOCK, 16), Rectifier(two_webcams()))
    core.correct(TURNED)
    grey = np.zeros((240, 320), np.uint8)
    assert core.compute(grey, grey, now.monotonic_ns).overlay == TURNED
    assert (
        StereoCore(MatchSettings(MatcherName.BLOCK, 16)).compute(grey, grey, now.monotonic_ns).overlay == AS_CALIBRATED
    )


@pytest.mark.parametrize("epipolar", [Epipolar.LEFT, Epipolar.UP, Epipolar.DOWN])
def test_points_of_a_lying_image_are_found_in_the_upright_one(epipolar: Epipolar) -> None:
    """A bright pixel and a step beside it, laid on their side and set up again, are where they were."""
    image = np.zeros((40, 60), np.uint8)
    image[11, 23] = 255
    row, column = np.argwhere(lying(image, epipolar))[0]
    points = np.array([[float(column), float(row)]])
    assert upright_points(points, epipolar, (60, 40)).tolist() == [[23.0, 11.0]]
    steps = upright_points(points + np.array([[1.0, 2.0]]), epipolar, (60, 40)) - np.array([[23.0, 11.0]])
    assert upright_steps(np.array([[1.0, 2.0]]), epipolar) == pytest.approx(steps)
