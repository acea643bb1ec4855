"""Both programs get to know each other by a code, over real sockets, with the real commands."""

import json
import os
import pty
import re
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from itertools import cycle
from pathlib import Path

import pytest
import zmq

from common.keys import KeyFolder
from common.protocol.pairing_code import CODE_DIGITS, Ask, Identity, code_text
from common.protocol.pairing_wire import frame_word
from tests.support.numbered import write_film
from tests.support.programs import Program, board, host, program, until

_CODE = re.compile(r"pairing_code code=(\d{6}) host=(\S+)")


def ports() -> int:
    """A free port with another free one behind it."""
    while True:
        with socket.socket() as first, socket.socket() as second:
            first.bind(("", 0))
            port = int(first.getsockname()[1])
            try:
                second.bind(("", port + 1))
            except (OSError, OverflowError):
                continue
            return port


@dataclass(frozen=True, slots=True)
class Rig:
    """A board on every network, and where its host finds it.

    Attributes:
        agent: the board.
        link: the host's link to it.
        folder: of everything.
    """

    agent: Program
    link: str
    folder: Path

    @property
    def board_keys(self) -> str:
        """The board's folder of keys."""
        return str(self.folder / "b")

    @property
    def host_keys(self) -> str:
        """The host's folder of keys."""
        return str(self.folder / "h")

    def codes(self) -> list[str]:
        """The codes that the board has shown in its log."""
        return [code for code, _ in _CODE.findall(self.agent.stderr)]

    def pair(self, *options: str) -> "subprocess.Popen[str]":
        """Start `phone-host pair`."""
        command = [sys.executable, "-P", "-m", "phone_host.cli", "pair", "--link", self.link, "--keys", self.host_keys]
        return subprocess.Popen(
            [*command, *options], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )

    def pair_by_log(self) -> tuple[int, str, str]:
        """Pair with the code that the board's log shows; exit code, stdout and stderr."""
        known = len(self.codes())
        pairing = self.pair("--json")
        until(lambda: len(self.codes()) > known or pairing.poll() is not None, "the board shows a code")
        said = pairing.communicate(f"{self.codes()[-1]}\n", timeout=60)
        return pairing.returncode, *said

    def pair_wrongly(self, *options: str) -> int:
        """Type a code that is not the board's; the exit code."""
        known = len(self.codes())
        pairing = self.pair(*options)
        until(lambda: len(self.codes()) > known or pairing.poll() is not None, "a code is shown")
        wrong = code_text((int(self.codes()[-1]) + 1) % 10**CODE_DIGITS)
        _, err = pairing.communicate(f"{wrong}\n", timeout=60)
        assert "the code was" in err
        return pairing.returncode

    def streams(self, name: str) -> None:
        """A host gets frames over this link."""
        images = self.folder / "film"
        arguments = ["run", "--link", self.link, "--keys", self.host_keys, "--camera", f"replay:{images}?pace=demand"]
        with host([*arguments, "--pairs", "3", "--json"], self.folder, name) as running:
            assert running.wait() == 0, running.stderr
        assert running.json()["frames"]["paired"] >= 3


@contextmanager
def on_every_network(folder: Path, *options: str) -> Iterator[Rig]:
    """A board that listens on every network, with short paths for its keys."""
    if not (folder / "film").exists():
        write_film(folder / "film", 20)
    port = ports()
    command = ["run", "--camera", f"replay:{folder / 'film'}?pace=demand&loop=1", "--link", f"tcp://*:{port}", *options]
    with board([*command, "--keys", str(folder / "b"), "--json"], folder) as agent:
        until(lambda: " serving " in agent.stderr or agent.process.poll() is not None, "the board serves")
        yield Rig(agent, f"tcp://127.0.0.1:{port}", folder)


@pytest.fixture
def rig(tmp_path: Path) -> Iterator[Rig]:
    """A board that nobody knows yet."""
    with on_every_network(tmp_path) as made:
        yield made


def test_a_code_from_the_log_lets_a_host_in(rig: Rig) -> None:
    """A new board shows a code when a host asks; typed on the host it makes both trust each other, and the stream runs; then the door is closed."""
    code, out, err = rig.pair_by_log()
    assert code == 0, err
    paired = json.loads(out)
    assert paired["name"] == re.sub(r"[^A-Za-z0-9._-]", "-", socket.gethostname())[:64]
    assert paired["key"] == KeyFolder(Path(rig.board_keys)).own().public
    assert [peer.key for peer in KeyFolder(Path(rig.board_keys)).peers()] == [
        KeyFolder(Path(rig.host_keys)).own().public
    ]
    rig.streams("host")
    until(lambda: "pairing_closed" in rig.agent.stderr, "the door closes")
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(("127.0.0.1", int(rig.link.rpartition(":")[2]) + 1))


