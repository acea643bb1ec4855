"""`phone-host scan` as a user starts it, on a rendered still life: the surface against the truth, the same bytes twice, moved things."""

import json
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from phone_host.cli import main
from phone_host.report.scan_lines import scan_lines
from phone_host.report.scan_report import ScanReport
from phone_host.run.file_pairs import FilePairs
from phone_host.run.scan_job import run_scan
from phone_host.scan.scan_wanted import ScanWanted
from phone_host.scan.tracking_words import Weakness
from phone_host.scene.scene_model import Body, Box, Scene, Texture
from phone_host.stereo.core import StereoCore
from phone_host.stereo.depth_limits import DepthWanted
from phone_host.stereo.match import MatchSettings
from phone_host.stereo.matcher_names import MatcherName
from phone_host.stereo.rectifier import Rectifier
from phone_host.stereo.view_files import pair_files
from tests.support.programs import board, host, on_a_full_disk
from tests.support.still_life import left_axes, off_surfaces_m, photographed, small_rig, still_life

EXAMPLE = Path(__file__).parents[2] / "examples" / "scan_object.py"
TURNS_DEG = [0.0, 5.0, 10.0, 15.0, 20.0]


@pytest.fixture(scope="module")
def walk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Five views on the way around the still life."""
    return photographed(tmp_path_factory.mktemp("walk"), TURNS_DEG, [still_life()] * len(TURNS_DEG))


def scan(walk: Path, out: Path) -> dict[str, Any]:
    """Run it; return its report."""
    given = ["scan", walk / "left", walk / "right", "--calibration", walk / "rig.yaml", "--out", out, "--json"]
    command = [sys.executable, "-m", "phone_host.cli", *map(str, given)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=100)
    assert done.returncode == 0, done.stderr
    report: dict[str, Any] = json.loads(done.stdout)
    return report


class _Watcher:
    """Somebody who watches, and perhaps presses Ctrl-C when these words are shown."""

    def __init__(self, until: str = "") -> None:
        self._until = until

    def __call__(self, amount: int = 1) -> None:
        """Wait on."""

    def say(self, what: str) -> None:
        """Read what is being done."""
        if what == self._until:
            raise KeyboardInterrupt


def scan_here(walk: Path, out: Path, until: str = "") -> ScanReport:
    """The same in this process, which saves seconds; Ctrl-C when the words `until` are shown."""
    core = StereoCore(MatchSettings(MatcherName.TANDEM), Rectifier(small_rig()), None, DepthWanted(search_from_m=0.3))
    files = pair_files(str(walk / "left"), str(walk / "right"))
    pairs = FilePairs(files=files, out=out, make_core=lambda _: core, matcher="tandem")
    return run_scan(pairs, ScanWanted(), _Watcher(until))


def surface_of(path: Path) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Read points and triangles by what the PLY format says, with no code of ours."""
    head, body = path.read_bytes().split(b"end_header\n", 1)
    points, faces = (int(re.search(rb"element %s (\d+)" % name, head)[1]) for name in (b"vertex", b"face"))  # type: ignore[index]  # it is there
    vertices = np.frombuffer(body, np.dtype([("at", "<f4", 3), ("rgb", "u1", 3)]), points)
    triangles = np.frombuffer(body, np.dtype([("n", "u1"), ("of", "<i4", 3)]), faces, vertices.nbytes)
    assert len(body) == vertices.nbytes + triangles.nbytes
    assert set(triangles["n"].tolist()) == {3}
    return vertices["at"].astype(np.float64), triangles["of"]


def written(folder: Path, name: str) -> bytes:
    """Return a file of a scan, without the name of the folder, which is in the commands that its page gives for what comes next."""
    return (folder / name).read_bytes().replace(str(folder).encode(), b"FOLDER")


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
    scan_here(walk, tmp_path / "two")
    for name in ("model.ply", "trajectory.txt", "report.json", "index.html"):
        assert written(tmp_path / "one", name) == written(tmp_path / "two", name)


