"""What the demo says at its end can be pasted."""

import shlex
import sys
from pathlib import Path

import pytest

import board_agent.cli
import phone_host.cli
from phone_host.demo.demonstration import DepthErrors
from phone_host.scene.film import Film
from phone_host.verbs.demo import closing

ERRORS = DepthErrors(
    pairs=1,
    pixels=1000,
    density=0.9,
    disparity_px=0.1,
    outliers=0.0,
    depth_mm=5.0,
    depth_p95_mm=9.0,
    depth_percent=0.3,
    at_1_m_mm=2.0,
    at_2_m_mm=8.0,
    wrong_pairs=0,
)


@pytest.mark.parametrize("folder", ["out/demo", "my results/it's $HOME", "a;b&c"])
def test_the_next_commands_can_be_pasted(folder: str) -> None:
    """Whatever the folder's name, a shell takes each command apart as it was meant, and both programs take it."""
    out = Path(folder)
    said = closing(out, Film(left=out / "film" / "left", right=out / "film" / "right", frames=60, fps=15), ERRORS)
    lines = said.partition("try next")[2].splitlines()[1:]
    board, host, bare, *activate = [shlex.split(line) for line in lines if line.startswith("  ")]
    assert Path(board[0]).name == "board-agent"
    assert board_agent.cli.parser().parse_args(board[1:]).camera == f"replay:{out}/film/left?fps=15&loop=1"
    options = phone_host.cli.parser().parse_args(host[1:])
    assert (options.camera, options.calibration) == (f"replay:{out}/film/right?fps=15&loop=1", f"{out}/rig.yaml")
    assert [Path(word).name for word in bare] == ["phone-host"]
    assert all(words[0] == "." and Path(words[1]).is_file() for words in activate)


def test_without_activation_the_demo_says_how_the_programs_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """The line to type stands there if the shell does not find phone-host, and only then."""
    out = Path("out/demo")
    film = Film(left=out / "film" / "left", right=out / "film" / "right", frames=60, fps=15)
    monkeypatch.setenv("PATH", "/usr/bin:/bin")
    assert "/activate" in closing(out, film, ERRORS)
    monkeypatch.setenv("PATH", str(Path(sys.executable).parent))
    assert "/activate" not in closing(out, film, ERRORS)
