"""Unwanted callers at a board's door: silent strangers, guesses from many sides, codes typed twice, and false doors."""

import re
import socket
import time
from collections.abc import Iterator
from contextlib import ExitStack, closing, suppress
from itertools import cycle
from pathlib import Path

import pytest

from common.keys import KeyFolder
from common.protocol.enrolment_wire import frame_word
from common.protocol.enrolment_words import Ask, Identity
from tests.support.enrolment_rig import Owner, Rig, on_every_network, ports, start_pairing
from tests.support.numbered import write_film
from tests.support.programs import board, program, until


@pytest.fixture
def rig(tmp_path: Path) -> Iterator[Rig]:
    """A board that has no peers yet."""
    with on_every_network(tmp_path) as made:
        yield made


def test_one_code_and_one_account_of_tries_for_all_links(tmp_path: Path) -> None:
    """A board with two links shows one code, valid at either; wrong codes at both count together, whatever host they come from."""
    first = ports()
    second = next(port for port in iter(ports, None) if abs(port - first) > 1)
    write_film(tmp_path / "film", 10)
    listening = [word for port in (first, second) for word in ("--link", f"tcp://*:{port}")]
    serving = ["run", "--camera", f"replay:{tmp_path / 'film'}?pace=demand", "--keys", str(tmp_path / "b"), *listening]
    with ExitStack() as stack:
        agent = stack.enter_context(board(serving, tmp_path))
        until(lambda: "pairing_open" in agent.stderr, "the board takes in hosts")
        keeper = stack.enter_context(closing(Owner(str(tmp_path / "b"), tmp_path)))
        rigs = [Rig(agent, f"tcp://127.0.0.1:{port}", tmp_path, keeper) for port in (first, second)]
        for number, rig in enumerate((rigs[0], rigs[1], rigs[0])):
            assert rig.pair_wrongly("--keys", str(tmp_path / f"h{number}")) == 4
        assert "pause_s=60" in agent.stderr
        refused = rigs[1].pair()
        assert "pause" in refused.communicate("", timeout=60)[1]
        assert refused.returncode == 3
        keeper.leaves()
        owner = stack.enter_context(
            program("board_agent.cli", ["pair", "--keys", rigs[0].board_keys], tmp_path, "pair")
        )
        shown = re.compile(
            rf"^tcp://\*:{first}, tcp://\*:{second}: type this code on the host: (\d{{6}})$", re.MULTILINE
        )
        until(lambda: bool(shown.search(owner.out.read_text())), "the code is shown")
        (code,) = shown.findall(owner.out.read_text())
        pairing = rigs[1].pair("--code", code)
        _, err = pairing.communicate(timeout=60)
        assert pairing.returncode == 0, err
        assert owner.wait() == 0, owner.stderr


def test_strangers_that_say_nothing_keep_nobody_from_pairing(rig: Rig) -> None:
    """Strangers ask and fall silent, or never finish a word, or connect and say nothing: a host is paired meanwhile, and the strangers are disconnected."""
    door = ("127.0.0.1", int(rig.link.rpartition(":")[2]) + 1)
    ask = frame_word(Ask(Identity(bytes(32), "stranger")))
    until(lambda: "pairing_open" in rig.agent.stderr, "the door is open")
    with ExitStack() as stack:
        strangers = [stack.enter_context(socket.create_connection(door, timeout=60)) for _ in range(40)]
        for stranger, said in zip(strangers, cycle((ask, ask[:20], b"")), strict=False):
            with suppress(ConnectionError):  # made room for another one
                stranger.sendall(said)
        until(lambda: "pairing_asked" in rig.agent.stderr, "a stranger has asked")
        pairing = rig.pair()  # the code is the same for everyone who asks
        _, err = pairing.communicate(f"{rig.code()}\n", timeout=60)
        assert pairing.returncode == 0, err
        for stranger in strangers:
            with suppress(ConnectionError):
                while stranger.recv(1000):
                    pass
    assert "pairing_failed" not in rig.agent.stderr
    assert rig.agent.stderr.count("pairing_asked") <= 3


def test_who_is_connected_when_the_door_closes_is_hung_up_on(rig: Rig) -> None:
    """A stranger that connected while the door was open, and goes on asking, is cut off when it closes: nobody can guess after that."""
    until(lambda: "pairing_open" in rig.agent.stderr, "the door is open")
    door = ("127.0.0.1", int(rig.link.rpartition(":")[2]) + 1)
    assert rig.pair_by_code()[0] == 0
    ask = frame_word(Ask(Identity(bytes(32), "stranger")))
    with suppress(ConnectionError), socket.create_connection(door, timeout=60) as stranger:
        stranger.sendall(ask)
        while stranger.recv(1000):
            pass
    until(lambda: "pairing_closed" in rig.agent.stderr, "the door closes")
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(door)


