"""ipc paths in folders that others can write to, and sockets of other users. Real users, real sockets."""

import os
import shutil
import signal
import socket
import stat
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path

import pytest
import zmq

from board_agent.doctor.board_doctor import examine_link
from common.diagnostic import Severity
from common.doctor.access import Account
from common.doctor.unit_check import Unit
from common.errors import SettingsError, TakenError, UnavailableError
from common.link.base import Incoming, Link
from common.link.factory import open_link, parse_link
from common.link.waiter import Waiter
from phone_host.subprocesses.board_process import runtime_folder
from tests.support.nobody import NOBODY, nobody

PATIENCE_S = 30.0

needs_root = pytest.mark.skipif(os.geteuid() != 0, reason="only root can play two users")


@pytest.fixture
def shared() -> Iterator[Path]:
    """A folder like /tmp: world-writable and sticky."""
    folder = Path(tempfile.mkdtemp())
    folder.chmod(0o1777)
    yield folder
    shutil.rmtree(folder)


def listen(uri: str) -> Link:
    """The board's end."""
    return open_link(parse_link(uri, listens_by_default=True), board=True)


def dial(uri: str) -> Link:
    """The host's end."""
    return open_link(parse_link(uri, listens_by_default=False))


def false_board(path: Path) -> None:
    """Listens at a path, and sends to every caller what a board might send."""
    os.umask(0)
    sock = zmq.Context().socket(zmq.ROUTER)
    sock.bind(f"ipc://{path}")
    while True:
        sock.send_multipart([sock.recv_multipart()[0], b"i am your board"])


def silent_listener(path: Path) -> None:
    """Listens with the shortest queue, fills it, and accepts no connection."""
    os.umask(0)
    with socket.socket(socket.AF_UNIX) as sock:
        sock.bind(str(path))
        sock.listen(0)
        callers = [socket.socket(socket.AF_UNIX) for _ in range(8)]
        for caller in callers:
            caller.settimeout(0)
            caller.connect_ex(str(path))
        (path.parent / "full").touch()
        signal.pause()


def refused_word(link: Link) -> UnavailableError:
    """Send hellos until the answering side is refused."""
    deadline = time.monotonic() + PATIENCE_S
    while time.monotonic() < deadline:
        for connection in link.dialled.values():
            link.send(connection, b"hello", b"")
        try:
            assert not list(link.receive()), "a packet of a stranger was believed"
        except UnavailableError as error:
            return error
        time.sleep(0.01)
    pytest.fail("nobody was refused")


@needs_root
def test_a_socket_of_another_user_is_not_dialled(shared: Path) -> None:
    """Another user's socket in /tmp is refused at once, in a line that names path, owner and both remedies; `owner=` allows it."""
    path = shared / "board"
    with nobody(lambda: false_board(path), path):
        with pytest.raises(UnavailableError, match=f"ipc://{path} .*nobody.*XDG_RUNTIME_DIR.*owner=nobody") as caught:
            dial(f"ipc://{path}")
        assert "\n" not in str(caught.value)
        for name in ("nobody", str(NOBODY)):
            dial(f"ipc://{path}?owner={name}").close()


@needs_root
def test_a_stranger_who_comes_later_is_not_believed(shared: Path) -> None:
    """If another user takes a free path after a host has begun to wait for its board, his process gives him away: none of his packets gets through."""
    path = shared / "board"
    with closing(dial(f"ipc://{path}")) as link, nobody(lambda: false_board(path), path):
        assert "a process of user nobody listens there" in str(refused_word(link))
    with closing(dial(f"ipc://{path}2?owner=nobody")) as link, nobody(lambda: false_board(Path(f"{path}2")), path):
        deadline = time.monotonic() + PATIENCE_S
        while not (packets := list(link.receive())) and time.monotonic() < deadline:
            for connection in link.dialled.values():
                link.send(connection, b"hello", b"")
            time.sleep(0.01)
        assert packets


@needs_root
@pytest.mark.parametrize("way", ["straight", "through a link"])
def test_a_folder_of_another_user_is_not_used(shared: Path, way: str) -> None:
    """Neither side uses another user's folder, whose owner could exchange the socket; `owner=` allows it."""
    place = shared / "nobodys"
    place.mkdir()
    os.chown(place, NOBODY, NOBODY)
    path = place / "board"
    if way != "straight":
        link = shared / "link"
        link.symlink_to(place)
        path = link / "board"
    with pytest.raises(UnavailableError, match="belongs to user nobody"):
        dial(f"ipc://{path}")
    with pytest.raises(UnavailableError, match="belongs to user nobody"):
        listen(f"ipc://{path}")
    dial(f"ipc://{path}?owner=nobody").close()


