"""Every command without one of the packages that it needs: real processes whose interpreter does not find the package."""

import json
import os
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from board_agent.cli import parser as board_parser
from phone_host.cli import parser as host_parser
from phone_host.doctor.host_doctor import FURTHER_MODULES  # the list that must be complete
from tests.support.numbered import write_film
from tests.support.requests import verbs_in

_HIDE = """
import os, sys
class Hidden:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] == os.environ["HIDDEN"]:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
sys.meta_path.insert(0, Hidden())
"""

_NAMES = {"cv2": "opencv-python-headless", "serial": "pyserial", "yaml": "PyYAML", "zmq": "pyzmq"}
"""Distributions that are not called as their module."""

_HOST_MODULES = (
    "aiohttp",
    "cryptography",
    "cv2",
    "msgpack",
    "numpy",
    "rich",
    "segno",
    "serial",
    "yaml",
    "zeroconf",
    "zmq",
)

_ARGUMENTS = {
    "calibrate": ["left", "right", "--out", "out/rig.yaml"],
    "calibrate-time": ["--link", "ipc://no", "--camera", "replay:left", "--calibration", "rig.yaml"],
    "demo": ["--seconds", "1", "--out", "out"],
    "export": ["model", "--to", "stl", "--out", "out"],
    "measure": ["left.png", "right.png", "--calibration", "rig.yaml", "--points", "1,1", "2,2"],
    "print": ["model", "--printer", "file:out.gcode"],
    "printcheck": ["model.ply"],
    "quality": ["left.png", "right.png", "--calibration", "rig.yaml", "--out", "out"],
    "record": ["--link", "ipc://no", "--camera", "replay:left", "--out", "out.mcap"],
    "relief": ["left.png", "right.png", "--calibration", "rig.yaml", "--out", "out"],
    "run": ["--link", "ipc://no", "--camera", "replay:left", "--wait", "0", "--out", "out"],
    "scan": ["left", "right", "--calibration", "rig.yaml", "--out", "out"],
    "serve": ["127.0.0.1:0"],
    "sessions": ["info", "a.mcap"],
    "stereo": ["left.png", "right.png", "--rectified", "--disparities", "16", "--out", "out"],
    "target": ["chessboard", "--out", "out"],
}  # fmt: skip

_BOARD_ARGUMENTS = {"record": ["--camera", "replay:left", "--out", "out.mcap"], "run": ["--camera", "replay:left"]}


def without(module: str, folder: Path, program: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run a program in a folder with an interpreter that does not find a module."""
    (folder / "hide").mkdir(exist_ok=True)
    (folder / "hide" / "sitecustomize.py").write_text(_HIDE)
    environment = {**os.environ, "HIDDEN": module, "PYTHONPATH": str(folder / "hide")}
    command = [str(Path(sys.executable).parent / program), *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=60, cwd=folder, env=environment)


@pytest.mark.parametrize(
    "verb", [verb for verb in verbs_in(host_parser()) if verb not in {"doctor", "keys", "pair", "settings"}]
)
def test_a_verb_without_numpy_is_one_line(tmp_path: Path, verb: str) -> None:
    """It names the package and what installs it, prints nothing else, not even OpenCV's own lines, and ends with 3."""
    done = without("numpy", tmp_path, "phone-host", verb, *_ARGUMENTS[verb])
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (3, "", 1)
    assert "needs the package numpy, which is not installed: install it: pip install numpy" in done.stderr


def test_versions_and_the_traceback_are_there_without_numpy(tmp_path: Path) -> None:
    """What a user with a broken installation is asked for: `run --version` prints the versions, and --debug shows where the import failed."""
    versions = without("numpy", tmp_path, "phone-host", "run", "--version")
    assert (versions.returncode, versions.stderr) == (0, "")
    assert "protocol" in versions.stdout
    assert "Traceback" in without("numpy", tmp_path, "phone-host", "run", "--debug", "--camera", "x").stderr


@pytest.mark.parametrize(
    ("module", "program", "arguments"),
    [
        ("cv2", "phone-host", ["stereo", *_ARGUMENTS["stereo"]]),
        ("rich", "phone-host", ["stereo", *_ARGUMENTS["stereo"]]),
        ("zmq", "phone-host", ["pair", "--link", "tcp://127.0.0.1:9"]),
        ("msgpack", "phone-host", ["run", *_ARGUMENTS["run"]]),
        ("aiohttp", "phone-host", ["serve", *_ARGUMENTS["serve"]]),
        ("numpy", "delay-bench", ["--seconds", "1"]),
        ("zmq", "delay-bench", ["--seconds", "1"]),
        *((module, "board-agent", ["run", *_BOARD_ARGUMENTS["run"]]) for module in ("zmq", "msgpack")),
        *((module, "board-agent", ["record", *_BOARD_ARGUMENTS["record"]]) for module in ("zmq", "msgpack")),
        ("serial", "board-agent", ["run", *_BOARD_ARGUMENTS["run"], "--link", "serial:/dev/none"]),
    ],
)  # fmt: skip
def test_any_missing_package_is_one_line(tmp_path: Path, module: str, program: str, arguments: list[str]) -> None:
    """Whatever package is missing and whatever needs it: one line on stderr names both, and the exit code is 3."""
    write_film(tmp_path / "left", 1)
    done = without(module, tmp_path, program, *arguments)
    name = _NAMES.get(module, module)
    lines = [line for line in done.stderr.splitlines() if f"package {name}" in line]
    assert (done.returncode, done.stdout, len(lines)) == (3, "", 1), done.stderr
    assert f"pip install {name}" in lines[0]
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize("verb", verbs_in(board_parser()))
def test_no_verb_of_the_board_shows_a_traceback(tmp_path: Path, verb: str) -> None:
    """Without ZeroMQ each verb works, or says in one line what it needs."""
    done = without("zmq", tmp_path, "board-agent", verb, *_BOARD_ARGUMENTS.get(verb, ()))
    assert "Traceback" not in done.stderr
    assert done.returncode != 1


@pytest.mark.parametrize(
    ("program", "module"),
    [*(("phone-host", module) for module in ("cv2", "numpy", "rich", "zmq")), *(("board-agent", module) for module in ("serial", "zmq"))],
)  # fmt: skip
def test_the_doctor_names_the_missing_package(tmp_path: Path, program: str, module: str) -> None:
    """It makes its other checks all the same, exactly one of them names the package and what installs it, and the exit code is 3."""
    done = without(module, tmp_path, program, "doctor", "--json")
    assert (done.returncode, done.stderr) == (3, "")
    checks = json.loads(done.stdout)["checks"]
    (found,) = [check for check in checks if check["what"] == module and check["verdict"] == "fail"]
    assert f"pip install {_NAMES.get(module, module)}" in found["remedy"]
    assert [check["what"] for check in checks if module in check["finding"]] in ([], [module])
    assert {"clock", "disk"} <= {check["what"] for check in checks}


def test_the_doctor_looks_for_every_package_of_the_host() -> None:
    """What pyproject.toml requires is what the doctor checks."""
    project = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text())["project"]
    required = {line.partition(";")[0].rstrip(" .0123456789,<>=").lower() for line in project["dependencies"]}
    assert required == {_NAMES.get(module, module).lower() for module in _HOST_MODULES}
    assert {"cv2", "msgpack", "numpy", "serial", "zmq", *FURTHER_MODULES} == set(_HOST_MODULES)
