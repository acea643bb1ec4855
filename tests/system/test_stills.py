"""Folders of photographs through both programs: paired by the number in the name, never with another one, never without a word."""

import json
from pathlib import Path

import pytest

from tests.support.numbered import saved_numbers, write_film
from tests.support.programs import board, host


def stills(folder: Path, name: str, numbers: list[int]) -> Path:
    """A folder that holds these numbered images under a camera's own names."""
    write_film(folder / "film", max(numbers) + 1)
    (folder / name).mkdir()
    for number in numbers:
        (folder / "film" / f"{number}.jpg").rename(folder / name / f"{number:04}_{name}1.jpg")
    return folder / name


def test_photographs_meet_the_one_of_their_number(tmp_path: Path) -> None:
    """The sides begin at 2 and 4, both lack numbers, and one is longer: each saved pair shows one number twice, and the rest are counted and doubted."""
    left = stills(tmp_path, "left", [2, 3, 4, 5, 7, 8, 9])
    right = stills(tmp_path, "right", [4, 5, 6, 7, 9, 11])
    link, out = f"ipc://{tmp_path}/link", tmp_path / "out"
    receiving = ["run", "--camera", f"replay:{right}", "--link", link, "--out", str(out), "--save-every", "1", "--json"]
    with (
        host(receiving, tmp_path) as receiver,
        board(["run", "--camera", f"replay:{left}", "--link", link], tmp_path) as sender,
    ):
        assert receiver.wait() == 0
        assert sender.wait() == 0
    assert saved_numbers(out) == [(number, number) for number in (4, 5, 7, 9)]
    report = receiver.json()
    assert report["paired_by"] == "number"
    assert report["frames"]["orphaned"] == {"no_image_of_that_number": 3}
    assert report["host_frames"]["orphaned"] == {"no_image_of_that_number": 2}
    assert [warning["doubt"] for warning in report["warnings"]] == ["image_numbers"]
    assert report["delays_ms"]["capture"] is None
    assert set(report["not_measured"]) == {"capture", "end_to_end", "time_skew"}


@pytest.mark.parametrize(("left", "right"), [("", "?fps=20&loop=1"), ("?loop=1", "")])
def test_stills_and_a_film_are_refused(left: str, right: str, tmp_path: Path) -> None:
    """One line names both and what to change; the exit code is that of a wrong setting."""
    film, link = write_film(tmp_path / "film", 5), f"ipc://{tmp_path}/link"
    with (
        board(["run", "--camera", f"replay:{film}{left}", "--link", link], tmp_path),
        host(["run", "--camera", f"replay:{film}{right}", "--link", link], tmp_path) as receiver,
    ):
        assert receiver.wait() == 2
    last = receiver.stderr.splitlines()[-1]
    assert "shows stills" in last
    assert "keeps a clock" in last


def test_without_a_board_a_run_waits_says_so_and_ends_with_3(tmp_path: Path) -> None:
    """Also if this machine's film ends meanwhile; what is waited for is said once."""
    film, link = write_film(tmp_path / "film", 3), f"ipc://{tmp_path}/link"
    with (
        host(["run", "--camera", f"replay:{film}?fps=30", "--link", link], tmp_path, "short") as short,
        host(["run", "--camera", f"replay:{film}?loop=1", "--link", link, "--wait", "1.5"], tmp_path) as waiting,
    ):
        assert short.wait() == 3
        assert waiting.wait() == 3
    assert "no board came before this machine's camera had shown its last image" in short.stderr
    assert waiting.stderr.count(f"waiting for a board at {link}") == 1
    assert "no board within 1.5 s" in waiting.stderr


def test_seconds_end_a_run_and_another_commands_report_is_kept(tmp_path: Path) -> None:
    """A second after the first pair the run is done, with 0; `calibrate` then puts its report beside that of the run."""
    film, link, out = write_film(tmp_path / "film", 3), f"ipc://{tmp_path}/link", tmp_path / "out"
    camera = f"replay:{film}?fps=20&loop=1"
    limited = ["run", "--camera", camera, "--link", link, "--seconds", "1", "--json", "--out", str(out)]
    with board(["run", "--camera", camera, "--link", link], tmp_path), host(limited, tmp_path) as receiver:
        assert receiver.wait() == 0
    report = receiver.json()
    assert report["command"] == "run"
    assert report["ended"] == "seconds_over"
    assert report["pairs"] > 1
    boards = tmp_path / "boards"
    boards.mkdir()
    (boards / "0.jpg").write_bytes((film / "1.jpg").read_bytes())
    size = ["--board", "9x6", "--square", "25mm", "--out", str(out / "rig.yaml")]
    with host(["calibrate", str(film), str(boards), *size], tmp_path, "calibrate") as calibrating:
        assert calibrating.wait() == 4  # there is no chessboard
    assert "what run has written in" in calibrating.stderr
    assert json.loads((out / "report-run.json").read_text())["pairs"] == report["pairs"]
    assert (out / "index-run.html").exists()
    assert json.loads((out / "report.json").read_text())["verdict"] == "reject"
