"""Submaps: a scan that goes on from them has the model and the places of the one that closed them; damage is one clear line."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from common.diagnostic import Diagnostic
from common.errors import DataError, SettingsError
from common.ledger import StageTimes
from common.words import distance_text
from phone_host.geometry.se3 import SE3
from phone_host.model import Processed, RectifiedPair
from phone_host.run.kept_submaps import KeptSubmaps, read_submaps
from phone_host.run.scan_result import memory_remarks
from phone_host.scan.blocks import Box
from phone_host.scan.scan import Scan, scan_for
from phone_host.scan.scan_wanted import ScanWanted
from phone_host.scan.submap_bytes import submap_bytes, submap_of
from phone_host.scan.volume import Volume
from phone_host.scan.volume_settings import VolumeSettings
from tests.support.plane_films import CORNER, GEOMETRY, path, plane_view, texture

PICTURE = texture()
WANTED = ScanWanted(voxel_m=0.02)
POSES = path(6, np.array([0.008, 0.012, -0.006, 0.012, -0.006, 0.01]))


def shown(pose: SE3) -> Processed:
    """The corner as a pair with depth."""
    view = plane_view(pose, PICTURE, CORNER)
    cloud = np.full((*view.grey.shape, 3), np.nan, np.float32)
    cloud[..., 2] = view.depth_m
    disparity = (GEOMETRY.focal_px * GEOMETRY.baseline_m / view.depth_m).astype(np.float32)
    return Processed(RectifiedPair(view.colours, view.colours), disparity, cloud, StageTimes(), GEOMETRY)


def taken(scan: Scan, poses: list[SE3], first: int = 0) -> Scan:
    """Take views from there."""
    for number, pose in enumerate(poses, first):
        assert scan.take(str(number), float(number), shown(pose)).is_fused
    return scan


def triangles(scan: Scan) -> NDArray[np.float32]:
    """Corners of the model's triangles."""
    mesh = scan.model().mesh
    return mesh.points_m[mesh.triangles]


def test_a_scan_goes_on_from_its_submaps() -> None:
    """Two submaps, as bytes and back, give model and pairs of the scan that closed them; the next view is found and fused."""
    scan = taken(scan_for(WANTED), POSES[:2])
    first = scan.close_submap()
    second = taken(scan, POSES[2:4], 2).close_submap()
    assert (first.is_whole, second.is_whole) == (True, False)
    again = scan_for(WANTED)
    again.go_on([submap_of(submap_bytes(each), "a file") for each in (first, second)])
    assert np.array_equal(triangles(again), triangles(scan))
    assert [pair.name for pair in again.pairs] == ["0", "1", "2", "3"]
    assert all(
        np.array_equal(one.world_camera.R, other.world_camera.R)
        for one, other in zip(again.pairs, scan.pairs, strict=True)
    )
    told = again.take("4", 4.0, shown(POSES[4]))
    assert told.is_fused
    assert np.linalg.norm((told.world_camera.inverse() @ POSES[4]).t_m) < 3e-3


def test_what_is_joined_later_is_in_the_submaps() -> None:
    """Pairs that were lost when a submap was closed and in the model afterwards: the next one is whole, and a scan goes on from it with all."""
    scan = taken(scan_for(WANTED), POSES[:3])
    away = [SE3.of(np.array([0.0, turn, 0.0, 0.3 * turn, 0.0, 0.0])) for turn in np.linspace(1.1, 0.1, 11)]
    told = [scan.take(f"away {number}", 3.0 + number, shown(pose)) for number, pose in enumerate(away[:3])]
    assert [pair.is_fused for pair in told] == [False] * 3
    first = scan.close_submap()
    assert not any(pair.is_fused for pair in first.pairs[3:])
    for number, pose in enumerate(away[3:]):
        scan.take(f"back {number}", 6.0 + number, shown(pose))
    assert all(pair.is_fused for pair in scan.pairs)
    assert all(scan.final(pair).is_fused for pair in told)
    second = scan.close_submap()
    assert second.is_whole
    again = scan_for(WANTED)
    again.go_on([submap_of(submap_bytes(second), "a file")])
    assert np.array_equal(triangles(again), triangles(scan))
    assert [pair.state for pair in again.pairs] == [pair.state for pair in scan.pairs]


def test_submaps_do_not_grow_for_ever() -> None:
    """On the same surface again and again, some submap holds everything, and those before it are removed."""
    scan, sizes = scan_for(WANTED), []
    for number in range(6):
        submap = taken(scan, POSES[:1], number).close_submap()
        sizes.append(submap.is_whole)
    assert sizes[0]
    assert any(sizes[1:])


def test_another_calibration_is_refused() -> None:
    """Submaps of another geometry: a wrong setting, not a pair that failed."""
    submap = taken(scan_for(WANTED), POSES[:1]).close_submap()
    again = scan_for(WANTED)
    again.go_on([replace(submap, geometry=replace(GEOMETRY, baseline_m=0.2))])
    with pytest.raises(SettingsError, match="another calibration"):
        again.take("1", 1.0, shown(POSES[1]))


@pytest.mark.parametrize("cut", [0, 5, 30, 2000, -1])
def test_a_damaged_submap_is_named(cut: int) -> None:
    """Cut anywhere, or with a changed byte: one line with the file's name."""
    whole = submap_bytes(taken(scan_for(WANTED), POSES[:1]).close_submap())
    for damaged in (whole[:cut], whole[:2500] + bytes([whole[2500] ^ 255]) + whole[2501:]):
        with pytest.raises(DataError, match=r"^submap-7.bin is damaged"):
            submap_of(damaged, "submap-7.bin")


