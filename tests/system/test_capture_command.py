"""A camera's film is checked by `doctor --capture` and on the page, with a film of a camera that is turned by hand."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from phone_host.doctor.camera_check.words import CHECK_AGAIN
from phone_host.geometry.se3 import rotations_of
from phone_host.model import CameraModel, Rig
from phone_host.output.rig_yaml import write_rig
from phone_host.stereo.rectify import rectify_rig
from tests.support.page_client import page
from tests.support.programs import until

_FPS, _LOOP = 30, 120


@pytest.fixture(scope="module")
def film(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with rig.yaml and a film of 4 s, in a loop: a far, spotted wall before an ideal camera that is turned to and fro, up and down."""
    folder = tmp_path_factory.mktemp("film")
    matrix = np.array([[280.0, 0, 159.5], [0, 280.0, 119.5], [0, 0, 1]])
    model = CameraModel(width_px=320, height_px=240, matrix=matrix, distortion=np.zeros(5))
    rig = Rig(left=model, right=model, R_right_left=np.eye(3), t_right_left_m=np.array([-0.1, 0, 0]))
    write_rig(folder / "rig.yaml", rig, rectify_rig(rig))
    (folder / "film").mkdir()
    spots = np.random.default_rng(1).integers(0, 255, (160, 200), np.uint8)
    wall = cv2.GaussianBlur(cv2.resize(spots, (800, 640), interpolation=cv2.INTER_CUBIC), (0, 0), 1.0)
    shift = np.array([[1.0, 0, -240], [0, 1, -200], [0, 0, 1]])  # the wall is larger than the picture
    for number in range(_LOOP):
        angle = 2 * np.pi * number / _LOOP
        turn = rotations_of(np.array([0.05 * np.sin(2 * angle), 0.08 * np.sin(3 * angle), 0.02 * np.sin(5 * angle)]))
        seen = cv2.warpPerspective(wall, matrix @ turn @ np.linalg.inv(matrix) @ shift, (320, 240))
        cv2.imwrite(str(folder / "film" / f"{number:03d}.jpg"), seen)
    return folder


def _started(film: Path, *arguments: str) -> "subprocess.Popen[str]":
    """Start the doctor with the film. The user's data lie beside the film."""
    camera = f"replay:{film}/film?fps={_FPS}&loop=1&pace=clock"
    command = [sys.executable, "-P", "-m", "phone_host.cli", "doctor", "--json", "--camera", camera, *arguments]
    own = {**os.environ, "XDG_DATA_HOME": str(film / "data")}
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=own)


def _ended(process: "subprocess.Popen[str]") -> tuple[dict[str, Any], str]:
    """Return its JSON and what it told on the way."""
    with process:
        found, told = process.communicate(timeout=300)
    assert "Traceback" not in told
    return json.loads(found) if found else {}, told


def doctor(film: Path, *arguments: str) -> tuple[dict[str, Any], str]:
    """Run the doctor with the film; return its JSON and what it told on the way."""
    return _ended(_started(film, *arguments))


@pytest.fixture(scope="module")
def captures(film: Path) -> list[tuple[dict[str, Any], str]]:
    """Two checks of ten seconds, side by side: with the calibration, and before there is one."""
    begun = [_started(film, *words, "--capture", "10") for words in (("--calibration", str(film / "rig.yaml")), ())]
    return [_ended(process) for process in begun]


def test_a_film_is_checked_and_kept_beside_the_rig(film: Path, captures: list[tuple[dict[str, Any], str]]) -> None:
    """The user is led through it; an ideal camera's film is rigid, with no rolling shutter; the next doctor knows."""
    found, told = captures[0]
    checks = {check["what"]: check for check in found["checks"]}
    assert checks["stabilisation"]["verdict"] == "ok", found["capture"]
    assert "global" in checks["shutter"]["finding"]
    assert found["capture"] == json.loads((film / "capture.json").read_text(encoding="utf-8"))
    assert found["capture"]["rigidity"]["knows_lens"] is True
    assert "hold the camera still" in told
    assert "turn it a little" in told
    again, _ = doctor(film, "--calibration", str(film / "rig.yaml"))
    (kept,) = (check["finding"] for check in again["checks"] if check["what"] == "capture")
    assert kept.startswith("checked: none seen")


def test_a_film_is_checked_before_the_calibration_and_kept_among_the_users_data(
    film: Path, captures: list[tuple[dict[str, Any], str]], tmp_path: Path
) -> None:
    """Without a calibration the next doctor knows of the check, too; with one that has none beside it, another is asked for."""
    found, _ = captures[1]
    kept = film / "data" / "tandemscan" / "capture.json"
    assert found["capture"] == json.loads(kept.read_text(encoding="utf-8"))
    assert found["capture"]["rigidity"]["knows_lens"] is False
    (judged,) = (each for each in found["checks"] if each["what"] == "stabilisation")
    again, _ = doctor(film)
    (known,) = (each for each in again["checks"] if each["what"] == "capture")
    assert (known["verdict"], known["finding"]) == (judged["verdict"], f"checked: {judged['finding']}")
    # Without the lens, some stretches of this film look warped: whether enough are among those that were filmed is chance.
    found["capture"]["rigidity"] |= {"warping": "good", "unseen": None}
    kept.write_text(json.dumps(found["capture"]), encoding="utf-8")
    rig = shutil.copy(film / "rig.yaml", tmp_path)
    late, _ = doctor(film, "--calibration", str(rig))
    (known,) = (each for each in late["checks"] if each["what"] == "capture")
    assert (known["verdict"], known["remedy"]) == ("warn", CHECK_AGAIN)


def test_a_check_needs_a_camera_with_a_clock(film: Path, tmp_path: Path) -> None:
    """Without --camera, with half a second, or with stills, one line says what to do."""
    assert doctor(film, "--capture", "0.5")[1].startswith("phone-host: error: --capture is 0.5")
    stills = [sys.executable, "-P", "-m", "phone_host.cli", "doctor", "--capture", "--camera", f"replay:{film}/film"]
    done = subprocess.run(stills, capture_output=True, text=True, check=False, timeout=60, cwd=tmp_path)
    assert done.returncode == 4
    assert "on demand" in done.stderr


def test_the_page_leads_through_the_check_and_can_stop_it(film: Path, tmp_path: Path) -> None:
    """The page says what to do now; Stop ends it, nothing is kept, and the page is idle."""
    with page(["serve", "127.0.0.1:0"], tmp_path) as (_, client):
        assert "no camera" in client.do("capture")["problem"]
        client.do("set", camera=f"replay:{film}/film?fps={_FPS}&loop=1&pace=clock")
        assert client.do("capture") == {"words": "hold the camera still"}
        until(lambda: [each["what"] for each in client.state()["checks"]] == ["film"], "the guide's words")
        assert client.do("stop") == {"words": "stopped"}
        assert client.until_idle()["trouble"] is None
        client.do("set", camera=f"replay:{film}/film")
        client.do("capture")
        over = client.until_idle()
        assert "on demand" in over["trouble"]["problem"]
        assert over["checks"] == []  # nobody is asked to hold it any more
    assert not (tmp_path / "capture.json").exists()
