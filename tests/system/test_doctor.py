"""The doctor's verbs as real processes on this machine: no camera needed."""

import json
import os
import socket
import subprocess
import sys
from pathlib import Path
from typing import Any

from tests.support.numbered import write_film
from tests.support.programs import board, free_port, until


def doctor(module: str, *arguments: str, **more: str) -> tuple[int, dict[str, Any]]:
    """Run a doctor to its end; return the exit code, and the checks by what they checked. `more`: of its environment."""
    command = [sys.executable, "-P", "-m", module, "doctor", "--json", *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60, env={**os.environ, **more})
    assert "Traceback" not in done.stderr
    found: dict[str, Any] = {}
    for check in json.loads(done.stdout)["checks"]:
        found.setdefault(check["what"], check)
    return done.returncode, found


def test_a_sound_board_is_exit_0(tmp_path: Path) -> None:
    """With images to show and a free link nothing fails, each check is named, and every warning has a remedy."""
    write_film(tmp_path / "film", 3)
    code, checks = doctor("board_agent.cli", "--camera", f"replay:{tmp_path}/film", "--link", f"ipc://{tmp_path}/link")
    assert code == 0
    assert {"settings", "service", "camera", "link", "clock", "date", "disk", "power", "usb-log"} <= set(checks)
    assert all(check["remedy"] for check in checks.values() if check["verdict"] != "ok")


def test_a_missing_camera_is_exit_4(tmp_path: Path) -> None:
    """A missing camera fails with its remedy, and the other checks are made all the same."""
    code, checks = doctor("board_agent.cli", "--camera", f"v4l2:{tmp_path}/none", "--link", f"ipc://{tmp_path}/link")
    assert code == 4
    assert checks["camera"]["verdict"] == "fail"
    assert checks["camera"]["remedy"]
    assert checks["link"]["verdict"] == "ok"


def test_a_taken_port_names_who_has_it(tmp_path: Path) -> None:
    """A port that this test itself listens on fails, and its process is named; the port is left as it was."""
    write_film(tmp_path / "film", 3)
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        code, checks = doctor(
            "board_agent.cli", "--camera", f"replay:{tmp_path}/film", "--link", f"tcp://127.0.0.1:{port}"
        )
    assert code == 4
    assert "pid" in checks["link"]["finding"]


def test_a_running_board_keeps_its_link(tmp_path: Path) -> None:
    """The doctor finds a running agent's ipc link taken and does not steal its path: the agent keeps listening there."""
    write_film(tmp_path / "film", 3)
    arguments = ["--camera", f"replay:{tmp_path}/film?loop=1", "--link", f"ipc://{tmp_path}/link"]
    with board(["run", *arguments], tmp_path) as agent:
        until(lambda: "serving" in agent.stderr, "the agent serves")
        code, checks = doctor("board_agent.cli", *arguments)
        assert code == 4
        assert checks["link"]["verdict"] == "fail"
        with socket.socket(socket.AF_UNIX) as probe:
            probe.connect(str(tmp_path / "link"))
        assert agent.stop() == 0


def test_settings_that_make_no_sense_are_exit_2_and_the_first_finding(tmp_path: Path) -> None:
    """A bad URI or file is exit 2 as in `run`; it is one finding with its remedy, and the machine is checked all the same."""
    code, checks = doctor("board_agent.cli", "--camera", "v4l2:auto?size=big")
    assert code == 2
    assert checks["settings"]["verdict"] == "fail"
    assert "size=big" in checks["settings"]["finding"]
    assert "640x480" in checks["settings"]["remedy"]
    assert {"clock", "disk"} <= set(checks)
    assert "camera" not in checks
    (tmp_path / "host.toml").write_text("tolerance = 5\ncamera = v4l2:auto\n")
    code, checks = doctor(
        "phone_host.cli", "--config", str(tmp_path / "host.toml"), "--keys", str(tmp_path), "--out", str(tmp_path)
    )
    assert code == 2
    assert next(iter(checks)) == "settings"
    assert "line 2, 'camera = v4l2:auto'" in checks["settings"]["finding"]
    assert {"python", "numpy", "cv2", "disk"} <= set(checks)


