"""The closed model: a grid tells what is empty, the field closes what nobody saw, and that is told."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from common.diagnostic import Diagnostic
from phone_host.geometry.se3 import SE3
from phone_host.native.library import Library, native
from phone_host.output.meshes.ply_mesh import read_ply_mesh
from phone_host.output.meshes.printable import Flaw, Printer, problems
from phone_host.output.ply import PointCloud, write_surface
from phone_host.scan.blocks import ONE, VOXELS, Blocks, Box, Cells
from phone_host.scan.carving import Carving
from phone_host.scan.closing import Floor, closed
from phone_host.scan.fusion import KeptDepths
from phone_host.scan.mesh import Mesh, mesh_of
from phone_host.scan.scan_model import ScanModel, closed_model
from phone_host.scan.view import View
from phone_host.scan.volume import Volume
from phone_host.scan.volume_settings import VolumeSettings
from tests.support.solid_views import Thing, around, thing_view

THING = Thing()
BOX = Box((-0.1, -0.1, 0.0), (0.1, 0.1, 0.15))
SETTINGS = VolumeSettings(voxel_m=0.003, far_m=1.0, truncation_voxels=6.0)
NONE = Diagnostic(message="not built", remedy="")
with_library = pytest.mark.skipif(not isinstance(native(), Library), reason="the native library is not built")


def scanned(poses: list[SE3], views: list[View], box: Box = BOX) -> tuple[Volume, Carving]:
    """A volume and a carving with these views."""
    volume, carving = Volume(SETTINGS), Carving(Cells.of(box, SETTINGS.voxel_m))
    for pose, view in zip(poses, views, strict=True):
        volume.fuse(view, pose)
        carving.see(view, pose)
    return volume, carving


def content_m3(mesh: Mesh) -> float:
    """What a closed mesh encloses, m^3."""
    corners = mesh.points_m[mesh.triangles].astype(np.float64)
    return float((np.cross(corners[:, 0], corners[:, 1]) * corners[:, 2]).sum() / 6)


def blocking(mesh: Mesh) -> set[Flaw]:
    """What keeps a mesh from being printed, and whether it is several bodies."""
    found = problems(mesh.points_m.astype(np.float64) * 1e3, mesh.triangles, Printer(), lambda _: None)
    return {each.flaw for each in found} & {Flaw.OPEN, Flaw.TANGLED, Flaw.INSIDE_OUT, Flaw.CROSSING, Flaw.CRUMBS}


@pytest.fixture(scope="module")
def model() -> ScanModel:
    """The thing from twelve sides, with noise."""
    poses = around(12)
    volume, carving = scanned(poses, [thing_view(THING, pose, seed=n) for n, pose in enumerate(poses)])
    return closed_model(volume, carving, BOX, Floor(skip_m=0.004))


def test_a_thing_on_a_floor_becomes_a_closed_body(model: ScanModel) -> None:
    """No hole, no crossing, one body of the thing's content within 1 %, on the floor; no triangle is a line."""
    mesh = model.mesh
    assert blocking(mesh) == set()
    assert content_m3(mesh) == pytest.approx(THING.volume_m3(0.001), rel=0.01)
    assert mesh.points_m[:, 2].min() == pytest.approx(0.0, abs=0.1 * SETTINGS.voxel_m)
    corners = mesh.points_m[mesh.triangles].astype(np.float64)
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    assert areas.min() > 1e-6 * SETTINGS.voxel_m**2
    seen = mesh.points_m[model.seen].astype(np.float64)
    assert np.abs(THING.distance_m(seen)).mean() < 0.25 * SETTINGS.voxel_m


def test_what_nobody_saw_is_told_and_takes_its_colour_from_the_border(model: ScanModel) -> None:
    """The underside, 80 of the 430 cm^2, and what hangs over it; the underside is as green as the box, the noise of unseen points is not known."""
    under = model.mesh.points_m[:, 2] < 0.001
    assert not model.seen[under].any()
    assert model.seen[~under].mean() > 0.85
    off_green = np.abs(model.mesh.colours[under] - np.array([60.0, 160, 40]))
    assert off_green.mean(axis=0).max() < 8
    assert np.percentile(off_green, 95) < 30
    assert np.isnan(model.noise_m[~model.seen]).all()
    assert 0.12 < model.unseen_share < 0.35
    assert model.seen[~under].sum() * 0.9 < len(model.seen_mesh.points_m) <= model.seen.sum()


