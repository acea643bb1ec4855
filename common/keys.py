"""This machine's key and those of the machines that it trusts, as files in one folder.

Rules: files are for their owner only (0600 in a folder of 0700) and appear whole or not at all. Root acts here for the service with the
service's rights (`common.files`): what it writes is the folder's owner's, and what that one may have planted leads nowhere. A file that
others may read, or that is no key file, is refused with one line: nothing is repaired in silence.
"""

import fcntl
import json
import os
import stat
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Final

from common import now
from common.errors import DataError, SettingsError, TakenError, UnavailableError
from common.files import become_owner, opened_folder, read_file, replacing_in
from common.peers import Peer, clean_name, is_key

SERVICE_FOLDER: Final = Path("/var/lib/tandemscan")
"""Where the board's service keeps its state (StateDirectory= of its unit)."""

_KEY_FILE: Final = "key"
_PEERS_FILE: Final = "peers.json"
_CODES_FILE: Final = "spent-codes"
_CODES_KEPT: Final = 64
"""Codes that were typed last; a board shows one for minutes."""
_MAX_FILE_BYTES: Final = 1 << 20
"""Thousands of peers; more is no file of ours."""

_LOCK_WAIT_NS: Final = 10_000_000_000
_LOCK_STEP_S: Final = 0.05
"""Who changes the folder holds it for some ms. A service that was taken over may hold it for ever."""


@dataclass(frozen=True, slots=True)
class OwnKey:
    """This machine's pair of keys, Z85."""

    public: str
    secret: str


