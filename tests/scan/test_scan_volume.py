"""The volume: fusing, casting, registration and the mesh; the native library and numpy agree."""

from dataclasses import replace

import numpy as np
import pytest

from common.diagnostic import Diagnostic
from phone_host.geometry.se3 import SE3
from phone_host.native.library import Library, native
from phone_host.scan.blocks import BLOCK_BYTES, ONE, SIDE, VOXELS, Blocks
from phone_host.scan.mesh import Mesh, cube_cases, mesh_of
from phone_host.scan.registration import RegistrationSettings, Trial, registered, summed
from phone_host.scan.view import Camera, View, halved, narrowed
from phone_host.scan.volume import Volume
from phone_host.scan.volume_settings import MOST_WEIGHT, VolumeSettings
from tests.support.plane_films import CORNER, GEOMETRY, WALL, distance, path, plane_view, texture

PICTURE = texture()
POSES = path(3, np.array([0.01, 0.02, -0.01, 0.02, -0.01, 0.02]))
NONE = Diagnostic(message="not built", remedy="")
SETTINGS = VolumeSettings(voxel_m=0.02, far_m=3.0)

with_library = pytest.mark.skipif(not isinstance(native(), Library), reason="the native library is not built")


def views() -> list[View]:
    """Three views of a corner, with a hole in the depth."""
    made = [plane_view(pose, PICTURE, CORNER) for pose in POSES]
    made[1].depth_m[60:90, 100:150] = np.nan
    return made


def filled(library: Library | Diagnostic, threads: int = 1, settings: VolumeSettings = SETTINGS) -> Volume:
    """A volume with the three views."""
    volume = Volume(settings, threads, library)
    for view, pose in zip(views(), POSES, strict=True):
        volume.fuse(view, pose)
    return volume


def test_blocks_are_found_where_they_were_put() -> None:
    """After growing twice, too, and among places that share a slot of the table; elsewhere there is none."""
    random, blocks = np.random.default_rng(1), Blocks(300)
    places = np.unique(random.integers(-900, 900, (300, 3)).astype(np.int32), axis=0)
    blocks.add(places[:200])
    blocks.field[:200] = np.arange(200)[:, np.newaxis]
    blocks = blocks.grown(500).grown(900)
    blocks.add(places[200:])
    assert np.array_equal(blocks.find(places), np.arange(len(places)))
    assert np.array_equal(blocks.field[blocks.find(places[:200]), 7], np.arange(200))
    assert (blocks.find(places + 5000) == -1).all()


@with_library
def test_the_library_and_numpy_make_the_same_volume() -> None:
    """Every bit of field, weight, colour, points and normals, with several threads."""
    ours, other = filled(native(), 3), filled(NONE)
    count = ours.blocks.count
    assert count == other.blocks.count
    there = other.blocks.find(ours.blocks.places[:count])
    assert np.array_equal(ours.blocks.field[:count], other.blocks.field[there])
    assert np.array_equal(ours.blocks.weights[:count], other.blocks.weights[there])
    assert np.array_equal(ours.blocks.colours[:count], other.blocks.colours[there])
    depth, geometry = halved(views()[1].depth_m, GEOMETRY)
    for seeds in (depth, None):
        one, two = (volume.cast(Camera(geometry, depth.shape, POSES[1]), seeds) for volume in (ours, other))
        assert np.array_equal(one.points_m, two.points_m, equal_nan=True)
        assert np.array_equal(one.normals, two.normals, equal_nan=True)


@with_library
def test_every_instruction_set_computes_the_same() -> None:
    """Field and cast points are the same bits in each."""
    library = native()
    assert isinstance(library, Library)
    depth, geometry = halved(views()[1].depth_m, GEOMETRY)
    made = [filled(library.using(simd)) for simd in library.usable_sets()]
    points = [volume.cast(Camera(geometry, depth.shape, POSES[1]), depth).points_m for volume in made]
    assert all(np.array_equal(volume.blocks.field, made[0].blocks.field) for volume in made)
    assert all(np.array_equal(each, points[0], equal_nan=True) for each in points)


