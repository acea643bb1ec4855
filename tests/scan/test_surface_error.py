"""The stated error of a surface: 95 % of the points lie within two standard deviations, and these are at most twice as wide as they must be."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from common import now
from phone_host.geometry.se3 import SE3
from phone_host.model import Processed
from phone_host.scan.mat import USUAL_MAT, parse_mat
from phone_host.scan.scan import Scan, scan_for
from phone_host.scan.scan_model import ScanModel, open_model
from phone_host.scan.scan_wanted import ScanWanted
from phone_host.scan.surface_error import ErrorScope, PoseErrors
from phone_host.scan.volume import Volume
from phone_host.scan.volume_settings import VolumeSettings
from phone_host.scene.object_scene import Setting
from phone_host.stereo.core import StereoCore
from phone_host.stereo.depth_limits import DepthWanted
from phone_host.stereo.match import MatchSettings
from phone_host.stereo.matcher_names import MatcherName
from phone_host.stereo.rectifier import Rectifier
from tests.bench.scan_error_objects import error_scene
from tests.scan.test_scan_mat import WANTED as ON_MAT
from tests.scan.test_scan_mat import walked
from tests.support.mats import BALL_M
from tests.support.plane_films import CORNER, plane_view, texture
from tests.support.surface_coverage import Distance, coverage
from tests.support.table_things import computed_view, small_scene, true_camera
from tests.support.turning_things import Size, matched_view, off_thing_m, photographed, processed_of, turned_scene

Floats = NDArray[np.float64]

VIEWS = range(0, 28, 2)
"""From 14 places over 208 degrees."""

AROUND_M = 0.12
"""Nothing else stands on the table so near to the figure."""


@pytest.fixture(scope="module")
def around() -> list[Processed]:
    """A figure on a table."""
    return [computed_view(number) for number in VIEWS]


def scan_of(pairs: list[Processed], wanted: ScanWanted) -> Scan:
    """All pairs in one scan."""
    scan = scan_for(wanted)
    for number, pair in enumerate(pairs):
        scan.take(str(number), float(number), pair)
    return scan


def assert_stated_well(model: ScanModel, distance: Distance, start: SE3 | None, reach_m: float = np.inf) -> None:
    """Drift is included, 95 % of the points lie within two deviations, and these are not twice as wide as they must be."""
    found = coverage(model, distance, start, reach_m)
    assert model.error_scope is ErrorScope.DRIFT
    assert found.share >= 0.95
    assert found.width <= 2


def figure_m(points: Floats) -> Floats:
    """How far points lie from the figure."""
    return np.abs(small_scene().solid.signed_distance(points))


def scene_m(points: Floats) -> Floats:
    """And from the table beneath it, too."""
    return np.minimum(figure_m(points), np.abs(points[:, 2]))


@pytest.mark.parametrize(("on_table", "distance"), [(True, figure_m), (False, scene_m)], ids=["table", "free"])
def test_a_way_around_an_object(around: list[Processed], distance: Distance, *, on_table: bool) -> None:
    """On a table and in a free scan, drift included; the model lies as well as a rigid motion can lay it."""
    scan = scan_of(around, ScanWanted(voxel_m=0.002, on_table=on_table))
    model = scan.model()
    start = true_camera(VIEWS[0]) @ scan.pairs[0].world_camera.inverse()
    assert scan.fused == len(VIEWS)
    assert_stated_well(model, distance, start, AROUND_M)


def ball_m(points: Floats) -> Floats:
    """How far points lie from the ball on the mat; below its lower half the mat hides where it ends."""
    off = np.linalg.norm(points - [0, 0, BALL_M], axis=1) - BALL_M
    return np.where(points[:, 2] > BALL_M / 2, off, 0)


def test_an_object_on_a_mat() -> None:
    """In the axes of the mat as it lies: nothing is aligned. Six views alone show too little, and it says so."""
    pairs = [walked(degrees) for degrees in range(0, 360, 30)]
    model = scan_of(pairs, ON_MAT).model()
    assert_stated_well(model, ball_m, None)
    assert scan_of(pairs[::2], ON_MAT).model().error_scope is ErrorScope.NOISE


def test_a_bottle_on_a_mat() -> None:
    """Mostly plain and the same from all sides, from nine places: its depths are more exact than plain surfaces let one fear."""
    scene = error_scene("bottle", Setting(views=9))
    core = StereoCore(
        MatchSettings(matcher=MatcherName.TANDEM, disparities=256),
        Rectifier(scene.rig),
        wanted=DepthWanted(search_from_m=0.25),
    )
    views = [scene.view(number) for number in range(9)]
    pairs = [core.compute(view.left, view.right, now.monotonic_ns) for view in views]
    model = scan_of(pairs, ScanWanted(mat=parse_mat(USUAL_MAT))).model()
    assert_stated_well(model, lambda points: np.abs(scene.solid.signed_distance(points)), None)


def test_an_object_that_turns() -> None:
    """On a turntable without a mat, a whole turn in steps of 15 degrees."""
    size = Size(320, 240, 420.0, 0.06)
    scenes = [turned_scene(math.radians(15 * number)) for number in range(26)]
    views = [matched_view(photographed(scene, size, number), size, 96) for number, scene in enumerate(scenes)]
    scan = scan_of([processed_of(view) for view in views], ScanWanted(voxel_m=0.002, turntable=True))
    model = scan.model()
    assert scan.fused == len(views)
    assert_stated_well(model, off_thing_m, SE3.identity())


@pytest.mark.parametrize(
    ("pose_errors", "least", "most"), [(PoseErrors.DRIFT, 1.4, 2.5), (PoseErrors.INDEPENDENT, 0.7, 1.3)]
)
def test_a_matcher_smooths_where_a_surface_bends(pose_errors: PoseErrors, least: float, most: float) -> None:
    """So pieces on an edge are stated less exact than even ones; on a mat, where the images are laid onto each other again, they are not."""
    turns = np.linspace(-0.8, 0.8, 10)
    at = SE3(np.eye(3), np.array([0.0, 0.0, 1.0]))
    poses = [at @ SE3.of(np.array([0.0, turn, 0.0, 0.0, 0.0, 0.0])) @ at.inverse() for turn in turns]
    views = [plane_view(pose, texture(), CORNER) for pose in poses]
    volume = Volume(VolumeSettings(voxel_m=0.02, far_m=3.0))
    for view, pose in zip(views, poses, strict=True):
        volume.fuse(view, pose)
    model = open_model(volume).judged(volume, list(zip(views, poses, strict=True)), pose_errors)
    apart = np.sort([np.abs((model.mesh.points_m - plane.through_m) @ plane.axes[0]) for plane in CORNER], axis=0)[1]
    assert model.error_scope is ErrorScope.DRIFT
    edges, even = (np.nanmedian(model.noise_m[chosen]) for chosen in (apart < 0.02, apart > 0.2))
    assert least < edges / even < most


@pytest.mark.parametrize("count", [0, 1, 3])
def test_too_few_places_do_not_show_drift(around: list[Processed], count: int) -> None:
    """With no pair, one, and three within 32 degrees the error is that of the noise, and the model says so."""
    model = scan_of(around[:count], ScanWanted(voxel_m=0.002)).model()
    assert model.error_scope is ErrorScope.NOISE


def test_a_resumed_scan_does_not_state_its_drift(around: list[Processed]) -> None:
    """The views before the resumption are gone, so those after it cannot show how far both lie apart."""
    wanted = ScanWanted(voxel_m=0.002)
    begun = scan_of(around[:2], wanted)
    resumed = scan_for(wanted)
    resumed.go_on([begun.close_submap(whole=True)])
    for number, pair in enumerate(around[2:], 2):
        resumed.take(str(number), float(number), pair)
    assert resumed.fused == len(VIEWS)
    assert resumed.model().error_scope is ErrorScope.NOISE
