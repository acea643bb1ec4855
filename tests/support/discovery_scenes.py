"""Boards and a host alone in a network of their own: `python -m tests.support.discovery_scenes SCENE FOLDER`, inside `unshare -rn`.

Each scene starts real boards, announces them with a real mDNS responder where it says so, and runs `phone-host run` without --link; it prints
the host's exit code and stderr as one JSON object.
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

from phone_host.discovery import SERVICE
from tests.support.programs import board, host, until

PORT = 5555


def announce(stack: ExitStack, name: str, address: str, port: int) -> None:
    """Announce a board until the stack is left."""
    network = Zeroconf(interfaces=["127.0.0.1"])
    stack.callback(network.close)
    where = [socket.inet_aton(address)]
    network.register_service(
        ServiceInfo(SERVICE, f"{name}.{SERVICE}", port=port, addresses=where, server=f"{name}.local.")
    )


def serve(stack: ExitStack, folder: Path, name: str, address: str, port: int) -> Any:
    """Run a board, open to everybody on loopback, until the stack is left."""
    camera = f"replay:{folder / 'film'}?pace=demand&loop=1"
    link = f"tcp://{address}:{port}"
    option = "" if address.startswith("127.") else "?insecure=1"
    agent = stack.enter_context(board(["run", "--camera", camera, "--link", link + option], folder, name))
    until(lambda: " serving " in agent.stderr, f"{name} serves")
    return agent


def look(folder: Path, *options: str, name: str = "host", wait: str = "20") -> dict[str, Any]:
    """Run a host that is told of no board."""
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


def scene(name: str, folder: Path) -> list[dict[str, Any]]:
    """Play one scene; gives what each host said."""
    with ExitStack() as stack:
        match name:
            case "announced":
                serve(stack, folder, "bone", "127.0.0.2", 6001)
                announce(stack, "bone", "127.0.0.2", 6001)
                announce(stack, "gone", "127.0.0.2", 6002)  # announced by a responder, but nobody serves there
                return [look(folder)]
            case "several":
                for number, board_name in enumerate(("bone", "pi")):
                    serve(stack, folder, board_name, "127.0.0.2", 6001 + number)
                    announce(stack, board_name, "127.0.0.2", 6001 + number)
                return [look(folder)]
            case "last":
                agent = serve(stack, folder, "bone", "127.0.0.2", 6001)
                announce(stack, "bone", "127.0.0.2", 6001)
                first = look(folder, name="first")
                serve(stack, folder, "pi", "127.0.0.2", 6002)
                announce(stack, "pi", "127.0.0.2", 6002)
                again = look(folder, name="again")
                assert agent.stop(signal.SIGTERM) == 0
                return [first, again, look(folder, name="other")]
            case "here":
                serve(stack, folder, "bone", "127.0.0.1", PORT)
                return [look(folder)]
            case "gadget":
                subprocess.run(["ip", "addr", "add", "192.168.7.2/32", "dev", "lo"], check=True)
                serve(stack, folder, "bone", "192.168.7.2", PORT)
                return [look(folder)]
            case "foreign":
                stranger = stack.enter_context(socket.create_server(("127.0.0.1", PORT)))
                assert stranger.getsockname()[1] == PORT
                return [look(folder, wait="1")]
            case _:
                raise AssertionError(name)


if __name__ == "__main__":
    print(json.dumps(scene(sys.argv[1], Path(sys.argv[2]))))
