"""The mat: which one, where it lies, and a scan of what stands on it."""

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from common import now
from common.errors import SettingsError
from phone_host.geometry.se3 import SE3, vectors_of
from phone_host.model import Image, Processed
from phone_host.scan.mat import USUAL_MAT, mat_corners, parse_mat
from phone_host.scan.mat_pose import MatPose, MatScale, fit_mat
from phone_host.scan.mat_tracker import ABOVE_M
from phone_host.scan.scan import Scan, ScannedPair, ScanWanted
from phone_host.scan.tracking_words import Tracking, Weakness
from phone_host.stereo.core import StereoCore
from phone_host.stereo.depth_limits import DepthWanted
from phone_host.stereo.match import MatchSettings
from phone_host.stereo.matcher_names import MatcherName
from phone_host.stereo.rectifier import Rectifier
from tests.support.mat_rigs import rig_of
from tests.support.mats import BALL_M, MAT, MatPainter, looking_at, of_right

RIG = rig_of("small")
SURE = MatScale()
STANDS_M = np.array([0.0, 0.0, 0.05])
AT_M = np.array([0.0, 0.0, 0.035])


def from_side(degrees: float) -> SE3:
    """Where the mat lies for a left camera that looks at it from a side."""
    return looking_at(math.radians(degrees), math.radians(40), 0.38, AT_M)


@cache
def painters() -> tuple[MatPainter, MatPainter]:
    return MatPainter(RIG.left, fine=2), MatPainter(RIG.right, fine=2)


def pictures(degrees: float, stretch: float = 1.0) -> tuple[Image, Image]:
    left, right = painters()
    camera_mat = from_side(degrees)
    return left.image(camera_mat, 1, stretch), right.image(of_right(RIG, camera_mat), 2, stretch)


def found_in(images: tuple[Image, Image], scale: MatScale) -> MatPose | None:
    rectifier = Rectifier(RIG)
    pair = rectifier.rectify(*images)
    corners = mat_corners(pair.left, pair.right, MAT)
    return fit_mat(MAT.points_m(), corners, rectifier.geometry, pair.epipolar, scale)


def true_pose(degrees: float) -> SE3:
    return SE3(Rectifier(RIG).rectification.R_left, np.zeros(3)) @ from_side(degrees)


def test_the_usual_mat_is_that_of_the_target_command() -> None:
    """Without a value, --mat means 10x8 squares of 25 mm; its middle is the origin, its first corner upper left."""
    mat = parse_mat(USUAL_MAT)
    assert mat.name == USUAL_MAT
    assert mat.size_m == pytest.approx((0.25, 0.2))
    assert mat.points_m()[0] == pytest.approx([-0.1, 0.075, 0])
    assert mat.points_m().mean(axis=0) == pytest.approx([0, 0, 0])
    assert parse_mat(" 8x6:28mm:20mm:6x6 ").name == "8x6:28mm:20mm:6x6"


@pytest.mark.parametrize("text", ["left", "10x8", "10x8:25mm", "10x8:25mm:24mm:5x5", "10x8:25:18:5x5", "2x2:25mm:18mm:5x5", "10x8:25mm:18mm:7x7", "90x90:25mm:18mm:5x5"])  # fmt: skip
def test_what_is_no_mat_is_refused_in_one_line_that_shows_how(text: str) -> None:
    """Each bad value names the option, and the remedy shows a good one."""
    with pytest.raises(SettingsError) as refused:
        parse_mat(text)
    assert "--mat" in str(refused.value)
    assert USUAL_MAT in refused.value.remedy


def test_the_pose_is_that_of_the_rendered_mat() -> None:
    """From corners in both images, the pose is exact to 0.2 mm where the object stands and 0.1 degrees, and says how exact it is."""
    for degrees in (0, 130, 250):
        found, truth = found_in(pictures(degrees), SURE), true_pose(degrees)
        assert found is not None
        off_m = float(np.linalg.norm(found.camera_mat.apply(STANDS_M) - truth.apply(STANDS_M)))
        assert off_m < 0.0002
        assert off_m < 5 * found.sigma_at(STANDS_M)
        assert np.linalg.norm(vectors_of(found.camera_mat.R.T @ truth.R)) < math.radians(0.1)
        assert min(found.seen) >= 20


