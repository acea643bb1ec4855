"""The cost of a start: help and the board's start import no more than they need."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]

HEAVY = {"numpy", "cv2", "rich", "zmq", "msgpack", "serial", "zeroconf", "asyncio", "importlib.metadata"}


def loaded_by(module: str, *arguments: str) -> set[str]:
    """The modules that a command has loaded when it ends."""
    code = (
        "import contextlib, io, json, sys\n"
        f"from {module} import main\n"
        "with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):\n"
        f"    main({list(arguments)!r})\n"
        "print(json.dumps(sorted(sys.modules)))\n"
    )
    done = subprocess.run([sys.executable, "-P", "-c", code], check=True, capture_output=True, text=True, cwd=ROOT)
    return set(json.loads(done.stdout))


@pytest.mark.parametrize(
    ("module", "arguments"),
    [
        ("phone_host.cli", ["--help"]),
        ("phone_host.cli", ["--version"]),
        ("phone_host.cli", ["settings"]),
        ("phone_host.bench.cli", ["--help"]),
        ("phone_host.bench.cli", ["--emulate", "list"]),
        ("board_agent.cli", ["--version"]),
        ("board_agent.cli", ["run", "--help"]),
        ("board_agent.cli", ["settings"]),
    ],
)
def test_help_and_settings_load_nothing_heavy(module: str, arguments: list[str]) -> None:
    """Help, save that of verbs which compute, settings and lists need no numpy, OpenCV, rich or ZeroMQ, and no search for other packages. tests/bench/bench_start.py measures what they cost."""
    assert loaded_by(module, *arguments) & HEAVY == set()


def test_help_loads_no_command() -> None:
    """`phone-host --help` loads none of the verbs' commands, and no more than 120 modules of ours."""
    ours = {name for name in loaded_by("phone_host.cli", "--help") if name.split(".")[0] in {"common", "phone_host"}}
    assert not [name for name in ours if name.startswith("phone_host.verbs.") and name.endswith(".command")]
    assert len(ours) < 120


@pytest.mark.parametrize(
    ("link", "camera", "unwanted"),
    [
        (
            "ipc://{folder}/link",
            "v4l2:{folder}/none",
            {"common.camera.replay", "common.link.serial", "common.link.rfcomm"},
        ),
        (
            "serial:{folder}/none",
            "replay:{folder}",
            {"common.camera.v4l2", "common.link.zeromq", "common.link.rfcomm"},
        ),
    ],
)
def test_the_board_loads_what_it_was_asked_for(link: str, camera: str, unwanted: set[str], tmp_path: Path) -> None:
    """board-agent run loads the kinds of link and camera that were requested, neither the others nor what keys and extensions need."""
    (tmp_path / "1.pgm").write_bytes(b"P5 2 2 255\nabcd")
    chosen = ["--link", link.format(folder=tmp_path), "--camera", camera.format(folder=tmp_path)]
    loaded = loaded_by("board_agent.cli", "run", *chosen)
    assert loaded & {*unwanted, "common.link.curve", "board_agent.enrolment", "importlib.metadata", "asyncio"} == set()