def test_a_host_that_is_not_paired_is_told_so_in_one_line(rig: Rig) -> None:
    """Before pairing `run` ends with exit 3 and the command that helps; so it does once the board has forgotten the host."""
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
    assert rig.pair_by_log()[0] == 0
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
    """With a host known the door is closed; `board-agent pair` opens it, shows the code at once and tells who has come; --code takes it."""
    assert rig.pair_by_log()[0] == 0
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


def test_one_code_and_one_account_of_tries_for_all_links(tmp_path: Path) -> None:
    """A board with two links shows one code, good at either; wrong codes at one and at the other count together, whatever host they come from."""
    first = ports()
    second = next(port for port in iter(ports, None) if abs(port - first) > 1)
    write_film(tmp_path / "film", 10)
    listening = [word for port in (first, second) for word in ("--link", f"tcp://*:{port}")]
    serving = ["run", "--camera", f"replay:{tmp_path / 'film'}?pace=demand", "--keys", str(tmp_path / "b"), *listening]
    with ExitStack() as stack:
        agent = stack.enter_context(board(serving, tmp_path))
        until(lambda: "pairing_open" in agent.stderr, "the board takes in hosts")
        rigs = [Rig(agent, f"tcp://127.0.0.1:{port}", tmp_path) for port in (first, second)]
        for number, rig in enumerate((rigs[0], rigs[1], rigs[0])):
            assert rig.pair_wrongly("--keys", str(tmp_path / f"h{number}")) == 4
        assert "pause_s=60" in agent.stderr
        refused = rigs[1].pair()
        assert "pause" in refused.communicate("", timeout=60)[1]
        assert refused.returncode == 3
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
    """Strangers ask and fall silent, or never end a word, or connect and say nothing at all: a host is paired meanwhile, and they are hung up on."""
    door = ("127.0.0.1", int(rig.link.rpartition(":")[2]) + 1)
    ask = frame_word(Ask(Identity(bytes(32), "stranger")))
    until(lambda: "pairing_open" in rig.agent.stderr, "the door is open")
    with ExitStack() as stack:
        strangers = [stack.enter_context(socket.create_connection(door, timeout=60)) for _ in range(40)]
        for stranger, said in zip(strangers, cycle((ask, ask[:20], b"")), strict=False):
            with suppress(ConnectionError):  # made room for another one
                stranger.sendall(said)
        code, _, err = rig.pair_by_log()
        assert code == 0, err
        for stranger in strangers:
            with suppress(ConnectionError):
                while stranger.recv(1000):
                    pass
    assert "pairing_failed" not in rig.agent.stderr
    assert rig.agent.stderr.count("pairing_code") <= 2


def test_who_is_connected_when_the_door_closes_is_hung_up_on(rig: Rig) -> None:
    """A stranger that connected while the door was open, and goes on asking, is cut off when it closes: nobody guesses behind it."""
    until(lambda: "pairing_open" in rig.agent.stderr, "the door is open")
    door = ("127.0.0.1", int(rig.link.rpartition(":")[2]) + 1)
    assert rig.pair_by_log()[0] == 0
    ask = frame_word(Ask(Identity(bytes(32), "stranger")))
    with suppress(ConnectionError), socket.create_connection(door, timeout=60) as stranger:
        stranger.sendall(ask)
        while stranger.recv(1000):
            pass
    until(lambda: "pairing_closed" in rig.agent.stderr, "the door closes")
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(door)


def test_a_code_typed_before_is_refused_by_every_later_process(rig: Rig) -> None:
    """Somebody in the middle learns some bits each time a code is proved to him: a host proves one once, however often it is started."""
    assert rig.pair_wrongly() == 4
    (typed,) = KeyFolder(Path(rig.host_keys)).spent_codes()
    assert typed not in rig.codes()
    for _ in range(2):
        again = rig.pair("--code", typed)
        _, err = again.communicate(timeout=60)
        assert again.returncode == 2, err
        assert "typed before" in err
        assert err.count("\n") == 1
    assert rig.agent.stderr.count("pairing_failed") == 1, "the board has heard nothing of it"
    assert (Path(rig.host_keys) / "spent-codes").stat().st_mode & 0o077 == 0


