"""The board lowers its camera's rate on a cable that is too slow, says so, and raises it again; nothing is lost from the account, no pair is wrong."""

import json
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from tests.support.numbered import saved_numbers, write_film
from tests.support.programs import Program, board, host, ledgers, lines, until
from tests.support.pty_line import PtyLine

FPS = 20
LEAST_FPS = 5


@pytest.fixture(scope="module")
def film(tmp_path_factory: pytest.TempPathFactory) -> tuple[str, int]:
    """A replay URI of numbered images on the clock, and the length of the longest."""
    folder = write_film(tmp_path_factory.mktemp("film") / "numbered", 1000)
    return f"replay:{folder}?fps={FPS}&loop=1", max(path.stat().st_size for path in folder.iterdir())


def rungs(program: Program) -> list[int]:
    """The rungs to which a program says that the camera went."""
    steps = [line for line in program.stderr.splitlines() if "camera_stepped" in line]
    return [int(word.partition("=")[2]) for line in steps for word in line.split() if word.startswith("rung=")]


def steps(out: Path) -> list[int]:
    """How many periods of the film lie between the board's frames of each two pairs."""
    exposed = [ledger["exposed_ns"] for ledger in ledgers(out)] if lines(out / "delays.jsonl") else []
    return [round((after - before) * FPS / 1e9) for before, after in pairwise(exposed)]


def check_account(out: Path, report: Any, account: Any) -> None:
    """Every pair shows one number twice, and every frame is accounted for on both sides."""
    numbers = saved_numbers(out)
    assert numbers
    assert all(left == right for left, right in numbers)
    frames = report["frames"]
    assert frames["received"] == frames["paired"] + frames["held"] + sum(frames["orphaned"].values())
    [session] = report["sessions"]
    assert session["sent"] >= session["received"] + session["lost"]
    assert account["grabbed"] == account["sent"] + sum(account["dropped"].values())


def test_the_rate_follows_the_line(film: tuple[str, int], tmp_path: Path) -> None:
    """On a line for half of the frames the camera goes to half its rate, where none is replaced; on a fast one it is back at the whole, in one session."""
    uri, largest_bytes = film
    out = tmp_path / "out"
    slow_bytes_per_s = 1.15 * largest_bytes * FPS / 2
    with PtyLine(tmp_path, bytes_per_s=slow_bytes_per_s, delay_ns=1_000_000) as line:
        board_uri, host_uri = line.uris
        receiving = ["run", "--camera", uri, "--link", host_uri, "--out", str(out), "--save-every", "1", "--json"]
        sending = ["run", "--camera", uri, "--link", board_uri, "--least-fps", str(LEAST_FPS), "--json"]
        with (
            host([*receiving, "--log-level", "info"], tmp_path) as receiver,
            board(sending, tmp_path) as sender,
        ):
            until(lambda: rungs(sender)[-1:] == [1], "half of the rate")
            until(lambda: rungs(receiver)[-1:] == [1], "the host knows")
            until(lambda: steps(out)[-25:].count(2) >= 24, "every other image, without a gap")
            for way in line.ways:
                way.bytes_per_s = 3e6
            until(lambda: rungs(sender)[-1:] == [0], "the whole rate")
            until(lambda: rungs(receiver)[-1:] == [0], "the host knows")
            before = lines(out / "delays.jsonl")
            until(lambda: lines(out / "delays.jsonl") >= before + 30, "pairs at the whole rate")
            assert receiver.stop() == 0
            assert sender.stop() == 0
            report, account = receiver.json(), sender.json()
    check_account(out, report, account)
    [session] = report["sessions"]
    assert session["camera"]["rung"] == 0
    assert session["camera"]["lowest_rung"] == 3  # 10, 6.7 and 5 frames/s
    assert session["camera"]["changes"] == len(rungs(sender)) == len(rungs(receiver)) >= 2
    assert session["camera"]["fps"] == pytest.approx(FPS, abs=0.01)
    assert "board camera: as it was asked for" in (out / "index.html").read_text()
    assert json.loads((out / "report.json").read_text())["sessions"][0]["camera"] == session["camera"]


def test_without_leave_the_rate_stays(film: tuple[str, int], tmp_path: Path) -> None:
    """A camera whose rate may not be lowered is left as it is on however slow a line; frames are replaced on the board."""
    uri, largest_bytes = film
    out = tmp_path / "out"
    with PtyLine(tmp_path, bytes_per_s=largest_bytes * FPS / 4, delay_ns=1_000_000) as line:
        board_uri, host_uri = line.uris
        receiving = ["run", "--camera", uri, "--link", host_uri, "--out", str(out), "--save-every", "1", "--json"]
        with (
            host([*receiving, "--pairs", "60"], tmp_path) as receiver,
            board(["run", "--camera", uri, "--link", board_uri, "--json"], tmp_path) as sender,
        ):
            assert receiver.wait() == 0
            assert sender.stop() == 0
            report, account = receiver.json(), sender.json()
    check_account(out, report, account)
    assert rungs(sender) == []
    assert report["sessions"][0]["camera"]["lowest_rung"] == 0
    assert account["dropped"]["replaced"] > 60
