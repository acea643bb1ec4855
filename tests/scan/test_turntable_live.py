"""A thing that turns before two cameras in real processes, and Ctrl-C in the middle."""

import json
import math
import signal
from pathlib import Path

import cv2
import numpy as np

from phone_host.output.meshes.ply_mesh import read_ply_mesh
from tests.support.programs import board, host, until
from tests.support.turning_things import Size, photographed, turned_scene

SIZE = Size(320, 240, 420.0, 0.06)
TURNS_DEG = (0, 11, 22, 33, 44, 55, 44, 33, 22, 11)


def film(folder: Path) -> None:
    """Turned forth and back, so that it may be joined anywhere; then somebody pushes the table."""
    turns = [turned_scene(math.radians(degrees)) for degrees in TURNS_DEG]
    pushed = turned_scene(1.0, table_turns=True)
    for side in ("left", "right"):
        (folder / side).mkdir()
    for number, scene in enumerate((*turns, pushed)):
        pair = photographed(scene, SIZE, number)
        for side, image in (("left", pair.left), ("right", pair.right)):
            cv2.imwrite(str(folder / side / f"{number:02}.png"), image)


def test_ctrl_c_keeps_a_turn_that_was_scanned_live(tmp_path: Path) -> None:
    """The closed model of the pairs so far, with its field, and exit code 130; the report says how far it has turned."""
    film(tmp_path)
    link, out, film_of = f"ipc://{tmp_path}/link", tmp_path / "out", "replay:{}?fps=2&loop=1"
    words = ["scan", "--turntable", "--link", link, "--camera", film_of.format(tmp_path / "right"), "--out", str(out)]
    rig = ["--rectified", "--focal", "420", "--baseline", "60", "--disparities", "96", "--voxel", "2mm"]
    with (
        board(["run", "--camera", film_of.format(tmp_path / "left"), "--link", link], tmp_path),
        host([*words, *rig], tmp_path) as scanning,
    ):
        until(lambda: scanning.stderr.count("the background moves, too") >= 2, "the film was shown once")
        scanning.send(signal.SIGINT)
        assert scanning.wait() == 130
    report = json.loads((out / "report.json").read_text())
    assert report["in_model"] >= 8
    assert "field.bin" in report["files"]
    assert any("the object has turned by" in warning for warning in report["warnings"])
    mesh = read_ply_mesh((out / "model.ply").read_bytes(), "model.ply", 1.0)
    seen = mesh.points_m[mesh.seen].astype(np.float64)
    assert len(seen) > 1000