def test_the_surface_is_where_it_was_seen() -> None:
    """Cast from the last pose, without a seed: a tenth of a voxel from the true depth on the median, normals of the wall to 2 degrees."""
    volume = Volume(SETTINGS)
    for pose in POSES:
        volume.fuse(plane_view(pose, PICTURE, WALL), pose)
    depth, geometry = halved(plane_view(POSES[2], PICTURE, WALL).depth_m, GEOMETRY)
    surface = volume.cast(Camera(geometry, depth.shape, POSES[2]))
    off = np.abs(surface.points_m[..., 2] - depth)
    assert np.isfinite(off).mean() > 0.9
    assert np.nanmedian(off) < 0.1 * SETTINGS.voxel_m
    normals = surface.normals.reshape(-1, 3) @ POSES[2].R.T
    assert np.nanmedian(normals @ WALL[0].axes[0]) > np.cos(np.radians(2))


def test_what_lies_before_a_surface_is_carved() -> None:
    """A view that looks through what an earlier one saw empties it."""
    volume, view = Volume(SETTINGS), plane_view(POSES[0], PICTURE)
    volume.fuse(replace(view, depth_m=np.full_like(view.depth_m, 0.5)), POSES[0])
    before = mesh_of(volume.blocks, SETTINGS.voxel_m)
    for _ in range(3):
        volume.fuse(view, POSES[0])
    after = mesh_of(volume.blocks, SETTINGS.voxel_m)
    assert (before.points_m[:, 2] < 0.6).all()
    assert (after.points_m[:, 2] > 0.6).mean() > 0.99


