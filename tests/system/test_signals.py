"""Signals end every long verb and both daemons in order: the terminal is closed, ssh is lost, somebody quits."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.numbered import write_film
from tests.support.programs import PATIENCE_S, free_port, program, until
from tests.support.terminal import in_terminal


def _verbs(folder: Path) -> dict[str, tuple[str, list[str]]]:
    """Module and arguments of programs that run until they are stopped."""
    film = f"replay:{folder / 'film'}?fps=15&loop=1"
    return {
        "board-agent run": ("board_agent.cli", ["run", "--camera", film, "--link", f"ipc://{folder}/b", "--json"]),
        "board-agent record": (
            "board_agent.cli",
            ["record", "--camera", film, "--out", f"{folder}/board.mcap", "--json"],
        ),
        "run": (
            "phone_host.cli",
            [
                "run",
                "--link",
                f"ipc://{folder}/nobody",
                "--camera",
                film,
                "--rectified",
                "--disparities",
                "16",
                "--out",
                f"{folder}/run",
                "--json",
            ],
        ),
        "record": ("phone_host.cli", ["record", "--alone", "--camera", film, "--out", f"{folder}/host.mcap", "--json"]),
        "serve": ("phone_host.cli", ["serve", f"127.0.0.1:{free_port()}", "--json"]),
    }


_NAMES = ("board-agent run", "board-agent record", "run", "record", "serve")


def _has_begun(name: str, folder: Path, log: str) -> bool:
    files = {"board-agent record": "board.mcap", "record": "host.mcap"}
    if name in files:
        return any(path.stat().st_size > 20_000 for path in folder.glob(f"*{files[name]}*"))
    if name == "serve":
        return (folder / "program.out").exists() and "url" in (folder / "program.out").read_text()
    return "waiting for a board" in log or "serving session" in log


@pytest.mark.parametrize("number", [signal.SIGHUP, signal.SIGQUIT, signal.SIGTERM])
@pytest.mark.parametrize("name", _NAMES)
def test_a_stream_ends_in_order_by_every_signal_but_ctrl_c(name: str, number: signal.Signals, tmp_path: Path) -> None:
    """Its account is printed whole, and the exit code is 0."""
    write_film(tmp_path / "film", 10)
    module, arguments = _verbs(tmp_path)[name]
    with program(module, arguments, tmp_path, "program") as running:
        until(lambda: _has_begun(name, tmp_path, running.stderr), f"{name} has begun")
        assert running.stop(number) == 0
        assert isinstance(running.json(), dict)
        assert "Traceback" not in running.stderr


@pytest.mark.parametrize("name", ["board-agent run", "run"])
def test_nohup_keeps_a_program_alive(name: str, tmp_path: Path) -> None:
    """What a parent has SIGHUP ignored for goes on, and ends by SIGTERM."""
    write_film(tmp_path / "film", 10)
    module, arguments = _verbs(tmp_path)[name]
    command = ["nohup", sys.executable, "-P", "-m", module, *arguments]
    environment = {**os.environ, "XDG_CONFIG_HOME": str(tmp_path / "config")}
    with (
        (tmp_path / "program.err").open("wb") as log,
        subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=log, stdin=subprocess.DEVNULL, env=environment, cwd=tmp_path
        ) as process,
    ):
        try:
            until(lambda: _has_begun(name, tmp_path, (tmp_path / "program.err").read_text()), f"{name} has begun")
            process.send_signal(signal.SIGHUP)
            process.send_signal(signal.SIGTERM)
            out, _ = process.communicate(timeout=PATIENCE_S)
        finally:
            process.kill()
    assert process.returncode == 0
    assert isinstance(json.loads(out), dict)


def test_a_closed_terminal_ends_a_run_with_its_report(tmp_path: Path) -> None:
    """The live table's terminal is gone while it is drawn: the report is on the disk, and the exit code is that of SIGTERM."""
    write_film(tmp_path / "film", 10)
    link, film = f"ipc://{tmp_path}/b", f"replay:{tmp_path / 'film'}?fps=15&loop=1"
    host = [sys.executable, "-P", "-m", "phone_host.cli", "run", "--link", link, "--camera", film]
    with (
        program("board_agent.cli", ["run", "--camera", film, "--link", link], tmp_path, "board"),
        in_terminal(
            [*host, "--rectified", "--disparities", "16", "--out", str(tmp_path / "run")], 100, tmp_path
        ) as running,
    ):
        running.read_until(b"pairs")
        assert running.hang_up() == 0
    assert json.loads((tmp_path / "run" / "report.json").read_text())


def test_a_closed_terminal_ends_a_computation_with_129(tmp_path: Path) -> None:
    """The bar over many pairs is drawn on a terminal that goes: pairs that are done stay whole, and the exit code is 129."""
    for side, folder in (("left", tmp_path / "left"), ("right", tmp_path / "right")):
        folder.mkdir()
        write_film(tmp_path / side, 1)
        for number in range(1, 400):
            os.link(folder / "0.jpg", folder / f"{number}.jpg")
    command = [sys.executable, "-P", "-m", "phone_host.cli", "stereo", str(tmp_path / "left"), str(tmp_path / "right")]
    out = tmp_path / "out"
    with in_terminal([*command, "--rectified", "--disparities", "16", "--out", str(out)], 100, tmp_path) as running:
        until(lambda: running.read() and (out / "pair-000000" / "disparity.pfm").exists(), "a pair is done")
        assert running.hang_up() == 129
    done = sorted(path.parent.name for path in out.glob("pair-*/disparity.pfm"))
    assert 1 <= len(done) < 400