def test_a_wrong_picture_does_not_condemn_the_model_of_the_others(walk: Path, tmp_path: Path) -> None:
    """A picture of something else is named with its pair, which is not in the model; it is no failure."""
    wrong = tmp_path / "wrong"
    shutil.copytree(walk, wrong)
    first, *_ = sorted((wrong / "left").iterdir())
    camera = small_rig().left
    other = np.random.default_rng(1).integers(0, 255, (camera.height_px // 4, camera.width_px // 4, 3), np.uint8)
    cv2.imwrite(str(first), cv2.resize(other, (camera.width_px, camera.height_px), interpolation=cv2.INTER_CUBIC))
    report = scan_here(wrong, tmp_path / "one")
    assert (report.fused, report.is_sound) == (4, True)
    told = [remark for remark in report.remarks if "different scenes" in remark.message]
    assert [(remark.message[:7], remark.is_failure) for remark in told] == [("pair 0:", False)]


def test_what_somebody_moved_meanwhile_does_not_spoil_the_rest(walk: Path, tmp_path: Path) -> None:
    """Somebody moves the ball at the third view, and back: table and cube stay within 2 mm on average, all other pairs are in the model."""
    for name in ("left", "right"):
        shutil.copytree(walk / name, tmp_path / name)
    shutil.copy(walk / "rig.yaml", tmp_path)
    (tmp_path / "moved").mkdir()
    moved = photographed(tmp_path / "moved", TURNS_DEG[2:3], [still_life(0.12)])
    for name in ("left", "right"):
        shutil.copy(moved / name / "000.jpg", tmp_path / name / "002.jpg")
    report = scan_here(tmp_path, tmp_path / "out")
    assert {pair.name for pair in report.scanned if not pair.is_fused} <= {"2"}
    off = off_surfaces_m(left_axes(surface_of(tmp_path / "out" / "model.ply")[0]))
    assert max(off[name].mean() for name in ("table", "cube")) < 0.002


def test_somebody_who_walks_by_is_told_and_stays_out_of_the_model(tmp_path: Path) -> None:
    """A column of the size of a leg goes past behind the still life: the pairs say so, and ball, cube and table are as without it."""
    folder = photographed(tmp_path, TURNS_DEG, [with_column(number) for number in range(len(TURNS_DEG))])
    report = scan_here(folder, tmp_path / "out")
    assert report.fused == len(TURNS_DEG)
    told = [pair.weakness for pair in report.scanned]
    assert told.count(Weakness.RESTLESS) >= 3
    assert any("something in the scene moves" in line for line in scan_lines(report, "out"))
    off = off_surfaces_m(left_axes(surface_of(tmp_path / "out" / "model.ply")[0]))
    assert max(each.mean() for each in off.values()) < 0.002
    assert max(each.max() for each in off.values()) < 0.03


def with_column(number: int) -> Scene:
    """The still life, and a striped column at a place of its own."""
    stripes = Texture(seed=77, light_bgr=(0.7, 0.3, 0.3), dark_bgr=(0.2, 0.1, 0.4), shortest_m=0.01)
    column = Body("column", Box((0.15, 0.6, 0.1)), (-0.35 + 0.07 * number, -0.08, 1.0), stripes)
    return replace(still_life(), bodies=(*still_life().bodies, column))


def test_a_full_disk_keeps_the_model(walk: Path, tmp_path: Path) -> None:
    """A disk on which model.ply still fits, and the page no more: one line that says so, exit code 3, and the whole model."""
    out = tmp_path / "out"
    words = ["scan", walk / "left", walk / "right", "--calibration", walk / "rig.yaml", "--out", out]
    done = on_a_full_disk("phone_host.cli", list(map(str, words)), tmp_path, 700_000)
    assert done.returncode == 3
    assert f"{out / 'model.ply'} is written" in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
    assert len(surface_of(out / "model.ply")[1]) > 10_000


def test_ctrl_c_keeps_what_was_scanned(walk: Path, tmp_path: Path) -> None:
    """The model of the first three pairs, and a report that says so."""
    with pytest.raises(KeyboardInterrupt):
        scan_here(walk, tmp_path / "o", "matching 3")
    report = json.loads((tmp_path / "o" / "report.json").read_text())
    assert (report["interrupted_of"], report["in_model"]) == (5, 3)
    assert len(surface_of(tmp_path / "o" / "model.ply")[1]) == report["model"]["triangles"] > 5000


def test_a_box_behind_all_that_is_seen_is_no_model(
    walk: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """What is closed there was seen by nobody: the command says that nothing lies in the box, with exit code 4."""
    words = ["scan", walk / "left", walk / "right", "--calibration", walk / "rig.yaml", "--out", tmp_path / "o"]
    assert main([*map(str, words), "--box", "100x100x100@0,0,9000"]) == 4
    assert "warning: nothing of what the pairs show lies in the box: move or enlarge --box" in capsys.readouterr().out


def test_two_cameras_give_the_model_of_the_files(walk: Path, tmp_path: Path) -> None:
    """The same pictures from a board's camera and this machine's, shown on demand: the same bytes. At their end the user is told what goes on, and what to do next."""
    link = f"ipc://{tmp_path}/link"
    words = ["scan", "--link", link, "--camera", f"replay:{walk / 'right'}", "--calibration", str(walk / "rig.yaml")]
    with board(["run", "--camera", f"replay:{walk / 'left'}", "--link", link], tmp_path) as sender:
        with host([*words, "--pairs", "5", "--out", str(tmp_path / "live")], tmp_path) as receiver:
            assert receiver.wait() == 0
        sender.wait()
    assert "5 pairs in the model: all pairs have arrived, the model is being made" in receiver.stderr
    told = receiver.out.read_text()
    assert "try next" in told
    assert re.search(r"phone-host export \S*live --to ", told)
    scan_here(walk, tmp_path / "files")
    for name in ("model.ply", "trajectory.txt"):
        assert (tmp_path / "live" / name).read_bytes() == (tmp_path / "files" / name).read_bytes()
    report = json.loads((tmp_path / "live" / "report.json").read_text())
    assert (report["in_model"], report["verdict"], report["model"]["drift_included"]) == (5, "warning", False)


def test_the_example_scans_the_same(walk: Path, tmp_path: Path) -> None:
    """examples/scan_object.py tells the state of each pair, and leaves the model that the command makes of the same pictures."""
    link = f"ipc://{tmp_path}/link"
    with board(["run", "--camera", f"replay:{walk / 'left'}", "--link", link], tmp_path):
        words = [EXAMPLE, link, f"replay:{walk / 'right'}", walk / "rig.yaml", "around", "5"]
        command = [sys.executable, *map(str, words)]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False, timeout=100)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[:2] == ["pair 0: tracking", "pair 1: tracking"]
    scan_here(walk, tmp_path / "files")
    assert (tmp_path / "scan" / "model.ply").read_bytes() == (tmp_path / "files" / "model.ply").read_bytes()