def test_values_are_put_as_far_as_there_is_memory() -> None:
    """Without room for all blocks, the first ones have their values, the others are counted; the same with numpy alone."""
    view = plane_view(SE3.identity(), PICTURE, CORNER)
    volume = Volume(VolumeSettings(voxel_m=0.02, far_m=3.0), library=Diagnostic(message="not built", remedy=""))
    volume.fuse(view, SE3.identity())
    values = volume.changed_blocks()
    assert len(volume.changed_blocks().places) == 0
    small = Volume(VolumeSettings(voxel_m=0.02, far_m=3.0, most_bytes=100 * 3612))
    small.put(values)
    assert small.left_out == len(values.places) - small.blocks.count
    assert np.array_equal(small.blocks.field[: small.blocks.count], values.field[: small.blocks.count])


def test_a_model_that_fills_its_memory_becomes_coarser_and_goes_on() -> None:
    """Nothing is left out, no pair is lost, the report says so, and a scan that goes on from the next submap has the same model; with --voxel it stays fine."""
    box = Box((-0.5, -0.5, 0.2), (0.5, 0.5, 1.5))
    scan = scan_for(ScanWanted(most_bytes=5_000_000, box=box))
    taken(scan, POSES[:1])
    begun_m = scan.poses.begun_voxel_m
    scan.close_submap()
    taken(scan, POSES[1:5], 1)
    assert scan.settings is not None
    assert scan.volume is not None
    assert scan.settings.voxel_m == 2 * begun_m
    assert scan.volume.left_out == 0
    (remark,) = memory_remarks(scan)
    assert f"its voxels became {distance_text(2 * begun_m)} wide, {distance_text(begun_m)} at first" in remark.text
    whole = scan.close_submap()
    assert whole.is_whole
    again = scan_for(ScanWanted(most_bytes=5_000_000, box=box))
    again.go_on([submap_of(submap_bytes(whole), "a file")])
    assert np.array_equal(triangles(again), triangles(scan))
    fine = taken(scan_for(ScanWanted(most_bytes=5_000_000, voxel_m=begun_m)), POSES[:5])
    assert fine.settings is not None
    assert fine.volume is not None
    assert fine.volume.left_out > 0
    assert fine.settings.voxel_m == begun_m


def test_what_was_carved_before_a_resume_counts_in_coarser_cells_too() -> None:
    """A model that becomes coarser after it was gone on with knows what all five views told of its box."""
    wanted = ScanWanted(most_bytes=5_500_000, box=Box((-0.5, -0.5, 0.2), (0.5, 0.5, 1.5)))
    first = taken(scan_for(wanted), POSES[:2]).close_submap()
    again = scan_for(wanted)
    again.go_on([submap_of(submap_bytes(first), "a file")])
    last = taken(again, POSES[2:5], 2).close_submap()
    assert last.settings.voxel_m == 2 * first.settings.voxel_m
    assert last.carved is not None
    assert last.carved.cells.voxel_m == last.settings.voxel_m
    assert last.carved.views == 5
    assert last.carved.counts[0].max() > 2


def test_files_are_kept_and_removed(tmp_path: Path) -> None:
    """One after 20 fused pairs; a resumed scan writes the next number; what is missing is told; none is left at the end."""
    scan = scan_for(WANTED)
    kept = KeptSubmaps(tmp_path, scan)
    with pytest.raises(DataError, match="holds no submaps"):
        read_submaps(tmp_path)
    for number in range(40):
        taken(scan, POSES[:1], number)
        kept.after_pair()
    assert sorted(path.name for path in tmp_path.glob("submap*")) == ["submap-0000.bin", "submap-0001.bin"]
    resumed = KeptSubmaps(tmp_path, again := scan_for(WANTED), read_submaps(tmp_path))
    for number in range(40, 60):
        taken(again, POSES[:1], number)
        resumed.after_pair()
    assert [path.name for path in tmp_path.glob("submap*")] == ["submap-0002.bin"]
    assert len(read_submaps(tmp_path)[0].pairs) == 60
    (tmp_path / "submap-0004.bin").write_bytes(b"")
    with pytest.raises(DataError, match="is missing"):
        read_submaps(tmp_path)
    (tmp_path / "submap-0004.bin").unlink()
    second = replace(read_submaps(tmp_path)[0], is_whole=False)
    (tmp_path / "submap-0002.bin").write_bytes(submap_bytes(second))
    with pytest.raises(DataError, match=r"before .* are missing"):
        read_submaps(tmp_path)
    resumed.done()
    assert not list(tmp_path.glob("submap*"))
    assert resumed.remarks == ()


def test_a_folder_that_vanishes_ends_the_keeping_only(tmp_path: Path) -> None:
    """What cannot be written is told in the report; the scan goes on."""
    (tmp_path / "file").write_text("")
    scan = scan_for(WANTED)
    kept = KeptSubmaps(tmp_path / "file", scan)
    for number in range(21):
        taken(scan, POSES[:1], number)
        kept.after_pair()
    assert "could not have been resumed" in kept.remarks[0].message
    kept.done()


def test_what_the_views_told_of_a_box_is_kept() -> None:
    """A scan in a box goes on with the same counts, so its closed model is the same; with another box it is refused."""
    wanted = replace(WANTED, box=Box((-0.3, -0.3, 0.5), (0.3, 0.3, 1.2)))
    scan = taken(scan_for(wanted), POSES[:2])
    kept = submap_of(submap_bytes(scan.close_submap()), "a file")
    again = scan_for(wanted)
    again.go_on([kept])
    assert scan.model().is_closed
    assert np.array_equal(triangles(again), triangles(scan))
    with pytest.raises(SettingsError, match="another box"):
        scan_for(replace(WANTED, box=Box((-0.3, -0.3, 0.5), (0.3, 0.3, 1.5)))).go_on([kept])
