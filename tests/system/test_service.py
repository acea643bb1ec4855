"""board-agent as a service manager sees it, without one: a datagram socket of the test takes its place."""

import select
import signal
import socket
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.numbered import saved_numbers, write_film
from tests.support.programs import PATIENCE_S, board, host


@pytest.fixture
def manager(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[socket.socket]:
    """A bound datagram socket, named in the programs' environment as systemd does it."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as listener:
        listener.bind(str(tmp_path / "notify"))
        listener.settimeout(PATIENCE_S)
        monkeypatch.setenv("NOTIFY_SOCKET", str(tmp_path / "notify"))
        monkeypatch.setenv("WATCHDOG_USEC", "1000000")
        yield listener


def until_told(manager: socket.socket, word: str) -> str:
    """Read datagrams until one contains the word; return that one."""
    while word not in (told := manager.recv(4096).decode()):
        pass
    return told


def forget(manager: socket.socket) -> None:
    """Drain the socket: it holds about ten datagrams, and a program that may not wait loses any further ones."""
    while select.select([manager], [], [], 0)[0]:
        manager.recv(4096)


def test_a_camera_that_comes_late_is_waited_for(
    manager: socket.socket, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With wait_for_camera the agent is ready without a camera, says what is missing, streams once the camera is there, and says when it stops."""
    monkeypatch.setenv("BOARD_AGENT_WAIT_FOR_CAMERA", "true")
    film = tmp_path / "film"
    arguments = ["run", "--camera", f"replay:{film}?fps=10&loop=1", "--link", f"ipc://{tmp_path}/link"]
    with board(arguments, tmp_path) as sender:
        told = until_told(manager, "waiting for the camera")
        assert "READY=1" in told
        assert "WATCHDOG=1" in told
        assert str(film) in told
        write_film(tmp_path / "new", 20)
        (tmp_path / "new").rename(film)
        until_told(manager, "waiting for a host on ipc://")
        with host([*arguments, "--out", str(tmp_path / "out"), "--pairs", "25", "--save-every", "5"], tmp_path) as run:
            until_told(manager, "sent to the host")
            assert run.wait() == 0
        forget(manager)
        assert all(left == right for left, right in saved_numbers(tmp_path / "out"))
        assert sender.stop() == 0
        until_told(manager, "STOPPING=1")
        assert "camera_missing" in sender.stderr


@pytest.mark.parametrize(("number", "code"), [(signal.SIGTERM, 0), (signal.SIGINT, 130)])
def test_a_signal_ends_the_wait_for_a_camera(
    manager: socket.socket, number: signal.Signals, code: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """During the wait for a camera SIGTERM ends with exit 0, Ctrl-C with 130, and an account of no frames is printed."""
    monkeypatch.setenv("BOARD_AGENT_WAIT_FOR_CAMERA", "1")
    arguments = ["run", "--camera", f"replay:{tmp_path}/none", "--link", f"ipc://{tmp_path}/link", "--json"]
    with board(arguments, tmp_path) as sender:
        until_told(manager, "waiting for the camera")
        assert sender.stop(number) == code
        assert sender.json()["grabbed"] == 0
        assert "Traceback" not in sender.stderr


def test_without_the_setting_a_missing_camera_is_exit_3(manager: socket.socket, tmp_path: Path) -> None:
    """On the command line a missing camera ends the agent at once with exit 3, and it never says READY."""
    with board(["run", "--camera", f"replay:{tmp_path}/none", "--link", f"ipc://{tmp_path}/link"], tmp_path) as sender:
        assert sender.wait() == 3
    manager.setblocking(False)  # noqa: FBT003 - the standard library's own signature
    with pytest.raises(BlockingIOError):
        manager.recv(4096)
