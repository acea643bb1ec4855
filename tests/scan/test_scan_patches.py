"""The surface in patches: together they are the whole, and only what changed is made and sent again."""

import json
import struct

import numpy as np

from phone_host.geometry.se3 import SE3
from phone_host.scan.mesh import Mesh, mesh_of, only
from phone_host.scan.patches import Patch, Patches
from phone_host.scan.volume import Volume
from phone_host.scan.volume_settings import VolumeSettings
from phone_host.web.source import Surface
from phone_host.web.surface_bytes import surface_bytes
from tests.support.plane_films import CORNER, WALL, plane_view, texture

PICTURE = texture()
SETTINGS = VolumeSettings(voxel_m=0.01, far_m=3.0)
MANY = 10**9


def grown() -> Volume:
    """A volume with a view of a corner."""
    volume = Volume(SETTINGS)
    volume.fuse(plane_view(SE3.identity(), PICTURE, CORNER), SE3.identity())
    return volume


def test_the_patches_are_the_whole_surface() -> None:
    """Each triangle of the surface is in one patch, inside its cube; each patch has a number of its own."""
    volume = grown()
    patches = Patches(1)
    patches.renew(volume)
    found, whole = patches.since(0, MANY), mesh_of(volume.blocks, SETTINGS.voxel_m)
    assert sum(len(each.mesh.triangles) for each in found) == len(whole.triangles) > 1000
    assert [each.number for each in found] == list(range(1, len(found) + 1))
    assert len(found) > 3
    for each in found:
        low = np.array(each.place) * each.side_m
        assert (each.mesh.points_m >= low - 1e-6).all()
        assert (each.mesh.points_m <= low + each.side_m + SETTINGS.voxel_m).all()


def test_only_what_changed_is_made_again() -> None:
    """A second view of a part changes the patches that it shows, as a whole new making would; without a view nothing is new."""
    volume = grown()
    patches = Patches(1)
    patches.renew(volume)
    before = patches.since(0, MANY)
    patches.renew(volume)
    assert patches.since(before[-1].number, MANY) == ()
    part = plane_view(SE3.identity(), PICTURE, CORNER)
    part.depth_m[:, 60:] = np.nan
    volume.fuse(part, SE3.identity())
    patches.renew(volume)
    newer = patches.since(before[-1].number, MANY)
    assert 0 < len(newer) < len(before)
    whole = mesh_of(volume.blocks, SETTINGS.voxel_m)
    assert sum(len(each.mesh.triangles) for each in patches.since(0, MANY)) == len(whole.triangles)


def test_an_answer_is_bounded_and_goes_on() -> None:
    """With a small bound the patches come one by one, in their order, and all of them."""
    patches = Patches(1)
    patches.renew(grown())
    numbers, newest = [], 0
    while some := patches.since(newest, 10):
        assert len(some) == 1
        newest = some[-1].number
        numbers.append(newest)
    assert numbers == [each.number for each in patches.since(0, MANY)]


def test_a_surface_that_goes_away_is_told() -> None:
    """Where nothing is left the patch comes once more, without triangles."""
    volume = Volume(SETTINGS)
    volume.fuse(plane_view(SE3.identity(), PICTURE, WALL), SE3.identity())
    patches = Patches(1)
    patches.renew(volume)
    newest = patches.since(0, MANY)[-1].number
    gone = volume.changed_blocks(every=True)
    gone.weights[:] = 0
    volume.put(gone)
    patches.renew(volume)
    newer = patches.since(newest, MANY)
    assert newer
    assert all(len(each.mesh.triangles) == 0 for each in newer)


def test_a_volume_that_became_coarser_is_shown_anew() -> None:
    """The patches are the surface of the wider voxels; those of the narrow ones, which lay in other cubes, are gone."""
    volume, patches = grown(), Patches(1)
    patches.renew(volume)
    before = patches.since(0, MANY)
    volume.coarsen()
    patches.renew(volume)
    whole = {each.place: each for each in (*before, *patches.since(before[-1].number, MANY))}
    shown = [each for each in whole.values() if len(each.mesh.triangles)]
    assert {each.side_m for each in shown} == {2 * before[0].side_m}
    assert sum(len(each.mesh.triangles) for each in shown) == len(mesh_of(volume.blocks, 0.02).triangles) > 500


