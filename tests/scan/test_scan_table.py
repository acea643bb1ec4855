"""A thing on a table without a mat: the table in a noisy view, the thing's box, and a scan of it."""

import json
import math
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from common.errors import SettingsError
from phone_host.cli import main
from phone_host.geometry.se3 import SE3
from phone_host.output.axes import Axes
from phone_host.output.meshes.ply_mesh import read_ply_mesh
from phone_host.output.meshes.printable import Flaw, Printer, problems
from phone_host.output.meshes.solid import Solid
from phone_host.scan.blocks import Box
from phone_host.scan.scan import scan_for
from phone_host.scan.scan_wanted import ScanWanted
from phone_host.scan.submap_bytes import submap_bytes, submap_of
from phone_host.scan.surface import thing_box
from phone_host.scan.table import Table, find_table
from phone_host.scan.tracking_words import Weakness
from phone_host.scan.volume import Volume
from phone_host.scan.volume_settings import VolumeSettings
from tests.support.programs import board
from tests.support.solid_views import Thing, around, thing_view
from tests.support.table_things import Slope, bare_scene, computed, small_scene, true_camera, write_pictures

PAIRS = 9


@pytest.mark.parametrize(
    "slope",
    [Slope(), Slope(down_deg=20, deep_m=1.0), Slope(deep_m=0.47), Slope(deep_m=0.5, wide_m=0.1), Slope(down_deg=60)],
    ids=["large", "flat", "before a floor", "a quarter of the view", "steep"],
)
def test_the_table_of_noisy_depths(slope: Slope) -> None:
    """With 0.5 px of noise its normal is exact to a fifth of a degree and its height to 1 mm; the origin lies below the ball, z up."""
    for seed in (1, 2, 3):
        found = find_table(slope.view(seed))
        assert isinstance(found, Table)
        assert math.degrees(math.acos(min(1.0, float(found.plane.normal @ slope.normal)))) < 0.2
        assert found.plane.distance_m == pytest.approx(slope.height_m, abs=0.001)
        foot = found.world_camera.apply(np.array([[0.0, 0.0, slope.height_m / math.sin(math.radians(slope.down_deg))]]))
        assert np.abs(foot[0, :2]).max() < 0.6 * slope.ball_m
        assert abs(foot[0, 2]) < 0.001
        assert found.world_camera.R @ slope.normal == pytest.approx([0, 0, 1], abs=0.004)
        assert found.room.holds(np.array([[0, 0, 2 * slope.ball_m]], np.float32)).all()


def test_what_is_no_table_with_a_thing_is_told() -> None:
    """A bare table, a wall, no depth at all: a reason each, whatever the noise."""
    assert find_table(Slope(ball_m=0).view(1)) is Weakness.BARE_TABLE
    assert find_table(Slope(ball_m=0).view()) is Weakness.BARE_TABLE
    assert find_table(Slope(down_deg=0, deep_m=0, ball_m=0).view(1)) is Weakness.NO_TABLE
    blank = Slope().view(1)
    blank.depth_m[:] = np.nan
    assert find_table(blank) is Weakness.NO_TABLE


def test_the_table_of_a_wide_view_is_that_of_a_small_one() -> None:
    """A view of 1280 px is made small first: the table and the ball are where they are in one of 320."""
    small, seen = find_table(Slope().view()), Slope().view()
    wide = replace(
        seen,
        depth_m=np.repeat(np.repeat(seen.depth_m, 4, axis=0), 4, axis=1),
        geometry=replace(seen.geometry, focal_px=1200, cx_px=4 * 159.5 + 1.5, cy_px=4 * 119.5 + 1.5),
    )
    found = find_table(wide)
    assert isinstance(small, Table)
    assert isinstance(found, Table)
    assert found.plane.distance_m == pytest.approx(small.plane.distance_m, abs=0.001)
    assert found.world_camera.t_m == pytest.approx(small.world_camera.t_m, abs=0.003)


def test_depths_without_a_plane_are_no_table() -> None:
    """Single pixels that are far from each other, and depths that only chance has put there."""
    draw = np.random.default_rng(1)
    scattered = Slope().view()
    alone = np.full_like(scattered.depth_m, np.nan)
    alone[::40, ::35] = scattered.depth_m[::40, ::35]
    chance = draw.uniform(0.3, 3.0, alone.shape).astype(np.float32)
    for depth in (alone, chance):
        assert find_table(replace(scattered, depth_m=depth)) is Weakness.NO_TABLE


