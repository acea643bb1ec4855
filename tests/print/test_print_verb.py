"""phone-host print against a simulated printer: as its user meets it."""

import json
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from phone_host.printers.gcode import examine
from tests.support.marlin_printer import Faults, MarlinPrinter, cube, printer
from tests.support.programs import until


@pytest.fixture
def gcode(tmp_path: Path) -> Path:
    """A print of 600 lines."""
    path = tmp_path / "cube.gcode"
    path.write_text("\n".join(["; a cube", *cube(600)]) + "\n")
    return path


def command(home: Path, *arguments: str) -> list[str]:
    """The command line."""
    del home
    return [sys.executable, "-P", "-m", "phone_host.cli", "print", *arguments]


def environment(home: Path) -> dict[str, str]:
    """Its own folder for data."""
    return {**os.environ, "XDG_DATA_HOME": str(home), "HOME": str(home)}


def done(home: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run it to its end."""
    return subprocess.run(
        command(home, *arguments),
        env=environment(home),
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
        stdin=subprocess.DEVNULL,
    )


def uri(there: MarlinPrinter) -> str:
    """Its address."""
    return f"serial:{there.path}?baud=115200"


def test_a_print_is_sent_whole(gcode: Path, tmp_path: Path) -> None:
    """Every line, in order; a sentence at the end, or one JSON object; nothing is left in the journal."""
    with printer() as there:
        ended = done(tmp_path, str(gcode), "--printer", uri(there), "--yes")
    assert (ended.returncode, ended.stdout, ended.stderr) == (0, "printed: 600 lines\n", "")
    assert there.done == cube(600)
    with printer(Faults(corrupted=0.02)) as there:
        ended = done(tmp_path, str(gcode), "--printer", uri(there), "--yes", "--json")
    told = json.loads(ended.stdout)
    assert (told["ended"], told["done"], told["lines"]) == ("done", 600, 600)
    assert told["resent"] == there.resends > 0
    assert there.done == cube(600)
    assert not list(tmp_path.rglob("printing/*.json"))


def test_ctrl_c_cools_the_printer(gcode: Path, tmp_path: Path) -> None:
    """In the middle of a print: heaters off, 130."""
    with printer(Faults(delay_s=0.01)) as there:
        asked = command(tmp_path, str(gcode), "--printer", uri(there), "--yes")
        with subprocess.Popen(asked, env=environment(tmp_path), stdout=subprocess.PIPE, text=True) as process:
            until(lambda: len(there.done) > 50, "some lines")
            process.send_signal(signal.SIGINT)
            said, _ = process.communicate(timeout=60)
        assert process.returncode == 130
        assert "heaters, fan and motors are off" in said
        assert there.nozzle == there.bed == 0.0
        assert len(there.done) < len(gcode.read_text().splitlines()), "it was not printed to its end"


def test_the_next_start_says_what_became_of_a_killed_print(gcode: Path, tmp_path: Path) -> None:
    """Killed in the middle: the next start tells it, once, and does not go on by itself."""
    with printer(Faults(delay_s=0.01)) as there:
        asked = command(tmp_path, str(gcode), "--printer", uri(there), "--yes")
        with subprocess.Popen(asked, env=environment(tmp_path), stdout=subprocess.DEVNULL) as process:
            until(lambda: len(there.done) > 50, "some lines")
            process.kill()
            process.wait(60)
        count = len(there.done)
        again = done(tmp_path, str(gcode), "--printer", uri(there))
        assert again.returncode == 2
        assert "was not finished" in again.stderr
        assert str(gcode) in again.stderr
        assert "heaters may be on" in again.stderr
        assert len(there.done) == count
    assert "was not finished" not in done(tmp_path, str(gcode), "--printer", "serial:/dev/ttyNOPE", "--yes").stderr


def test_an_unplugged_printer_is_told(gcode: Path, tmp_path: Path) -> None:
    """At half of the print; exit 3."""
    with printer(Faults(dies_after=300)) as there:
        ended = done(tmp_path, str(gcode), "--printer", uri(there), "--yes")
    assert ended.returncode == 3
    assert "cannot be cooled from here" in ended.stderr
    assert len(ended.stderr.splitlines()) == 1


@pytest.mark.parametrize(
    ("said", "words"),
    [("Error:Thermal Runaway, system stopped!", "Thermal Runaway"), ("start", "the printer has restarted")],
)
def test_a_printer_that_stops_is_told(gcode: Path, tmp_path: Path, said: str, words: str) -> None:
    """In its own words, with how far it came; exit 3."""
    with printer(Faults(says={100: said})) as there:
        ended = done(tmp_path, str(gcode), "--printer", uri(there), "--yes")
    assert ended.returncode == 3
    assert words in ended.stderr
    assert "of 600 lines were done" in ended.stderr


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (["cube.gcode", "--printer", "serial:/dev/ttyNOPE", "--yes"], 3, "there is no printer at /dev/ttyNOPE"),
        (["cube.gcode", "--printer", "serial:/dev/ttyNOPE"], 2, "give --yes"),
        (["cube.gcode", "--printer", "usb0", "--yes"], 2, "names no printer"),
        (["cube.gcode", "--printer", "serial:/dev/ttyNOPE", "--bed", "50,50,50", "--yes"], 4, "leaves the bed: line"),
        (["cube.gcode", "--printer", "serial:/dev/ttyNOPE", "--bed", "50"], 2, "--bed"),
        (["cube.gcode", "--printer", "serial:/dev/ttyNOPE", "--up", "y"], 2, "are for models"),
        (["none.gcode", "--printer", "serial:/dev/ttyNOPE", "--yes"], 4, "does not exist"),
        (["noise.gcode", "--printer", "serial:/dev/ttyNOPE", "--yes"], 4, "line 1 is no G-code"),
        (["empty.gcode", "--printer", "serial:/dev/ttyNOPE", "--yes"], 4, "no line that a printer would execute"),
        (["travel.gcode", "--printer", "serial:/dev/ttyNOPE", "--yes"], 4, "extrudes nothing"),
    ],
)
def test_bad_input_gets_one_line(gcode: Path, tmp_path: Path, arguments: list[str], code: int, words: str) -> None:
    """With the culprit and the remedy, before anything is sent."""
    del gcode
    (tmp_path / "noise.gcode").write_bytes(bytes(range(256)))
    (tmp_path / "empty.gcode").write_text("; nothing\n")
    (tmp_path / "travel.gcode").write_text("G28\nG1 X5\n")
    name, *others = arguments
    ended = done(tmp_path, str(tmp_path / name), *others)
    assert ended.returncode == code
    assert words in ended.stderr
    assert len(ended.stderr.splitlines()) == 1


def cube_file(path: Path, side_mm: float, *, is_open: bool = False) -> Path:
    """Write a cube as text STL, its last two triangles left out or not."""
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float) * side_mm
    squares = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = [corner for a, b, c, d in squares for corner in ((a, b, c), (a, c, d))]
    lines = ["solid cube"]
    for triangle in triangles[: -2 if is_open else None]:
        lines += ["facet normal 0 0 0", "outer loop"]
        lines += ["vertex " + " ".join(f"{value:g}" for value in corners[corner]) for corner in triangle]
        lines += ["endloop", "endfacet"]
    path.write_text("\n".join([*lines, "endsolid cube"]) + "\n")
    return path


@pytest.mark.skipif(shutil.which("prusa-slicer") is None, reason="needs prusa-slicer")
def test_a_model_is_sliced_and_printed(tmp_path: Path) -> None:
    """A cube of 6 mm comes out in the middle of the bed, hot, and cold at the end."""
    stl = cube_file(tmp_path / "cube.stl", 6)
    with printer() as there:
        ended = done(tmp_path, str(stl), "--unit", "mm", "--printer", uri(there), "--bed", "100,120,90", "--yes")
        assert (there.nozzle, there.bed) == (0.0, 0.0)
    assert (ended.returncode, ended.stderr) == (0, "")
    assert any(text.startswith("M109 S2") for text in there.done)
    found = examine([f"{text}\n" for text in there.done], "done")
    middle = [(low + high) / 2 for low, high in zip(found.low_mm, found.high_mm, strict=True)]
    assert middle[:2] == pytest.approx([50, 60], abs=1.5)
    assert found.high_mm[2] == pytest.approx(6, abs=0.2)


@pytest.mark.skipif(shutil.which("prusa-slicer") is None, reason="needs prusa-slicer")
def test_a_model_that_cannot_be_printed_is_refused(tmp_path: Path) -> None:
    """Open, larger than the bed, none at all, or with a profile that the slicer refuses: one line each."""
    there = ["--printer", "serial:/dev/ttyNOPE", "--yes", "--unit", "mm"]
    (tmp_path / "bad.ini").write_text("layer_height = many\n")
    cases = [
        ([str(cube_file(tmp_path / "open.stl", 20, is_open=True))], "cannot be printed"),
        ([str(cube_file(tmp_path / "large.stl", 400))], "cannot be printed"),
        ([str(cube_file(tmp_path / "cube.stl", 20)), "--profile", str(tmp_path / "bad.ini")], "the slicer refuses"),
    ]
    for arguments, words in cases:
        ended = done(tmp_path, *arguments, *there)
        assert ended.returncode == 4, ended.stderr
        assert words in ended.stderr
        assert len(ended.stderr.splitlines()) == 1


def test_without_a_slicer_it_says_how_to_get_one(tmp_path: Path) -> None:
    """Exit 3; G-code still prints."""
    stl = cube_file(tmp_path / "cube.stl", 20)
    asked = command(tmp_path, str(stl), "--printer", "serial:/dev/ttyNOPE", "--yes")
    bare = {**environment(tmp_path), "PATH": str(tmp_path)}
    ended = subprocess.run(asked, env=bare, capture_output=True, text=True, check=False, timeout=60)
    assert ended.returncode == 3
    assert "no slicer is installed" in ended.stderr