def test_a_sheet_that_was_printed_too_small_is_measured_by_the_rig() -> None:
    """Printed at 96 %, the squares come out so long, and the pose is that of the sheet as it lies there."""
    found = found_in(pictures(40, stretch=0.96), MatScale(1.0, 0.05))
    assert found is not None
    assert found.scale.value == pytest.approx(0.96, abs=0.002)
    assert found.scale.sigma < 0.002
    assert np.linalg.norm(found.camera_mat.t_m - true_pose(40).t_m) < 0.0005


def test_one_image_is_enough_and_none_gives_no_pose() -> None:
    """With the left image covered, the right one tells the pose; with both covered there is none."""
    left, right = pictures(0)
    black = np.zeros_like(left)
    alone = found_in((black, right), SURE)
    assert alone is not None
    assert alone.seen[0] == 0
    assert np.linalg.norm(alone.camera_mat.apply(STANDS_M) - true_pose(0).apply(STANDS_M)) < 0.001
    assert found_in((black, np.zeros_like(right)), SURE) is None


@cache
def walked(degrees: float) -> Processed:
    core = StereoCore(
        MatchSettings(matcher=MatcherName.TANDEM, disparities=96),
        Rectifier(RIG),
        wanted=DepthWanted(search_from_m=0.28),
    )
    return core.compute(*pictures(degrees), now.monotonic_ns)


def scanned(degrees: list[float], wanted: ScanWanted) -> tuple[Scan, list[ScannedPair]]:
    scan = Scan(wanted)
    return scan, [scan.take(str(at), float(at), walked(at)) for at in degrees]


WANTED = ScanWanted(voxel_m=0.002, mat=MAT)


def test_what_stands_on_the_mat_becomes_a_model_in_the_mats_axes() -> None:
    """Steps of 60 degrees are no matter; only the ball remains, where it stands, and the same bytes come again."""
    scan, pairs = scanned([0, 60, 120, 180, 240, 300], WANTED)
    assert {pair.state for pair in pairs} == {Tracking.TRACKING}
    mesh = scan.model().mesh
    points = mesh.points_m.astype(float)
    off = np.abs(np.linalg.norm(points - [0, 0, BALL_M], axis=1) - BALL_M)
    assert len(mesh.triangles) > 1000
    assert points[:, 2].min() >= ABOVE_M
    assert off[points[:, 2] > 0.02].mean() < 0.0015
    again = scanned([0, 60, 120, 180, 240, 300], replace(WANTED, threads=2))[0].model().mesh
    assert mesh.points_m.tobytes() == again.points_m.tobytes()


def test_a_pair_without_the_mat_is_lost_with_a_reason_or_laid_against_the_model() -> None:
    """Before the mat was seen nothing is fused; later the same view without its marks fits the model where it was, and another does not."""
    hidden = without_marks(walked(0))
    scan = Scan(WANTED)
    first = scan.take("first", 0.0, hidden)
    assert (first.state, first.weakness) == (Tracking.LOST, Weakness.NO_MAT)
    seen = scan.take("seen", 1.0, walked(0))
    assert seen.state is Tracking.TRACKING
    assert seen.mat is not None
    held = scan.take("held", 2.0, hidden)
    assert (held.state, held.weakness, held.mat) == (Tracking.WEAK, Weakness.NO_MAT, None)
    assert np.linalg.norm(held.world_camera.t_m - seen.world_camera.t_m) < 0.002
    far = scan.take("far", 3.0, without_marks(walked(180)))
    assert far.state is Tracking.LOST
    assert scan.fused == 2


def without_marks(processed: Processed) -> Processed:
    """The same pair, its images grey: only the depth remains."""
    grey: Callable[[Image], Image] = np.zeros_like
    pair = replace(processed.pair, left=grey(processed.pair.left), right=grey(processed.pair.right))
    return replace(processed, pair=pair)