def test_far_depths_weigh_less_and_weights_end() -> None:
    """At twice the depth a sixteenth; a voxel's weight stays at its greatest."""
    view = plane_view(POSES[0], PICTURE, noise_px=0.3)
    near, far = Volume(SETTINGS), Volume(SETTINGS)
    near.fuse(replace(view, depth_m=np.full_like(view.depth_m, 0.8)), POSES[0])
    far.fuse(replace(view, depth_m=np.full_like(view.depth_m, 1.6)), POSES[0])
    assert near.blocks.weights.max() == pytest.approx(16 * far.blocks.weights.max(), rel=0.2)
    for _ in range(MOST_WEIGHT // 64 + 2):
        near.fuse(replace(view, noise_px=1e-3), POSES[0])
    assert near.blocks.weights.max() == MOST_WEIGHT


@pytest.mark.parametrize("library", [native(), NONE])
def test_memory_is_bounded(library: Library | Diagnostic) -> None:
    """What finds no room is counted, and the rest is fused."""
    volume = Volume(replace(SETTINGS, most_bytes=300 * BLOCK_BYTES), 1, library)
    small = Volume(replace(SETTINGS, most_bytes=20 * BLOCK_BYTES), 1, library)
    view = plane_view(POSES[0], PICTURE)
    volume.fuse(view, POSES[0])
    small.blocks = Blocks(20)
    changed = small.fuse(view, POSES[0])
    assert volume.left_out == 0
    assert small.left_out > 0
    assert small.blocks.count == len(changed) == 20
    assert small.memory_bytes == 20 * BLOCK_BYTES
    assert changed.any()


def test_a_coarser_volume_shows_the_same_surface() -> None:
    """Voxels twice as wide in a third of the memory or less; the surface is seen as deep as before, within a twentieth of a voxel on average."""
    settings = VolumeSettings(voxel_m=0.01, far_m=3.0, truncation_voxels=6.2)
    fine, coarse = (filled(native(), settings=settings) for _ in range(2))
    before = coarse.fused
    coarse.coarsen()
    assert coarse.settings == replace(fine.settings, voxel_m=0.02)
    assert 3 * coarse.memory_bytes < fine.memory_bytes
    assert len(coarse.changed_since(before)) == coarse.blocks.count
    one, other = (each.cast(Camera(GEOMETRY, (180, 240), POSES[1])).points_m[..., 2] for each in (fine, coarse))
    both = np.isfinite(one) & np.isfinite(other)
    assert both.sum() > 0.98 * np.isfinite(one).sum()
    assert float(np.abs(one - other)[both].mean()) < 0.001


def test_wrong_sizes_are_refused() -> None:
    """Images of unlike sizes never reach the library."""
    volume, view = Volume(SETTINGS), plane_view(POSES[0], PICTURE)
    with pytest.raises(ValueError, match="depth"):
        volume.fuse(replace(view, depth_m=view.depth_m[:-1]), POSES[0])
    with pytest.raises(ValueError, match="seeds"):
        volume.cast(Camera(GEOMETRY, (10, 10), POSES[0]), view.depth_m)
    surface = volume.cast(Camera(GEOMETRY, (10, 10), POSES[0]))
    with pytest.raises(ValueError, match="surface"):
        registered(view.depth_m, surface, REGISTRATION, None)


REGISTRATION = RegistrationSettings(
    most_m=0.2, floor_m=0.006, noise_per_m=0.005, geometry=halved(np.zeros((2, 2), np.float32), GEOMETRY)[1]
)


@with_library
@pytest.mark.parametrize("step", [1, 3])
def test_the_library_and_numpy_sum_the_same(step: int) -> None:
    """The normal equations agree to a thousandth: numpy's points are float64, the library's float32. Threads change no bit."""
    volume, library = filled(native()), native()
    assert isinstance(library, Library)
    depth, geometry = halved(views()[1].depth_m, GEOMETRY)
    surface = volume.cast(Camera(geometry, depth.shape, POSES[1]), depth)
    motion = SE3.of(np.array([0.002, 0.001, 0.003, 0.004, -0.002, 0.003]))
    trial = Trial(motion, step)
    sums = [summed(depth, surface, replace(REGISTRATION, threads=threads), trial, library) for threads in (1, 3)]
    numpys = summed(depth, surface, REGISTRATION, trial, None)
    assert np.array_equal(sums[0], sums[1])
    assert sums[0][29] > 0.8 * sums[0][30] > 0
    assert np.allclose(sums[0], numpys, rtol=1e-3, atol=1e-4 * np.abs(numpys).max())


def test_a_depth_is_laid_against_the_surface() -> None:
    """A start that is 1 cm and 0.6 degrees off ends within 0.5 mm and 0.05 degrees; all six directions are told."""
    volume = filled(native())
    depth, geometry = halved(views()[2].depth_m, GEOMETRY)
    off = SE3.of(np.array([0.006, -0.005, 0.007, 0.006, 0.005, -0.006]))
    surface = volume.cast(Camera(geometry, depth.shape, POSES[2] @ off), depth)
    found = native()
    fit = registered(depth, surface, REGISTRATION, found if isinstance(found, Library) else None)
    assert fit.told == 6
    assert fit.overlap > 0.8
    assert fit.near > 0.95
    assert (distance(POSES[2] @ off @ fit.start_now, POSES[2]) < (9e-4, 5e-4)).all()


def test_a_plane_tells_three_directions() -> None:
    """Along a plane and about its normal the start stays; across it the error goes."""
    volume, wall = Volume(SETTINGS), plane_view(POSES[0], PICTURE, WALL)
    volume.fuse(wall, POSES[0])
    depth, geometry = halved(wall.depth_m, GEOMETRY)
    along, across = WALL[0].axes[1] * 0.01, WALL[0].axes[0] * 0.01
    surface = volume.cast(Camera(geometry, depth.shape, SE3(np.eye(3), along + across)), depth)
    fit = registered(depth, surface, REGISTRATION, None)
    assert fit.told == 3
    assert fit.start_now.t_m @ WALL[0].axes[0] == pytest.approx(-0.01, abs=1e-3)
    assert abs(fit.start_now.t_m @ WALL[0].axes[1]) < 1e-3


@pytest.mark.parametrize(("patch_px", "share"), [(1.0, 0.0), (1e5, 1.0)])
def test_a_start_weighs_against_the_depths(patch_px: float, share: float) -> None:
    """Many independent depths overrule a start that is 1 cm off; depths that all err together leave it as it is."""
    volume = filled(native())
    depth, geometry = halved(views()[2].depth_m, GEOMETRY)
    off = SE3(np.eye(3), np.array([0.006, 0.005, -0.006]))
    surface = volume.cast(Camera(geometry, depth.shape, POSES[2] @ off), depth)
    settings = replace(REGISTRATION, patch_px=patch_px, start_turn=0.005, start_shift_m=0.005)
    fit = registered(depth, surface, settings, None)
    left = np.linalg.norm(off.t_m + fit.start_now.t_m) / np.linalg.norm(off.t_m)
    assert left == pytest.approx(share, abs=0.12)


def test_without_partners_nothing_moves() -> None:
    """An empty volume gives the start back, and says so."""
    depth, geometry = halved(views()[0].depth_m, GEOMETRY)
    surface = Volume(SETTINGS).cast(Camera(geometry, depth.shape, POSES[0]), depth)
    fit = registered(depth, surface, REGISTRATION, None)
    assert fit.overlap == fit.told == 0
    assert np.array_equal(fit.start_now.pose(), np.zeros(6))


def ball(radius_m: float, voxel_m: float) -> Blocks:
    """The field of a ball, known everywhere, its blocks in no order."""
    blocks, side = Blocks(600), np.arange(-4, 4, dtype=np.int32)
    places = np.stack(np.meshgrid(side, side, side), axis=-1).reshape(-1, 3)
    blocks.add(np.random.default_rng(2).permutation(places))
    at = np.arange(VOXELS)
    local = np.column_stack([at % SIDE, at // SIDE % SIDE, at // SIDE**2])
    voxels = SIDE * blocks.places[: blocks.count, np.newaxis] + local
    far = np.linalg.norm(voxels * voxel_m - [0.003, 0.002, 0.001], axis=2) - radius_m
    field = np.rint(np.clip(far / (4 * voxel_m), -1, 1) * ONE)
    blocks.field[: blocks.count] = np.where(field == 0, 1, field)
    blocks.weights[: blocks.count] = 1
    blocks.colours[: blocks.count] = (10, 20, 30)
    return blocks


def volume_of(mesh: Mesh) -> float:
    """Content of a closed mesh, m^3; negative if it is inside out."""
    corners = mesh.points_m[mesh.triangles].astype(np.float64)
    return float((np.cross(corners[:, 0], corners[:, 1]) * corners[:, 2]).sum() / 6)


def test_a_ball_becomes_a_closed_mesh() -> None:
    """Points lie on it to a fiftieth of a voxel, every edge belongs to two triangles that face outwards, and the volume is that of the ball."""
    mesh = mesh_of(ball(0.2, 0.01), 0.01)
    away = np.linalg.norm(mesh.points_m - [0.003, 0.002, 0.001], axis=1)
    sides = np.concatenate([mesh.triangles[:, [0, 1]], mesh.triangles[:, [1, 2]], mesh.triangles[:, [2, 0]]])
    there, counts = np.unique(sides, axis=0, return_counts=True)
    assert np.abs(away - 0.2).max() < 2e-4
    assert (counts == 1).all()
    assert np.array_equal(there, np.unique(sides[:, ::-1], axis=0))
    assert volume_of(mesh) == pytest.approx(4 / 3 * np.pi * 0.2**3, rel=5e-3)
    assert (mesh.colours == (30, 20, 10)).all()


def test_the_mesh_is_open_where_nobody_looked() -> None:
    """No triangle reaches what was not seen often enough; without a surface there is none; the order of the blocks changes nothing."""
    blocks = ball(0.2, 0.01)
    blocks.weights[blocks.places[:, 2] >= 0] = 3
    half = mesh_of(blocks, 0.01, 2)
    assert 0 < len(half.triangles) < 0.6 * len(mesh_of(blocks, 0.01).triangles)
    assert half.points_m[:, 2].min() >= 0
    assert len(mesh_of(Blocks(), 0.01).triangles) == len(mesh_of(blocks, 0.01, 9).triangles) == 0


def test_cubes_turned_inside_out_have_as_many_crossings() -> None:
    """Each case's triangles use exactly the edges whose ends differ; the empty and the full cube have none."""
    counts, edges = cube_cases()
    assert counts[0] == counts[255] == 0
    for case in range(256):
        crossed = {n for n in range(12) if _differ(case, n)}
        assert {int(edge) for edge in edges[case].ravel() if edge >= 0} == crossed


def _differ(case: int, edge: int) -> bool:
    axis, at = divmod(edge, 4)
    low = [n for n in range(8) if not n >> axis & 1][at]
    return bool((case >> low ^ case >> (low | 1 << axis)) & 1)


@pytest.mark.parametrize(("width_px", "step"), [(97, 1), (48, 4)])
def test_narrowed_depths_lie_where_they_lay(width_px: int, step: int) -> None:
    """Depths 97 px wide are halved until they are narrow enough; what remains is every n-th pixel, and its ray is that of the pixel it was."""
    depth = np.arange(97 * 61, dtype=np.float32).reshape(61, 97)
    small, geometry, wider = narrowed(depth, GEOMETRY, width_px)
    assert wider == step
    assert np.array_equal(small, depth[::step, ::step])
    for pixel in (0, small.shape[1] - 1):
        ray = (pixel - geometry.cx_px) / geometry.focal_px
        assert ray == pytest.approx((step * pixel - GEOMETRY.cx_px) / GEOMETRY.focal_px)