def test_fewer_views_leave_more_unseen() -> None:
    """From half of the sides the body is closed, too, and more of it was not seen."""
    poses = around(6, turn_deg=150)
    volume, carving = scanned(poses, [thing_view(THING, pose) for pose in poses])
    half = closed_model(volume, carving, BOX, Floor())
    assert blocking(half.mesh) == set()
    assert 0.35 < half.unseen_share < 0.8
    assert content_m3(half.mesh) > 0.97 * THING.volume_m3(0.001)


def test_what_a_single_view_hides_is_inside() -> None:
    """One view from above: closed as far as the box, and more than the thing."""
    [pose] = around(1, height_deg=60)
    volume, carving = scanned([pose], [thing_view(THING, pose)])
    body = closed_model(volume, carving, BOX, Floor())
    assert Flaw.OPEN not in blocking(body.mesh)
    assert content_m3(body.mesh) > THING.volume_m3(0.001)
    low, high = body.mesh.points_m.min(axis=0), body.mesh.points_m.max(axis=0)
    assert (low >= np.array(BOX.low_m) - 1e-6).all()
    assert (high <= np.array(BOX.high_m) + 1e-6).all()


def test_a_patch_without_depth_is_closed_smoothly() -> None:
    """No view measures the front of the box in a patch of 2 cm: the surface goes on over it to half a millimetre, and is not called seen."""
    poses = around(12)
    views = []
    for pose in poses:
        view = thing_view(THING, pose)
        rows, columns = np.mgrid[: view.grey.shape[0], : view.grey.shape[1]]
        slopes = np.stack(
            [(columns - view.geometry.cx_px) / 300, (rows - view.geometry.cy_px) / 300, np.ones_like(rows)], -1
        )
        at = (slopes * view.depth_m[..., np.newaxis]) @ pose.R.T + pose.t_m
        with np.errstate(invalid="ignore"):
            patch = (
                (np.abs(at[..., 0] - 0.05) < 0.001) & (np.abs(at[..., 1]) < 0.01) & (np.abs(at[..., 2] - 0.03) < 0.01)
            )
        views.append(replace(view, depth_m=np.where(patch, np.float32(np.nan), view.depth_m)))
    volume, carving = scanned(poses, views)
    found = closed_model(volume, carving, BOX, Floor())
    mesh = found.mesh
    inside = (mesh.points_m[:, 0] > 0.04) & (np.abs(mesh.points_m[:, 1:] - [0, 0.03]).max(axis=1) < 0.006)
    assert blocking(mesh) == set()
    assert inside.sum() > 10
    assert not found.seen[inside].any()
    assert np.abs(mesh.points_m[inside, 0] - 0.05).max() < 0.0015


def test_nothing_is_empty_where_nothing_was_measured() -> None:
    """Without a floor around it the thing still is one closed body: what nothing hides is not inside."""
    poses = around(8)
    volume, carving = scanned(poses, [thing_view(THING, pose, floor_m=0.0) for pose in poses])
    body = closed_model(volume, carving, BOX, Floor())
    assert blocking(body.mesh) == set()
    assert content_m3(body.mesh) == pytest.approx(THING.volume_m3(0.001), rel=0.15)


def test_depths_without_end_carve() -> None:
    """Infinite depths say that nothing is there: all cells in view are empty. NaN says nothing."""
    [pose] = around(1)
    view = thing_view(THING, pose)
    carving = Carving(Cells.of(BOX, 0.005))
    carving.see(replace(view, depth_m=np.full_like(view.depth_m, np.nan)), pose)
    assert not carving.counts[:2].any()
    assert carving.counts[2].mean() > 0.5
    carving.see(replace(view, depth_m=np.full_like(view.depth_m, np.inf)), pose)
    assert np.array_equal(carving.counts[0], carving.counts[2])
    assert not carving.counts[1].any()


@with_library
def test_the_library_and_numpy_carve_the_same() -> None:
    """Every count, with several threads and every instruction set, in cells of some voxels."""
    library, pose = native(), around(5)[1]
    assert isinstance(library, Library)
    view = thing_view(THING, pose, seed=1)
    view.depth_m[:20], view.depth_m[20:90] = np.inf, np.nan
    made = [
        Carving(Cells((-30, -20, 0), (61, 47, 30), 3, 0.0011), 3, library.using(simd)) for simd in library.usable_sets()
    ]
    made.append(Carving(made[0].cells, 1, NONE))
    for carving in made:
        for _ in range(2):
            carving.see(view, pose)
    for carving in made:
        assert np.array_equal(carving.counts, made[-1].counts)
    assert made[-1].counts.any(axis=(1, 2, 3)).all()


