"""This machine's key and those of the machines it trusts, as files in one folder.

Rules: files are for their owner only (0600 in a folder of 0700) and appear whole or not at all. Root acts here with the service's rights
(`common.files`): what it writes belongs to the folder's owner, and links planted by that owner lead nowhere. A file that others may read,
or that is not a key file, is refused with one line: nothing is repaired silently.
"""

import fcntl
import json
import os
import stat
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, Final

from common import now
from common.errors import DataError, SettingsError, TakenError, UnavailableError
from common.files import become_owner, opened_folder, read_file, replacing_in
from common.peers import Peer, clean_name, is_key
from common.value import value

SERVICE_FOLDER: Final = Path("/var/lib/tandemscan")
"""Where the board's service keeps its state (StateDirectory= of its unit)."""

_KEY_FILE: Final = "key"
_PEERS_FILE: Final = "peers.json"
_CODES_FILE: Final = "spent-codes"
_CODES_KEPT: Final = 64
"""How many typed codes are remembered. A board shows one for minutes."""
_MAX_FILE_BYTES: Final = 1 << 20
"""Room for thousands of peers. A larger file is not ours."""

_LOCK_WAIT_NS: Final = 10_000_000_000
_LOCK_STEP_S: Final = 0.05
"""Processes that change the folder hold its lock for some ms. A service that was taken over may hold it for ever."""


@value()
class OwnKey:
    """This machine's key pair, Z85."""

    public: str
    secret: str


