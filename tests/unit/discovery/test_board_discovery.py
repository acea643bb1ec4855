"""Boards are found where the documentation says they listen: on an ipc socket of this user, too."""

from pathlib import Path

import pytest
import zmq

from phone_host.discovery.discovery import find_board, list_boards


def test_a_board_on_the_documented_ipc_socket_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A socket `board` in $XDG_RUNTIME_DIR that greets is listed, and is what a command without --link takes."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    link = f"ipc://{tmp_path}/board"
    with zmq.Context() as context, context.socket(zmq.ROUTER) as board:
        board.bind(link)
        assert link in [found.link for found in list_boards(tmp_path)]
        assert find_board(tmp_path, lambda: 0.0, 0.0) == link


def test_a_socket_that_nobody_serves_is_no_board(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A socket's file outlives a board that was killed."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    with zmq.Context() as context, context.socket(zmq.ROUTER) as board:
        board.bind(f"ipc://{tmp_path}/other")
        (tmp_path / "other").rename(tmp_path / "board")
    assert (tmp_path / "board").is_socket()
    assert not any(found.link.startswith("ipc:") for found in list_boards(tmp_path))