class KeyFolder:
    """Key and peers in a folder. Nothing is made before it is asked for.

    Args:
        path: the folder; made with the first file.
        lock_wait_ns: how long another process that changes it is waited for.
    """

    def __init__(self, path: Path, *, lock_wait_ns: int = _LOCK_WAIT_NS) -> None:
        self.path = path
        self._lock_wait_ns = lock_wait_ns

    @property
    def has_key(self) -> bool:
        """Whether a key was made already."""
        try:
            with self._opened(make=False) as folder:
                return _has(folder, _KEY_FILE)
        except FileNotFoundError:
            return False

    def own(self) -> OwnKey:
        """Give this machine's keys; makes them when there are none.

        Raises:
            DataError: the file is no key, or others may read it.
            UnavailableError: it cannot be read or written.
        """
        try:
            secret = self._read(_KEY_FILE).strip()
        except FileNotFoundError:
            secret = self._make().strip()
        with suppress(ValueError):  # of a text that is no Z85
            if is_key(secret):
                return OwnKey(_curve().curve_public(secret.encode()).decode(), secret)
        path = self.path / _KEY_FILE
        raise DataError(
            f"{path} is not a key", "restore it from a backup, or make a new one with keys --new and pair again"
        )

    def renew(self) -> OwnKey:
        """Make new keys in place of the old ones; whoever trusted those must be paired again.

        Raises:
            UnavailableError: they cannot be written.
        """
        public, secret = _curve().curve_keypair()
        with self._locked() as folder:
            _write(folder, _KEY_FILE, secret + b"\n")
        return OwnKey(public.decode(), secret.decode())

    def peers(self) -> tuple[Peer, ...]:
        """Give all peers, in the order in which they were added.

        Raises:
            DataError: the file is none of ours, or others may read it.
            UnavailableError: it cannot be read.
        """
        try:
            with self._opened(make=False) as folder:
                return self._peers_in(folder)
        except FileNotFoundError:
            return ()

    def _peers_in(self, folder: int) -> tuple[Peer, ...]:
        try:
            text = self._read_in(folder, _PEERS_FILE)
        except FileNotFoundError:
            return ()
        try:
            items = json.loads(text)
            if not isinstance(items, list):
                raise TypeError(items)
            return tuple(_peer(item) for item in items)
        except (ValueError, TypeError, RecursionError):
            path = self.path / _PEERS_FILE
            raise DataError(
                f"{path} is not a list of known machines",
                "restore it from a backup, or delete it and pair every machine again",
            ) from None

    @property
    def peers_state(self) -> tuple[int, int, int] | None:
        """Something that changes when the file of peers does; None while there is none. As cheap as one system call."""
        try:
            status = os.lstat(self.path / _PEERS_FILE)  # once for each connection
        except OSError:
            return None
        return status.st_mtime_ns, status.st_ino, status.st_size

    def add(self, peer: Peer) -> Peer:
        """Trust a machine. One whose key is known already is renewed; a name that another has gets a number.

        Returns:
            The peer under the name that it has now.

        Raises:
            SettingsError: the key is none.
            DataError: the file of peers is bad.
            UnavailableError: it cannot be written.
        """
        if not is_key(peer.key):
            raise SettingsError(
                f"{peer.key!r} is not a public key", "give the 40 characters that `keys` shows on the other machine"
            )
        with self._locked() as folder:
            others = tuple(known for known in self._peers_in(folder) if known.key != peer.key)
            taken = {known.name for known in others}
            wanted = clean_name(peer.name)
            names = (wanted, *(f"{wanted}-{number}" for number in range(2, len(taken) + 3)))
            named = replace(peer, name=next(name for name in names if name not in taken))
            _write_peers(folder, (*others, named))
        return named

    def forget(self, name: str) -> Peer:
        """Trust a machine no longer; gives what was known of it.

        Raises:
            SettingsError: there is none of that name.
            DataError: the file of peers is bad.
            UnavailableError: it cannot be written.
        """
        with self._locked() as folder:
            peers = self._peers_in(folder)
            for peer in peers:
                if peer.name == name:
                    _write_peers(folder, tuple(known for known in peers if known is not peer))
                    return peer
        raise SettingsError(
            f"{name!r} is not known", f"the names are {', '.join(peer.name for peer in peers) or '(none)'}"
        )

    def spent_codes(self) -> tuple[str, ...]:
        """Give the codes that were typed here last. None is to be proved twice: each time tells somebody in the middle some of its bits.

        Raises:
            DataError: others may read the file.
            UnavailableError: it cannot be read.
        """
        try:
            return tuple(self._read(_CODES_FILE).split())
        except FileNotFoundError:
            return ()

    def spend(self, code: str) -> None:
        """Take note that a code is being proved.

        Raises:
            DataError: others may read the file.
            UnavailableError: it cannot be written.
        """
        with self._locked() as folder:
            spent = self._read_in(folder, _CODES_FILE).split() if _has(folder, _CODES_FILE) else []
            codes = (*spent, code)[-_CODES_KEPT:]
            _write(folder, _CODES_FILE, "\n".join(codes).encode() + b"\n")

    @contextmanager
    def with_owners_rights(self) -> Iterator[None]:
        """Do something in the folder, which is made if it is missing, with its owner's rights: root would leave there what is root's.

        Raises:
            UnavailableError: the folder cannot be used.
        """
        with self._opened(make=True):
            yield

    def become_owner(self) -> bool:
        """Give up root's rights for those of the folder's owner, for good; whether the folder is there.

        Raises:
            UnavailableError: it cannot be used.
        """
        try:
            become_owner(self.path)
        except FileNotFoundError:
            return False
        except OSError as error:
            raise _unavailable(self.path, error) from None
        return True

    def _make(self) -> str:
        secret = _curve().curve_keypair()[1]  # not below: whose rights we have there may not be able to load it
        with self._locked() as folder:
            if not _has(folder, _KEY_FILE):  # another process may have been faster
                _write(folder, _KEY_FILE, secret + b"\n")
            return self._read_in(folder, _KEY_FILE)

    def _read(self, name: str) -> str:
        """Read a small file that must be its owner's alone; FileNotFoundError where there is none."""
        with self._opened(make=False) as folder:
            return self._read_in(folder, name)

    def _read_in(self, folder: int, name: str) -> str:
        path = self.path / name
        content, status = read_file(folder, path, _MAX_FILE_BYTES)
        if status.st_mode & 0o077:
            mode = f"mode {stat.S_IMODE(status.st_mode):04o}"
            raise DataError(f"{path} can be read by other users ({mode})", f"chmod 600 {path}")
        return content.decode("ascii", "replace")

    @contextmanager
    def _opened(self, *, make: bool) -> Iterator[int]:
        """Open the folder; whatever fails in the block is told, save FileNotFoundError where nothing is to be made."""
        try:
            with opened_folder(self.path, make=make) as folder:
                yield folder
        except OSError as error:
            if isinstance(error, FileNotFoundError) and not make:
                raise
            raise _unavailable(self.path, error) from None

    @contextmanager
    def _locked(self) -> Iterator[int]:
        """Keep other processes from changing the folder meanwhile."""
        with self._opened(make=True) as folder:
            until_ns = now.monotonic_ns() + self._lock_wait_ns
            while True:
                try:
                    fcntl.flock(folder, fcntl.LOCK_EX | fcntl.LOCK_NB)
                    break
                except BlockingIOError:
                    if now.monotonic_ns() > until_ns:
                        raise TakenError(
                            f"{self.path} is held by another program", f"stop it: fuser -v {self.path} names it"
                        ) from None
                threading.Event().wait(_LOCK_STEP_S)
            yield folder


