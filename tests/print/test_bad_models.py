"""What is wrong with a model, or with the disk, gets one line from each command that takes models; nothing is lost."""

import os
import struct
import subprocess
import sys
from pathlib import Path

import pytest

from common.errors import SettingsError
from phone_host.api import export_model
from tests.print.test_print_verb import cube_file, environment

NAN_PLY = (
    b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    b"element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 nan\n0 1 0\n3 0 1 2\n"
)


def said(home: Path, *words: str, most_bytes: int = 0) -> subprocess.CompletedProcess[str]:
    """Run a command; `most_bytes` is what a file may hold, as on a disk that is full."""
    limit = ["prlimit", f"--fsize={most_bytes}"] if most_bytes else []
    asked = [*limit, sys.executable, "-P", "-m", "phone_host.cli", *words]
    return subprocess.run(
        asked, env=environment(home), capture_output=True, text=True, check=False, timeout=100, cwd=home, stdin=subprocess.DEVNULL
    )  # fmt: skip


@pytest.fixture
def models(tmp_path: Path) -> Path:
    """A folder of bad models."""
    (tmp_path / "empty.stl").write_bytes(bytes(80) + struct.pack("<I", 0))
    (tmp_path / "nan.ply").write_bytes(NAN_PLY)
    (tmp_path / "beyond.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 99999999999999999999999\n")
    cube_file(tmp_path / "open.stl", 20, is_open=True)
    cube_file(tmp_path / "cube.stl", 20)
    return tmp_path


@pytest.mark.parametrize("verb", ["export", "printcheck", "print"])
@pytest.mark.parametrize(
    ("name", "words"),
    [("empty.stl", "holds no triangle"), ("nan.ply", "is no place"), ("beyond.obj", "line 4 is not read")],
)
def test_what_is_no_mesh_is_refused_in_one_line(models: Path, verb: str, name: str, words: str) -> None:
    """By each command, with exit 4, and nothing is written."""
    more = {
        "export": ["--to", "stl", "--out", "out"],
        "printcheck": ["--out", "out"],
        "print": ["--printer", "file:x.gcode"],
    }
    ended = said(models, verb, name, *more[verb])
    if verb == "print" and "no slicer is installed" in ended.stderr:
        pytest.skip("needs a slicer")
    assert ended.returncode == 4
    assert words in ended.stderr
    assert len(ended.stderr.splitlines()) == 1
    assert not list(models.rglob("out/*"))


def test_an_open_mesh_is_exported_with_a_note_and_cannot_be_mended(models: Path) -> None:
    """Export keeps every triangle and says so; printcheck draws the hole if it is told where; --fix refuses in one line."""
    exported = said(models, "export", "open.stl", "--unit", "mm", "--to", "3mf", "--tolerance", "0.1", "--out", "out")
    assert exported.returncode == 0
    assert "note: the mesh is not closed" in exported.stdout
    checked = said(models, "printcheck", "open.stl", "--unit", "mm", "--out", "out")
    assert checked.returncode == 4
    assert "stop: 4 edges end in nothing" in checked.stdout
    assert (models / "out/open-printcheck.png").stat().st_size > 1000
    before = sorted(models.rglob("*"))
    assert (
        said(models, "printcheck", "open.stl", "--unit", "mm").stdout.splitlines() == checked.stdout.splitlines()[:-1]
    )
    assert sorted(models.rglob("*")) == before, "without --out nothing is written"
    assert said(models, "printcheck", "open.stl", "--unit", "mm", "--fix").returncode == 2
    mended = said(models, "printcheck", "open.stl", "--unit", "mm", "--fix", "--out", "out2")
    assert mended.returncode == 4
    assert "not closed" in mended.stderr
    assert len(mended.stderr.splitlines()) == 1


@pytest.mark.parametrize(
    "words", [["export", "cube.stl", "--to", "stl"], ["printcheck", "cube.stl", "--fix"]], ids=["export", "check"]
)
def test_a_full_disk_is_told_and_what_was_there_stays(models: Path, words: list[str]) -> None:
    """One line with the folder, exit 3 or 4; no half of a file is left, and an older result is whole."""
    out = models / "out"
    out.mkdir()
    (out / "older.stl").write_text("mine")
    ended = said(models, *words, "--unit", "mm", "--out", "out", most_bytes=512)
    assert ended.returncode in {3, 4}
    assert "out" in ended.stderr
    assert len(ended.stderr.splitlines()) == 1
    left = [(path.name, path.read_text()) for path in out.iterdir() if path.name != ".tandemscan"]
    assert left == [("older.stl", "mine")]


def test_a_pipe_as_gcode_and_a_profile_that_is_not_there_are_refused_at_once(models: Path) -> None:
    """Nobody waits for the other end of a pipe; a missing profile is the option's fault, not the model's."""
    os.mkfifo(models / "pipe.gcode")
    ended = said(models, "print", "pipe.gcode", "--printer", "file:x.gcode")
    assert ended.returncode == 4
    assert ended.stderr.startswith("phone-host: error: pipe.gcode is not a plain file: ")
    ended = said(models, "print", "cube.stl", "--unit", "mm", "--printer", "file:x.gcode", "--profile", "none.ini")
    if "no slicer is installed" in ended.stderr:
        pytest.skip("needs a slicer")
    assert ended.returncode == 2
    assert "--profile none.ini is no file" in ended.stderr
    assert len(ended.stderr.splitlines()) == 1


def test_a_model_is_not_replaced_by_its_own_export(models: Path) -> None:
    """Neither under another spelling of its folder nor through the API's door; another format beside it is written."""
    assert said(models, "export", "cube.stl", "--unit", "mm", "--to", "ply", "--out", "made").returncode == 0
    made = models / "made" / "cube.ply"
    before = made.read_bytes()
    ended = said(models, "export", "made/cube.ply", "--to", "stl,ply", "--tolerance", "1mm", "--out", "./made/../made")
    assert (ended.returncode, ended.stdout) == (2, "")
    assert "made/cube.ply would be replaced by its own export: give another folder" in ended.stderr
    with pytest.raises(SettingsError, match="its own export"):
        export_model(made, ["ply"], models / "made")
    assert made.read_bytes() == before
    assert not (models / "made" / "cube.stl").exists()
    assert said(models, "export", "made/cube.ply", "--to", "stl", "--out", "made").returncode == 0
