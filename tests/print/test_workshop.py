"""What the page makes of a scan, by the station's own parts: checked, saved, printed on a simulated printer."""

import os
import re
import shutil
from pathlib import Path

import numpy as np
import pytest

from common.errors import SettingsError
from phone_host.output.model_file import read_model
from phone_host.output.ply import PointCloud, write_surface
from phone_host.serve.workshop import Workshop, asked_print
from phone_host.web.source import PrintStage, PrintState
from tests.support.marlin_printer import printer
from tests.support.programs import until

SQUARES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
needs_slicer = pytest.mark.skipif(shutil.which("prusa-slicer") is None, reason="needs prusa-slicer")


def scan(folder: Path, side_m: float, *, is_open: bool = False) -> str:
    """A folder that holds a cube as a scan's model."""
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], np.float32) * np.float32(side_m)
    triangles = np.array([corner for a, b, c, d in SQUARES for corner in ((a, b, c), (a, c, d))], np.int32)
    folder.mkdir()
    cloud = PointCloud(corners, np.full((8, 3), 200, np.uint8))
    write_surface(folder / "model.ply", cloud, triangles[:-2] if is_open else triangles)
    return str(folder)


@pytest.fixture(autouse=True)
def own_data(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The journal lies in a folder of the test's own."""
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))


def state(workshop: Workshop) -> PrintState:
    """How the print goes; there is one."""
    assert workshop.state is not None
    return workshop.state


def test_a_model_is_checked_and_saved(tmp_path: Path) -> None:
    """A closed cube passes; one that is open, too large, or not there is refused in words; what was saved is read back in mm."""
    workshop, usual = Workshop(lambda: None), asked_print({}, None)
    folder = scan(tmp_path / "cube", 0.02)
    assert workshop.check(folder, usual).startswith("it can be printed")
    small = workshop.check(folder, asked_print({"bed": "10,10,10"}, None))
    assert small.startswith("it cannot be printed: ")
    assert "bed" in small
    assert "holes" in workshop.check(scan(tmp_path / "open", 0.02, is_open=True), usual)
    with pytest.raises(SettingsError, match="no scan yet"):
        workshop.check("", usual)
    assert workshop.saved(folder) == ()
    assert workshop.save(folder, "stl") == "saved as cube.stl"
    assert workshop.saved(folder) == ("cube.stl",)
    assert np.ptp(read_model(Path(folder) / "cube.stl").solid.points_m, axis=0) == pytest.approx(0.02)
    with pytest.raises(SettingsError, match="no format"):
        workshop.save(folder, "dwg")
    workshop.close()


@needs_slicer
def test_a_print_needs_an_answer_that_names_file_and_printer(tmp_path: Path) -> None:
    """It is prepared, asks, refuses another answer, prints, and leaves the printer cold. Meanwhile no second one begins."""
    folder = scan(tmp_path / "cube", 0.006)
    with printer() as there:
        workshop = Workshop(lambda: None)
        wanted = asked_print({"printer": f"serial:{there.path}?baud=115200", "bed": "100,100,100"}, None)
        workshop.prepare(folder, wanted)
        with pytest.raises(SettingsError, match="is active"):
            workshop.prepare(folder, wanted)
        until(lambda: state(workshop).stage is PrintStage.ASKS, "it asks")
        asks = state(workshop).asks
        assert asks == f"cube.gcode on {wanted.text}"
        assert there.done == []
        with pytest.raises(SettingsError, match=r"cube\.gcode on serial"):
            workshop.start("cube.gcode on serial:/dev/ttyUSB7")
        assert there.done == []
        workshop.start(asks)
        until(lambda: state(workshop).stage is PrintStage.OVER, "it is printed")
        assert state(workshop).level == "good", state(workshop).words
        assert any(text.startswith("M109 S2") for text in there.done)
        assert (there.nozzle, there.bed) == (0.0, 0.0)
        with pytest.raises(SettingsError, match="nothing is ready"):
            workshop.start(asks)
        workshop.close()


@needs_slicer
def test_the_end_of_the_program_leaves_the_printer_cold(tmp_path: Path) -> None:
    """Whoever closes the page's program in the middle of a print does not leave a hot nozzle behind."""
    folder = scan(tmp_path / "cube", 0.02)
    with printer() as there:
        workshop = Workshop(lambda: None)
        workshop.prepare(folder, asked_print({"printer": f"serial:{there.path}?baud=115200"}, None))
        until(lambda: state(workshop).stage is PrintStage.ASKS, "it asks")
        workshop.start(state(workshop).asks)
        until(lambda: there.nozzle > 100 and len(there.done) > 40, "it prints, hot")
        workshop.close()
        assert (there.nozzle, there.bed) == (0.0, 0.0)
        assert "cancelled" in state(workshop).words


