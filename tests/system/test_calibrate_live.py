"""phone-host calibrate --live with real processes: views of a rendered board over a real link become a calibration."""

import json
import re
import signal
from pathlib import Path

import cv2
import numpy as np
import pytest

from phone_host.geometry.se3 import SE3
from phone_host.model import Side
from phone_host.output.rig_yaml import read_rig
from tests.support.board_films import FPS as _FPS
from tests.support.board_films import SECONDS as _SECONDS
from tests.support.board_films import board_films
from tests.support.novice.hands import motion
from tests.support.novice.painter import Moment, Painter
from tests.support.novice.scene import BOARDS, board_of, novice_scene
from tests.support.programs import board, host, until
from tests.support.rigs import small_rig


def _marked_films(folder: Path, poses: list[list[float]]) -> None:
    """Two films of a ChArUco board in some poses, each still for a while. Parts of it lie outside the images."""
    scene, charuco = novice_scene(1), board_of("charuco")
    right = SE3(scene.rig.R_right_left, scene.rig.t_right_left_m)
    for side, to_camera in ((Side.LEFT, SE3.identity()), (Side.RIGHT, right)):
        (folder / side.value).mkdir(parents=True)
        painter = Painter(scene.eye(side), charuco, 1)
        for number, pose in enumerate(poses):
            moment = Moment(to_camera @ motion(np.array(pose), charuco.points_m().mean(axis=0)))
            image = cv2.imencode(".jpg", painter.paint((moment, moment)))[1].tobytes()
            for frame in range(round(_SECONDS * _FPS)):
                (folder / side.value / f"{number * 100 + frame}.jpg").write_bytes(image)


def _live(folder: Path, *options: str) -> list[str]:
    camera = f"replay:{folder}/right?fps={_FPS}&loop=1"
    out = folder / "rig" / "rig.yaml"
    given = ["--link", f"ipc://{folder}/link", "--camera", camera, "--square", "25mm", "--no-sound", "--out", str(out)]
    return ["calibrate", "--live", *given, *options]


@pytest.fixture
def films(tmp_path: Path) -> Path:
    """A folder with both films."""
    board_films(tmp_path)
    return tmp_path


def test_views_are_taken_by_themselves_and_make_a_rig(films: Path) -> None:
    """Five views over a real link: each told at once, saved as a picture, calibrated from; the summary says how to do that again."""
    theirs = ["run", "--camera", f"replay:{films}/left?fps={_FPS}&loop=1", "--link", f"ipc://{films}/link"]
    with (
        board(theirs, films),
        host(_live(films, "--views", "5", "--json", "--snapshots", f"{films}/shown"), films) as ours,
    ):
        assert ours.wait() == 0, ours.stderr
    told = re.findall(r"^(taken: \d|say: .*|so far: .*)", ours.stderr, re.MULTILINE)
    assert [line for line in told if line.startswith("taken")] == [f"taken: {view}" for view in range(1, 6)]
    assert "say: taken, 1" in told
    assert told[-1] == "say: done: verdict usable"
    report = ours.json()
    assert (report["live"]["ended"], report["live"]["views"], report["pairs"]["used"]) == ("enough views", 5, 5)
    assert report["board"]["inner_corners"] == "9x6"
    baseline_m = float(np.linalg.norm(small_rig().t_right_left_m))
    rig = read_rig(films / "rig" / "rig.yaml")
    assert float(np.linalg.norm(rig.t_right_left_m)) == pytest.approx(baseline_m, rel=0.02)
    assert rig.left_camera is not None
    names = {f"{view:02}.png" for view in range(1, 6)}
    for side in ("left", "right"):
        assert {path.name for path in (films / "rig" / "views" / side).glob("*.png")} == names
    shown = json.loads((films / "shown" / "guide.json").read_text())
    assert (shown["state"], shown["views"], shown["verdict"]) == ("enough views", 5, "usable")
    assert (films / "shown" / "guide.svg").read_text().startswith("<svg")


def test_parts_of_a_marked_board_are_views_and_a_rig_takes_more_of_them(tmp_path: Path) -> None:
    """A ChArUco board, half of it in the picture, makes a rig of five views; `--from` knows the board and adds three others."""
    flat, there = [0.05, 0.0, 0.36], tmp_path / "rig" / "rig.yaml"
    films = {
        "first": [
            [*flat, 0.5, 0, 0],
            [*flat, -0.5, 0, 0],
            [*flat, 0, 0.5, 0],
            [*flat, 0, -0.5, 0],
            [0.05, 0, 0.5, 0, 0, 0],
        ],
        "more": [[0.16, 0.08, 0.36, 0.4, 0.3, 0.3], [-0.04, -0.08, 0.36, -0.4, 0, 0.2], [0.15, -0.1, 0.4, 0, 0.5, 0.1]],
    }
    rigs = []
    for name, count, options in (("first", 5, ["--board", BOARDS["charuco"]]), ("more", 3, ["--from", str(there)])):
        folder = tmp_path / name
        _marked_films(folder, films[name])
        theirs = ["run", "--camera", f"replay:{folder}/left?fps={_FPS}&loop=1", "--link", f"ipc://{folder}/link"]
        ours_camera = f"replay:{folder}/right?fps={_FPS}&loop=1"
        live = [
            "calibrate",
            "--live",
            "--link",
            f"ipc://{folder}/link",
            "--camera",
            ours_camera,
            "--no-sound",
            "--json",
        ]
        live += [*options, "--views", str(count), "--out", str(there), f"{folder}/views/left", f"{folder}/views/right"]
        with board(theirs, folder), host(live, folder) as ours:
            assert ours.wait() in {0, 4}, ours.stderr
        report = ours.json()
        assert report["live"]["views"] == count, ours.stderr
        rigs.append(report)
    assert rigs[0]["board"]["from"] == "option"
    assert rigs[1]["board"]["from"] == "earlier calibration"
    assert [rig["pairs"]["used"] for rig in rigs] == [5, 8]
    true_mm = float(np.linalg.norm(novice_scene(1).rig.t_right_left_m)) * 1e3
    assert rigs[1]["baseline_mm"] == pytest.approx(true_mm, rel=0.02)


def test_a_stop_before_the_fifth_view_gives_no_rig(films: Path) -> None:
    """Ctrl-C ends it at once with exit 130; what was taken stays."""
    theirs = ["run", "--camera", f"replay:{films}/left?fps={_FPS}&loop=1", "--link", f"ipc://{films}/link"]
    with board(theirs, films), host(_live(films, "--board", "9x6"), films) as ours:
        until(lambda: "taken: 1" in ours.stderr, "the first view")
        assert ours.stop(signal.SIGINT) == 130
    assert (films / "rig" / "views" / "left" / "01.png").exists()
    told = ours.stderr.replace("\n", " ")
    assert re.search(rf"no rig: only \d views? taken.*, kept in {films}/rig/views/left", told)
    assert not (films / "rig" / "rig.yaml").exists()