def test_what_reaches_across_the_whole_picture_is_no_thing_on_a_table() -> None:
    """A beam on the table, from the left rim to the right one: nobody can walk around it."""
    beam = Slope(ball_m=0).view()
    beam.depth_m[90:130] = beam.depth_m[130]
    assert find_table(beam) is Weakness.BARE_TABLE


def test_the_box_holds_what_is_connected_to_the_thing_in_the_middle() -> None:
    """All of the thing from the table up, and nothing of a block that stands 5 cm beside it; an empty room has none."""
    settings = VolumeSettings(voxel_m=0.003, far_m=1.0, truncation_voxels=6.0)
    volume, thing = Volume(settings), Thing()
    for number, pose in enumerate(around(8)):
        volume.fuse(thing_view(thing, pose, seed=number), pose)
    room = Box((-0.2, -0.2, 0.0), (0.2, 0.2, 0.3))
    box = thing_box(volume.blocks, settings, room, 0.006)
    assert box is not None
    grid = np.stack(np.meshgrid(*[np.linspace(-0.15, 0.15, 61)] * 2, np.linspace(0.01, 0.2, 39)), -1).reshape(-1, 3)
    inside = grid[thing.distance_m(grid) < 0]
    low, high = inside.min(axis=0), inside.max(axis=0)
    assert box.low_m[2] == 0.006
    assert (np.array(box.low_m)[:2] < low[:2]).all()
    assert (np.array(box.low_m)[:2] > low[:2] - 0.03).all()
    assert (np.array(box.high_m) > high - 0.005).all()
    assert (np.array(box.high_m) < high + 0.03).all()
    assert thing_box(volume.blocks, settings, Box((0.5, 0.5, 0.0), (0.6, 0.6, 0.1)), 0.006) is None


@pytest.fixture(scope="module")
def pictures(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A figure on a table from nine places over 64 degrees."""
    folder = tmp_path_factory.mktemp("figure")
    write_pictures(folder, PAIRS, small_scene())
    return folder


def scanned(pictures: Path, out: Path, *words: str) -> int:
    """Call the verb."""
    given = [str(pictures / "left"), str(pictures / "right"), "--calibration", str(pictures / "rig.yaml")]
    return main(["scan", *given, "--near", "25cm", "--voxel", "2mm", *words, "--out", str(out)])


@pytest.fixture(scope="module")
def scan_of_it(pictures: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Its results."""
    out = tmp_path_factory.mktemp("scan") / "out"
    assert scanned(pictures, out, "--object") == 0
    return out


def model_of(out: Path) -> Solid:
    return read_ply_mesh((out / "model.ply").read_bytes(), "model.ply", 1.0)


def from_table(out: Path) -> SE3:
    """Takes the model's axes to those of the figure, by where the first pair was taken."""
    report = json.loads((out / "report.json").read_text())
    words = next(line for line in (out / "trajectory.txt").read_text().splitlines() if not line.startswith("#")).split()
    assert report["in_model"] == PAIRS
    x, y, z, w = (float(word) for word in words[4:8])
    turn = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    return true_camera(0) @ SE3(turn, np.array([float(word) for word in words[1:4]])).inverse()


def test_a_figure_on_a_table_becomes_a_closed_model_that_stands_on_it(scan_of_it: Path) -> None:
    """What was seen lies 1 mm off the true surface on average; no table is left beside it, and it ends on the table."""
    mesh, to_figure = model_of(scan_of_it), from_table(scan_of_it)
    points = np.asarray(mesh.points_m, np.float64)
    flaws = {each.flaw for each in problems(points * 1e3, mesh.triangles, Printer(), lambda _: None)}
    assert not flaws & {Flaw.OPEN, Flaw.TANGLED, Flaw.INSIDE_OUT, Flaw.CROSSING}
    assert np.abs(to_figure.R[:, 2] - [0, 0, 1]).max() < 0.01
    assert points[:, 2].min() == pytest.approx(0.0, abs=0.0002)
    low, high = small_scene().solid.bounds_m
    assert points[:, 2].max() == pytest.approx(high[2] - low[2], abs=0.006)
    seen = mesh.seen
    off_m = np.abs(small_scene().solid.signed_distance(to_figure.apply(points)))
    assert seen.mean() > 0.15
    assert off_m[seen].mean() < 0.001
    assert np.quantile(off_m[seen], 0.95) < 0.0035
    report = json.loads((scan_of_it / "report.json").read_text())
    assert report["model"]["axes"] == Axes.TABLE.text
    assert (report["verdict"], report["model"]["drift_included"]) == ("warning", False)
    assert {pair["state"] for pair in report["pairs"]} == {"tracking"}
    assert "the axes are the table" in (scan_of_it / "index.html").read_text()


def test_the_python_api_scans_it_as_the_command_does(pictures: Path, tmp_path: Path) -> None:
    """examples/scan_object.py, told `table`, leaves the folder that the command makes of the same pictures: the same model, in the same axes."""
    link, example = f"ipc://{tmp_path}/link", Path(__file__).parents[2] / "examples" / "scan_object.py"
    with board(["run", "--camera", f"replay:{pictures / 'left'}", "--link", link], tmp_path):
        words = [example, link, f"replay:{pictures / 'right'}", pictures / "rig.yaml", "table", str(PAIRS)]
        command = [sys.executable, *map(str, words)]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False, timeout=100)
    assert done.returncode == 0, done.stderr
    given = [str(pictures / "left"), str(pictures / "right"), "--calibration", str(pictures / "rig.yaml")]
    assert main(["scan", *given, "--object", "--out", str(tmp_path / "command")]) == 0
    assert (tmp_path / "scan" / "model.ply").read_bytes() == (tmp_path / "command" / "model.ply").read_bytes()
    api, command_s = (json.loads((tmp_path / out / "report.json").read_text()) for out in ("scan", "command"))
    assert (api["model"], api["files"], api["in_model"]) == (command_s["model"], command_s["files"], PAIRS)