def test_two_links_side_by_side_are_refused(tmp_path: Path) -> None:
    """A link on the port where another one's new hosts are taken in ends the start with exit 2 and one line that names both and the remedy."""
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
    """A wrong code ends with exit 4 and spends the code shown; after the third one nobody may try for a minute, until the owner says so."""
    for _ in range(3):
        assert rig.pair_wrongly() == 4
    assert len(set(rig.codes())) == 3
    pairing = rig.pair()
    _, err = pairing.communicate("", timeout=60)
    assert pairing.returncode == 3
    assert "pause" in err
    assert re.search(r"wait \d+ s", err)
    assert rig.agent.stderr.count("pairing_failed") == 3
    assert "pause_s=60" in rig.agent.stderr
    with program("board_agent.cli", ["pair", "--keys", rig.board_keys], rig.folder, "pair") as owner:
        until(lambda: "type this code" in owner.out.read_text(), "the code is shown")
        pairing = rig.pair("--code", owner.out.read_text().split()[-1])
        assert pairing.wait(60) == 0, pairing.communicate()
        pairing.communicate()
        assert owner.wait() == 0


def test_on_a_terminal_a_wrong_code_is_asked_again(rig: Rig) -> None:
    """Who mistypes on a terminal gets another try with the new code; the old one is not taken again."""
    master, slave = pty.openpty()
    command = ["pair", "--link", rig.link, "--keys", rig.host_keys]
    err = rig.folder / "pair.err"
    with err.open("wb") as said:
        pairing = subprocess.Popen([sys.executable, "-P", "-m", "phone_host.cli", *command], stdin=slave, stderr=said)
    os.close(slave)
    try:
        until(lambda: len(rig.codes()) == 1 and "type it" in err.read_text(), "the first code is asked for")
        os.write(master, b"%06d\n" % ((int(rig.codes()[0]) + 1) % 10**CODE_DIGITS))
        until(lambda: len(rig.codes()) == 2 and err.read_text().count("type it") == 2, "the second code is asked for")
        os.write(master, f"{rig.codes()[1][:3]} {rig.codes()[1][3:]}\n".encode())
        assert pairing.wait(60) == 0, err.read_text()
    finally:
        pairing.kill()
        pairing.wait()
        os.close(master)
    assert "the code was wrong" in err.read_text() or "not proved" in err.read_text()


def test_without_an_agent_pair_waits_and_says_so(tmp_path: Path) -> None:
    """`board-agent pair` with nobody to talk to says what it waits for, and after its time ends with exit 3 and the remedy; so does the host's."""
    with program("board_agent.cli", ["pair", "--seconds", "2", "--keys", str(tmp_path)], tmp_path, "pair") as alone:
        assert alone.wait() == 3
    waiting, last = alone.stderr.splitlines()
    for line in (waiting, last):
        assert "no running board-agent" in line
    assert "waiting" in waiting


def test_the_owner_may_come_before_the_agent(tmp_path: Path) -> None:
    """`board-agent pair` waits for an agent that has opened no link yet, because its camera is missing, and goes on when it is there."""
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
        agent = stack.enter_context(board(["run", "--config", str(config)], tmp_path))
        until(lambda: "type this code" in owner.out.read_text(), "the code is shown")
        pairing = Rig(agent, f"tcp://127.0.0.1:{port}", tmp_path).pair("--code", owner.out.read_text().split()[-1])
        _, err = pairing.communicate(timeout=60)
        assert pairing.returncode == 0, err
        assert owner.wait() == 0, owner.stderr


@pytest.mark.parametrize(
    ("module", "options", "named"),
    [
        ("board_agent.cli", ["pair", "--seconds", "nan"], "--seconds nan"),
        ("board_agent.cli", ["keys", "--forget", "nobody"], "nobody"),
        ("board_agent.cli", ["keys", "--add", "phone", "short"], "short"),
        ("phone_host.cli", ["keys", "--add", "bone", "serial:/dev/ttyACM0", "a" * 40], "serial:/dev/ttyACM0"),
        ("phone_host.cli", ["pair", "--link", "ipc:///tmp/board"], "ipc:///tmp/board"),
        ("phone_host.cli", ["pair", "--link", "tcp://127.0.0.1:65535"], "65535"),
        ("phone_host.cli", ["pair", "--link", "tcp://127.0.0.1:5555", "--pairing-port", "0"], "--pairing-port 0"),
    ],
)
def test_what_makes_no_sense_is_one_line(module: str, options: list[str], named: str, tmp_path: Path) -> None:
    """A wrong option of keys or pair ends with exit 2 and one line that names it; no key is trusted or forgotten."""
    with program(module, [*options, "--keys", str(tmp_path)], tmp_path, "wrong") as wrong:
        assert wrong.wait() == 2
    assert named in wrong.stderr
    assert wrong.stderr.count("\n") == 1
    assert KeyFolder(tmp_path).peers() == ()


def test_keys_are_shown_and_never_the_secret_one(tmp_path: Path) -> None:
    """`keys` on both sides shows the public key, adds a peer by hand, and prints no secret."""
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
