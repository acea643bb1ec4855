"""Both programs enrol each other by a code, over real sockets, with the real commands."""

import json
import os
import pty
import re
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
import zmq

from common.keys import KeyFolder
from common.protocol.enrolment_code import CODE_DIGITS
from tests.support.enrolment_rig import Rig, on_every_network, ports, start_pairing
from tests.support.numbered import write_film
from tests.support.programs import board, host, program, until


@pytest.fixture
def rig(tmp_path: Path) -> Iterator[Rig]:
    """A board that has no peers yet."""
    with on_every_network(tmp_path) as made:
        yield made


def test_a_code_that_the_owner_is_shown_lets_a_host_in(rig: Rig) -> None:
    """`board-agent pair` shows a code; typed on the host it makes both trust each other, and the stream runs; then the door is closed.

    The board's log, which others can read too, says that a host asks, but never shows the code.
    """
    code, out, err = rig.pair_by_code()
    assert code == 0, err
    paired = json.loads(out)
    assert paired["name"] == re.sub(r"[^A-Za-z0-9._-]", "-", socket.gethostname())[:64]
    assert paired["key"] == KeyFolder(Path(rig.board_keys)).own().public
    assert [peer.key for peer in KeyFolder(Path(rig.board_keys)).peers()] == [
        KeyFolder(Path(rig.host_keys)).own().public
    ]
    rig.streams("host")
    assert "pairing_asked" in rig.agent.stderr
    assert not [shown for shown in rig.codes() if shown in rig.agent.stderr]
    until(lambda: "pairing_closed" in rig.agent.stderr, "the door closes")
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(("127.0.0.1", int(rig.link.rpartition(":")[2]) + 1))


def test_a_host_that_is_not_paired_is_told_so_in_one_line(rig: Rig) -> None:
    """Before pairing, `run` ends with exit 3 and the command that helps; the same happens once the board has forgotten the host."""
    arguments = [
        "run",
        "--link",
        rig.link,
        "--keys",
        rig.host_keys,
        "--camera",
        f"replay:{rig.folder / 'film'}?pace=demand",
    ]
    with host(arguments, rig.folder, "stranger") as stranger:
        assert stranger.wait() == 3
    assert f"phone-host pair --link {rig.link}" in stranger.stderr.splitlines()[-1]
    assert rig.pair_by_code()[0] == 0
    name = KeyFolder(Path(rig.board_keys)).peers()[0].name
    with board(["keys", "--keys", rig.board_keys, "--forget", name, "--json"], rig.folder, "forget") as forget:
        assert forget.wait() == 0, forget.stderr
    assert forget.json()["peers"] == []
    with host(arguments, rig.folder, "forgotten") as forgotten:
        assert forgotten.wait() == 3
    assert "does not know this machine's key" in forgotten.stderr
    assert f"phone-host pair --link {rig.link}" in forgotten.stderr
    assert "key_denied" in rig.agent.stderr
    assert "Traceback" not in rig.agent.stderr + forgotten.stderr


def test_the_owner_takes_in_a_second_host(rig: Rig) -> None:
    """Once a host is known the door is closed; `board-agent pair` opens it, shows the code at once and says who has come; --code accepts it."""
    assert rig.pair_by_code()[0] == 0
    until(lambda: "pairing_closed" in rig.agent.stderr, "the door closes")
    second = ["--keys", str(rig.folder / "h2")]
    with program("board_agent.cli", ["pair", "--keys", rig.board_keys], rig.folder, "pair") as owner:
        until(lambda: "type this code" in owner.out.read_text(), "the code is shown")
        shown = owner.out.read_text().split()[-1]
        assert len(shown) == CODE_DIGITS
        pairing = rig.pair("--code", shown, "--json", *second)
        out, err = pairing.communicate(timeout=60)
        assert pairing.returncode == 0, err
        assert owner.wait() == 0, owner.stderr
    assert "paired with" in owner.out.read_text()
    names = [peer.name for peer in KeyFolder(Path(rig.board_keys)).peers()]
    assert len(names) == 2
    assert names[1] == f"{names[0]}-2"
    assert json.loads(out)["key"] == KeyFolder(Path(rig.board_keys)).own().public


def test_on_a_terminal_a_wrong_code_is_asked_again(rig: Rig) -> None:
    """After a mistyped code, a terminal user gets another try with the new code; the old one is no longer accepted."""
    master, slave = pty.openpty()
    command = ["pair", "--link", rig.link, "--keys", rig.host_keys]
    err = rig.folder / "pair.err"
    with err.open("wb") as said:
        pairing = subprocess.Popen([sys.executable, "-P", "-m", "phone_host.cli", *command], stdin=slave, stderr=said)
    os.close(slave)
    try:
        until(lambda: "board-agent pair" in err.read_text(), "the first code is asked for")
        os.write(master, b"%06d\n" % ((int(rig.code()) + 1) % 10**CODE_DIGITS))
        until(lambda: len(rig.codes()) == 2, "the owner is shown the second code")
        until(lambda: err.read_text().count("and type the 6 digits") == 2, "the second code is asked for")
        os.write(master, f"{rig.codes()[1][:3]} {rig.codes()[1][3:]}\n".encode())
        assert pairing.wait(60) == 0, err.read_text()
    finally:
        pairing.kill()
        pairing.wait()
        os.close(master)
    assert "the code was wrong" in err.read_text() or "not proved" in err.read_text()


def test_without_an_agent_pair_waits_and_says_so(tmp_path: Path) -> None:
    """`board-agent pair` without an agent says what it waits for, and after its timeout ends with exit 3 and the remedy; so does the host's."""
    with program("board_agent.cli", ["pair", "--seconds", "2", "--keys", str(tmp_path)], tmp_path, "pair") as alone:
        assert alone.wait() == 3
    waiting, last = alone.stderr.splitlines()
    for line in (waiting, last):
        assert "no running board-agent" in line
    assert "waiting" in waiting


