"""Either side is killed and comes back, in any order: the stream returns, nothing is paired wrongly, everything is counted."""

import signal
from pathlib import Path
from typing import Any

import pytest

from tests.support.numbered import saved_numbers, write_film
from tests.support.programs import board, free_port, host, ledgers, lines, until

FPS = 20
FRAMES = 1000  # 50 s: longer than any test here, so that a number identifies one moment


@pytest.fixture(scope="module")
def film(tmp_path_factory: pytest.TempPathFactory) -> str:
    """A replay URI of numbered images, clock-paced, so that two replays show the same number at the same time."""
    folder = write_film(tmp_path_factory.mktemp("film") / "numbered", FRAMES)
    return f"replay:{folder}?fps={FPS}&loop=1"


@pytest.fixture(params=["tcp", "ipc"])
def link(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    """A link address that nobody uses."""
    return f"tcp://127.0.0.1:{free_port()}" if request.param == "tcp" else f"ipc://{tmp_path}/link"


def check_pairs(out: Path) -> None:
    """Both images of every saved pair show the same number, and every ledger adds up."""
    numbers = saved_numbers(out)
    assert numbers
    assert all(left == right for left, right in numbers)
    for ledger in ledgers(out):
        delays = ("capture_ns", "outbox_ns", "propagation_ns", "pairing_ns", "queuing_ns", "processing_ns")
        assert sum(ledger[name] for name in delays) == ledger["end_to_end_ns"]


def check_account(session: dict[str, Any]) -> None:
    """A session that ended in order balances on both sides of the link."""
    assert session["tail"] == "known"
    assert session["grabbed"] == session["sent"] + sum(session["dropped"].values()) + session["waiting"]
    assert session["waiting"] in {0, 1}
    assert session["sent"] == session["received"] + session["lost"]


def test_a_killed_board_comes_back_and_the_host_goes_on(film: str, link: str, tmp_path: Path) -> None:
    """After SIGKILL and restart of the board the running host pairs frames of the new session, and only matching ones."""
    out = tmp_path / "out"
    arguments = ["run", "--camera", film, "--link", link]
    with host([*arguments, "--out", str(out), "--save-every", "1", "--json"], tmp_path) as receiver:
        with board(arguments, tmp_path, "board1") as first:
            until(lambda: lines(out / "delays.jsonl") >= 10, "ten pairs of the first session")
            first.send(signal.SIGKILL)
            first.wait()
        before = lines(out / "delays.jsonl")
        with board(arguments, tmp_path, "board2") as second:
            until(lambda: lines(out / "delays.jsonl") >= before + 10, "ten pairs of the second session")
            assert receiver.stop() == 0
            assert second.stop() == 0
    sessions = [ledger["session"] for ledger in ledgers(out)]
    assert len(set(sessions)) == 2
    assert sessions == sorted(sessions, key=sessions.index)  # never back to the old one
    report = receiver.json()
    assert [session["tail"] for session in report["sessions"]] == ["unknown", "known"]
    check_account(report["sessions"][1])
    frames = report["frames"]
    assert frames["received"] == frames["paired"] + frames["held"] + sum(frames["orphaned"].values())
    check_pairs(out)


def test_a_killed_host_comes_back_and_the_board_goes_on(film: str, link: str, tmp_path: Path) -> None:
    """After SIGKILL of the host a new one gets the stream from the same board session, starting with fresh frames."""
    arguments = ["run", "--camera", film, "--link", link]
    with board([*arguments, "--json"], tmp_path) as sender:
        outs = [tmp_path / f"out{number}" for number in range(3)]
        for number, out in enumerate(outs):
            with host([*arguments, "--out", str(out), "--save-every", "1"], tmp_path, f"host{number}") as receiver:
                until(lambda out=out: lines(out / "delays.jsonl") >= 10, f"ten pairs for host {number}")  # type: ignore[misc]  # bound now
                receiver.send(signal.SIGKILL)
                receiver.wait()
        assert sender.stop() == 0
        account = sender.json()
    for out in outs:
        check_pairs(out)
    last = [ledgers(out)[-1]["sequence"] for out in outs]
    first = [ledgers(out)[0]["sequence"] for out in outs]
    assert first[1] > last[0]
    assert first[2] > last[1]
    assert len({ledger["session"] for out in outs for ledger in ledgers(out)}) == 1
    assert account["grabbed"] == account["sent"] + sum(account["dropped"].values())


def test_a_host_may_come_long_before_its_board(film: str, link: str, tmp_path: Path) -> None:
    """A host that was started first finds the board when it comes, and ends with exit 0 after the requested number of pairs."""
    out = tmp_path / "out"
    arguments = ["run", "--camera", film, "--link", link]
    with host([*arguments, "--out", str(out), "--pairs", "5", "--save-every", "1"], tmp_path) as receiver:
        until((out / "delays.jsonl").exists, "the host has started")
        with board(arguments, tmp_path):
            assert receiver.wait() == 0
    assert len(ledgers(out)) == 5
    check_pairs(out)


def test_who_listens_may_be_swapped(film: str, link: str, tmp_path: Path) -> None:
    """With ?bind=1 on the host and ?connect=1 on the board the same stream flows, even after the board was killed."""
    out = tmp_path / "out"
    with host(
        ["run", "--camera", film, "--link", f"{link}?bind=1", "--out", str(out), "--save-every", "1"], tmp_path
    ) as receiver:
        sender = ["run", "--camera", film, "--link", f"{link}?connect=1"]
        with board(sender, tmp_path, "board1") as first:
            until(lambda: lines(out / "delays.jsonl") >= 5, "five pairs of the first session")
            first.send(signal.SIGKILL)
            first.wait()
        before = lines(out / "delays.jsonl")
        with board(sender, tmp_path, "board2"):
            until(lambda: lines(out / "delays.jsonl") >= before + 5, "five pairs of the second session")
            assert receiver.stop() == 0
    check_pairs(out)


def test_a_stopped_board_process_is_missed_and_found_again(film: str, link: str, tmp_path: Path) -> None:
    """A board frozen by SIGSTOP until the host gave it up continues in the same session; frames it sent meanwhile are lost, not paired."""
    out = tmp_path / "out"
    arguments = ["run", "--camera", film, "--link", link]
    with (
        host(
            [*arguments, "--out", str(out), "--save-every", "1", "--json", "--log-level", "info"], tmp_path
        ) as receiver,
        board(arguments, tmp_path) as sender,
    ):
        until(lambda: lines(out / "delays.jsonl") >= 5, "five pairs before")
        sender.send(signal.SIGSTOP)
        until(lambda: "board_gone" in receiver.stderr, "the host notices")
        before = lines(out / "delays.jsonl")
        sender.send(signal.SIGCONT)
        until(lambda: lines(out / "delays.jsonl") >= before + 5, "five pairs after")
        assert receiver.stop() == 0
    check_pairs(out)
    assert len({ledger["session"] for ledger in ledgers(out)}) == 1


def test_a_second_host_is_told_busy(film: str, link: str, tmp_path: Path) -> None:
    """While one host is served, another ends with exit 3 and one line that says busy, as its report and page do; the first keeps its stream."""
    out, refused = tmp_path / "out", tmp_path / "refused"
    arguments = ["run", "--camera", film, "--link", link]
    with (
        board(arguments, tmp_path),
        host([*arguments, "--out", str(out), "--save-every", "1"], tmp_path, "host1") as first,
    ):
        until(lambda: lines(out / "delays.jsonl") >= 5, "the first host streams")
        with host([*arguments, "--wait", "4", "--out", str(refused), "--json"], tmp_path, "host2") as second:
            assert second.wait() == 3
            complaint = [line for line in second.stderr.splitlines() if "error" in line]
            assert len(complaint) == 1
            assert "busy" in complaint[0]
            assert "Traceback" not in second.stderr
        told = second.json()
        assert "waiting for a board" not in second.stderr
        assert "busy with another host" in told["error"]["problem"]
        assert "busy with another host" in told["trust"]["headline"]
        assert told["trust"]["headline"] in (refused / "index.html").read_text(encoding="utf-8")
        before = lines(out / "delays.jsonl")
        until(lambda: lines(out / "delays.jsonl") >= before + 5, "the first host streams on")
        assert first.stop(signal.SIGINT) == 130
    check_pairs(out)


@pytest.mark.parametrize("fps", [2, 500])
def test_a_demand_paced_film_begins_anew_with_its_board(fps: int, link: str, tmp_path: Path) -> None:
    """After the board is killed both replays restart at image 0, whether the film is slower or faster than the clock."""
    folder, out = write_film(tmp_path / "film", 200), tmp_path / "out"
    arguments = ["run", "--camera", f"replay:{folder}?fps={fps}&pace=demand", "--link", link]
    with host([*arguments, "--out", str(out), "--save-every", "1", "--pairs", "60", "--json"], tmp_path) as receiver:
        with board(arguments, tmp_path, "board1") as first:
            until(lambda: lines(out / "delays.jsonl") >= 10, "ten pairs of the first session")
            first.send(signal.SIGKILL)
            first.wait()
        with board(arguments, tmp_path, "board2"):
            assert receiver.wait() == 0
    numbers = saved_numbers(out)
    assert len(numbers) == 60
    assert all(left == right for left, right in numbers)
    sessions = [ledger["session"] for ledger in ledgers(out)]
    for session in set(sessions):
        shown = [left for (left, _), of in zip(numbers, sessions, strict=True) if of == session]
        assert shown == list(range(len(shown)))
