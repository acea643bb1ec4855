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
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest
import zmq

from common.keys import KeyFolder
from common.protocol.pairing_code import CODE_DIGITS
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


def test_each_link_has_a_code_of_its_own_and_is_named_beside_it(tmp_path: Path) -> None:
    """Of a board with two links `board-agent pair` tells which code is for which; with that a host pairs at that link."""
    first = ports()
    second = next(port for port in iter(ports, None) if abs(port - first) > 1)
    write_film(tmp_path / "film", 10)
    listening = [word for port in (first, second) for word in ("--link", f"tcp://*:{port}")]
    serving = ["run", "--camera", f"replay:{tmp_path / 'film'}?pace=demand", "--keys", str(tmp_path / "b"), *listening]
    with ExitStack() as stack:
        agent = stack.enter_context(board(serving, tmp_path))
        until(lambda: " serving " in agent.stderr, "the board serves")
        rig = Rig(agent, f"tcp://127.0.0.1:{second}", tmp_path)
        owner = stack.enter_context(program("board_agent.cli", ["pair", "--keys", rig.board_keys], tmp_path, "pair"))
        shown = re.compile(r"^tcp://\*:(\d+): type this code on the host: (\d{6})$", re.MULTILINE)
        until(lambda: len(shown.findall(owner.out.read_text())) == 2, "both codes are shown")
        codes = {int(port): code for port, code in shown.findall(owner.out.read_text())}
        assert codes.keys() == {first, second}
        pairing = rig.pair("--code", codes[second])
        _, err = pairing.communicate(timeout=60)
        assert pairing.returncode == 0, err
        assert owner.wait() == 0, owner.stderr


def test_three_wrong_codes_are_followed_by_a_pause(rig: Rig) -> None:
    """A wrong code ends with exit 4 and spends the code shown; after the third one nobody may try for a minute, until the owner says so."""
    for _ in range(3):
        known = len(rig.codes())
        pairing = rig.pair()
        until(lambda known=known: len(rig.codes()) > known, "a code is shown")  # type: ignore[misc]
        wrong = f"{(int(rig.codes()[-1]) + 1) % 10**CODE_DIGITS:0{CODE_DIGITS}d}"
        _, err = pairing.communicate(f"{wrong}\n", timeout=60)
        assert pairing.returncode == 4, err
        assert "the code was" in err
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


def test_without_an_agent_pair_says_so(tmp_path: Path) -> None:
    """`board-agent pair` with nobody to talk to, and `phone-host pair` with nobody there, end with exit 3 and the remedy in one line."""
    with program("board_agent.cli", ["pair", "--keys", str(tmp_path)], tmp_path, "pair") as alone:
        assert alone.wait() == 3
    assert "no running board-agent" in alone.stderr
    assert alone.stderr.count("\n") == 1


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
