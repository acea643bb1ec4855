"""The page before the real programs: phone-host serve and run --serve, board-agent, rendered films; depth against the truth."""

import re
import signal
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from common.recording.opened import open_recorded
from phone_host.model import CameraModel, Rig
from phone_host.output.model_file import read_model
from phone_host.output.rig_yaml import write_rig
from phone_host.scene.scene_model import rig_poses
from phone_host.scene.scene_render import render
from phone_host.stereo.rectify import rectify_rig
from tests.support.numbered import BITS, write_film
from tests.support.page_client import PageClient, page
from tests.support.plain_scenes import plane_scene
from tests.support.programs import board, until
from tests.web.conftest import PHONE

DEPTH_M = 1.2
FOCAL_PX = 260.0


@pytest.fixture(scope="module")
def wall(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A rig and films of a wall that stands 1.2 m away, square to the cameras."""
    matrix = np.array([[FOCAL_PX, 0, 159.5], [0, FOCAL_PX, 119.5], [0, 0, 1]])
    model = CameraModel(width_px=320, height_px=240, matrix=matrix, distortion=np.zeros(5))
    rig = Rig(left=model, right=model, R_right_left=np.eye(3), t_right_left_m=np.array([-0.1, 0, 0]))
    folder = tmp_path_factory.mktemp("wall")
    write_rig(folder / "rig.yaml", rig, rectify_rig(rig))
    for name, pose in zip(("left", "right"), rig_poses(rig), strict=True):
        (folder / name).mkdir()
        image = render(plane_scene(DEPTH_M), model, pose)
        for number in range(3):
            cv2.imwrite(str(folder / name / f"{number}.png"), image, [cv2.IMWRITE_PNG_COMPRESSION, 1])
    return folder


def use(shown: Any, step: str, field: str, words: str) -> None:
    """Type an address into a step's field, and have it taken."""
    shown.evaluate("step => { location.hash = step; }", step)
    shown.fill(f"#{field}-typed", words)
    shown.press(f"#{field}-typed", "Enter")
    shown.wait_for_function("field => document.getElementById(`${field}-answer`).textContent !== ''", arg=field)
    assert "bad" not in shown.get_attribute(f"#{field}-answer", "class"), shown.text_content(f"#{field}-answer")


def number_at(shown: Any, side: str) -> int:
    """Read the number that a numbered image shows, from the page's own pixels."""
    levels = shown.evaluate(
        f"""side => {{ const c = document.getElementById(side), pen = c.getContext('2d'), by = c.width / 160;
        return [...Array({BITS}).keys()].map(bit => pen.getImageData(Math.round((bit * 12 + 6) * by), Math.round(6 * by), 1, 1).data[0]); }}""",
        side,
    )
    return sum(1 << bit for bit, level in enumerate(levels) if level > 128)


def _scan(shown: Any) -> None:
    """Scan the wall until it is on the page, and save it."""
    shown.evaluate("location.hash = 'scan'")
    shown.click("#scan-go")
    shown.wait_for_function("() => +document.getElementById('scan-model').dataset.parts > 0")
    shown.click("#scan-go")
    shown.wait_for_selector("#scan-saved:not([hidden])")
    with shown.expect_download() as saved:
        shown.click("#scan-files a >> text=model.ply")
    assert Path(saved.value.path()).read_bytes().startswith(b"ply\n")


def test_from_nothing_to_true_depth_on_the_page_alone(browser: Any, wall: Path, tmp_path: Path) -> None:
    """Typed addresses, Start, a tap: 1.2 m. The board dies and comes back: pairs go on without a touch. A scan is made and saved. The host ends: the page says so."""
    theirs = ["run", "--camera", f"replay:{wall}/left?fps=10&loop=1", "--link", f"ipc://{tmp_path}/link"]
    shown = browser.new_page(viewport=PHONE)
    shown.set_default_timeout(60_000)
    errors: list[str] = []
    shown.on("pageerror", lambda error: errors.append(str(error)))
    with page(["serve", "127.0.0.1:0"], tmp_path) as (ours, client):
        with board(theirs, tmp_path, "board1") as first:
            shown.goto(client.url)
            shown.wait_for_selector("#panel-board:not([hidden])")
            use(shown, "board", "link", f"ipc://{tmp_path}/link")
            use(shown, "camera", "camera", f"replay:{wall}/right?fps=10&loop=1")
            use(shown, "calibration", "calibration", f"{wall}/rig.yaml")
            shown.evaluate("location.hash = 'run'")
            shown.click("#go")
            shown.wait_for_selector("#views[data-pair]")
            box = shown.locator("#map-frame").bounding_box()
            shown.mouse.click(box["x"] + 0.4 * box["width"], box["y"] + 0.4 * box["height"])
            shown.wait_for_selector("#readout[data-from=program]")
            found = re.match(r"distance ([\d.]+) mm ± ([\d.]+) mm", shown.text_content("#readout"))
            assert found, shown.text_content("#readout")
            x, y = 0.4 * 320 - 160, 0.4 * 240 - 120
            truth_mm = 1000 * DEPTH_M * np.sqrt(1 + (x**2 + y**2) / FOCAL_PX**2)
            assert float(found[1]) == pytest.approx(truth_mm, rel=0.02)
            first.send(signal.SIGKILL)
            first.wait()
        before = int(shown.get_attribute("#views", "data-pair"))
        with board(theirs, tmp_path, "board2"):
            shown.wait_for_function("was => +document.querySelector('#views').dataset.pair > was + 2", arg=before)
            shown.click("#snapshot")
            shown.wait_for_function("() => document.querySelector('#run-answer').textContent.includes('pair-')")
            shown.click("#record")
            shown.wait_for_function("() => /: 0:0[1-9]/.test(document.querySelector('#recording').textContent)")
            shown.reload()
            shown.wait_for_selector("#views[data-pair]")
            shown.wait_for_selector("#recording[data-on=yes]")
            shown.click("#go")
            shown.wait_for_function("() => document.querySelector('#go').textContent === 'Start'")
            _scan(shown)
        assert ours.stop() == 0
        shown.wait_for_selector("body[data-line=ended]")
    assert errors == []
    shown.close()
    [scan] = (tmp_path / "data" / "tandemscan" / "scans").iterdir()
    assert {path.name for path in scan.iterdir()} >= {"model.ply", "trajectory.txt", "report.json", "index.html"}
    points_m = read_model(scan, "m").solid.points_mm / 1000
    assert np.median(points_m[:, 2]) == pytest.approx(DEPTH_M, rel=0.02)
    [recording] = (tmp_path / "data" / "tandemscan" / "recordings").glob("*.mcap")
    recorded = open_recorded(recording)  # the run has ended it
    assert recorded.is_complete
    assert all(len(images) > 3 for images in recorded.images.values())
    assert {"rig.yaml", "settings.json", "cameras.json"} <= recorded.attachments.keys()


def _recorded(client: PageClient) -> int:
    """Frames in the recording that goes on; 0 also while the newest snapshot is from before its start."""
    live = client.state()["live"] or {}
    return int((live.get("recording") or {"frames": 0})["frames"])


def test_the_pairs_on_the_page_beside_a_run_are_pairs(browser: Any, tmp_path: Path) -> None:
    """Both pictures carry their frame's number: on the page they always show the same one, as the run pairs them."""
    film = write_film(tmp_path / "film", 24)
    ours = ["run", "--link", f"ipc://{tmp_path}/link", "--camera", f"replay:{film}?fps=8&loop=1", "--rectified"]
    ours += ["--disparities", "16", "--serve", "127.0.0.1:0"]
    theirs = ["run", "--camera", f"replay:{film}?fps=8&loop=1", "--link", f"ipc://{tmp_path}/link"]
    shown = browser.new_page(viewport={"width": 1200, "height": 800})
    shown.set_default_timeout(60_000)
    with page(ours, tmp_path) as (running, client), board(theirs, tmp_path):
        shown.goto(client.url)
        seen = []
        for _ in range(6):
            was = shown.get_attribute("#views", "data-pair")
            shown.wait_for_function(
                "was => document.querySelector('#views').dataset.pair && document.querySelector('#views').dataset.pair !== was",
                arg=was,
            )
            seen.append(shown.evaluate("() => document.querySelector('#views').dataset.pair"))
            left, right = number_at(shown, "left"), number_at(shown, "right")
            if shown.get_attribute("#views", "data-pair") == seen[-1]:
                assert left == right
        assert len(set(seen)) == 6
        assert client.do("record")["words"].startswith("recording to ")
        assert client.do("record")["problem"] == "a recording is going on"
        until(lambda: _recorded(client) > 2, "recorded frames")
        assert "recorded: " in client.do("end_recording")["words"]
        assert client.do("end_recording")["words"] == "nothing is recorded"
        shown.wait_for_selector("#trust[data-level=bad], #trust[data-level=warning]")  # twice the same image
        assert "same" in shown.text_content("#trust").lower()
        running.stop(signal.SIGKILL)
        shown.wait_for_selector("body[data-line=lost]")
        assert "Connection lost" in shown.text_content("#headline")
    shown.close()
