"""What is said when board and host cannot get to know each other leads on."""

import socket
from pathlib import Path

import pytest

from board_agent.enrolment import absence
from common.errors import UnavailableError
from common.keys import SERVICE_FOLDER, KeyFolder
from phone_host.discovery.enrolment import PairingCall


def closed_port() -> int:
    """A port of this machine at which nobody listens."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        port: int = server.getsockname()[1]
        return port


def test_on_this_machine_the_host_is_told_that_pairing_may_not_be_needed(tmp_path: Path) -> None:
    """A board-agent that listens on loopback alone has no door at which to pair: `run` connects as it is."""
    call = PairingCall(("127.0.0.1", closed_port()), KeyFolder(tmp_path), patience_s=0.1)
    with pytest.raises(UnavailableError, match="no pairing is needed") as caught:
        call.ask()
    assert "`phone-host run` connects" in caught.value.remedy
    assert "`sudo board-agent pair`" in caught.value.remedy


def test_a_link_at_which_nobody_listens_is_told_with_the_address_that_was_typed(tmp_path: Path) -> None:
    """With nobody at the link itself, its address and its pairing port are named; with a board whose door is closed, the door is."""
    port = closed_port()
    call = PairingCall(("127.0.0.1", port), KeyFolder(tmp_path), f"tcp://127.0.0.1:{port}", patience_s=0.1)
    with pytest.raises(UnavailableError, match=f"nobody listens at tcp://127.0.0.1:{port}, nor at its pairing port"):
        call.ask()
    with socket.create_server(("127.0.0.1", 0)) as board:
        link = f"tcp://127.0.0.1:{board.getsockname()[1]}"
        call = PairingCall(("127.0.0.1", closed_port()), KeyFolder(tmp_path), link, patience_s=0.1)
        with pytest.raises(UnavailableError, match=f"{link} \\(pairing port [0-9]+\\) does not take in a new host"):
            call.ask()


def test_what_pairing_waits_for_is_said_at_once(tmp_path: Path) -> None:
    """While the board's door is closed, one line says for what and how long the host waits, before the first pause."""
    said: list[str] = []
    port = closed_port()
    call = PairingCall(("127.0.0.1", port), KeyFolder(tmp_path), f"tcp://127.0.0.1:{port}", said.append, patience_s=0.3)
    with pytest.raises(UnavailableError):
        call.ask()
    assert said == [f"waiting 0.3 s for tcp://127.0.0.1:{port} (pairing port {port}) to take in a new host"]


def test_before_the_set_up_the_board_says_how_to_start(tmp_path: Path) -> None:
    """With one's own keys, the command that starts an agent; with the service's, where to look. Neither says `sudo` to root."""
    own, service = absence(KeyFolder(tmp_path)), absence(KeyFolder(SERVICE_FOLDER))
    assert "board-agent run --camera v4l2:auto --link 'tcp://*:5555'" in own.remedy
    assert "127.0.0.1" in own.remedy
    assert "systemctl status board-agent" in service.remedy
    assert "sudo" not in str(own) + str(service)