def test_the_owner_may_come_before_the_agent(tmp_path: Path) -> None:
    """`board-agent pair` waits for an agent that has opened no link because its camera is missing, and goes on once the camera is there."""
    camera = tmp_path / "film"
    config = tmp_path / "board.toml"
    port = ports()
    config.write_text(
        f'camera = "replay:{camera}?pace=demand"\nlink = ["tcp://*:{port}"]\nkeys = "{tmp_path}/b"\nwait_for_camera = true\n'
    )
    with ExitStack() as stack:
        owner = stack.enter_context(program("board_agent.cli", ["pair", "--config", str(config)], tmp_path, "pair"))
        until(lambda: "waiting" in owner.stderr, "the owner is told what is missing")
        write_film(camera, 10)
        stack.enter_context(board(["run", "--config", str(config)], tmp_path))
        until(lambda: "type this code" in owner.out.read_text(), "the code is shown")
        link, keys = f"tcp://127.0.0.1:{port}", str(tmp_path / "h")
        pairing = start_pairing(link, keys, "--code", owner.out.read_text().split()[-1])
        _, err = pairing.communicate(timeout=60)
        assert pairing.returncode == 0, err
        assert owner.wait() == 0, owner.stderr


@pytest.mark.parametrize(
    ("module", "options", "named"),
    [
        ("board_agent.cli", ["pair", "--seconds", "nan"], "--seconds is 'nan'"),
        ("board_agent.cli", ["keys", "--forget", "nobody"], "nobody"),
        ("board_agent.cli", ["keys", "--add", "phone", "short"], "short"),
        ("phone_host.cli", ["keys", "--add", "bone", "serial:/dev/ttyACM0", "a" * 40], "serial:/dev/ttyACM0"),
        ("phone_host.cli", ["pair", "--link", "ipc:///tmp/board"], "ipc:///tmp/board"),
        ("phone_host.cli", ["pair", "--link", "tcp://127.0.0.1:65535"], "65535"),
        ("phone_host.cli", ["pair", "--link", "tcp://127.0.0.1:5555", "--pairing-port", "0"], "--pairing-port is 0"),
    ],
)
def test_what_makes_no_sense_is_one_line(module: str, options: list[str], named: str, tmp_path: Path) -> None:
    """A wrong option of keys or pair ends with exit 2 and one line that names it; no key is trusted or forgotten."""
    with program(module, [*options, "--keys", str(tmp_path)], tmp_path, "wrong") as wrong:
        assert wrong.wait() == 2
    assert named in wrong.stderr
    assert wrong.stderr.count("\n") == 1
    assert KeyFolder(tmp_path).peers() == ()


def test_a_folder_too_deep_for_a_socket_is_named(tmp_path: Path) -> None:
    """If no socket path is short enough, the owner is told at once, and the wait ends with exit 3."""
    deep = tmp_path / ("x" * 60) / ("y" * 60)
    deep.mkdir(parents=True)
    with program("board_agent.cli", ["pair", "--seconds", "1", "--keys", str(deep)], tmp_path, "deep") as waiting:
        assert waiting.wait() == 3
    assert "too long" in waiting.stderr
    assert "--keys" in waiting.stderr


def test_keys_are_shown_and_never_the_secret_one(tmp_path: Path) -> None:
    """On both sides `keys` shows the public key, adds a peer by hand, and prints no secret."""
    folder = KeyFolder(tmp_path / "b")
    other = zmq.curve_keypair()[0].decode()
    for module, add in (
        ("board_agent.cli", ["phone", other]),
        ("phone_host.cli", ["bone", "tcp://192.0.2.1:5555", other]),
    ):
        for options in (["--add", *add], [], ["--json"]):
            with program(module, ["keys", "--keys", str(folder.path), *options], tmp_path, "keys") as shown:
                assert shown.wait() == 0, shown.stderr
            assert folder.own().secret not in shown.out.read_text() + shown.stderr
            assert folder.own().public in shown.out.read_text()
            assert add[0] in shown.out.read_text()
            if "--json" in options:
                assert shown.json()["peers"][0]["name"] == add[0]
    (folder.path / "key").chmod(0o644)
    with program("board_agent.cli", ["keys", "--keys", str(folder.path)], tmp_path, "open") as refused:
        assert refused.wait() == 4
    assert "chmod 600" in refused.stderr
    assert refused.stderr.count("\n") == 1


def test_insecure_is_named_in_the_log(tmp_path: Path) -> None:
    """`?insecure=1` opens a link to everybody, without any key; both logs say so at the start."""
    write_film(tmp_path / "film", 20)
    port = ports()
    camera = f"replay:{tmp_path / 'film'}?pace=demand"
    link = ["--link", f"tcp://*:{port}?insecure=1", "--keys", str(tmp_path / "b")]
    with board(["run", "--camera", camera, *link], tmp_path) as agent:
        until(lambda: " serving " in agent.stderr, "the board serves")
        assert f"link_insecure address=tcp://*:{port}" in agent.stderr
        arguments = [
            "run",
            "--link",
            f"tcp://127.0.0.1:{port}?insecure=1",
            "--camera",
            camera,
            "--keys",
            str(tmp_path / "h"),
        ]
        with host([*arguments, "--pairs", "3", "--json"], tmp_path) as running:
            assert running.wait() == 0, running.stderr
        assert "link_insecure" in running.stderr
        assert agent.stop(signal.SIGTERM) == 0
    assert not (tmp_path / "b").exists()
    assert not (tmp_path / "h").exists()
