"""Streets: voxels, reach and odometry follow rig and depths; a pair that is not in the model keeps the pose that odometry tells."""

import math
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from phone_host.cli import main
from phone_host.geometry.se3 import SE3
from phone_host.model import StereoGeometry
from phone_host.output.axes import Axes
from phone_host.report.scan_json import scan_json
from phone_host.run.scan_job import trajectory_of
from phone_host.run.scan_result import report_of
from phone_host.scan.odometry import Odometry, OdometrySettings, odometry_for
from phone_host.scan.piece import pose_gate_for
from phone_host.scan.scan import scan_for
from phone_host.scan.scan_wanted import ScanWanted
from phone_host.scan.scanned import PoseOrigin
from phone_host.scan.submap_bytes import submap_bytes, submap_of
from phone_host.scan.tracker import Tracker
from phone_host.scan.view import View, reduced
from phone_host.scan.volume_settings import fineness_for
from tests.bench.trajectory_errors import trajectory_errors
from tests.support.plane_films import CORNER, path, plane_view, street_view, texture
from tests.support.turning_things import processed_of

PICTURE = texture()
BACKWARDS = path(6, np.array([0.0, 0.004, 0.0, 0.0, 0.0, -1.2]))
STEP = np.array([0.008, 0.012, -0.006, 0.012, -0.006, 0.01])


def drive(baseline_m: float) -> list[View]:
    """A car that reverses, 1.2 m between two views."""
    return [street_view(pose, PICTURE, baseline_m) for pose in BACKWARDS]


def depths(near_m: float, far_m: float, focal_px: float, baseline_m: float) -> View:
    """A view whose quarters end at these depths."""
    row = np.interp(np.arange(64), [0, 16, 48, 63], [near_m / 2, near_m, far_m, 2 * far_m])
    depth = np.broadcast_to(row, (48, 64)).astype(np.float32)
    grey = np.zeros(depth.shape, np.uint8)
    geometry = StereoGeometry(focal_px=focal_px, baseline_m=baseline_m, cx_px=32.0, cy_px=24.0)
    colours = np.repeat(grey[..., np.newaxis], 3, axis=2)
    return View(grey=grey, colours=colours, depth_m=depth, geometry=geometry, noise_px=0.5)


@pytest.mark.parametrize("baseline_m", [0.3, 0.54, 1.0])
def test_a_model_of_a_street_reaches_to_its_far_quarter(baseline_m: float) -> None:
    """Voxels are a sixth of the noise there, 25 cm at most, and the field tells the surface as far as that noise; only 14 voxels end the reach."""
    view = depths(10.0, 28.0, 700.0, baseline_m)
    settings, reach_m = fineness_for(view, math.nan, 1), float(np.quantile(view.depth_m, 0.75))
    noise_m = view.noise_per_m * reach_m**2
    assert settings.voxel_m == pytest.approx(min(noise_m / 6, 0.25), rel=0.07)
    assert settings.far_m == pytest.approx(reach_m, rel=0.04)
    assert settings.is_of_street
    assert fineness_for(view, 0.25, 1).voxel_m == 0.25
    assert fineness_for(view, 0.05, 1).truncation_voxels == pytest.approx(min(noise_m / 0.05, 14))
    poor = fineness_for(depths(10.0, 28.0, 700.0, 0.06), math.nan, 1)
    assert (poor.voxel_m, poor.truncation_voxels) == (0.25, 14)


@pytest.mark.parametrize(("near_m", "far_m", "baseline_m"), [(0.4, 2.0, 0.06), (1.4, 2.5, 0.1), (3.0, 9.0, 0.2)])
def test_a_table_and_a_room_are_as_fine_as_their_near_depths(near_m: float, far_m: float, baseline_m: float) -> None:
    """Half the noise of the near depths, whatever stands behind; the reach is the square root of three times the near depth."""
    view = depths(near_m, far_m, 525.0, baseline_m)
    settings = fineness_for(view, math.nan, 1)
    assert settings.voxel_m == pytest.approx(view.noise_per_m * near_m**2 / 2, rel=0.07)
    assert settings.far_m == pytest.approx(math.sqrt(3) * near_m, rel=0.04)
    assert not settings.is_of_street


@pytest.mark.parametrize("voxel_m", [math.nan, 0.002, 0.1, 0.25])
@pytest.mark.parametrize("near_m", [0.4, 1.4, 6.0, 10.0])
def test_rig_and_depths_decide_what_is_a_street(near_m: float, voxel_m: float) -> None:
    """Not the voxels that the user gives; nor those that became coarser where the memory was full, which a scan that goes on begins with."""
    is_street, settings = near_m > 5, fineness_for(depths(near_m, 3 * near_m, 525.0, 0.2), voxel_m, 1)
    coarser = settings.coarser.coarser
    assert settings.is_of_street is coarser.is_of_street is is_street
    assert odometry_for(coarser) is odometry_for(settings) is odometry_for(replace(settings, voxel_m=0.01))
    assert pose_gate_for(coarser) == pose_gate_for(settings)
    assert (odometry_for(settings).keyframe_after == 1) is is_street


