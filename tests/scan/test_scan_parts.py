"""The parts of a scan beside the tracker: steps in the depth, fineness, box, pieces of a mesh, its noise, and its files."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from common.ledger import StageTimes
from phone_host.geometry.se3 import SE3
from phone_host.model import Processed, RectifiedPair, Search
from phone_host.output.axes import Axes
from phone_host.output.ply import PointCloud, write_surface
from phone_host.output.trajectory_text import Station, tum_text
from phone_host.scan.blocks import Box
from phone_host.scan.mesh import NO_SIZE, Mesh, only, size_of, thinned, without_crumbs
from phone_host.scan.scan import scan_for
from phone_host.scan.scan_model import surface_noise_m
from phone_host.scan.scan_wanted import ScanWanted
from phone_host.scan.tracking_words import Tracking, Weakness
from phone_host.scan.view import view_of, without_edges
from phone_host.scan.volume import Volume
from phone_host.scan.volume_settings import VolumeSettings, fineness_for
from tests.support.plane_films import CORNER, GEOMETRY, plane_view, texture

PICTURE = texture()


def square(side: int, at_m: float = 0.0) -> Mesh:
    """A flat square of side x side cells, 1 cm each, from x = `at_m` on."""
    rows, columns = np.mgrid[0 : side + 1, 0 : side + 1]
    points = np.column_stack([at_m + columns.ravel() / 100, rows.ravel() / 100, np.zeros((side + 1) ** 2)])
    corner = (rows[:-1, :-1] * (side + 1) + columns[:-1, :-1]).ravel()
    upper = np.column_stack([corner, corner + 1, corner + side + 1])
    lower = np.column_stack([corner + 1, corner + side + 2, corner + side + 1])
    triangles = np.concatenate([upper, lower]).astype(np.int32)
    return Mesh(points.astype(np.float32), np.full((len(points), 3), 90, np.uint8), triangles)


def both(one: Mesh, other: Mesh) -> Mesh:
    """Two meshes as one."""
    triangles = np.concatenate([one.triangles, other.triangles + len(one.points_m)]).astype(np.int32)
    points, colours = (np.concatenate([getattr(one, name), getattr(other, name)]) for name in ("points_m", "colours"))
    return Mesh(points, colours, triangles)


def processed(depth_m: float, side: int = 40) -> Processed:
    """A pair that shows a wall."""
    cloud = np.full((side, side, 3), depth_m, np.float32)
    image = np.full((side, side), 80, np.uint8)
    disparity = np.full((side, side), 20, np.float32)
    geometry = replace(GEOMETRY, cx_px=(side - 1) / 2, cy_px=(side - 1) / 2)
    return Processed(RectifiedPair(image, image), disparity, cloud, StageTimes(), geometry=geometry)


def test_depths_beside_a_step_are_left_out() -> None:
    """Of 20 px of disparity, a step of 1 px stays and one of 5 px takes one column on each side; beside a hole nothing is lost."""
    disparity = np.full((9, 40), 20.0)
    disparity[:, 10:] += 1
    disparity[:, 20:] += 5
    depth = (GEOMETRY.focal_px * GEOMETRY.baseline_m / disparity).astype(np.float32)
    depth[:, 30] = np.nan
    kept = np.isfinite(without_edges(depth, GEOMETRY))
    assert np.flatnonzero(~kept[4]).tolist() == [19, 20, 30]
    assert (kept == kept[:1]).all()


def test_a_model_is_as_fine_as_its_near_depths_deserve() -> None:
    """Half their noise, depths as far as their noise stays below the truncation; a finer voxel gets a wider one, in voxels, up to 14."""
    view = replace(plane_view(SE3.identity(), PICTURE, CORNER), noise_px=0.2)
    near_m = float(np.nanquantile(view.depth_m, 0.25))
    settings = fineness_for(view, math.nan, 1000)
    assert settings.voxel_m == pytest.approx(0.2 * near_m**2 / 20 / 2, rel=0.07)
    assert settings.far_m == pytest.approx(math.sqrt(settings.truncation_m / view.noise_per_m))
    assert settings.most_bytes == 1000
    assert settings.truncation_voxels == pytest.approx(6, rel=0.1)
    assert fineness_for(view, settings.voxel_m / 2, 1).truncation_voxels == pytest.approx(12, rel=0.1)
    assert fineness_for(view, settings.voxel_m / 9, 1).truncation_voxels == 14
    assert fineness_for(view, settings.voxel_m / 9, 1).far_m >= near_m


def test_a_box_holds_what_lies_inside() -> None:
    """Its faces belong to it."""
    points = np.array([[0, 0, 0], [1, 1, 1], [0.5, 0.5, 1.01], [-0.01, 0.5, 0.5]], np.float32)
    assert Box((0, 0, 0), (1, 1, 1)).holds(points).tolist() == [True, True, False, False]


def test_a_mesh_is_measured() -> None:
    """A square of 10 cm has 0.01 m^2 and 40 cm of border; nothing has nothing."""
    size = size_of(square(10))
    assert [size.area_m2, size.border_m] == pytest.approx([0.01, 0.4])
    assert size.extent_m == pytest.approx((0.1, 0.1, 0))
    assert size_of(Mesh.empty()) == NO_SIZE


def test_small_pieces_are_left_out() -> None:
    """Of a piece of 800 triangles and one of 2, the second goes; a piece of 32 stays."""
    large = square(20)
    assert len(without_crumbs(both(square(1, 5.0), large)).triangles) == 800
    assert len(without_crumbs(both(large, square(4, 5.0))).triangles) == 832
    assert without_crumbs(Mesh.empty()).triangles.size == 0
    half = only(large, large.points_m[large.triangles, 0].max(axis=1) < 0.1001)
    assert size_of(half).extent_m == pytest.approx((0.1, 0.2, 0))


def test_a_mesh_to_show_has_no_more_triangles_than_asked() -> None:
    """It covers the same area, each of its points stands for one of the whole; a small mesh is shown as it is."""
    mesh = square(40)
    small, stands_for = thinned(mesh, 900, 0.01)
    assert 300 < len(small.triangles) <= 900
    assert size_of(small).area_m2 == pytest.approx(size_of(mesh).area_m2, rel=0.15)
    assert np.linalg.norm(mesh.points_m[stands_for] - small.points_m, axis=1).max() < 0.03
    whole, everything = thinned(mesh, 3200, 0.01)
    assert whole is mesh
    assert everything.tolist() == list(range(len(mesh.points_m)))


def test_the_noise_of_a_surface_falls_with_the_root_of_the_views() -> None:
    """A voxel of one sure view is known to half a voxel; with four views to a quarter; where nothing was fused, to nothing."""
    volume = Volume(VolumeSettings(voxel_m=0.02, far_m=3.0))
    view = replace(plane_view(SE3.identity(), PICTURE, CORNER), noise_px=0.01)
    volume.fuse(view, SE3.identity())
    row, column = 90, 120
    z = float(view.depth_m[row, column])
    at = np.array([[(column - GEOMETRY.cx_px) * z / 200, (row - GEOMETRY.cy_px) * z / 200, z], [9, 9, 9]], np.float32)
    assert surface_noise_m(at, volume.blocks, volume.settings)[0] == pytest.approx(0.01)
    for _ in range(3):
        volume.fuse(view, SE3.identity())
    noise = surface_noise_m(at, volume.blocks, volume.settings)
    assert noise[0] == pytest.approx(0.005)
    assert np.isnan(noise[1])


def test_a_scan_waits_for_depth_and_refuses_another_size() -> None:
    """Pairs without depth are lost in words, and there is no model; then one begins it; a pair of another size is an error."""
    scan = scan_for(ScanWanted(voxel_m=0.05))
    none = scan.take("0", 0.0, processed(math.nan))
    assert (none.state, none.weakness, none.density) == (Tracking.LOST, Weakness.NO_DEPTH, 0.0)
    assert (scan.settings, len(scan.model().mesh.triangles), scan.fused) == (None, 0, 0)
    assert scan.take("1", 1.0, processed(1.0)).state is Tracking.TRACKING
    assert (scan.fused, [pair.name for pair in scan.pairs]) == (1, ["0", "1"])
    with pytest.raises(Exception, match="2 is 30x30 px when rectified, the first pair 40x40 px"):
        scan.take("2", 2.0, processed(1.0, side=30))


def test_a_wide_view_is_laid_against_the_model_at_less_than_its_size() -> None:
    """The second of two pairs of a wall, 300 px wide, lies on what the first has made; without texture that is weak."""
    scan = scan_for(ScanWanted(voxel_m=0.05))
    scan.take("0", 0.0, processed(1.0, side=300))
    pair = scan.take("1", 1.0, processed(1.0, side=300))
    assert (pair.state, pair.weakness) == (Tracking.WEAK, Weakness.FEW_CORNERS)
    assert pair.overlap > 0.9
    assert pair.off_m < 0.005


def test_only_what_lies_in_the_box_belongs_to_the_model() -> None:
    """The wall is 1 m away; a box of the left half keeps that, no box the right half, too."""
    box = Box((-0.1, -0.1, 0.9), (0.0, 0.1, 1.1))
    scan, whole = scan_for(ScanWanted(voxel_m=0.02, box=box)), scan_for(ScanWanted(voxel_m=0.02))
    for one in (scan, whole):
        one.take("0", 0.0, processed(1.0))
    model = scan.model()
    assert whole.model().mesh.points_m[:, 0].max() > 0.05
    assert len(model.mesh.triangles) > 20
    assert model.mesh.points_m[:, 0].max() <= 0
    assert model.noise_m.shape == (len(model.mesh.points_m),)


def test_the_noise_of_a_smaller_search_is_that_of_its_pixels() -> None:
    """Matched at half the size, a disparity is known half as well."""
    assert view_of(processed(1.0)).noise_px == 0.5
    small = replace(processed(1.0), search=Search(scale=0.5, disparities=64))
    assert view_of(small).noise_px == 1.0
    assert view_of(small).colours.shape == (40, 40, 3)


def test_a_trajectory_is_text_that_tells_the_poses() -> None:
    """Stamp, place, and the quaternion of a quarter turn about y: (0, 0.7071, 0, 0.7071)."""
    turn = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])
    head, line = tum_text([Station(2.5, turn, np.array([0.1, -0.2, 0.3]))]).splitlines()
    assert head.startswith("# timestamp tx ty tz qx qy qz qw")
    assert [float(word) for word in line.split()] == pytest.approx([2.5, 0.1, -0.2, 0.3, 0, 0.70710678, 0, 0.70710678])


@pytest.mark.parametrize(("axes", "signs"), [(Axes.CAMERA, (1, 1, 1)), (Axes.Y_UP, (1, -1, -1))])
def test_a_surface_is_a_ply_file(tmp_path: Path, axes: Axes, signs: tuple[int, int, int]) -> None:
    """Its points, colours and triangles, by what the format says."""
    points = np.array([[0, 0, 1], [0.5, 0, 1], [0, 0.25, 2]], np.float32)
    colours = np.array([[1, 2, 3], [4, 5, 6], [7, 8, 9]], np.uint8)
    write_surface(tmp_path / "m.ply", PointCloud(points, colours), np.array([[2, 0, 1]], np.int32), axes)
    head, body = (tmp_path / "m.ply").read_bytes().split(b"end_header\n", 1)
    assert b"element vertex 3\n" in head
    assert b"element face 1\nproperty list uchar int vertex_indices\n" in head
    vertices = np.frombuffer(body, np.dtype([("at", "<f4", 3), ("rgb", "u1", 3)]), 3)
    assert np.array_equal(vertices["at"], points * np.array(signs))
    assert np.array_equal(vertices["rgb"], colours)
    assert body[45:46] == b"\x03"
    assert np.frombuffer(body[46:], "<i4").tolist() == [2, 0, 1]
