"""phone-host calibrate --live with real processes: views of a rendered board over a real link become a calibration."""

import json
import re
import signal
from pathlib import Path

import cv2
import numpy as np
import pytest

from phone_host.output.rig_yaml import read_rig
from tests.support.boards import BOARD, render_pair
from tests.support.programs import board, host, until
from tests.support.rigs import small_rig

_SECONDS: float = 1.2
_FPS = 10


def _films(folder: Path) -> None:
    """Two films of a board that is tilted four ways, each still for a while."""
    tilts = ((0.5, 0.0), (-0.5, 0.0), (0.0, 0.5), (0.0, -0.5))
    middle = BOARD.points_m().mean(axis=0)
    numbers = iter(range(1000))
    for side in ("left", "right"):
        (folder / side).mkdir()
    for across, down in tilts:
        turn = np.array([-down, across, 0.0])
        pose = np.concatenate([turn, np.array([0.03, 0.0, 0.5]) - cv2.Rodrigues(turn)[0] @ middle])
        pair = [cv2.imencode(".jpg", image)[1].tobytes() for image in render_pair(small_rig(), pose)]
        for _ in range(round(_SECONDS * _FPS)):
            number = next(numbers)
            for side, image in zip(("left", "right"), pair, strict=True):
                (folder / side / f"{number}.jpg").write_bytes(image)


def _live(folder: Path, *options: str) -> list[str]:
    camera = f"replay:{folder}/right?fps={_FPS}&loop=1"
    out = folder / "rig" / "rig.yaml"
    given = ["--link", f"ipc://{folder}/link", "--camera", camera, "--square", "25mm", "--no-sound", "--out", str(out)]
    return ["calibrate", "--live", *given, *options]


@pytest.fixture
def films(tmp_path: Path) -> Path:
    """A folder with both films."""
    _films(tmp_path)
    return tmp_path


def test_views_are_taken_by_themselves_and_make_a_rig(films: Path) -> None:
    """Four views over a real link: each told at once, saved as a picture, calibrated from; the summary says how to do that again."""
    theirs = ["run", "--camera", f"replay:{films}/left?fps={_FPS}&loop=1", "--link", f"ipc://{films}/link"]
    with (
        board(theirs, films),
        host(_live(films, "--views", "4", "--json", "--snapshots", f"{films}/shown"), films) as ours,
    ):
        assert ours.wait() == 0, ours.stderr
    told = re.findall(r"^(taken: \d|say: .*|so far: .*)", ours.stderr, re.MULTILINE)
    assert [line for line in told if line.startswith("taken")] == [f"taken: {view}" for view in (1, 2, 3, 4)]
    assert "say: hold still" in told
    assert told[-1] == "say: done: verdict usable"
    report = ours.json()
    assert (report["live"]["ended"], report["live"]["views"], report["pairs"]["used"]) == ("enough views", 4, 4)
    assert report["board"]["inner_corners"] == "9x6"
    baseline_m = float(np.linalg.norm(small_rig().t_right_left_m))
    rig = read_rig(films / "rig" / "rig.yaml")
    assert float(np.linalg.norm(rig.t_right_left_m)) == pytest.approx(baseline_m, rel=0.02)
    assert rig.left_camera is not None
    names = {f"{view:02}.png" for view in (1, 2, 3, 4)}
    for side in ("left", "right"):
        assert {path.name for path in (films / "rig" / "views" / side).glob("*.png")} == names
    shown = json.loads((films / "shown" / "guide.json").read_text())
    assert (shown["state"], shown["views"], shown["verdict"]) == ("enough views", 4, "usable")
    assert (films / "shown" / "guide.svg").read_text().startswith("<svg")


def test_a_stop_before_the_third_view_gives_no_rig(films: Path) -> None:
    """Ctrl-C ends it at once with exit 130; what was taken stays."""
    theirs = ["run", "--camera", f"replay:{films}/left?fps={_FPS}&loop=1", "--link", f"ipc://{films}/link"]
    with board(theirs, films), host(_live(films, "--board", "9x6"), films) as ours:
        until(lambda: "taken: 1" in ours.stderr, "the first view")
        assert ours.stop(signal.SIGINT) == 130
    assert (films / "rig" / "views" / "left" / "01.png").exists()
    assert not (films / "rig" / "rig.yaml").exists()
