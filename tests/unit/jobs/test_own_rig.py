"""A replay takes the rig that is in the recording, if no other is given."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from phone_host.cli import main
from phone_host.jobs.run import Opened, open_run
from phone_host.jobs.run_request import checked
from phone_host.model import Rig, Verdict
from phone_host.output.rig_yaml import write_rig
from phone_host.stereo.rectify import rectify_rig
from tests.support.pictures import jpeg
from tests.support.recorded import recording
from tests.support.requests import request_of
from tests.support.rigs import unlike_rig

_SIZES = {"left": (640, 480), "right": (1280, 720)}


def _recording(folder: Path, rig: Rig | None) -> Path:
    """A recording with that rig in it; with none, its rig.yaml is damaged."""
    content = b"a: 1\n"
    if rig is not None:
        write_rig(folder / "rig.yaml", rig, rectify_rig(rig))
        content = (folder / "rig.yaml").read_bytes()
    path = folder / "session.mcap"
    path.write_bytes(recording(2, image=lambda side, number: jpeg(*_SIZES[side], seed=number), rig=content))
    return path


def _opened(folder: Path, *words: str) -> tuple[Opened, list[str]]:
    """The run that these words open, and what it told."""
    told: list[str] = []
    request = request_of("run", "--replay", str(folder / "session.mcap"), *words)
    return open_run(request, checked(request), told.append), told


def test_a_replay_computes_depth_by_the_recording_s_own_rig(tmp_path: Path) -> None:
    """One line says so, and the settings say where it comes from; a rig that is given goes before it."""
    path = _recording(tmp_path, unlike_rig())
    opened, told = _opened(tmp_path)
    assert opened.core is not None
    assert opened.core.rig is not None
    assert np.allclose(opened.core.rig.t_right_left_m, unlike_rig().t_right_left_m)
    assert told == [f"no --calibration: depth is computed by rig.yaml in {path}"]
    assert opened.found.values.calibration == "rig.yaml"
    assert dict(opened.found.origins)["calibration"] == str(path)
    for words in (("--calibration", str(tmp_path / "rig.yaml")), ("--rectified", "--disparities", "64")):
        assert not _opened(tmp_path, *words)[1]


@pytest.mark.parametrize(
    ("rig", "words"),
    [
        (None, "is not a calibration file"),
        (replace(unlike_rig(), verdict=Verdict.REJECT), "was rejected by its own calibration; --use-rejected-rig"),
    ],
)
def test_a_recorded_rig_that_is_of_no_use_keeps_nobody_from_the_delays(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], rig: Rig | None, words: str
) -> None:
    """It is named, and there is no depth; a scan, which needs metres, says what is missing."""
    _recording(tmp_path, rig)
    opened, told = _opened(tmp_path)
    assert opened.core is None
    assert words in told[0]
    assert "pairs and delays only" in told[1]
    assert main(["scan", "--replay", str(tmp_path / "session.mcap"), "--out", str(tmp_path / "out")]) == 2
    assert "no --calibration is given, so there are no metres" in capsys.readouterr().err.splitlines()[-1]