def default_folder(environment: Mapping[str, str], *, service: bool) -> Path:
    """Where keys lie when no setting says so.

    Args:
        environment: of the process: STATE_DIRECTORY of a service, XDG_CONFIG_HOME, HOME.
        service: whether the machine's service counts: for whoever may write its folder (root), its keys are meant.

    Returns:
        The folder; it need not exist.
    """
    if service:
        if given := environment.get("STATE_DIRECTORY", "").partition(":")[0]:
            return Path(given)
        if os.access(SERVICE_FOLDER, os.W_OK | os.X_OK):
            return SERVICE_FOLDER
    home = environment.get("XDG_CONFIG_HOME", "")
    # The specification: a relative path is invalid and to be ignored.
    base = Path(home) if home.startswith("/") else Path(environment.get("HOME", "/")) / ".config"
    return base / "tandemscan"


def usual_keys() -> KeyFolder:
    """The host's folder where no setting names another."""
    return KeyFolder(default_folder(os.environ, service=False))


def _curve() -> Any:  # noqa: ANN401 - a module
    """ZeroMQ, loaded only when a key is made or read: --help and settings need none of it."""
    import zmq  # noqa: PLC0415

    if not zmq.has("curve"):
        raise UnavailableError(
            "this ZeroMQ was built without CURVE encryption", "install one with libsodium (apt: python3-zmq)"
        )
    return zmq


def _peer(item: Any) -> Peer:  # noqa: ANN401 - whatever JSON holds
    peer = Peer(**item)
    texts = asdict(peer).values()
    # Printable: whoever writes this file must not command the terminal of who lists it.
    if not all(isinstance(text, str) and text.isprintable() for text in texts) or not is_key(peer.key):
        raise ValueError(item)
    return peer


def _has(folder: int, name: str) -> bool:
    try:
        os.stat(name, dir_fd=folder, follow_symlinks=False)
    except FileNotFoundError:
        return False
    return True


def _write_peers(folder: int, peers: tuple[Peer, ...]) -> None:
    text = json.dumps([asdict(peer) for peer in peers], indent=1)
    _write(folder, _PEERS_FILE, text.encode() + b"\n")


def _write(folder: int, name: str, content: bytes) -> None:
    """Put a file in place, whole, for its owner only; a power cut leaves the old one or the new one."""
    with replacing_in(folder, name, mode=0o600) as file:
        file.write(content)


def _unavailable(path: Path, error: OSError) -> UnavailableError:
    remedy = "check the disk"
    if error.errno in {1, 13, 30}:
        remedy = "run it with sudo, or name another folder with --keys"
        if os.geteuid() == 0:  # which has acted for whoever owns the way to it
            remedy = f"give all of it to one user (ls -ld {path} and above), or name another folder with --keys"
    return UnavailableError(f"{path} cannot be used ({error.strerror})", remedy)
