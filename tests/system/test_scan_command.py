"""`phone-host scan` as a user starts it, on a rendered still life: the surface against the truth, the same bytes twice, moved things."""

import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.support.still_life import left_axes, off_surfaces_m, photographed, still_life

TURNS_DEG = [0.0, 5.0, 10.0, 15.0, 20.0]


@pytest.fixture(scope="module")
def walk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Five views on the way around the still life."""
    return photographed(tmp_path_factory.mktemp("walk"), TURNS_DEG, [still_life()] * len(TURNS_DEG))


def scan(walk: Path, out: Path, *words: str) -> dict[str, Any]:
    """Run it; return its report."""
    given = ["scan", walk / "left", walk / "right", "--calibration", walk / "rig.yaml", "--out", out, "--json", *words]
    command = [sys.executable, "-m", "phone_host.cli", *map(str, given)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=100)
    assert done.returncode == 0, done.stderr
    report: dict[str, Any] = json.loads(done.stdout)
    return report


def surface_of(path: Path) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Read points and triangles by what the PLY format says, with no code of ours."""
    head, body = path.read_bytes().split(b"end_header\n", 1)
    points, faces = (int(re.search(rb"element %s (\d+)" % name, head)[1]) for name in (b"vertex", b"face"))  # type: ignore[index]  # it is there
    vertices = np.frombuffer(body, np.dtype([("at", "<f4", 3), ("rgb", "u1", 3)]), points)
    triangles = np.frombuffer(body, np.dtype([("n", "u1"), ("of", "<i4", 3)]), faces, vertices.nbytes)
    assert len(body) == vertices.nbytes + triangles.nbytes
    assert set(triangles["n"].tolist()) == {3}
    return vertices["at"].astype(np.float64), triangles["of"]


def test_a_walk_around_a_still_life_gives_its_surfaces(walk: Path, tmp_path: Path) -> None:
    """All pairs are in the model; ball, cube and table lie within 2 mm of the truth on average; a second run writes the same bytes."""
    report = scan(walk, tmp_path / "one")
    assert report == json.loads((tmp_path / "one" / "report.json").read_text())
    assert (report["command"], report["in_model"], len(report["pairs"])) == ("scan", 5, 5)
    points_m, triangles = surface_of(tmp_path / "one" / "model.ply")
    assert (len(points_m), len(triangles)) == (report["model"]["points"], report["model"]["triangles"])
    assert triangles.max() == len(points_m) - 1
    off = off_surfaces_m(left_axes(points_m))
    assert all(len(each) > 500 for each in off.values())
    assert {name: each.mean() for name, each in off.items()} == pytest.approx(dict.fromkeys(off, 0.0), abs=0.002)
    stations = np.loadtxt(tmp_path / "one" / "trajectory.txt")
    assert stations[:, 0].tolist() == [0, 1, 2, 3, 4]
    # q = (0, sin(turn / 2), 0, cos): about the vertical axis, which rectification tilts by a degree or two.
    turned_deg = np.degrees(2 * np.arccos(stations[:, 7]))
    assert turned_deg == pytest.approx(np.array(TURNS_DEG), abs=0.5)
    scan(walk, tmp_path / "two")
    for name in ("model.ply", "trajectory.txt", "report.json", "index.html"):
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()