def test_equal_pairs_give_equal_bytes_and_a_box_overrides(pictures: Path, scan_of_it: Path, tmp_path: Path) -> None:
    """The second time all files are the same; --box, in the table's axes, keeps the figure's upper part alone."""
    assert scanned(pictures, tmp_path / "again", "--object") == 0
    for name in ("model.ply", "trajectory.txt", "report.json", "index.html"):
        again, first = (
            (folder / name).read_bytes().replace(str(folder).encode(), b"FOLDER")
            for folder in (tmp_path / "again", scan_of_it)
        )  # the page gives commands with the folder's name
        assert again == first
    assert scanned(pictures, tmp_path / "box", "--object", "--box", "120x120x60@0,10,80") == 0
    points = model_of(tmp_path / "box").points_m
    assert points[:, 2].min() >= 0.05 - 1e-5
    assert points[:, 2].max() == pytest.approx(model_of(scan_of_it).points_m[:, 2].max(), abs=0.002)


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["--mat"], "--object beside --mat"),
        (["--turntable"], "--object beside --turntable"),
        (["--axes", "y-up"], "--axes y-up beside --object"),
    ],
)
def test_what_contradicts_it_is_refused(
    pictures: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], words: list[str], expected: str
) -> None:
    """One line, exit code 2, no model."""
    assert scanned(pictures, tmp_path / "o", "--object", *words) == 2
    told = capsys.readouterr().err
    assert expected in told
    assert len(told.strip().splitlines()) == 1
    assert not (tmp_path / "o").exists()


def test_pairs_without_a_thing_on_a_table_are_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A bare table has depth, and nothing stands there: exit code 4, one line, no model."""
    write_pictures(tmp_path, 2, bare_scene())
    assert scanned(tmp_path, tmp_path / "o", "--object") == 4
    told = capsys.readouterr().err
    assert "nothing stands on the table in the middle of the picture in any of 2 pairs" in told
    assert len(told.strip().splitlines()) == 1
    assert not (tmp_path / "o" / "model.ply").exists()


def test_a_scan_goes_on_where_it_was_and_not_as_another_one(pictures: Path) -> None:
    """From its submaps the thing's room and box are the same; without --object they are refused."""
    wanted = ScanWanted(voxel_m=0.002, on_table=True)
    scan = scan_for(wanted)
    for number in range(4):
        scan.take(str(number), float(number), computed(pictures, number))
    kept = submap_of(submap_bytes(scan.close_submap()), "kept")
    later = scan_for(wanted)
    later.go_on([kept])
    assert later.model().mesh.points_m.tobytes() == scan.model().mesh.points_m.tobytes()
    assert later.take("4", 4.0, computed(pictures, 4)).is_fused
    with pytest.raises(SettingsError, match="was started with --object"):
        scan_for(replace(wanted, on_table=False)).go_on([kept])
