"""A board records alone, as its user has it do, and its recording is joined with the host's: with the real programs."""

import json
import signal
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from board_agent.ring import part_path, parts_of
from common.recording.opened import open_recorded
from tests.support.handheld import Eye, hand, panned
from tests.support.programs import board, host, ledgers, on_a_full_disk, program, until

RATE = 25
IMAGES = 12 * RATE


@pytest.fixture(scope="module")
def films(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folders left and right: twelve seconds of a wall over which a hand moves two cameras; images of one number are of one moment."""
    root = tmp_path_factory.mktemp("films")
    positions = hand(np.random.default_rng(11), IMAGES / RATE + 1)
    for side in ("left", "right"):
        (root / side).mkdir()
        eye = Eye(begin_s=0, end_s=IMAGES / RATE + 0.5, rate_hz=RATE, missing=0)
        shown = panned(np.random.default_rng(1), positions + (0.3 if side == "right" else 0), eye)
        for number, one in enumerate(shown[:IMAGES]):
            (root / side / f"{number}.jpg").write_bytes(one.image.payload)
    return root


def _uri(films: Path, side: str, rate: int = RATE) -> str:
    return f"replay:{films}/{side}?fps={rate}&loop=1"


def _numbers(films: Path, side: str) -> dict[bytes, int]:
    return {path.read_bytes(): int(path.stem) for path in (films / side).iterdir()}


def _sessions(words: list[str], folder: Path, name: str) -> Any:
    with program("phone_host.cli", ["sessions", *words], folder, name) as asked:
        code = asked.wait()
        return code, asked.out.read_text(), asked.stderr


def _heard(films: Path, folder: Path) -> Path:
    """Record over the link until the board's clock is stored."""
    path, link = folder / "earlier.mcap", f"ipc://{folder}/link"
    with board(["run", "--camera", _uri(films, "left"), "--link", link], folder, "linked"):
        words = ["record", "--camera", _uri(films, "right"), "--link", link, "--out", str(path), "--seconds", "3"]
        with host(words, folder, "earlier") as running:
            assert running.wait() == 0, running.stderr
    return path


def test_a_board_s_and_a_host_s_recordings_are_joined_and_replayed(films: Path, tmp_path: Path) -> None:
    """Each records alone. Joined by an earlier clock exchange, they replay with the pairs that were of one moment; without it, `join` ends with exit code 4 and names --clock."""
    earlier = _heard(films, tmp_path)
    both = [tmp_path / "board.mcap", tmp_path / "host.mcap"]
    words = ["record", "--camera", _uri(films, "left"), "--out", str(both[0])]
    own = ["record", "--alone", "--camera", _uri(films, "right"), "--out", str(both[1]), "--seconds", "4"]
    with board(words, tmp_path) as recording:
        until(lambda: both[0].exists() and both[0].stat().st_size > 10_000, "a recording on the board")
        with host(own, tmp_path) as running:
            assert running.wait() == 0, running.stderr
        assert recording.stop() == 0, recording.stderr
        assert "recorded: " in recording.out.read_text()
    joined = tmp_path / "joined.mcap"
    words = ["join", *map(str, both), "--out", str(joined)]
    code, told, err = _sessions(words, tmp_path, "deaf")
    assert (code, told, err.count("\n"), joined.exists()) == (4, "", 1, False)
    assert "no clock exchange" in err
    assert "give --clock" in err
    code, told, err = _sessions([*words, "--clock", str(earlier), "--json"], tmp_path, "join")
    assert code == 0, err
    values = json.loads(told)
    assert values["uncertainty_ns"] < 10_000_000
    assert values["seconds"] > 2
    images = open_recorded(joined).images
    left = {one.image.stamp_ns: one for one in images["/left/image/compressed"]}
    numbers = {side: _numbers(films, side) for side in ("left", "right")}
    true_ns = {
        numbers["right"][bytes(one.image.payload)]: one.image.stamp_ns for one in images["/right/image/compressed"]
    }
    errors = [
        abs(at - true_ns[number])
        for at, one in left.items()
        if (number := numbers["left"][bytes(one.image.payload)]) in true_ns
    ]
    assert len(errors) > 2 * RATE
    assert max(errors) < 2 * values["uncertainty_ns"]
    played = ["run", "--replay", str(joined), "--out", f"{tmp_path}/out", "--save-every", "0"]
    with host(played, tmp_path, "played") as replay:
        assert replay.wait() == 0, replay.stderr
    shown = {
        side: {one.sequence: numbers[side][bytes(one.image.payload)] for one in images[f"/{side}/image/compressed"]}
        for side in ("left", "right")
    }
    pairs = [
        (shown["left"][line["sequence"]], shown["right"][line["host_sequence"]]) for line in ledgers(tmp_path / "out")
    ]
    assert len(pairs) > 2 * RATE
    assert all(one == other for one, other in pairs)


def test_a_ring_that_is_killed_can_be_read(films: Path, tmp_path: Path) -> None:
    """SIGKILL in the middle: never more than its size, all parts but the last are whole, the frames follow each other; a restart goes on."""
    path = tmp_path / "drive.mcap"
    words = ["record", "--camera", _uri(films, "left", 1000), "--out", str(path), "--ring", "16MB"]
    with board(words, tmp_path) as recording:
        until(lambda: 2 in parts_of(path) and part_path(path, 2).stat().st_size > 500_000, "a second part")
        recording.stop(signal.SIGKILL)
    parts = parts_of(path)
    opened = [open_recorded(part) for part in parts.values()]
    assert [one.is_complete for one in opened] == [*[True] * (len(opened) - 1), False]
    assert sum(one.size_bytes for one in opened) <= 16_000_000
    sequences = [one.sequence for part in opened for one in part.images["/left/image/compressed"]]
    assert sequences == list(range(sequences[0], sequences[0] + len(sequences)))
    with board([*words, "--seconds", "0.2", "--json"], tmp_path, "again") as again:
        assert again.wait() == 0, again.stderr
        assert again.json()["ended"] == "time"
    assert max(parts_of(path)) == max(parts) + 1


def test_a_full_disk_ends_the_recording_in_one_line(films: Path, tmp_path: Path) -> None:
    """A file may take 300 kB: what is in it can be read; exit code 4, and one line says why and what to do."""
    path = tmp_path / "a.mcap"
    words = ["record", "--camera", _uri(films, "left", 400), "--out", str(path)]
    ended = on_a_full_disk("board_agent.cli", words, tmp_path, 300_000)
    assert ended.returncode == 4
    assert "it ended early (File too large): make room; what is in it can be used" in ended.stdout
    assert ended.stdout.count("\n") == 1
    assert not ended.stderr
    assert len(open_recorded(path).images["/left/image/compressed"]) > 50


@pytest.mark.parametrize(
    ("words", "code", "problem"),
    [
        (["--camera", "replay:{films}/left", "--out", "a.mcap"], 2, "--camera has pace=demand, and so no clock"),
        (["--camera", "replay:{films}/left?fps=5", "--out", "a.bag"], 2, "--out a.bag does not end in .mcap"),
        (["--camera", "replay:{films}/left?fps=5", "--out", "a.mcap", "--ring", "1MB"], 2, "give at least 16MB"),
        (["--camera", "replay:{films}/left?fps=5", "--out", "a.mcap", "--seconds", "9e9h"], 2, "--seconds is"),
        (["--camera", "replay:{films}/left?fps=5", "--out", "a.mcap", "--most", "900000GB"], 3, "has room for"),
        (["--camera", "replay:{films}/left?fps=5", "--out", "none/a.mcap"], 3, "none cannot be used"),
        (["--out", "a.mcap"], 2, "no camera is given"),
    ],
)
def test_what_makes_no_sense_is_one_line(
    films: Path, tmp_path: Path, words: list[str], code: int, problem: str
) -> None:
    """What is wrong and what to do; nothing is written."""
    with board(["record", *(word.replace("{films}", str(films)) for word in words)], tmp_path) as asked:
        assert asked.wait() == code
    assert problem in asked.stderr
    assert asked.stderr.count("\n") == 1
    assert not list(tmp_path.glob("a*"))