def test_a_code_typed_before_is_refused_by_every_later_process(rig: Rig) -> None:
    """A man in the middle learns some bits each time a code is proved to him: a host proves a code only once, however often it is started."""
    assert rig.pair_wrongly() == 4
    (typed,) = KeyFolder(Path(rig.host_keys)).spent_codes()
    assert typed not in rig.codes()
    rig.owner.leaves()
    for _ in range(2):
        again = rig.pair("--code", typed)
        _, err = again.communicate(timeout=60)
        assert again.returncode == 2, err
        assert "typed before" in err
        assert err.count("\n") == 1
    assert rig.agent.stderr.count("pairing_failed") == 1, "the board has heard nothing of it"
    assert (Path(rig.host_keys) / "spent-codes").stat().st_mode & 0o077 == 0


def test_a_door_that_drips_is_given_up(tmp_path: Path) -> None:
    """A false door that never finishes a word, or says nothing at all, ends `phone-host pair` with one line: exit 3 or 4."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1] - 1
        for said, code, line in (
            (b"\xff", 3, "does not answer any more"),
            (b"HTTP/1.1 400 Bad Request\r\n" * 9, 4, "does not answer like a board"),
        ):
            pairing = start_pairing(f"tcp://127.0.0.1:{port}", str(tmp_path / "h"))
            line_to_host, _ = server.accept()
            with line_to_host:
                line_to_host.sendall(said)
                due = time.monotonic()
                while (
                    pairing.poll() is None
                ):  # much more often than the host's timeout, and too seldom to complete a word in that time
                    if time.monotonic() >= due:
                        due += 0.5
                        with suppress(ConnectionError):
                            line_to_host.sendall(b"\xff")
                    time.sleep(0.02)
            _, err = pairing.communicate()
            assert pairing.returncode == code, err
            assert line in err
            assert err.count("\n") == 1


def test_two_links_side_by_side_are_refused(tmp_path: Path) -> None:
    """A link on the port of another link's door ends the start with exit 2 and one line that names both and the remedy."""
    write_film(tmp_path / "film", 3)
    port = ports()
    for other in (f"tcp://*:{port + 1}", f"tcp://127.0.0.1:{port + 1}"):
        links = ["--link", f"tcp://*:{port}", "--link", other, "--keys", str(tmp_path / "b")]
        with board(["run", "--camera", f"replay:{tmp_path / 'film'}", *links], tmp_path) as agent:
            assert agent.wait() == 2
        assert f"tcp://*:{port} " in agent.stderr
        assert other in agent.stderr
        assert str(port + 2) in agent.stderr
        assert agent.stderr.count("\n") == 1


def test_three_wrong_codes_are_followed_by_a_pause(rig: Rig) -> None:
    """A wrong code ends with exit 4 and uses up the code shown; after the third nobody may try for a minute, unless the owner allows it."""
    for _ in range(3):
        assert rig.pair_wrongly() == 4
    assert len(set(rig.codes())) == 4, "three that were spent, and the next one"
    pairing = rig.pair()
    _, err = pairing.communicate("", timeout=60)
    assert pairing.returncode == 3
    assert "pause" in err
    assert re.search(r"wait \d+ s", err)
    assert rig.agent.stderr.count("pairing_failed") == 3
    assert "pause_s=60" in rig.agent.stderr
    rig.owner.leaves()
    with program("board_agent.cli", ["pair", "--keys", rig.board_keys], rig.folder, "pair") as owner:
        until(lambda: "type this code" in owner.out.read_text(), "the code is shown")
        pairing = rig.pair("--code", owner.out.read_text().split()[-1])
        assert pairing.wait(60) == 0, pairing.communicate()
        pairing.communicate()
        assert owner.wait() == 0


def test_the_owner_is_told_that_the_door_cannot_be_opened(rig: Rig) -> None:
    """While another program has the door's port, `board-agent pair` says so and shows no code; it goes on when the port is free."""
    assert rig.pair_by_code()[0] == 0
    until(lambda: "pairing_closed" in rig.agent.stderr, "the door closes")
    door = int(rig.link.rpartition(":")[2]) + 1
    with ExitStack() as stack:
        taken = stack.enter_context(socket.create_server(("", door)))
        owner = stack.enter_context(program("board_agent.cli", ["pair", "--keys", rig.board_keys], rig.folder, "pair"))
        until(lambda: str(door) in owner.stderr, "the owner is told")
        assert "Address already in use" in owner.stderr
        assert owner.out.read_text() == ""
        taken.close()
        until(lambda: "type this code" in owner.out.read_text(), "the code is shown")