def test_what_is_wrong_with_a_printer_is_said(tmp_path: Path) -> None:
    """No address, one that is none, and one that is not there; afterwards the next one can be prepared."""
    workshop, folder = Workshop(lambda: None), scan(tmp_path / "cube", 0.02)
    with pytest.raises(SettingsError, match="no printer is given"):
        workshop.prepare(folder, asked_print({}, None))
    with pytest.raises(SettingsError, match="names no printer"):
        asked_print({"printer": "usb0"}, None)
    workshop.prepare(folder, asked_print({"printer": "octoprint://127.0.0.1:9"}, None))
    until(lambda: state(workshop).stage is PrintStage.OVER, "it is told")
    assert state(workshop).level == "bad"
    assert "OctoPrint at 127.0.0.1:9" in state(workshop).words
    with pytest.raises(SettingsError, match="nothing is printed"):
        workshop.cancel()
    workshop.close()


@pytest.fixture
def slow_slicer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A slicer that never ends is the first one on the path; the file tells its process and its arguments."""
    program, told = tmp_path / "bin" / "prusa-slicer", tmp_path / "slicer.pid"
    program.parent.mkdir()
    program.write_text(f'#!/bin/sh\necho "$$ $*" > {told}\nexec sleep 1000\n')
    program.chmod(0o755)
    monkeypatch.setenv("PATH", str(program.parent), prepend=os.pathsep)
    return told


def _is_there(process: str) -> bool:
    return Path(f"/proc/{process}").exists()


def _sliced_folders(arguments: list[str]) -> set[Path]:
    """The folders of ours that a slicer's arguments name."""
    found = (re.search(r"/\S*/tandemscan-[^/]+", argument) for argument in arguments)
    return {Path(each[0]) for each in found if each is not None}


def test_cancelling_while_it_is_sliced_ends_the_slicer(tmp_path: Path, slow_slicer: Path) -> None:
    """At once: nothing of it stays, and the next print can be prepared; the end of the program is no different."""
    workshop, folder = Workshop(lambda: None), scan(tmp_path / "cube", 0.02)
    wanted = asked_print({"printer": f"file:{tmp_path / 'out.gcode'}"}, None)
    for end in (workshop.cancel, workshop.close):
        workshop.prepare(folder, wanted)
        until(lambda: slow_slicer.exists() and bool(slow_slicer.read_text().strip()), "it is sliced")
        assert state(workshop).words == "slicing"
        process, *arguments = slow_slicer.read_text().split()
        folders = _sliced_folders(arguments)
        assert folders
        assert all(folder.is_dir() for folder in folders)
        end()
        until(lambda: state(workshop).stage is PrintStage.OVER, "print cancelled")
        assert state(workshop).words == "not printed"
        assert not _is_there(process)
        assert not any(folder.exists() for folder in folders)
        slow_slicer.unlink()
    with pytest.raises(SettingsError, match="the program ends"):
        workshop.prepare(folder, wanted)


@needs_slicer
def test_what_was_prepared_is_not_started_after_the_end(tmp_path: Path) -> None:
    """Its file is gone, so it may not be; a file that somebody else has removed keeps no other print away."""
    workshop, folder = Workshop(lambda: None), scan(tmp_path / "cube", 0.006)
    wanted = asked_print({"printer": f"file:{tmp_path / 'out.gcode'}"}, None)
    workshop.prepare(folder, wanted)
    until(lambda: state(workshop).stage is PrintStage.ASKS, "it asks")
    asks = state(workshop).asks
    workshop.close()
    with pytest.raises(SettingsError, match="nothing is ready"):
        workshop.start(asks)
    assert not (tmp_path / "out.gcode").exists()


@needs_slicer
def test_a_file_is_written_and_nothing_is_said_of_a_bed(tmp_path: Path) -> None:
    """G-code for a card: the question and the end name the file; no printer prints."""
    workshop, folder, out = Workshop(lambda: None), scan(tmp_path / "cube", 0.006), tmp_path / "out.gcode"
    workshop.prepare(folder, asked_print({"printer": f"file:{out}"}, None))
    until(lambda: state(workshop).stage is PrintStage.ASKS, "it asks")
    assert state(workshop).words.startswith("write cube.gcode to ")
    assert "bed" not in state(workshop).words
    workshop.start(state(workshop).asks)
    until(lambda: state(workshop).stage is PrintStage.OVER, "it is over")
    assert state(workshop).words.startswith(f"cube.gcode: written to {out}")
    assert out.stat().st_size > 1000
    workshop.close()
