"""Both programs over a serial cable: numbered images are paired correctly, through garbage and a pulled cable, and everything is counted."""

import random
import signal
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from tests.support.numbered import saved_numbers, write_film
from tests.support.programs import board, host, ledgers, lines, until
from tests.support.pty_line import PtyLine

FPS = 20
FRAMES = 1000


@pytest.fixture(scope="module")
def film(tmp_path_factory: pytest.TempPathFactory) -> str:
    """A replay URI of numbered images, clock-paced, so that two replays show the same number at the same time."""
    folder = write_film(tmp_path_factory.mktemp("film") / "numbered", FRAMES)
    return f"replay:{folder}?fps={FPS}&loop=1"


@pytest.fixture
def cable(tmp_path: Path) -> Iterator[PtyLine]:
    """A cable as fast as the board's gadget serial is assumed to be."""
    with PtyLine(tmp_path, bytes_per_s=3e6, delay_ns=300_000) as line:
        yield line


def check(out: Path, report: Any, account: Any) -> None:
    """Both images of every saved pair show the same number, every ledger adds up, and every frame is accounted for."""
    numbers = saved_numbers(out)
    assert numbers
    assert all(left == right for left, right in numbers)
    for ledger in ledgers(out):
        assert ledger["link"] == "serial"
        delays = ("capture_ns", "outbox_ns", "propagation_ns", "pairing_ns", "queuing_ns", "processing_ns")
        assert sum(ledger[name] for name in delays) == ledger["end_to_end_ns"]
    frames = report["frames"]
    assert frames["received"] == frames["paired"] + frames["held"] + sum(frames["orphaned"].values())
    for session in report["sessions"]:
        assert session["sent"] >= session["received"] + session["lost"]
    assert account["grabbed"] == account["sent"] + sum(account["dropped"].values())


def test_garbage_and_a_pulled_cable(film: str, cable: PtyLine, tmp_path: Path) -> None:
    """Pairs flow, keep flowing after a burst of garbage, and resume after the cable was pulled and plugged in; all in one session."""
    out = tmp_path / "out"
    board_uri, host_uri = cable.uris
    receiving = ["run", "--camera", film, "--link", host_uri, "--out", str(out), "--save-every", "1", "--json"]
    with (
        host([*receiving, "--log-level", "info"], tmp_path) as receiver,
        board(["run", "--camera", film, "--link", board_uri, "--json"], tmp_path) as sender,
    ):
        until(lambda: lines(out / "delays.jsonl") >= 10, "ten pairs")
        for burst in range(3):
            cable.inject(random.Random(burst).randbytes(20_000))
            before = lines(out / "delays.jsonl")
            until(lambda before=before: lines(out / "delays.jsonl") >= before + 10, "pairs after garbage")  # type: ignore[misc]  # bound now
        cable.pull()
        until(lambda: "board_gone" in receiver.stderr, "the host notices")
        cable.plug()
        before = lines(out / "delays.jsonl")
        until(lambda: lines(out / "delays.jsonl") >= before + 10, "pairs after the cable is back")
        assert receiver.stop() == 0
        assert sender.stop() == 0
        check(out, receiver.json(), sender.json())
    assert len({ledger["session"] for ledger in ledgers(out)}) == 1


def test_a_line_that_spoils_bytes(film: str, cable: PtyLine, tmp_path: Path) -> None:
    """On a line that sometimes flips a bit or loses bytes, every pair is correct, and lost frames are counted as lost."""
    chance = random.Random(5)

    def spoil(data: bytes) -> bytes:
        if chance.random() > 0.05:
            return data
        at = chance.randrange(len(data))
        return data[:at] + (bytes((data[at] ^ 4,)) if chance.random() < 0.5 else b"") + data[at + 1 :]

    out = tmp_path / "out"
    board_uri, host_uri = cable.uris
    receiving = ["run", "--camera", film, "--link", host_uri, "--out", str(out), "--save-every", "1", "--json"]
    with (
        host(receiving, tmp_path) as receiver,
        board(["run", "--camera", film, "--link", board_uri, "--json"], tmp_path) as sender,
    ):
        until(lambda: lines(out / "delays.jsonl") >= 5, "five pairs on a clean line")
        cable.ways[0].spoil = spoil
        before = lines(out / "delays.jsonl")
        until(lambda: lines(out / "delays.jsonl") >= before + 100, "a hundred pairs on a bad one")
        cable.ways[0].spoil = bytes
        assert receiver.stop() == 0
        assert sender.stop() == 0
        report = receiver.json()
    check(out, report, sender.json())
    assert sum(session["lost"] for session in report["sessions"]) > 0


