"""Two passes of an object, the second turned over: how they lie is found without a start, and they become one surface."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from common.errors import DataError
from phone_host.cli import main
from phone_host.geometry.se3 import SE3, rotations_of
from phone_host.run.scan_job import read_field
from phone_host.scan.field_bytes import field_bytes, field_of
from phone_host.scan.field_sample import merged
from phone_host.scan.mesh import Mesh, mesh_of, size_of, without_crumbs
from phone_host.scan.surface_match import LEAST_WEIGHT, Match, matched_surfaces
from phone_host.scan.volume import Volume
from tests.support.computed_volumes import volume_of
from tests.support.turning_things import AXES, FOOT_M, off_thing_m

Floats = NDArray[np.float64]

Z = np.array([0.0, 0.0, 1.0])
MIDDLE_M = np.array([0.0, 0.0, 0.042])


def off_own_m(points_m: Floats) -> Floats:
    """Distances from the thing, its middle in the origin, z up."""
    return off_thing_m(FOOT_M + (points_m + MIDDLE_M) @ AXES.T)


def off_cube_m(points_m: Floats) -> Floats:
    """Distances from a cube of 60 mm."""
    beside = np.abs(points_m) - 0.03
    return np.asarray(np.linalg.norm(np.maximum(beside, 0), axis=1) + np.minimum(beside.max(axis=1), 0), np.float64)


def off_ball_m(points_m: Floats) -> Floats:
    """Distances from a ball of 40 mm radius."""
    return np.asarray(np.linalg.norm(points_m, axis=1) - 0.04, np.float64)


def plain(points_m: Floats) -> Floats:
    """One brightness."""
    return np.full(len(points_m), 120.0)


def spotted(points_m: Floats) -> Floats:
    """Spots that no turn takes to themselves."""
    x, y, z = 250 * points_m.T
    return np.asarray(
        120 + 50 * np.sin(1.1 * x + 0.3) * np.cos(0.8 * y - 0.5) + 40 * np.sin(1.3 * z + 0.6 * x + 1), np.float64
    )


def anywhere(seed: int) -> SE3:
    """A motion to any turn, and some 0.4 m away."""
    draw = np.random.default_rng(seed)
    axis = draw.normal(size=3)
    return SE3(rotations_of(axis / np.linalg.norm(axis) * draw.uniform(0, np.pi)), draw.normal(0, 0.25, 3))


def surface(volume: Volume) -> Mesh:
    """Its mesh."""
    return without_crumbs(mesh_of(volume.blocks, volume.settings.voxel_m, LEAST_WEIGHT))


@pytest.mark.parametrize("seed", [1])
def test_a_pass_turned_over_is_laid_on_the_first_and_closes_it(seed: int) -> None:
    """From any start: points are within 0.3 mm of where they belong, and hardly anything stays open but the creases that neither has seen."""
    first = volume_of(off_own_m, spotted, up=Z, moved=SE3.identity(), reach_m=0.085)
    away = anywhere(seed)
    second = volume_of(off_own_m, spotted, up=-Z, moved=away, reach_m=0.085)
    found = matched_surfaces(first, second)
    assert found.match is Match.FOUND
    points = surface(first).points_m[::40].astype(np.float64)
    assert np.linalg.norm(found.first_second.apply(away.apply(points)) - points, axis=1).max() < 0.0003
    whole = surface(merged(first, second, found.first_second))
    assert size_of(surface(first)).border_m > 0.1
    assert size_of(whole).border_m < 0.4 * size_of(surface(first)).border_m
    assert np.abs(off_own_m(whole.points_m.astype(np.float64))).mean() < 0.0003


def test_what_fits_in_several_ways_is_decided_by_its_spots_or_not_at_all() -> None:
    """A cube without spots is not put together; with spots it is, the right way."""
    away = anywhere(5)
    for tint, expected in ((plain, Match.SEVERAL), (spotted, Match.FOUND)):
        first = volume_of(off_cube_m, tint, up=Z, moved=SE3.identity(), reach_m=0.07)
        second = volume_of(off_cube_m, tint, up=-Z, moved=away, reach_m=0.07)
        found = matched_surfaces(first, second)
        assert found.match is expected
        if expected is Match.FOUND:
            points = surface(first).points_m[::40].astype(np.float64)
            assert np.linalg.norm(found.first_second.apply(away.apply(points)) - points, axis=1).max() < 0.0005


def test_round_things_and_different_ones_are_refused() -> None:
    """A ball can be turned within itself; a cube is no ball; what is hardly seen is nothing."""
    ball = volume_of(off_ball_m, plain, up=Z, moved=SE3.identity(), reach_m=0.07)
    again = volume_of(off_ball_m, plain, up=-Z, moved=anywhere(2), reach_m=0.07)
    cube = volume_of(off_cube_m, plain, up=Z, moved=SE3.identity(), reach_m=0.07)
    assert matched_surfaces(ball, again).match is Match.SEVERAL
    assert matched_surfaces(cube, again).match is Match.NONE
    assert matched_surfaces(cube, Volume(cube.settings)).match is Match.NONE


def test_a_field_is_kept_to_the_bit_and_damage_is_one_line() -> None:
    """Cut, flipped or foreign bytes are refused."""
    cube = volume_of(off_cube_m, spotted, up=Z, moved=SE3.identity(), reach_m=0.07, voxel_m=0.004)
    content = field_bytes(cube)
    read = field_of(content, "field.bin").volume(1)
    assert np.array_equal(surface(read).points_m, surface(cube).points_m)
    assert field_bytes(read) == content
    for spoiled in (b"", content[:300], content[:-9], b"x" + content, content[:25] + bytes(8) + content[33:]):
        with pytest.raises(DataError, match=r"field\.bin is damaged"):
            field_of(spoiled, "field.bin")


def test_onto_needs_a_folder_with_a_field(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """And --turntable, and another folder for the results: one line each."""
    with pytest.raises(DataError, match=r"holds no field\.bin"):
        read_field(tmp_path)
    rig = ["scan", "l", "r", "--rectified", "--focal", "500", "--baseline", "60", "--onto", str(tmp_path)]
    for more, told in (
        (["--out", str(tmp_path / "o")], "--onto without --turntable"),
        (["--turntable", "--out", str(tmp_path)], "--onto and --out are the same folder"),
        (["--turntable", "--out", str(tmp_path / "o")], "holds no field.bin"),
    ):
        assert main([*rig, *more]) in {2, 4}
        said = capsys.readouterr().err
        assert told in said
        assert len(said.strip().splitlines()) == 1
