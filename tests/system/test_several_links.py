"""Both programs over two links: one is taken away and given back; numbered images are paired correctly throughout, and everything is counted."""

import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from common import now
from common.camera.factory import open_camera
from common.frame import Buffer
from common.link.base import SendResult
from common.link.zeromq import ZeroMqListener
from common.words import times
from phone_host.bench.emulate import Profile
from phone_host.bench.relay import relay_process
from tests.support.board_thread import board_of
from tests.support.keys import acquainted
from tests.support.numbered import saved_numbers, write_film
from tests.support.programs import board, free_port, host, ledgers, lines, until
from tests.support.pty_line import PtyLine

FPS = 20
FRAMES = 2000  # 100 s: longer than any test here, so that a number identifies one moment


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


FAR_AWAY = Profile(name="far away", carrier="tcp", bytes_per_s=0, delay_ns=250_000_000)
"""So much slower than the cable that the choice between the two never depends on how busy the machine is."""


@pytest.fixture
def network(tmp_path: Path) -> Iterator[tuple[str, str]]:
    """The board's address on a distant network, and the address at which the host reaches it."""
    board_uri = f"tcp://127.0.0.1:{free_port()}"
    with relay_process("tcp", board_uri, tmp_path, FAR_AWAY) as relay:
        yield relay.board, relay.host


def with_links(verb: list[str], *links: str) -> list[str]:
    """A program's arguments for these links."""
    return [*verb, *(word for link in links for word in ("--link", link))]


def carriers(out: Path) -> list[str]:
    """The links that carried pairs, in order; a link appears once for each time that it took over."""
    names = [ledger["link"] for ledger in ledgers(out)]
    return [name for number, name in enumerate(names) if number == 0 or names[number - 1] != name]


def check(out: Path, report: Any, account: Any) -> None:
    """Saved pairs show the same number twice, in order; ledgers add up; every frame of the one session is accounted for over all links."""
    numbers = saved_numbers(out)
    assert numbers
    assert all(left == right for left, right in numbers)
    kept = ledgers(out)
    assert [ledger["sequence"] for ledger in kept] == sorted({ledger["sequence"] for ledger in kept})
    for ledger in kept:
        delays = ("capture_ns", "outbox_ns", "propagation_ns", "pairing_ns", "queuing_ns", "processing_ns")
        assert sum(ledger[name] for name in delays) == ledger["end_to_end_ns"]
    (session,) = report["sessions"]
    assert session["tail"] == "known"
    assert session["grabbed"] == session["sent"] + sum(session["dropped"].values()) + session["waiting"]
    assert session["sent"] == session["received"] + session["lost"]
    assert session["received"] == sum(link["frames"] for link in report["links"])
    frames = report["frames"]
    assert frames["received"] == frames["paired"] + frames["held"] + sum(frames["orphaned"].values())
    assert account["grabbed"] == account["sent"] + sum(account["dropped"].values())


def test_a_pulled_cable_and_back(film: str, cable: PtyLine, network: tuple[str, str], tmp_path: Path) -> None:
    """Pairs come over serial, over TCP when the cable is pulled, and over serial again when it is back; in one session, each reported with its link."""
    out = tmp_path / "out"
    board_uri, host_uri = cable.uris
    board_tcp, host_tcp = network
    receiving = ["run", "--camera", film, "--out", str(out), "--save-every", "1", "--json", "--log-level", "info"]
    with (
        board(with_links(["run", "--camera", film, "--json"], board_uri, board_tcp), tmp_path) as sender,
        host(with_links(receiving, host_uri, host_tcp), tmp_path) as receiver,
    ):
        until(lambda: lines(out / "delays.jsonl") >= 10 and carriers(out)[-1] == "serial", "pairs over the cable")
        cable.pull()
        before = lines(out / "delays.jsonl")
        until(lambda: lines(out / "delays.jsonl") >= before + 20 and carriers(out)[-1] == "tcp", "pairs over TCP")
        cable.plug()
        until(lambda: carriers(out)[-1] == "serial", "pairs over the cable again")
        assert receiver.stop() == 0
        assert sender.stop() == 0
    report = receiver.json()
    check(out, report, sender.json())
    serial, over_tcp = report["links"]
    assert (serial["link"], over_tcp["link"]) == ("serial", "tcp")
    assert serial["lost"] == 1
    assert report["switches"] == serial["took_over"] + over_tcp["took_over"] - 1 >= 2
    page = (out / "index.html").read_text()
    assert f"the stream changed links {times(report['switches'])}" in page
    assert f"<td>tcp</td><td>{over_tcp['frames']}</td>" in page
    assert "link_switched source=serial target=tcp" in receiver.stderr
    assert "link_switched source=tcp target=serial" in receiver.stderr


