"""A compromised board service, and its owner who runs `sudo board-agent pair`: root gives it nothing. Also links in a results folder."""

import os
import shutil
import socket
import tempfile
from collections.abc import Iterator
from pathlib import Path

import msgpack
import pytest
import zmq

from tests.support.enrolment_rig import ports
from tests.support.nobody import NOBODY, nobody
from tests.support.numbered import write_film
from tests.support.programs import host, program, until

pytestmark = pytest.mark.skipif(os.geteuid() != 0, reason="only root can act for another user")


@pytest.fixture
def folder() -> Iterator[Path]:
    """The service's folder of keys, which everybody may traverse."""
    place = Path(tempfile.mkdtemp())
    place.chmod(0o755)
    folder = place / "service"
    folder.mkdir(mode=0o700)
    os.chown(folder, NOBODY, NOBODY)
    yield folder
    shutil.rmtree(place)


def test_root_gives_up_its_rights_before_it_asks_the_service(folder: Path, tmp_path: Path) -> None:
    """`sudo board-agent pair` is the service's user by the time it connects; terminal escapes are not shown, a state is."""

    def answer() -> None:
        sock = zmq.Context().socket(zmq.ROUTER)
        sock.bind(f"ipc://{folder}/pairing-x")
        said = [
            b"\xc1",
            msgpack.packb(1),
            msgpack.packb(["tcp://*:1\x1b]0;owned\x07", "123456", "", "", 0, ""]),
            msgpack.packb(["tcp://*:1", ["123456"], "", "", 0, ""]),
            msgpack.packb(["tcp://*:1", "654321", "", "", 0, ""]),
        ]
        while True:
            connection, *_ = sock.recv_multipart()
            for word in said:
                sock.send_multipart([connection, word])

    with nobody(answer), program("board_agent.cli", ["pair", "--keys", str(folder)], tmp_path, "pair") as owner:
        until(lambda: "654321" in owner.out.read_text() or owner.process.poll() is not None, "the state is shown")
        status = Path(f"/proc/{owner.process.pid}/status").read_text()
        ids = {line.partition(":")[0]: line.split()[1:] for line in status.splitlines()}
        assert ids["Uid"] == ids["Gid"] == [str(NOBODY)] * 4
        assert ids["Groups"] == []
        assert "123456" not in owner.out.read_text()
        assert "\x1b" not in owner.out.read_text() + owner.stderr
        assert "Traceback" not in owner.stderr


def test_a_link_to_a_socket_of_roots_is_not_connected_to(folder: Path, tmp_path: Path) -> None:
    """Links, pipes and files with the name of a running agent's socket are skipped: root's own services are not contacted."""
    with socket.socket(socket.AF_UNIX) as roots:
        roots.bind(str(folder.parent / "roots"))
        roots.listen()
        roots.settimeout(0)
        (folder / "pairing-0").symlink_to(folder.parent / "roots")
        os.mkfifo(folder / "pairing-1")
        (folder / "pairing-2").touch()
        command = ["pair", "--seconds", "2", "--keys", str(folder)]
        with program("board_agent.cli", command, tmp_path, "pair") as owner:
            assert owner.wait() == 3
        assert "no running board-agent" in owner.stderr
        with pytest.raises(BlockingIOError):
            roots.accept()


def test_an_agent_that_root_runs_meets_its_owner(folder: Path, tmp_path: Path) -> None:
    """An agent that root started by hand gives its socket to the folder's owner, so that `pair`, which runs as that owner by then, reaches it."""
    write_film(tmp_path / "film", 3)
    serving = ["run", "--camera", f"replay:{tmp_path}/film?pace=demand", "--link", f"tcp://*:{ports()}"]
    with program("board_agent.cli", [*serving, "--keys", str(folder)], tmp_path, "agent") as agent:
        until(lambda: "pairing_open" in agent.stderr, "the board takes in hosts")
        with program("board_agent.cli", ["pair", "--keys", str(folder)], tmp_path, "pair") as owner:
            until(lambda: "type this code" in owner.out.read_text(), "the code is shown")
    assert {path.stat().st_uid for path in folder.iterdir()} == {NOBODY}


@pytest.mark.parametrize("name", ["delays.jsonl", "report.json", "pair-000000"])
def test_a_run_ends_before_it_begins_where_a_link_has_a_results_name(name: str, tmp_path: Path) -> None:
    """`run` into a folder with a planted link ends with exit 3 and one line that names link and remedy; the target and all else stay unchanged."""
    write_film(tmp_path / "film", 3)
    (tmp_path / "precious").write_text("precious")
    out = tmp_path / "out"
    out.mkdir()
    (out / "pair-000123-my-notes").mkdir()
    (out / name).symlink_to(tmp_path / "precious")
    arguments = ["run", "--camera", f"replay:{tmp_path}/film?loop=1", "--link", f"ipc://{tmp_path}/link"]
    with host([*arguments, "--out", str(out)], tmp_path) as running:
        assert running.wait() == 3
    assert f"{out}/{name} is a link" in running.stderr.splitlines()[-1]
    assert "--out" in running.stderr.splitlines()[-1]
    assert (tmp_path / "precious").read_text() == "precious"
    assert sorted(path.name for path in out.iterdir()) == sorted([name, "pair-000123-my-notes"])
