"""Root works in a folder of keys whose owner has been compromised. Real users, real links."""

import fcntl
import os
import re
import shutil
import stat
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

import pytest
import zmq

from common.errors import DataError, TandemError, UnavailableError
from common.files import opened_folder, replacing_in
from common.keys import KeyFolder
from common.peers import Peer
from tests.support.nobody import NOBODY, as_nobody, nobody

ROOT = Path(__file__).resolve().parents[3]
WHEN = "2026-01-01T00:00:00+0000"
SECRET = "what only root may know"

pytestmark = pytest.mark.skipif(os.geteuid() != 0, reason="only root can act for another user")


@pytest.fixture
def place() -> Iterator[Path]:
    """A folder of root's that everybody may pass through: pytest's own folders are closed to other users."""
    place = Path(tempfile.mkdtemp())
    place.chmod(0o755)
    (place / "secret").write_text(SECRET)
    (place / "secret").chmod(0o600)
    yield place
    shutil.rmtree(place)


@pytest.fixture
def folder(place: Path) -> Path:
    """A service's folder of keys."""
    folder = place / "service"
    folder.mkdir(mode=0o700)
    os.chown(folder, NOBODY, NOBODY)
    return folder


def keys_command(folder: Path, *options: str) -> "subprocess.CompletedProcess[str]":
    """`sudo board-agent keys`."""
    command = [sys.executable, "-P", "-m", "board_agent.cli", "keys", "--keys", str(folder), *options]
    return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)


def is_as_it_was(secret: Path) -> bool:
    """Whether root's file is still root's, with its content."""
    status = secret.stat()
    return secret.read_text() == SECRET and (status.st_uid, stat.S_IMODE(status.st_mode)) == (0, 0o600)


def test_what_root_writes_is_the_services(folder: Path) -> None:
    """Key, peers and spent codes that root writes belong to the folder's owner. Afterwards root has its own rights again."""
    keys = KeyFolder(folder)
    keys.own()
    keys.add(Peer(name="phone", key=zmq.curve_keypair()[0].decode(), added=WHEN))
    keys.spend("123456")
    assert {path.name: path.stat().st_uid for path in folder.iterdir()} == {
        "key": NOBODY,
        "peers.json": NOBODY,
        "spent-codes": NOBODY,
    }
    assert (os.geteuid(), os.getegid()) == (0, 0)
    assert keys.peers()[0].name == "phone"


@pytest.mark.parametrize("name", ["key", "peers.json", "spent-codes"])
def test_a_link_to_a_file_of_roots_is_neither_read_nor_written(place: Path, folder: Path, name: str) -> None:
    """Whatever root does with the folder, the link's target is unchanged, and none of its content is shown."""
    secret = place / "secret"
    as_nobody(lambda: (folder / name).symlink_to(secret))
    keys = KeyFolder(folder)
    read = {"key": keys.own, "peers.json": keys.peers, "spent-codes": keys.spent_codes}[name]
    with pytest.raises(DataError, match=f"{name} is not a plain file") as caught:
        read()
    assert SECRET not in str(caught.value)
    assert "\n" not in str(caught.value)
    for write in (
        lambda: keys.spend("1"),
        lambda: keys.add(Peer(name="x", key=zmq.curve_keypair()[0].decode(), added=WHEN)),
    ):
        with suppress(TandemError):
            write()
    with suppress(TandemError):
        keys.renew()
    assert is_as_it_was(secret)


def test_the_command_survives_a_link_in_place_of_the_key(place: Path, folder: Path) -> None:
    """`keys` reports the link in one line (4); `keys --new` replaces the link, not its target."""
    as_nobody(lambda: (folder / "key").symlink_to(place / "secret"))
    told = keys_command(folder)
    assert told.returncode == 4
    assert re.fullmatch(r"board-agent: error: .*/key is not a plain file .*\n", told.stderr)
    assert SECRET not in told.stderr
    assert keys_command(folder, "--new").returncode == 0
    assert not (folder / "key").is_symlink()
    assert (folder / "key").stat().st_uid == NOBODY
    assert is_as_it_was(place / "secret")


def test_names_foreseen_for_temporary_files_lead_nowhere(place: Path, folder: Path) -> None:
    """Links at every name that a process and thread number would give are not written through: names are random."""
    pid, thread = os.getpid(), threading.get_native_id()

    def plant() -> None:
        for name in (f".key.{pid}-{thread}.part", ".key.part", "key.part", ".key.tmp"):
            (folder / name).symlink_to(place / "secret")

    as_nobody(plant)
    KeyFolder(folder).renew()
    assert is_as_it_was(place / "secret")


def test_a_hard_link_to_a_file_of_roots_is_replaced_not_written(place: Path, folder: Path) -> None:
    """If the kernel lets anybody make hard links (protected_hardlinks=0), root's file keeps its content and owner, and is not read."""
    os.link(place / "secret", folder / "key")
    with pytest.raises(UnavailableError, match="Permission denied"):
        KeyFolder(folder).own()
    KeyFolder(folder).renew()
    assert is_as_it_was(place / "secret")


@pytest.mark.parametrize("name", ["key", "peers.json", "spent-codes"])
@pytest.mark.parametrize("make", [os.mkfifo, os.mkdir], ids=["pipe", "folder"])
def test_a_pipe_or_folder_under_a_files_name_is_one_line(folder: Path, name: str, make: Callable[[Path], None]) -> None:
    """Root does not wait for the other end of a pipe, and says which path is no file."""
    as_nobody(lambda: make(folder / name))
    keys = KeyFolder(folder)
    with pytest.raises(DataError, match=f"{name} is not a plain file"):
        {"key": keys.own, "peers.json": keys.peers, "spent-codes": keys.spent_codes}[name]()


