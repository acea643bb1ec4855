"""A board that no host knows yet, on every network, and `phone-host pair` beside it."""

import random
import re
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from common.protocol.pairing_code import CODE_DIGITS, code_text
from tests.support.numbered import write_film
from tests.support.programs import Program, board, host, until

_CODE = re.compile(r"pairing_code code=(\d{6}) host=(\S+)")


def ports() -> int:
    """A free port with another free one behind it, below those that the kernel gives to whoever dials (32768 and up on Linux)."""
    while True:
        port = random.randrange(20000, 32000)
        with socket.socket() as first, socket.socket() as second, suppress(OSError):
            first.bind(("", port))
            second.bind(("", port + 1))
            return port


def start_pairing(link: str, keys: str, *options: str) -> "subprocess.Popen[str]":
    """Start `phone-host pair` with pipes."""
    command = [sys.executable, "-P", "-m", "phone_host.cli", "pair", "--link", link, "--keys", keys]
    return subprocess.Popen(
        [*command, *options], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


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
        return start_pairing(self.link, self.host_keys, *options)

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