class KeyFolder:
    """The key and the peers in a folder. Nothing is created before it is asked for.

    Args:
        path: the folder; created with the first file.
        lock_wait_ns: how long to wait for another process that is changing it.
    """

    def __init__(self, path: Path, *, lock_wait_ns: int = _LOCK_WAIT_NS) -> None:
        self.path = path
        self._lock_wait_ns = lock_wait_ns

    @property
    def has_key(self) -> bool:
        """Whether a key already exists."""
        try:
            with self._opened(make=False) as folder:
                return _has(folder, _KEY_FILE)
        except FileNotFoundError:
            return False

    def own(self) -> OwnKey:
        """Return this machine's keys; create them if there are none.

        Raises:
            DataError: the file is not a key, or others may read it.
            UnavailableError: it cannot be read or written.
        """
        try:
            secret = self._read(_KEY_FILE).strip()
        except FileNotFoundError:
            secret = self._make().strip()
        with suppress(ValueError):  # the text is not Z85
            if is_key(secret):
                return OwnKey(_curve().curve_public(secret.encode()).decode(), secret)
        path = self.path / _KEY_FILE
        raise DataError(
            f"{path} is not a key", "restore it from a backup, or make a new one with keys --new and pair again"
        )

    def renew(self) -> OwnKey:
        """Replace the keys by new ones. Machines that trusted the old ones must be paired again.

        Raises:
            UnavailableError: they cannot be written.
        """
        public, secret = _curve().curve_keypair()
        with self._locked() as folder:
            _write(folder, _KEY_FILE, secret + b"\n")
        return OwnKey(public.decode(), secret.decode())

    def peers(self) -> tuple[Peer, ...]:
        """Return all peers, in the order in which they were added.

        Raises:
            DataError: the file is not one of ours, or others may read it.
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
        """A value that changes when the peers file does; None while there is none. Costs only one system call."""
        try:
            status = os.lstat(self.path / _PEERS_FILE)  # once for each connection
        except OSError:
            return None
        return status.st_mtime_ns, status.st_ino, status.st_size

    def add(self, peer: Peer) -> Peer:
        """Trust a machine. If its key is already known, its entry is renewed. A name that another machine has gets a number appended.

        Returns:
            The peer under the name that it has now.

        Raises:
            SettingsError: the key is invalid.
            DataError: the peers file is bad.
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
        """Stop trusting a machine; return its entry.

        Raises:
            SettingsError: there is no machine of that name.
            DataError: the peers file is bad.
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
        """Return the codes last typed here. No code may be proved twice: each proof reveals some of its bits to a man in the middle.

        Raises:
            DataError: others may read the file.
            UnavailableError: it cannot be read.
        """
        try:
            return tuple(self._read(_CODES_FILE).split())
        except FileNotFoundError:
            return ()

    def spend(self, code: str) -> None:
        """Record that a code is being proved.

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
        """Act in the folder with its owner's rights; create it if missing. Otherwise files that root leaves there would be root's.

        Raises:
            UnavailableError: the folder cannot be used.
        """
        with self._opened(make=True):
            yield

    def become_owner(self) -> bool:
        """Replace root's rights by those of the folder's owner, for good. Return whether the folder exists.

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
        secret = _curve().curve_keypair()[1]  # here: the owner, whose rights we take below, may be unable to load it
        with self._locked() as folder:
            if not _has(folder, _KEY_FILE):  # another process may have been faster
                _write(folder, _KEY_FILE, secret + b"\n")
            return self._read_in(folder, _KEY_FILE)

    def _read(self, name: str) -> str:
        """Read a small file that must be readable by its owner alone; raise FileNotFoundError if there is none."""
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
        """Open the folder. Any failure in the block becomes an error for the user, except FileNotFoundError if nothing is to be created."""
        try:
            with opened_folder(self.path, make=make) as folder:
                yield folder
        except OSError as error:
            if isinstance(error, FileNotFoundError) and not make:
                raise
            raise _unavailable(self.path, error) from None

    @contextmanager
    def _locked(self) -> Iterator[int]:
        """Keep other processes from changing the folder for the duration of the block."""
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
    """Where keys lie if no setting says so.

    Args:
        environment: environment of the process: STATE_DIRECTORY of a service, XDG_CONFIG_HOME, HOME.
        service: whether to consider the machine's service: for a user who may write its folder (root), its keys are meant.

    Returns:
        The folder; it need not exist.
    """
    if service:
        if given := environment.get("STATE_DIRECTORY", "").partition(":")[0]:
            return Path(given)
        if os.access(SERVICE_FOLDER, os.W_OK | os.X_OK):
            return SERVICE_FOLDER
    home = environment.get("XDG_CONFIG_HOME", "")
    # The XDG specification says that a relative path is invalid and must be ignored.
    base = Path(home) if home.startswith("/") else Path(environment.get("HOME", "/")) / ".config"
    return base / "tandemscan"


def usual_keys() -> KeyFolder:
    """The host's folder if no setting names another."""
    return KeyFolder(default_folder(os.environ, service=False))


def _curve() -> Any:  # noqa: ANN401 - a module
    """ZeroMQ, loaded only when a key is created or read: --help and settings do not need it."""
    import zmq  # noqa: PLC0415

    if not zmq.has("curve"):
        raise UnavailableError(
            "this ZeroMQ was built without CURVE encryption", "install one with libsodium (apt: python3-zmq)"
        )
    return zmq


def _peer(item: Any) -> Peer:  # noqa: ANN401 - whatever JSON holds
    peer = Peer(**item)
    texts = asdict(peer).values()
    # Printable, so that whoever writes this file cannot control the terminal of whoever lists it.
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
    """Put a file in place, whole and for its owner only. A power cut leaves either the old one or the new one."""
    with replacing_in(folder, name, mode=0o600) as file:
        file.write(content)


def _unavailable(path: Path, error: OSError) -> UnavailableError:
    remedy = "check the disk"
    if error.errno in {1, 13, 30}:
        remedy = "run it with sudo, or name another folder with --keys"
        if os.geteuid() == 0:  # root acted with the rights of the path's owner
            remedy = f"give all of it to one user (ls -ld {path} and above), or name another folder with --keys"
    return UnavailableError(f"{path} cannot be used ({error.strerror})", remedy)
