"""phone-host serve with a real board-agent: from nothing to depth through the page's API alone, and whatever comes between."""

import json
import signal
import socket
from http.client import HTTPException
from pathlib import Path
from urllib.error import HTTPError

import cv2
import numpy as np
import pytest

from common.keys import KeyFolder
from phone_host.model import CameraModel, Rig
from phone_host.output.rig_yaml import read_rig, write_rig
from phone_host.scene.scene_model import rig_poses
from phone_host.scene.scene_render import render
from phone_host.stereo.rectify import rectify_rig
from tests.support.board_films import board_films
from tests.support.enrolment_rig import on_every_network
from tests.support.page_client import page
from tests.support.plain_scenes import plane_scene
from tests.support.programs import board, host, ledgers, program, until
from tests.support.rigs import small_rig

DEPTH_M = 1.2
STILLS = 6


@pytest.fixture(scope="module")
def film(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with rig.yaml and films of a wall that stands 1.2 m away, square to the cameras."""
    matrix = np.array([[260.0, 0, 159.5], [0, 260.0, 119.5], [0, 0, 1]])
    model = CameraModel(width_px=320, height_px=240, matrix=matrix, distortion=np.zeros(5))
    rig = Rig(left=model, right=model, R_right_left=np.eye(3), t_right_left_m=np.array([-0.1, 0, 0]))
    folder = tmp_path_factory.mktemp("film")
    write_rig(folder / "rig.yaml", rig, rectify_rig(rig))
    for name, pose in zip(("left", "right"), rig_poses(rig), strict=True):
        (folder / name).mkdir()
        image = render(plane_scene(DEPTH_M), model, pose)
        for number in range(STILLS):
            cv2.imwrite(str(folder / name / f"{number}.png"), image, [cv2.IMWRITE_PNG_COMPRESSION, 1])
    return folder


def _theirs(film: Path, folder: Path) -> list[str]:
    return ["run", "--camera", f"replay:{film}/left?fps=15&loop=1", "--link", f"ipc://{folder}/link"]


def _mine(film: Path) -> str:
    return f"replay:{film}/right?fps=15&loop=1"


def test_from_nothing_to_depth_by_the_api_alone(film: Path, tmp_path: Path) -> None:
    """Find, set, check, run, tap, snapshot, stop and run again with another matcher; the settings stay, SIGTERM ends in order."""
    with board(_theirs(film, tmp_path), tmp_path), page(["serve", "127.0.0.1:0"], tmp_path) as (ours, client):
        assert client.state()["activity"] == "idle"
        assert client.do("run")["problem"] == "no board is chosen"
        assert "found" in client.do("find")["words"]
        wrong = client.do("set", camera="v4l2:/dev/video0?size=odd")
        assert wrong["problem"]
        assert wrong["remedy"]
        assert "no option" in client.do("set", colour="red")["problem"]
        client.do("set", link=f"ipc://{tmp_path}/link", camera=_mine(film))
        assert client.do("check") == {"words": "the check begins"}
        state = client.until_idle()
        assert state["trouble"] is None, state
        assert {each["grade"] for each in state["checks"]} <= {"ok", "warn"}
        assert "both cameras work" in client.step("check")["words"]
        client.do("set", calibration=f"{film}/rig.yaml", near="600")
        client.do("run")
        until(lambda: client.pairs() >= 5, "five pairs")
        tapped = client.post("/api/measure", {"points": [[120, 90], [200, 150]], "number": None})
        assert tapped["words"] == ""
        for place, sigma in zip(tapped["places_m"], tapped["place_sigmas_m"], strict=True):
            assert place[2] == pytest.approx(DEPTH_M, abs=max(4 * sigma, 0.01))
            assert 0 < sigma < 0.02
        assert tapped["length_m"] == pytest.approx(DEPTH_M / 260 * np.hypot(80, 60), abs=0.01)
        assert client.do("run")["problem"] == "a run is active"
        assert "next run" in client.do("set", matcher="sgbm")["words"]
        assert client.do("snapshot")["words"].endswith("pair-000000")
        assert client.do("stop") == {"words": "stopped"}
        client.do("run")
        until(lambda: client.state()["activity"] == "running" and client.pairs() >= 2, "the second run")
        assert client.state()["command"].endswith("--near 600") or "--matcher sgbm" in client.state()["command"]
        assert ours.stop() == 0
    saved = tmp_path / "data" / "tandemscan" / "snapshots" / "pair-000000"
    assert {path.name for path in saved.iterdir()} >= {"left.png", "right.png", "disparity.pfm", "cloud.ply"}
    file = tmp_path / "config" / "tandemscan" / "phone-host.toml"
    with program("phone_host.cli", ["settings", "--config", str(file), "--json"], tmp_path, "settings") as settings:
        assert settings.wait() == 0
    assert settings.json()["matcher"] == {"value": "sgbm", "origin": str(file)}


def test_a_board_that_comes_back_and_a_run_that_fails_leave_the_page_alive(film: Path, tmp_path: Path) -> None:
    """After SIGKILL and restart of the board the run goes on; a rig that is gone is told in words, and the next run works."""
    with page(["serve", "127.0.0.1:0"], tmp_path) as (ours, client):
        rig = tmp_path / "rig.yaml"
        rig.write_bytes((film / "rig.yaml").read_bytes())
        client.do("set", link=f"ipc://{tmp_path}/link", camera=_mine(film), calibration=str(rig))
        rig.unlink()
        client.do("run")
        assert "rig.yaml" in client.until_idle()["trouble"]["problem"]
        client.do("set", calibration=f"{film}/rig.yaml")
        client.do("run")
        with board(_theirs(film, tmp_path), tmp_path, "board1") as first:
            until(lambda: client.pairs() >= 3, "pairs of the first session")
            first.send(signal.SIGKILL)
            first.wait()
        before = client.pairs()
        with board(_theirs(film, tmp_path), tmp_path, "board2"):
            until(lambda: client.pairs() >= before + 3, "pairs of the second session")
        assert client.state()["activity"] == "running"
        assert client.state()["trouble"] is None
        assert ours.stop(signal.SIGINT) == 130


def test_a_page_beside_a_run_changes_no_bit(film: Path, tmp_path: Path) -> None:
    """The same stills give the same disparity with and without --serve and a busy viewer, and every delay adds up; the page takes snapshots and stops the run."""
    for name, more in (("plain", []), ("served", ["--serve", "127.0.0.1:0"])):
        folder = tmp_path / name
        folder.mkdir()
        link = ["--link", f"ipc://{folder}/link"]
        ours = ["run", *link, "--camera", f"replay:{film}/right", "--calibration", f"{film}/rig.yaml"]
        ours += ["--out", str(folder / "out"), "--save-every", "1", *more]
        theirs = ["run", "--camera", f"replay:{film}/left", *link]
        if not more:
            with board(theirs, folder), host(ours, folder) as running:
                assert running.wait() == 0, running.stderr
            continue
        with page(ours, folder) as (running, client), board(theirs, folder):
            while running.process.poll() is None:
                try:
                    client.state()
                    client.get("/api/cloud.ply")
                except (OSError, HTTPException):  # no pair yet, or the run has ended
                    continue
            assert running.wait() == 0, running.stderr
    plain, served = (tmp_path / name / "out" for name in ("plain", "served"))
    for number in range(STILLS):
        of_both = [(out / f"pair-{number:06d}" / "disparity.pfm").read_bytes() for out in (plain, served)]
        assert of_both[0] == of_both[1]
    assert len(ledgers(served)) == STILLS
    for ledger in ledgers(served):
        delays = ("capture_ns", "outbox_ns", "propagation_ns", "pairing_ns", "queuing_ns", "processing_ns")
        assert sum(ledger[name] for name in delays) == ledger["end_to_end_ns"]
    link = ["--link", f"ipc://{tmp_path}/link"]
    again = ["run", *link, "--camera", _mine(film), "--calibration", f"{film}/rig.yaml", "--out", str(served), "--json"]
    with (
        board(_theirs(film, tmp_path), tmp_path),
        page([*again, "--serve", "127.0.0.1:0"], tmp_path, "live") as (live, client),
    ):
        until(lambda: client.pairs() >= 2, "two pairs")
        assert "command line" in client.do("set", near="600")["problem"]
        assert client.do("snapshot")["words"].endswith("snapshots/pair-000000")
        assert client.do("stop") == {"words": "it is ending"}
        assert live.wait() == 0
    assert live.json()["ended"] == "stopped"
    assert (served / "snapshots" / "pair-000000" / "cloud.ply").exists()


def test_a_live_calibration_by_the_api_becomes_the_rig_of_the_next_run(tmp_path: Path) -> None:
    """Views of a rendered board: the guide is in the state, rig.yaml is written as `calibrate --live` does, and chosen."""
    board_films(tmp_path)
    theirs = ["run", "--camera", f"replay:{tmp_path}/left?fps=10&loop=1", "--link", f"ipc://{tmp_path}/link"]
    with board(theirs, tmp_path), page(["serve", "127.0.0.1:0"], tmp_path) as (ours, client):
        client.do("set", link=f"ipc://{tmp_path}/link", camera=f"replay:{tmp_path}/right?fps=10&loop=1")
        client.do("calibrate", square="25mm", views="5")
        until(lambda: (client.state()["guide"] or {}).get("views", 0) >= 1, "the first view")
        cameras = client.state()["guide"]["cameras"]
        assert all(sum(map(sum, cameras[side]["cells"])) > 0 for side in ("left", "right"))
        pictures = [
            cv2.imdecode(np.frombuffer(client.get(f"/api/{side}.jpg"), np.uint8), 0) for side in ("left", "right")
        ]
        assert all(picture is not None and picture.std() > 10 for picture in pictures)
        state = client.until_idle()
        with pytest.raises(HTTPError):  # they were no pairs of a run
            client.get("/api/left.jpg")
        assert state["trouble"] is None, state["trouble"]
        assert "verdict usable" in state["guide"]["result"]
        rig = tmp_path / "data" / "tandemscan" / "rig" / "rig.yaml"
        assert state["settings"]["calibration"] == str(rig)
        assert ours.stop() == 0
    true_m = float(np.linalg.norm(small_rig().t_right_left_m))
    assert float(np.linalg.norm(read_rig(rig).t_right_left_m)) == pytest.approx(true_m, rel=0.02)
    assert json.loads((rig.parent / "report.json").read_text())["command"] == "calibrate"


def test_a_board_is_enrolled_by_its_code(tmp_path: Path) -> None:
    """A wrong code is told with its remedy; with the one that `board-agent pair` shows, both know each other, and the board is chosen."""
    keys = tmp_path / "page-keys"
    with (
        on_every_network(tmp_path) as rig,
        page(["serve", "127.0.0.1:0", "--keys", str(keys)], tmp_path) as (_, client),
    ):
        assert "digits" in client.do("enrol", link=rig.link, code="12")["remedy"]
        with program("board_agent.cli", ["pair", "--keys", rig.board_keys], tmp_path, "owner") as owner:
            until(lambda: "type this code" in owner.out.read_text(), "the code is shown")
            told = client.do("enrol", link=rig.link, code=owner.out.read_text().split()[-1])
        assert told == {"words": "the board is enrolled"}
        assert client.state()["settings"]["link"] == rig.link
    assert [peer.address for peer in KeyFolder(keys).peers()] == [rig.link]


def test_the_page_of_a_run_is_served_to_other_machines_too(tmp_path: Path) -> None:
    """By https, with the fingerprint to compare; --lan without a page is refused."""
    run = ["run", "--link", f"ipc://{tmp_path}/link", "--camera", "replay:missing", "--lan"]
    with (
        host([*run, "--serve", "127.0.0.1:0"], tmp_path, "served") as served,
        host(run, tmp_path, "alone") as alone,
        host([*run[:-1], "--serve", "banana"], tmp_path, "strange") as strange,
    ):
        assert (served.wait(), alone.wait(), strange.wait()) == (3, 2, 2)
    assert "phone-host: the page: https://127.0.0.1:" in served.stderr
    assert "fingerprint (SHA-256)" in served.stderr
    assert alone.stderr.splitlines()[-1].endswith("--lan without --serve: add --serve, or leave it out")
    assert "'banana' is not an address that only this machine reaches: give" in strange.stderr.splitlines()[-1]


def test_two_pages_on_one_settings_file_lose_nothing(tmp_path: Path) -> None:
    """What either sets is in the file, a value that one takes back is gone, and a file that is a link stays one."""
    (tmp_path / "dotfiles").mkdir()
    real, link = tmp_path / "dotfiles" / "host.toml", tmp_path / "host.toml"
    real.write_text('# mine\ntolerance = "5ms"\n')
    link.symlink_to(real)
    arguments = ["serve", "127.0.0.1:0", "--config", str(link)]
    with page(arguments, tmp_path, "one") as (_, one), page(arguments, tmp_path, "two") as (_, two):
        assert "set" in one.do("set", link="tcp://127.0.0.1:1")["words"]
        assert "set" in two.do("set", board_side="right")["words"]
        assert "set" in one.do("set", matcher="block")["words"]
        assert "removed" in two.do("set", board_side="")["words"]
        assert "set" in two.do("set", fifo="2")["words"]
    assert link.is_symlink()
    text = real.read_text()
    assert text.startswith("# mine\n")
    for line in ("tcp://127.0.0.1:1", "block", "fifo", "tolerance"):
        assert line in text, text
    assert "right" not in text


def test_a_settings_file_that_links_to_itself_is_told(tmp_path: Path) -> None:
    """A choice cannot be kept in it: one line names the file and the remedy, and the page lives on."""
    link = tmp_path / "host.toml"
    link.symlink_to(link)
    with page(["serve", "127.0.0.1:0", "--config", str(link)], tmp_path, "one") as (serving, one):
        assert f"settings file {link} cannot be written" in json.dumps(one.do("set", matcher="block"))
        assert "Traceback" not in serving.stderr


def test_a_port_that_is_taken_is_told_with_the_remedy(tmp_path: Path) -> None:
    """Exit 3, one line."""
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with host(["serve", f"127.0.0.1:{port}"], tmp_path, "taken") as first:
            assert first.wait() == 3
    assert f"port {port} of 127.0.0.1 is taken: " in first.stderr.splitlines()[-1]