def test_either_side_may_be_killed(film: str, cable: PtyLine, tmp_path: Path) -> None:
    """A board and then a host are killed and replaced; pairs flow again each time."""
    board_uri, host_uri = cable.uris
    sending, receiving = ["run", "--camera", film, "--link", board_uri], ["run", "--camera", film, "--link", host_uri]
    outs = [tmp_path / "out1", tmp_path / "out2"]
    with host([*receiving, "--out", str(outs[0]), "--save-every", "1"], tmp_path, "host1") as first:
        with board(sending, tmp_path, "board1") as killed:
            until(lambda: lines(outs[0] / "delays.jsonl") >= 5, "pairs of the first board")
            killed.send(signal.SIGKILL)
            killed.wait()
        before = lines(outs[0] / "delays.jsonl")
        with board(sending, tmp_path, "board2"):
            until(lambda: lines(outs[0] / "delays.jsonl") >= before + 5, "pairs of the second board")
            first.send(signal.SIGKILL)
            first.wait()
            with host([*receiving, "--out", str(outs[1]), "--save-every", "1"], tmp_path, "host2") as second:
                until(lambda: lines(outs[1] / "delays.jsonl") >= 5, "pairs for the second host")
                assert second.stop() == 0
    assert len({ledger["session"] for ledger in ledgers(outs[0])}) == 2
    for out in outs:
        assert all(left == right for left, right in saved_numbers(out))


@pytest.mark.parametrize(("bytes_per_s", "pairs"), [(11_520, 8), (80_000, 40)], ids=["115200 baud", "80 kB/s"])
def test_a_slow_line_carries_fresh_frames(film: str, bytes_per_s: float, pairs: int, tmp_path: Path) -> None:
    """On a line for a tenth or half of the frames, each frame sent was the newest, takes as long as its bytes need, and finds its partner."""
    out = tmp_path / "out"
    with PtyLine(tmp_path, bytes_per_s=bytes_per_s, delay_ns=5_000_000) as line:
        board_uri, host_uri = line.uris
        receiving = ["run", "--camera", film, "--link", host_uri, "--out", str(out), "--save-every", "1", "--json"]
        with (
            host([*receiving, "--pairs", str(pairs)], tmp_path) as receiver,
            board(["run", "--camera", film, "--link", board_uri, "--json"], tmp_path) as sender,
        ):
            assert receiver.wait() == 0
            assert sender.stop() == 0
            report = receiver.json()
    check(out, report, sender.json())
    kept = ledgers(out)
    assert all(ledger["propagation_ns"] >= ledger["bytes"] / bytes_per_s * 1e9 for ledger in kept)
    assert report["frames"]["orphaned"].get("no_partner", 0) <= 1  # the first, before the line's delay was known
    sequences = [ledger["sequence"] for ledger in kept]
    steps = [after - before for before, after in pairwise(sequences)]
    least = round(min(ledger["bytes"] for ledger in kept) / bytes_per_s * FPS)
    assert min(steps) >= max(
        1, least - 1
    )  # frames between two sent ones were replaced on the board; none waits in the line
    (session,) = report["sessions"]
    assert session["dropped"]["replaced"] > 0


def test_a_missing_port_is_told_in_one_line(film: str, tmp_path: Path) -> None:
    """A missing port ends either program with exit 3 and one line that names it."""
    arguments = ["run", "--camera", film, "--link", f"serial:{tmp_path}/ttyNone"]
    for start, name in ((board, "board"), (host, "host")):
        with start(arguments, tmp_path, name) as program:
            assert program.wait() == 3
            told = [line for line in program.stderr.splitlines() if "error" in line]
            assert len(told) == 1
            assert "ttyNone" in told[0]
            assert "Traceback" not in program.stderr


def test_a_port_that_is_in_use_is_told(film: str, cable: PtyLine, tmp_path: Path) -> None:
    """A second board on the same port ends with exit 3 and says that the port is taken."""
    arguments = ["run", "--camera", film, "--link", cable.uris[0], "--log-level", "info"]
    with board(arguments, tmp_path, "board1") as first:
        until(lambda: "serving" in first.stderr, "the first one serves")
        with board(arguments, tmp_path, "board2") as second:
            assert second.wait() == 3
            assert "taken" in second.stderr
        assert first.stop() == 0