@pytest.mark.parametrize("open_end", [listen, dial])
def test_a_folder_where_anybody_may_exchange_sockets_is_refused(
    open_end: Callable[[str], Link], tmp_path: Path
) -> None:
    """Neither side uses a folder that others may write to and that is not sticky. The line names it and chmod."""
    for mode in (0o777, 0o702):
        tmp_path.chmod(mode)
        with pytest.raises(UnavailableError, match=f"other users may write to {tmp_path}.*chmod go-w"):
            open_end(f"ipc://{tmp_path}/board")
    for mode in (0o1777, 0o755):
        tmp_path.chmod(mode)
        open_end(f"ipc://{tmp_path}/board").close()


@needs_root
def test_a_listener_that_accepts_nobody_holds_up_nobody(shared: Path) -> None:
    """Another user's socket with a full queue is reported at once as taken, with the user's name."""
    path = shared / "board"
    with (
        nobody(lambda: silent_listener(path), shared / "full"),
        pytest.raises(TakenError, match="taken by user nobody"),
    ):
        listen(f"ipc://{path}")


@needs_root
def test_root_and_oneself_are_trusted(shared: Path) -> None:
    """A host meets its own user's board in a shared folder; the socket is closed to others."""
    with closing(listen(f"ipc://{shared}/board")) as board, closing(dial(f"ipc://{shared}/board")) as host:
        assert stat.S_IMODE((shared / "board").stat().st_mode) == 0o600
        heard: list[Incoming] = []
        waiter = Waiter(board.pollables)
        deadline = time.monotonic() + PATIENCE_S
        while len(heard) < 2 and time.monotonic() < deadline:
            for connection in host.dialled.values():
                host.send(connection, b"hello", b"")
            waiter.wait(20)
            heard += list(board.receive())
        assert len(heard) >= 2


@pytest.mark.parametrize("uri", ["ipc://x?owner=", "ipc://@board", "tcp://127.0.0.1:5555?owner=root"])
def test_links_without_an_owner_to_check_are_refused(uri: str) -> None:
    """An empty owner, a name that belongs to nobody (Linux's abstract sockets) and an owner of a tcp link are wrong usage."""
    with pytest.raises(SettingsError):
        parse_link(uri, listens_by_default=True)


def test_an_owner_who_does_not_exist_is_wrong_usage(tmp_path: Path) -> None:
    """The line names the user."""
    with pytest.raises(SettingsError, match="no-such-user"):
        dial(f"ipc://{tmp_path}/x?owner=no-such-user")


def test_the_folder_for_sockets(tmp_path: Path) -> None:
    """$XDG_RUNTIME_DIR if it is private to the user; else a folder of mode 0700 among the temporary files, whatever the umask."""
    own = tmp_path / "run"
    own.mkdir(mode=0o700)
    assert runtime_folder({"XDG_RUNTIME_DIR": str(own)}) == own
    own.chmod(0o755)
    made = tmp_path / f"tandemscan-{os.geteuid()}"
    before = os.umask(0)
    try:
        for given in (str(own), "", "relative", str(tmp_path / "nowhere")):
            assert runtime_folder({"XDG_RUNTIME_DIR": given, "TMPDIR": str(tmp_path)}) == made
    finally:
        os.umask(before)
    assert stat.S_IMODE(made.stat().st_mode) == 0o700


@needs_root
@pytest.mark.parametrize("plant", ["link", "file", "foreign", "open"])
def test_a_folder_for_sockets_that_somebody_has_planted_is_refused(plant: str, tmp_path: Path) -> None:
    """A link, a file, another user's folder or one that others may enter is not used; the error names it and the remedy."""
    folder = tmp_path / f"tandemscan-{os.geteuid()}"
    match plant:
        case "link":
            (tmp_path / "elsewhere").mkdir(mode=0o700)
            folder.symlink_to("elsewhere")
        case "file":
            folder.touch(0o700)
        case "foreign":
            folder.mkdir(mode=0o700)
            os.chown(folder, NOBODY, NOBODY)
        case _:
            folder.mkdir(mode=0o755)
    with pytest.raises(UnavailableError, match=f"{folder} .*XDG_RUNTIME_DIR"):
        runtime_folder({"TMPDIR": str(tmp_path)})


@needs_root
def test_the_doctor_asks_as_the_user_who_serves(shared: Path) -> None:
    """Root's doctor has nothing to report about a path in the service's own folder."""
    place = shared / "run"
    place.mkdir(mode=0o750)
    os.chown(place, NOBODY, NOBODY)
    account = Account("nobody", NOBODY, frozenset({NOBODY}), is_me=False)
    unit = Unit("board-agent.service")
    findings = examine_link(f"ipc://{place}/link", account, unit, listens_by_default=True)
    assert [finding.severity for finding in findings] == [Severity.OK]


@needs_root
def test_a_listener_lets_in_whom_it_names(tmp_path: Path) -> None:
    """The socket of a link with `owner=` belongs to that user, and is closed to all others but root."""
    tmp_path.chmod(0o755)
    path = tmp_path / "board"
    with closing(listen(f"ipc://{path}?owner=65534")):
        status = path.lstat()
        assert status.st_uid == 65534
        assert stat.S_IMODE(status.st_mode) == 0o600