def test_a_file_without_end_is_not_read(folder: Path) -> None:
    """Of a file of a terabyte no more than a megabyte is read; then it is refused."""

    def plant() -> None:
        with (folder / "peers.json").open("wb") as file:
            file.truncate(1 << 40)
        (folder / "peers.json").chmod(0o600)

    as_nobody(plant)
    with pytest.raises(DataError, match="longer than"):
        KeyFolder(folder).peers()


def test_names_in_the_folder_do_not_command_roots_terminal(folder: Path) -> None:
    """A peer whose name holds an escape sequence is refused in a line without that sequence."""
    key = zmq.curve_keypair()[0].decode()

    def plant() -> None:
        text = f'[{{"name": "\\u001b]0;x\\u0007", "key": "{key}", "added": ""}}]'
        (folder / "peers.json").write_text(text)
        (folder / "peers.json").chmod(0o600)

    as_nobody(plant)
    told = keys_command(folder)
    assert told.returncode == 4
    assert "\x1b" not in told.stdout + told.stderr


def test_a_folder_exchanged_for_a_link_is_acted_in_with_its_planters_rights(place: Path, folder: Path) -> None:
    """In the service's own folder `keys` links to a folder of root's: root writes nothing there, although root owns the folder at the end."""
    (place / "roots").mkdir(mode=0o755)
    as_nobody(lambda: (folder / "keys").symlink_to(place / "roots"))
    with pytest.raises(UnavailableError, match="Permission denied"):
        KeyFolder(folder / "keys").own()
    as_nobody(lambda: (folder / "deep").symlink_to(place))
    with pytest.raises(UnavailableError, match="Permission denied"):
        KeyFolder(folder / "deep" / "roots" / "new").own()
    assert not list((place / "roots").iterdir())


def test_a_link_of_roots_own_is_followed(place: Path, folder: Path) -> None:
    """Root's own links (/var, systemd's private folders) lead to the service's folder as always; so do relative links and `..`."""
    (place / "absolute").symlink_to(folder)
    (place / "relative").symlink_to("service")
    own = KeyFolder(folder).own()
    for path in (place / "absolute", place / "relative", place / "service" / ".." / "relative"):
        assert KeyFolder(path).own() == own


def test_root_does_not_pass_through_a_folder_where_anybody_may_exchange_things(place: Path) -> None:
    """A folder of root's that is world-writable and not sticky is refused in one line; a sticky one (/tmp) is not."""
    (place / "open").mkdir()
    (place / "open").chmod(0o777)
    with pytest.raises(UnavailableError, match="others may write"):
        KeyFolder(place / "open" / "keys").own()
    (place / "open").chmod(0o1777)
    KeyFolder(place / "open" / "keys").own()


def test_a_link_that_leads_to_itself_is_one_line(folder: Path) -> None:
    """A circle of links is detected."""
    as_nobody(lambda: (folder / "a").symlink_to("a"))
    with pytest.raises(UnavailableError, match="Too many levels"):
        KeyFolder(folder / "a" / "b").own()


def test_a_race_for_the_folder_gives_the_service_nothing(place: Path, folder: Path) -> None:
    """The service exchanges file and folder for links as fast as it can while root renews the key 300 times: root's files are unchanged."""
    (place / "roots").mkdir(mode=0o755)
    real, keys = folder / "real", folder / "keys"
    as_nobody(lambda: real.mkdir(mode=0o700))

    def exchange() -> None:
        while True:
            for target in (real, place / "roots"):
                (folder / "next").symlink_to(target)
                (folder / "next").rename(keys)
                (real / "next").symlink_to(place / "secret")
                (real / "next").rename(real / "key")

    with nobody(exchange):
        for _ in range(300):
            with suppress(TandemError):
                KeyFolder(keys).renew()
                KeyFolder(keys).own()
    assert is_as_it_was(place / "secret")
    assert not list((place / "roots").iterdir())
    assert all(path.lstat().st_uid == NOBODY for path in real.iterdir())


def test_a_lock_that_is_never_given_back_ends_in_one_line(folder: Path) -> None:
    """A service that holds its folder's lock makes root wait for a while, not for ever."""
    descriptor = os.open(folder, os.O_RDONLY)
    fcntl.flock(descriptor, fcntl.LOCK_EX)
    try:
        with pytest.raises(UnavailableError, match="held by another"):
            KeyFolder(folder, lock_wait_ns=10**8).renew()
    finally:
        os.close(descriptor)
    KeyFolder(folder).renew()


def test_a_folder_that_is_open_survives_its_exchange(folder: Path) -> None:
    """A file goes into the folder that was opened, even if another folder has that name by then."""
    as_nobody((folder / "keys").mkdir)
    as_nobody((folder / "elsewhere").mkdir)
    with opened_folder(folder / "keys") as opened:
        (folder / "keys").rename(folder / "moved")
        (folder / "keys").symlink_to("elsewhere")
        with replacing_in(opened, "key") as file:
            file.write(b"x")
    assert (folder / "moved" / "key").read_bytes() == b"x"
    assert not list((folder / "elsewhere").iterdir())