@pytest.mark.parametrize("baseline_m", [0.12, 0.3, 1.0])
def test_a_street_is_tracked_as_well_as_odometry_does(baseline_m: float) -> None:
    """Every view of a car that reverses is fused; the model makes the trajectory no worse than odometry, which is no worse than that of half images."""
    views = drive(baseline_m)
    tracker = Tracker(fineness_for(views[0], math.nan, 300_000_000))
    small = Odometry(OdometrySettings(corners=400, keyframe_share=0.6, keyframe_after=5))
    told = [tracker.track(view) for view in views]
    assert [each.is_fused for each in told] == [True] * len(views)
    halves = [small.step(reduced(view)).world_camera for view in views]
    model_mm, odometry_mm, half_mm = (
        trajectory_errors(poses, BACKWARDS).ate_mm
        for poses in ([each.world_camera for each in told], [each.moved.world_camera for each in told], halves)
    )
    assert model_mm <= 1.01 * odometry_mm
    assert model_mm <= 1.1 * half_mm


def test_a_model_of_wide_voxels_becomes_coarser_and_goes_on_from_its_submap() -> None:
    """Voxels of 25 cm become 50 cm wide where the memory is full; the scan that goes on has the same mesh, and takes pairs from where the last one was."""
    views = drive(0.3)
    scan = scan_for(ScanWanted(most_bytes=1_000_000))
    for number, view in enumerate(views[:5]):
        assert scan.take(str(number), float(number), processed_of(view)).is_fused
    assert scan.poses.begun_voxel_m == 0.25
    assert scan.settings is not None
    assert scan.settings.voxel_m > 0.25
    again = scan_for(ScanWanted(most_bytes=1_000_000))
    again.go_on([submap_of(submap_bytes(scan.close_submap()), "a file")])
    mesh = scan.model().mesh
    assert len(mesh.triangles) > 100
    assert np.array_equal(again.model().mesh.points_m, mesh.points_m)
    assert again.settings == scan.settings
    assert again.take("5", 5.0, processed_of(views[4])).is_fused
    assert again.take("6", 6.0, processed_of(views[5])).is_fused


def test_pairs_that_are_not_fused_keep_the_pose_of_odometry() -> None:
    """Two without enough depth are followed by corners: rows within 1 mm, and "tracked only"; two black ones have no row, and are "lost"."""
    poses = path(7, STEP)
    views = [plane_view(pose, PICTURE, CORNER) for pose in poses]
    for at in (2, 3):
        rows = np.arange(views[at].depth_m.shape[0])[:, np.newaxis]
        views[at] = replace(views[at], depth_m=np.where(rows % 60 == 0, views[at].depth_m, np.float32(np.nan)))
    for at in (4, 5):
        dark, no_depth = np.zeros_like(views[at].grey), np.full_like(views[at].depth_m, np.nan)
        views[at] = replace(views[at], grey=dark, colours=np.zeros_like(views[at].colours), depth_m=no_depth)
    scan = scan_for(ScanWanted(voxel_m=0.02))
    for number, view in enumerate(views):
        scan.take(str(number), float(number), processed_of(view))
    model, odometry, none = PoseOrigin.MODEL, PoseOrigin.ODOMETRY, PoseOrigin.NONE
    assert [pair.pose_origin for pair in scan.pairs] == [model, model, odometry, odometry, none, none, model]
    kept = submap_of(submap_bytes(scan.close_submap()), "a file").pairs
    assert [pair.pose_origin for pair in kept] == [pair.pose_origin for pair in scan.pairs]
    report = report_of(scan, scan.model(), scan.pairs, (), matcher="tandem", axes=Axes.CAMERA)
    written = np.loadtxt(trajectory_of(report).splitlines())
    assert written[:, 0].tolist() == [0, 1, 2, 3, 6]
    there = np.array([poses[int(stamp)].t_m for stamp in written[:, 0]])
    assert np.linalg.norm(written[:4, 1:4] - there[:4], axis=1).max() < 0.001
    told = scan_json(report)["pairs"]
    assert [each["pose"] for each in told] == [
        "fused",
        "fused",
        "tracked only",
        "tracked only",
        "lost",
        "lost",
        "fused",
    ]
    assert [each["place_m"] is None for each in told] == [False] * 4 + [True] * 2 + [False]


@pytest.mark.skipif("SCAN_DATA" not in os.environ, reason="SCAN_DATA is not set: no real images")
def test_a_street_of_kitti_is_scanned(tmp_path: Path) -> None:
    """All of 24 pairs, 1.2 m apart, are in the model, and where they were taken is known to 30 mm (root mean square)."""
    clip = Path(os.environ["SCAN_DATA"]) / "kitti_odometry_clips" / "KITTI_sequence_1"
    rig = ["--rectified", "--disparities", "96", "--focal", "707.0912", "--baseline", "537.15mm"]
    center = ["--center", "601.8873,183.1104"]
    out = tmp_path / "out"
    assert main(["scan", str(clip / "image_l"), str(clip / "image_r"), *rig, *center, "--out", str(out)]) == 0
    assert '"in_model": 24' in (out / "report.json").read_text()
    truth = [SE3(rows[:, :3], rows[:, 3]) for rows in np.loadtxt(clip / "poses.txt").reshape(-1, 3, 4)[:24]]
    found = [SE3(np.eye(3), row[1:4]) for row in np.loadtxt(out / "trajectory.txt")]
    assert trajectory_errors(found, truth).ate_mm <= 30
