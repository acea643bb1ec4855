"""`phone-host target` as a user starts it."""

import json
import subprocess
import sys
from pathlib import Path

import pytest


def _phone_host(*arguments: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "phone_host.cli", "target", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=110)


@pytest.mark.parametrize(
    ("arguments", "names", "square_mm"),
    [
        (["chessboard"], ["chessboard-9x6-25mm-a4.pdf", "chessboard-9x6-25mm-a4.svg"], 25),
        (["mat", "--paper", "letter"], ["mat-10x8-25mm-18mm-5x5-letter.pdf", "mat-10x8-25mm-18mm-5x5-letter.svg"], 25),
        (
            ["charuco", "--square", "2cm", "--mark", "15mm", "--paper", "a3"],
            ["charuco-8x6-20mm-15mm-5x5-a3.pdf", "charuco-8x6-20mm-15mm-5x5-a3.svg"],
            20,
        ),
        (["charuco", "--square", "1mm"], ["charuco-8x6-1mm-0.7mm-5x5-a4.pdf", "charuco-8x6-1mm-0.7mm-5x5-a4.svg"], 1),
        (["chessboard", "--screen", "1280x720"], ["chessboard-9x6-1280x720.png"], None),
    ],
)
def test_files_are_written_and_named(
    tmp_path: Path, arguments: list[str], names: list[str], square_mm: float | None
) -> None:
    """PDF and SVG lie in a new folder; --json names them and the square."""
    done = _phone_host(*arguments, "--out", tmp_path / "print", "--json")
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert told["files"] == [str(tmp_path / "print" / name) for name in names]
    assert told["square_mm"] == square_mm
    assert all((tmp_path / "print" / name).stat().st_size > 1000 for name in names)


def test_files_of_others_are_not_replaced(tmp_path: Path) -> None:
    """A file with the board's name and other content stays, exit 3; the same board may be made again."""
    assert _phone_host("chessboard", "--out", tmp_path).returncode == 0
    assert _phone_host("chessboard", "--out", tmp_path).returncode == 0
    mine = tmp_path / "chessboard-9x6-25mm-a4.pdf"
    mine.write_text("mine")
    done = _phone_host("chessboard", "--out", tmp_path)
    assert done.returncode == 3
    assert "chessboard-9x6-25mm-a4.pdf is another file" in done.stderr
    assert mine.read_text() == "mine"


def test_the_next_command_is_told(tmp_path: Path) -> None:
    """For a screen the size of a pixel follows from its diagonal, and the next command has it; a mat is for scans, too."""
    done = _phone_host("chessboard", "--screen", "1920x1080", "--diagonal", "15.6in", "--out", tmp_path)
    assert done.returncode == 0, done.stderr
    assert "--square '120px*0.1799mm'" in done.stdout
    mat = _phone_host("mat", "--out", tmp_path)
    assert "phone-host scan left/ right/ --mat 10x8:25mm:18mm:5x5" in mat.stdout


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["chessboard", "--square", "40mm"], "does not fit on A4"),
        (["chessboard", "--size", "9by6"], "--size is '9by6'"),
        (["chessboard", "--mark", "10mm"], "a chessboard has no marks"),
        (["charuco", "--square", "20mm", "--mark", "20mm"], "--mark 20mm does not fit"),
        (["mat", "--screen", "1280x720"], "--screen shows chessboards"),
        (["chessboard", "--diagonal", "15in"], "--diagonal is of a screen"),
        (["chessboard", "--screen", "1280x720", "--diagonal", "15.6"], "give its unit"),
        (["chessboard", "--screen", "1280x720", "--diagonal", "0in"], "which no screen has"),
        (["chessboard", "--screen", "1e9x1e9"], "20000 each, such as 1920x1080"),
        (["chessboard", "--square", "0.1mm"], "which no chessboard has"),
        (["chessboard", "--screen", "1280x720", "--square", "20mm"], "squares follow from its pixels"),
    ],
)
def test_what_makes_no_sense_is_exit_2_in_one_line(tmp_path: Path, arguments: list[str], said: str) -> None:
    """Nothing is written."""
    done = _phone_host(*arguments, "--out", tmp_path / "print")
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert said in done.stderr
    assert not (tmp_path / "print").exists()
