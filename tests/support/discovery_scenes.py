"""Boards and a host alone in their own network: `python -m tests.support.discovery_scenes SCENE FOLDER`, inside `unshare -rn`.

Each scene starts real boards, announces them with a real mDNS responder where it says so, and runs `phone-host run`
without --link. It prints the host's exit code and stderr as one JSON object.
"""

import json
import signal
import socket
import subprocess
import sys
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from zeroconf import ServiceInfo, Zeroconf

from phone_host.discovery.found import SERVICE
from tests.support.programs import board, host, program, until

PORT = 5555


def announce(stack: ExitStack, name: str, address: str, port: int) -> None:
    """Announce a board until the stack closes."""
    network = Zeroconf(interfaces=["127.0.0.1"])
    stack.callback(network.close)
    where = [socket.inet_aton(address)]
    network.register_service(
        ServiceInfo(SERVICE, f"{name}.{SERVICE}", port=port, addresses=where, server=f"{name}.local.")
    )


def serve(stack: ExitStack, folder: Path, name: str, link: str, *more: str) -> Any:
    """Run a board until the stack closes."""
    camera = f"replay:{folder / 'film'}?pace=demand&loop=1"
    agent = stack.enter_context(board(["run", "--camera", camera, "--link", link, *more], folder, name))
    until(lambda: " serving " in agent.stderr, f"{name} serves")
    return agent


def pair(stack: ExitStack, folder: Path) -> dict[str, Any]:
    """Pair with an unnamed board, by the code shown to its owner."""
    command = ["pair", "--keys", str(folder / "board-keys")]
    owner = stack.enter_context(program("board_agent.cli", command, folder, "owner"))
    shown = "type this code"
    try:
        until(
            lambda: owner.process.poll() is not None or shown in owner.out.read_text(),
            "the owner is shown a code, or told why not",
        )
    finally:
        assert shown in owner.out.read_text(), f"the owner is told: {owner.stderr or 'nothing'}"
    command = [sys.executable, "-P", "-m", "phone_host.cli", "pair", "--keys", str(folder / "keys")]
    pairing = subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    )
    err = pairing.communicate(f"{owner.out.read_text().split()[-1]}\n", timeout=60)[1]
    return {"code": pairing.returncode, "err": err}


def look(folder: Path, *options: str, name: str = "host", wait: str = "20") -> dict[str, Any]:
    """Run a host that is not told of any board."""
    camera = f"replay:{folder / 'film'}?pace=demand"
    arguments = [
        "run",
        "--camera",
        camera,
        "--keys",
        str(folder / "keys"),
        "--pairs",
        "3",
        "--wait",
        wait,
        "--json",
        *options,
    ]
    with host(arguments, folder, name) as running:
        return {"code": running.wait(), "err": running.stderr}


def announced(stack: ExitStack, folder: Path) -> list[dict[str, Any]]:
    """One board announces itself and serves; another was announced and is gone."""
    serve(stack, folder, "bone", "tcp://127.0.0.2:6001")
    announce(stack, "bone", "127.0.0.2", 6001)
    announce(stack, "gone", "127.0.0.2", 6002)
    return [look(folder)]


def several(stack: ExitStack, folder: Path) -> list[dict[str, Any]]:
    """Two boards."""
    for number, name in enumerate(("bone", "pi")):
        serve(stack, folder, name, f"tcp://127.0.0.2:{6001 + number}")
        announce(stack, name, "127.0.0.2", 6001 + number)
    return [look(folder)]


def last(stack: ExitStack, folder: Path) -> list[dict[str, Any]]:
    """A board is used, another one appears, the first one disappears."""
    agent = serve(stack, folder, "bone", "tcp://127.0.0.2:6001")
    announce(stack, "bone", "127.0.0.2", 6001)
    first = look(folder, name="first")
    serve(stack, folder, "pi", "tcp://127.0.0.2:6002")
    announce(stack, "pi", "127.0.0.2", 6002)
    again = look(folder, name="again")
    assert agent.stop(signal.SIGTERM) == 0
    return [first, again, look(folder, name="other")]


def here(stack: ExitStack, folder: Path) -> list[dict[str, Any]]:
    """A board on this machine."""
    serve(stack, folder, "bone", f"tcp://127.0.0.1:{PORT}")
    return [look(folder)]


def gadget(stack: ExitStack, folder: Path) -> list[dict[str, Any]]:
    """A board at the gadget's address, open to everybody."""
    plug_cable()
    serve(stack, folder, "bone", f"tcp://192.168.7.2:{PORT}?insecure=1")
    return [look(folder)]


def cable(stack: ExitStack, folder: Path) -> list[dict[str, Any]]:
    """A board at the gadget's address that is paired and in use."""
    plug_cable()
    serve(stack, folder, "bone", f"tcp://192.168.7.2:{PORT}", "--keys", str(folder / "board-keys"))
    return [pair(stack, folder), look(folder)]


def foreign(stack: ExitStack, folder: Path) -> list[dict[str, Any]]:
    """Something else on the usual port."""
    stack.enter_context(socket.create_server(("127.0.0.1", PORT)))
    return [look(folder, wait="1")]


def plug_cable() -> None:
    """Give this network the gadget's address."""
    subprocess.run(["ip", "addr", "add", "192.168.7.2/32", "dev", "lo"], check=True)


SCENES = {play.__name__: play for play in (announced, several, last, here, gadget, cable, foreign)}

if __name__ == "__main__":
    with ExitStack() as left:
        told = SCENES[sys.argv[1]](left, Path(sys.argv[2]))
    print(json.dumps(told))
