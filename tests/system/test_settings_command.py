"""`settings` of both programs as a user runs it."""

import json
import os
import subprocess
import sys

import pytest


def settings(module: str, *arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-P", "-m", module, "settings", *arguments],
        env=os.environ | environment, capture_output=True, text=True, check=False, timeout=60,
    )  # fmt: skip


def test_every_setting_of_the_host_is_an_option_and_named_as_its_origin() -> None:
    """Each setting given as an option is shown with its value and `--NAME`."""
    given = {
        "link": "serial:/dev/ttyACM0", "camera": "replay:right", "calibration": "rig.yaml", "matcher": "block",
        "tolerance": "5", "fifo": "2:block", "align_phase": "board", "keys": "my-keys", "log_level": "info",
        "max_megapixels": "12", "budget": "40",
    }  # fmt: skip
    words = [word for name, value in given.items() for word in (f"--{name.replace('_', '-')}", value)]
    words += ["--link", "tcp://board:5555", "--interpolate"]
    done = settings("phone_host.cli", "--json", *words)
    assert done.returncode == 0, done.stderr
    read = given | {
        "interpolate": True,
        "tolerance": 5.0,
        "budget": 40.0,
        "max_megapixels": 12,
        "link": ["serial:/dev/ttyACM0", "tcp://board:5555"],
    }
    assert json.loads(done.stdout) == {
        name: {"value": value, "origin": f"--{name.replace('_', '-')}"} for name, value in read.items()
    }


@pytest.mark.parametrize(
    ("module", "variable", "value"),
    [
        ("phone_host.cli", "PHONE_HOST_FIFO", "2:sometimes"),
        ("phone_host.cli", "PHONE_HOST_MATCHER", "magic"),
        ("phone_host.cli", "PHONE_HOST_TOLERANCE", "nan"),
        ("phone_host.cli", "PHONE_HOST_BUDGET", "0.5"),
        ("phone_host.cli", "PHONE_HOST_MAX_MEGAPIXELS", "0"),
        ("phone_host.cli", "PHONE_HOST_LINK", "carrier-pigeon://x"),
        ("phone_host.cli", "PHONE_HOST_CAMERA", "replay:x?fps=0"),
        ("phone_host.cli", "PHONE_HOST_LOG_LEVEL", "loud"),
        ("phone_host.cli", "PHONE_HOST_ALIGN_PHASE", "both"),
        ("phone_host.cli", "PHONE_HOST_INTERPOLATE", "perhaps"),
        ("board_agent.cli", "BOARD_AGENT_IDLE_AFTER", "-1"),
        ("board_agent.cli", "BOARD_AGENT_ADAPT", "quality colour"),
        ("board_agent.cli", "BOARD_AGENT_LEAST_FPS", "-2"),
        ("board_agent.cli", "BOARD_AGENT_LINK", "tcp://*:5555 tcp://nowhere"),
        ("board_agent.cli", "BOARD_AGENT_CAMERA", "v4l2:auto?size=big"),
    ],
)
def test_what_run_would_refuse_is_refused(module: str, variable: str, value: str) -> None:
    """An invalid value ends `settings` with exit 2 and one line that shows it."""
    done = settings(module, **{variable: value})
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.count("\n") == 1
    assert value.rsplit(maxsplit=1)[-1] in done.stderr