def test_a_box_may_be_chosen_when_the_views_have_passed() -> None:
    """Small copies of their depths carve nearly the same; of 1200 views at most 512 are kept, from first to last."""
    poses, kept, carving = around(12), KeptDepths(), Carving(Cells.of(BOX, 0.004))
    for number, pose in enumerate(poses):
        view = thing_view(THING, pose)
        kept.remember(number, view, pose)
        carving.see(view, pose)
    later = Carving(carving.cells)
    kept.carve(later)
    assert later.views == 12
    assert (later.empty != carving.empty).mean() < 0.03
    many, whole = KeptDepths(), thing_view(THING, poses[0])
    small = replace(whole, depth_m=whole.depth_m[:4, :4])
    for number in range(1200):
        many.remember(number, small, poses[0])
    few = Carving(Cells((0, 0, 0), (1, 1, 1), 1, 0.01))
    many.carve(few)
    assert few.views == 300


def test_counts_stay_at_their_greatest() -> None:
    """After 300 views as after 255; another carving goes on from a copy."""
    [pose] = around(1)
    view, carving = thing_view(THING, pose), Carving(Cells.of(BOX, 0.02))
    for _ in range(300):
        carving.see(view, pose)
    assert carving.counts[:2].max(axis=(1, 2, 3)).tolist() == [255, 255]
    again = Carving(carving.cells)
    again.go_on(carving.carved)
    assert again.views == 300
    assert np.array_equal(again.empty, carving.empty)


@settings(max_examples=12, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.integers(0, 2**32 - 1), st.floats(0.05, 0.95), st.floats(0.0, 1.0))
def test_whatever_the_field_the_surface_is_closed(seed: int, inside: float, known: float) -> None:
    """Random fields, as no thing has them: each edge has two triangles that face the same way, and none crosses another."""
    random, blocks = np.random.default_rng(seed), Blocks(64)
    places = np.unique(random.integers(-1, 2, (20, 3)).astype(np.int32), axis=0)
    blocks.add(places)
    shape = (len(places), VOXELS)
    blocks.field[: len(places)] = np.where(random.uniform(size=shape) < inside, -1, 1) * random.integers(1, ONE, shape)
    blocks.weights[: len(places)] = np.where(random.uniform(size=shape) < known, 64, 0)
    box = Box((-0.007, -0.0071, -0.006), (0.015, 0.0154, 0.0149))
    cells = Cells.of(box, 0.001)
    carving = Carving(cells)
    carving.counts[:] = random.integers(0, 3, carving.counts.shape)
    carving.views = 3
    made = closed(blocks, replace(SETTINGS, voxel_m=0.001), carving, box, Floor(-0.001, 0.002) if seed % 2 else None)
    mesh = mesh_of(made, 0.001)
    if len(mesh.triangles):
        assert blocking(mesh) <= {Flaw.CRUMBS}


def test_the_file_says_what_was_seen(tmp_path: Path) -> None:
    """A property after the colours; our own reader reads it, and others that go by the header pass over it."""
    points, colours = np.eye(3, dtype=np.float32), np.full((3, 3), 7, np.uint8)
    seen = np.array([True, False, True])
    write_surface(tmp_path / "m.ply", PointCloud(points, colours), np.array([[0, 1, 2]], np.int32), seen=seen)
    content = (tmp_path / "m.ply").read_bytes()
    head, body = content.split(b"end_header\n", 1)
    assert b"property uchar blue\nproperty uchar seen\nelement face 1\n" in head
    assert [body[16 * n + 15] for n in range(3)] == [1, 0, 1]
    solid = read_ply_mesh(content, "m.ply", 1.0)
    assert np.array_equal(solid.points_m, points)
    assert np.array_equal(solid.colours, colours)
    assert np.array_equal(solid.seen, seen)


def test_views_of_unlike_exposure_leave_no_seams() -> None:
    """Every second view twice as bright, bluer, too: the box has one colour, that of the first view, to 3 of 255."""
    poses, views = around(12), []
    for number, pose in enumerate(poses):
        view = thing_view(THING, pose)
        lit = view.colours * (np.array([0.9, 0.6, 0.5]) if number % 2 else np.ones(3))
        views.append(replace(view, colours=np.rint(lit).astype(np.uint8)))
    volume, _ = scanned(poses, views)
    mesh = mesh_of(volume.blocks, SETTINGS.voxel_m, 8)
    side = (np.abs(np.abs(mesh.points_m[:, 0]) - 0.05) < 0.002) & (np.abs(mesh.points_m[:, 2] - 0.03) < 0.015)
    assert side.sum() > 100
    assert np.abs(np.median(mesh.colours[side], axis=0) - [60, 160, 40]).max() <= 3
    assert np.percentile(np.abs(mesh.colours[side] - np.array([60.0, 160, 40])).max(axis=1), 95) <= 5
