"""Two wide fisheyes: views off the axis are what tells the lens, and none of them is rejected."""

from phone_host.calibration.solve.bundle_problem import Bend
from phone_host.calibration.solve.calibrate import fit_rig
from tests.support.fisheyes import BOARD, fisheye, fisheye_pairs


def test_views_that_only_a_fisheye_explains_are_kept() -> None:
    """120 degrees, a seed with which four coefficients explain 14 of 20 views, five 18, and one side's look alike to both lenses: all are kept."""
    camera = fisheye(120.0)
    found = fit_rig(fisheye_pairs(camera, camera, seed=14), BOARD, ((camera.width_px, camera.height_px),) * 2)
    assert len(found.kept) == 20
    assert found.bends == (Bend.FISHEYE, Bend.FISHEYE)
    assert abs(found.result.state.left.matrix[0, 0] / camera.matrix[0, 0] - 1) < 0.002
