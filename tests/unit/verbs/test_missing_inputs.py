"""An input that is not there: one line, and exit code 4 whichever command was to read it. A camera that is not there is none of these: 3."""

import logging
from collections.abc import Iterator
from pathlib import Path

import pytest

from phone_host.cli import main

_RIG = ("--calibration", "rig.yaml")
_OUT = ("--out", "out")


@pytest.fixture(autouse=True)
def _logs_as_before() -> Iterator[None]:
    """A run sets up logs of its own; take them away again."""
    before = logging.root.handlers[:]
    yield
    logging.root.handlers[:] = before


@pytest.mark.parametrize(
    ("words", "code"),
    [
        (("export", "none", "--to", "stl", *_OUT), 4),
        (("print", "none.stl", "--printer", "file:out.gcode"), 4),
        (("print", "none.gcode", "--printer", "file:out.gcode"), 4),
        (("print", "none.stl", "--printer", "octoprint://127.0.0.1:9", "--yes"), 4),
        (("print", "none.gcode", "--printer", "moonraker://127.0.0.1:9", "--yes"), 4),
        (("print", "none.stl", "--slicer", "cura", "--printer", "serial:none", "--yes"), 4),
        (("printcheck", "none"), 4),
        (("sessions", "info", "none.mcap"), 4),
        (("sessions", "repair", "none.mcap", "--out", "out.mcap"), 4),
        (("sessions", "join", "none.mcap", "other.mcap", "--out", "out.mcap"), 4),
        (("sessions", "import", "none", "--out", "out.mcap"), 4),
        (("sessions", "import", "none", "other", "--out", "out.mcap"), 4),
        (("calibrate", "none", "other", "--square", "25mm", "--out", "rig.yaml"), 4),
        (("calibrate", "none.mcap", "--square", "25mm", "--out", "rig.yaml"), 4),
        (("measure", "none.png", "other.png", *_RIG, "--points", "1,1", "2,2"), 4),
        (("relief", "none.png", "other.png", *_RIG, *_OUT), 4),
        (("stereo", "none.png", "other.png", *_RIG, *_OUT), 4),
        (("scan", "none", "other", *_RIG, *_OUT), 4),
        (("scan", "--replay", "none.mcap", *_RIG, *_OUT), 4),
        (("run", "--replay", "none.mcap"), 4),
        (("run", "--camera", "replay:none"), 3),
        (("run", "--camera", "replay:none.mcap"), 3),
    ],
)
def test_what_is_missing_has_one_exit_code(
    words: tuple[str, ...],
    code: int,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The line names the missing file, also on a machine without other programs such as slicers, and nothing is left behind."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PATH", str(tmp_path))
    assert main(words) == code
    printed = capsys.readouterr()
    assert not printed.out
    assert "none" in printed.err.splitlines()[-1]
    assert not list(tmp_path.iterdir())