def test_a_line_that_falls_silent_gives_way(
    film: str, cable: PtyLine, network: tuple[str, str], tmp_path: Path
) -> None:
    """A cable that silently swallows all bytes is replaced by TCP; no frame is paired twice or wrongly."""
    out = tmp_path / "out"
    board_uri, host_uri = cable.uris
    board_tcp, host_tcp = network
    receiving = ["run", "--camera", film, "--out", str(out), "--save-every", "1", "--json", "--log-level", "info"]
    with (
        board(with_links(["run", "--camera", film, "--json"], board_uri, board_tcp), tmp_path) as sender,
        host(with_links(receiving, host_uri, host_tcp), tmp_path) as receiver,
    ):
        until(lambda: lines(out / "delays.jsonl") >= 10 and carriers(out)[-1] == "serial", "pairs over the cable")
        for way in cable.ways:
            way.spoil = lambda _: b""
        before = lines(out / "delays.jsonl")
        until(lambda: lines(out / "delays.jsonl") >= before + 20 and carriers(out)[-1] == "tcp", "pairs over TCP")
        for way in cable.ways:
            way.spoil = bytes
        until(lambda: carriers(out)[-1] == "serial", "pairs over the cable again")
        assert receiver.stop() == 0
        assert sender.stop() == 0
    check(out, receiver.json(), sender.json())


def test_two_links_of_one_kind_and_one_that_comes_later(film: str, network: tuple[str, str], tmp_path: Path) -> None:
    """Two addresses of one board have names of their own; a link whose device appears during the run is used from then on."""
    out = tmp_path / "out"
    board_tcp, host_tcp = network
    serial = (f"serial:{tmp_path}/ttyBoard", f"serial:{tmp_path}/ttyHost")
    receiving = ["run", "--camera", film, "--out", str(out), "--save-every", "1", "--json", "--log-level", "info"]
    other = f"tcp://127.0.0.1:{free_port()}"
    second = tmp_path / "second"
    second.mkdir()
    with (
        relay_process("tcp", other, second, FAR_AWAY) as relay,
        board(with_links(["run", "--camera", film, "--json"], board_tcp, other, serial[0]), tmp_path) as sender,
        host(with_links(receiving, serial[1], host_tcp, relay.host), tmp_path) as receiver,
    ):
        until(lambda: lines(out / "delays.jsonl") >= 10, "pairs")
        assert carriers(out)[-1] in {"tcp", "tcp-2"}
        with PtyLine(tmp_path, bytes_per_s=3e6, delay_ns=300_000):
            until(lambda: carriers(out)[-1] == "serial", "pairs over the cable that was plugged in")
            assert receiver.stop() == 0
            assert sender.stop() == 0
    report = receiver.json()
    check(out, report, sender.json())
    assert [link["link"] for link in report["links"]] == ["serial", "tcp", "tcp-2"]


def test_two_boards_are_refused(film: str, tmp_path: Path) -> None:
    """A host whose links lead to two boards ends with exit 3 and one line that says so."""
    links = [f"ipc://{tmp_path}/link{number}" for number in range(2)]
    with (
        board(with_links(["run", "--camera", film], links[0]), tmp_path, "board1"),
        board(with_links(["run", "--camera", film], links[1]), tmp_path, "board2") as second,
    ):
        with host(with_links(["run", "--camera", film], *links), tmp_path) as receiver:
            assert receiver.wait() == 3
            told = [line for line in receiver.stderr.splitlines() if "error:" in line]
            assert len(told) == 1
            assert "different boards" in told[0]
            assert "Traceback" not in receiver.stderr
        with host(with_links(["run", "--camera", film, "--pairs", "3"], links[1]), tmp_path, "host2") as other:
            assert other.wait() == 0  # the second board was sent a goodbye
        assert second.process.poll() is None


