"""A board that no host knows yet, on every network, and `phone-host pair` beside it."""

import random
import re
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from common.protocol.enrolment_code import CODE_DIGITS, code_text
from tests.support.numbered import write_film
from tests.support.programs import Program, board, host, program, until

_CODE = re.compile(r"type this code on the host: (\d{6})$", re.MULTILINE)

_OWNER_S = 4.0
"""Within this time after `board-agent pair` has ended, the board has noticed (pairing_door says 3 s)."""


def ports() -> int:
    """A free port followed by another free one, below the range that the kernel gives to dialling processes (32768 and up on Linux)."""
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


class Owner:
    """The board's owner, running `sudo board-agent pair` while the block lasts; the codes shown stay known.

    Args:
        keys: the board's folder of keys.
        folder: for the command's output.
    """

    def __init__(self, keys: str, folder: Path) -> None:
        self._keys, self._folder = keys, folder
        self._stack = ExitStack()
        self._running: list[Program] = []

    @property
    def codes(self) -> list[str]:
        """The codes shown so far, each once."""
        return list(dict.fromkeys(code for run in self._running for code in _CODE.findall(run.out.read_text())))

    @property
    def has_gone(self) -> bool:
        """Whether the command is not running."""
        return not self._running or self._running[-1].process.poll() is not None

    def comes(self) -> bool:
        """Run the command unless it is running; returns whether it was not."""
        if not self.has_gone:
            return False
        name, command = f"owner{len(self._running)}", ["pair", "--keys", self._keys]
        self._running.append(self._stack.enter_context(program("board_agent.cli", command, self._folder, name)))
        return True

    def leaves(self) -> None:
        """End the command, and wait until the board has noticed."""
        self._stack.close()
        time.sleep(_OWNER_S)

    def close(self) -> None:
        """End the command."""
        self._stack.close()


@dataclass(frozen=True, slots=True)
class Rig:
    """A board on every network, and where its host finds it.

    Attributes:
        agent: the board.
        link: the host's link to it.
        folder: of everything.
        owner: the person who reads the codes.
    """

    agent: Program
    link: str
    folder: Path
    owner: Owner

    @property
    def board_keys(self) -> str:
        """The board's folder of keys."""
        return str(self.folder / "b")

    @property
    def host_keys(self) -> str:
        """The host's folder of keys."""
        return str(self.folder / "h")

    def codes(self) -> list[str]:
        """The codes shown to the owner."""
        return self.owner.codes

    def code(self) -> str:
        """Have the owner look at the board; returns the current code."""
        known = len(self.codes()) if self.owner.comes() else 0
        until(lambda: len(self.codes()) > known, "the owner is shown a code")
        return self.codes()[-1]

    def pair(self, *options: str) -> "subprocess.Popen[str]":
        """Start `phone-host pair`."""
        return start_pairing(self.link, self.host_keys, *options)

    def pair_by_code(self) -> tuple[int, str, str]:
        """Pair with the code that `board-agent pair` shows; returns exit code, stdout and stderr."""
        pairing = self.pair("--json")
        said = pairing.communicate(f"{self.code()}\n", timeout=60)
        until(lambda: pairing.returncode != 0 or self.owner.has_gone, "the owner is told who came")
        return pairing.returncode, *said

    def pair_wrongly(self, *options: str) -> int:
        """Type a code that is not the board's; returns the exit code."""
        pairing = self.pair(*options)
        wrong = code_text((int(self.code()) + 1) % 10**CODE_DIGITS)
        known = len(self.codes())
        _, err = pairing.communicate(f"{wrong}\n", timeout=60)
        assert "the code was" in err
        until(lambda: len(self.codes()) > known, "the owner is shown the next code")
        return pairing.returncode

    def streams(self, name: str) -> None:
        """Check that a host gets frames over this link."""
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
        owner = Owner(str(folder / "b"), folder)
        with closing(owner):
            yield Rig(agent, f"tcp://127.0.0.1:{port}", folder, owner)