def test_the_table_has_a_line_for_each_check(tmp_path: Path) -> None:
    """Without --json each line begins with its verdict, and each that is not ok ends with a remedy."""
    command = [sys.executable, "-P", "-m", "board_agent.cli", "doctor", "--camera", f"v4l2:{tmp_path}/none"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)
    lines = done.stdout.splitlines()
    assert all(line.split()[0] in {"ok", "warn", "fail"} for line in lines)
    assert all("->" in line for line in lines if not line.startswith("ok"))


def test_a_host_asks_the_board(tmp_path: Path) -> None:
    """A running board answers with its camera and its clock's uncertainty; without a board the port is reported as closed."""
    write_film(tmp_path / "film", 3)
    uri = f"tcp://127.0.0.1:{free_port()}"
    own = f"replay:{tmp_path}/film?loop=1"
    with board(["run", "--camera", own, "--link", uri], tmp_path) as agent:
        until(lambda: "serving" in agent.stderr, "the agent serves")
        code, checks = doctor("phone_host.cli", "--link", uri, "--camera", own, "--wait", "30", "--out", str(tmp_path))
        assert code == 0, checks
        assert "clock known to" in checks["board"]["finding"]
        assert agent.stop() == 0
    code, checks = doctor("phone_host.cli", "--link", uri, "--wait", "0.5", "--out", str(tmp_path))
    assert code == 4
    assert "nobody listens" in checks["board"]["finding"]


def test_a_host_without_anything_given_is_judged_by_itself(tmp_path: Path) -> None:
    """Python and its packages are listed with their versions, no board is asked, and an invalid rig fails."""
    code, checks = doctor("phone_host.cli", "--out", str(tmp_path))
    assert code == 0, checks
    assert {"python", "numpy", "cv2", "camera", "serial", "bluetooth", "board", "disk"} <= set(checks)
    (tmp_path / "rig.yaml").write_text("baseline: 3\n")
    code, checks = doctor("phone_host.cli", "--calibration", str(tmp_path / "rig.yaml"))
    assert code == 4
    assert "rig.yaml" in checks["rig"]["finding"]


def test_two_wheels_of_opencv_are_found(tmp_path: Path) -> None:
    """If the folder of a second OpenCV distribution is on the path, the conflict is named and fails."""
    other = tmp_path / "site" / "opencv_python-4.10.0.84.dist-info"
    other.mkdir(parents=True)
    (other / "METADATA").write_text("Metadata-Version: 2.1\nName: opencv-python\nVersion: 4.10.0.84\n")
    command = [sys.executable, "-P", "-m", "phone_host.cli", "doctor", "--json"]
    environment = {**os.environ, "PYTHONPATH": str(tmp_path / "site")}
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60, env=environment)
    assert done.returncode == 4, done.stderr
    (check,) = (check for check in json.loads(done.stdout)["checks"] if check["what"] == "cv2")
    assert "side by side" in check["finding"]


def test_on_android_what_android_keeps_away_is_said(tmp_path: Path) -> None:
    """With the platform's value that Python has there: no finding fails, links that cannot be do, and each remedy names a way that works."""
    (tmp_path / "sitecustomize.py").write_text("import sys\nsys.platform = 'android'\n")
    asked = "from pathlib import Path; from phone_host.discovery.discovery import _why_not; from phone_host.native.library import load; "
    asked += f"print(load(Path({str(tmp_path)!r})).remedy, _why_not(), sep='|')"  # no library lies there
    android = {**os.environ, "PYTHONPATH": str(tmp_path)}
    told = subprocess.run([sys.executable, "-c", asked], capture_output=True, text=True, check=True, env=android).stdout
    assert "termux-install.sh" in told
    assert told.endswith("|, which Android keeps from Termux\n")
    code, checks = doctor("phone_host.cli", PYTHONPATH=str(tmp_path))
    assert code == 0
    assert "Android" in checks["phone"]["finding"]
    assert "browser is the camera" in checks["camera"]["finding"]
    assert "Ethernet over USB" in checks["usb"]["finding"]
    assert "needs a laptop" in checks["bluetooth"]["finding"]
    links = ("--link", "serial:/dev/ttyACM0", "--link", "rfcomm://00:11:22:33:44:55", "--wait", "0")
    code, checks = doctor("phone_host.cli", *links, PYTHONPATH=str(tmp_path))
    assert code == 4
    assert {checks[name]["verdict"] for name in ("usb", "bluetooth")} == {"fail"}
    assert "tcp://192.168.7.2" in checks["usb"]["remedy"]
    assert checks["bluetooth"]["remedy"]