def test_a_board_that_has_forgotten_the_host_is_still_heard_over_other_links(film: str, tmp_path: Path) -> None:
    """A link that refuses this machine's key is named in one line and skipped while another link is up; if it is the only one, the run ends with exit 3.

    Once the board knows the key, that link comes up without a restart, although it was refused before and again meanwhile.
    """
    ipc, tcp = f"ipc://{tmp_path}/link", f"tcp://127.0.0.1:{free_port()}"
    board_keys, host_keys = acquainted(tmp_path, tcp)
    forgotten = next(peer for peer in board_keys.peers() if peer.name == "dialler")
    board_keys.forget("dialler")
    out = tmp_path / "out"
    sending = with_links(["run", "--camera", film, "--keys", str(board_keys.path)], ipc, tcp.replace("127.0.0.1", "*"))
    receiving = ["run", "--camera", film, "--keys", str(host_keys.path)]
    with board(sending, tmp_path) as sender:
        with host(with_links([*receiving, "--out", str(out), "--log-level", "info"], tcp, ipc), tmp_path) as receiver:
            until(lambda: "link_refused" in receiver.stderr, "the refused link is named")
            before = lines(out / "delays.jsonl")
            until(lambda: lines(out / "delays.jsonl") >= before + 10, "pairs over the other link")
            assert set(carriers(out)) == {"ipc"}
            with host(with_links(receiving, tcp), tmp_path, "alone") as alone:
                assert alone.wait() == 3
            assert "link_up link=tcp" not in receiver.stderr
            board_keys.add(forgotten)
            until(lambda: "link_up link=tcp" in receiver.stderr, "the link is taken into use")
            assert receiver.stop() == 0
        refusals = [line for line in receiver.stderr.splitlines() if "link_refused" in line]
        assert len(refusals) == 1
        assert f"phone-host pair --link {tcp}" in refusals[0]
        assert sender.stop() == 0


class RepeatingLink(ZeroMqListener):
    """A transport that delivers every frame twice if it has room for both."""

    def send(self, connection: bytes, header: bytes, payload: Buffer) -> SendResult:
        """Send it twice."""
        result = super().send(connection, header, payload)
        if len(payload) and result is SendResult.SENT:
            super().send(connection, header, payload)
        return result


def test_a_frame_that_comes_twice_is_paired_once(film: str, tmp_path: Path) -> None:
    """What a transport delivers twice never reaches pairing: each frame makes one pair, the repetitions are counted, and the account balances."""
    out = tmp_path / "out"
    ipc = f"ipc://{tmp_path}/link"
    receiving = ["run", "--camera", film, "--out", str(out), "--save-every", "1", "--pairs", "30", "--json"]
    camera = open_camera(film, "board", now.monotonic_ns())
    with board_of(camera, RepeatingLink(ipc, board=True)), host(with_links(receiving, ipc), tmp_path) as receiver:
        assert receiver.wait() == 0
    report = receiver.json()
    sequences = [ledger["sequence"] for ledger in ledgers(out)]
    assert sequences == sorted(set(sequences))
    assert len(sequences) == 30
    assert all(left == right for left, right in saved_numbers(out))
    (session,) = report["sessions"]
    assert session["sent"] == session["received"] + session["lost"]
    assert 15 <= session["stale"]["duplicate"] <= session["received"]


@pytest.mark.parametrize("killed", ["board", "host"])
def test_either_side_may_be_killed(film: str, killed: str, cable: PtyLine, tmp_path: Path) -> None:
    """A board and a host are killed and replaced; pairs flow again over the same two links."""
    board_uri, host_uri = cable.uris
    ipc = f"ipc://{tmp_path}/link"
    sending = with_links(["run", "--camera", film], board_uri, ipc)
    receiving = with_links(["run", "--camera", film, "--save-every", "1"], host_uri, ipc)
    outs = [tmp_path / "out1", tmp_path / "out2"]
    with (
        host([*receiving, "--out", str(outs[0])], tmp_path, "host1") as first,
        board(sending, tmp_path, "board1") as second,
    ):
        until(lambda: lines(outs[0] / "delays.jsonl") >= 10, "pairs before")
        if killed == "host":
            first.send(signal.SIGKILL)
            first.wait()
            with host([*receiving, "--out", str(outs[1])], tmp_path, "host2") as third:
                until(lambda: lines(outs[1] / "delays.jsonl") >= 10, "pairs for the second host")
                assert third.stop() == 0
        else:
            second.send(signal.SIGKILL)
            second.wait()
            before = lines(outs[0] / "delays.jsonl")
            with board(sending, tmp_path, "board2"):
                until(lambda: lines(outs[0] / "delays.jsonl") >= before + 10, "pairs of the second board")
                assert first.stop() == 0
    assert all(left == right for out in outs if out.exists() for left, right in saved_numbers(out))