def test_a_patch_never_has_more_points_than_are_allowed() -> None:
    """A patch with too many is thinned."""
    patches = Patches(1, most_points=300)
    patches.renew(grown())
    sizes = [len(each.mesh.points_m) for each in patches.since(0, MANY)]
    assert max(sizes) <= 300
    assert sum(sizes) > 500


def test_the_bytes_give_the_surface_back() -> None:
    """Points come back within half a step, triangles, colours and flags as they are, each part at a multiple of 4; nothing new repeats the number."""
    random = np.random.default_rng(3)
    points = (np.array([-2, 0, 5]) * 0.64 + random.uniform(0, 0.65, (7, 3))).astype(np.float32)
    mesh = Mesh(
        points, random.integers(0, 256, (7, 3), np.uint8), np.array([[0, 1, 2], [4, 5, 6], [6, 2, 0]], np.int32)
    )
    seen = np.array([1, 1, 0, 1, 0, 1, 1], np.bool_)
    nothing = Patch(11, (1, 1, 1), 0.64, Mesh.empty(), np.zeros(0, np.bool_))
    data = surface_bytes(Surface(4, (Patch(9, (-2, 0, 5), 0.64, mesh, seen), nothing)), 8)
    length = struct.unpack_from("<I", data)[0]
    assert length % 4 == 0
    head = json.loads(data[4 : 4 + length])
    assert (head["begun"], head["newest"]) == (4, 11)
    first, second = head["patches"]
    assert (second["points"], second["triangles"]) == (0, 0)
    at = 4 + length
    steps = np.frombuffer(data, "<u2", 21, at).reshape(7, 3)
    assert np.abs(np.array(first["low"]) + first["step"] * steps - points).max() <= first["step"]
    assert np.array_equal(np.frombuffer(data, "<u2", 9, at + 44).reshape(3, 3), mesh.triangles)
    assert np.array_equal(np.frombuffer(data, np.uint8, 21, at + 44 + 20).reshape(7, 3), mesh.colours)
    assert [each["unseen"] for each in head["patches"]] == [2, 0]
    assert list(data[at + 44 + 20 + 24 :]) == [*seen.tolist(), 0]
    again = surface_bytes(Surface(4, ()), 11)
    assert json.loads(again[4:])["newest"] == 11


def test_a_resumed_volume_shows_itself_whole() -> None:
    """What is put into a volume, as a scan does that goes on, is in the patches."""
    volume, other = grown(), Volume(SETTINGS)
    other.put(volume.changed_blocks(every=True))
    patches = Patches(1)
    patches.renew(other)
    whole = mesh_of(volume.blocks, SETTINGS.voxel_m)
    assert sum(len(each.mesh.triangles) for each in patches.since(0, MANY)) == len(whole.triangles)
    assert len(other.changed_blocks().places) == 0


def test_the_finished_surface_takes_the_place_of_what_grew() -> None:
    """All of it is in patches that lie in their cubes; what was shown where it is not is taken away."""
    volume = grown()
    patches = Patches(1)
    patches.renew(volume)
    before = {each.place for each in patches.since(0, MANY)}
    newest = max(each.number for each in patches.since(0, MANY))
    whole = mesh_of(volume.blocks, SETTINGS.voxel_m)
    left = only(whole, whole.points_m[whole.triangles].mean(axis=1)[:, 0] < 0)
    patches.become(left, SETTINGS.voxel_m, left.points_m[:, 1] < 0)
    found = patches.since(newest, MANY)
    assert {each.place for each in found} == before
    assert sum(len(each.mesh.triangles) for each in found) == len(left.triangles) > 500
    assert any(not len(each.mesh.triangles) for each in found)
    for each in found:
        if len(each.mesh.triangles):
            low = np.array(each.place) * each.side_m
            assert (each.mesh.points_m >= low - each.side_m / 10).all()
            assert np.array_equal(each.seen, each.mesh.points_m[:, 1] < 0)
            assert (each.mesh.points_m <= low + 1.1 * each.side_m).all()
