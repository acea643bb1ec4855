"""This machine's key and those of the machines that it trusts, as files in one folder.

Rules: files are for their owner only (0600 in a folder of 0700), appear whole or not at all, and belong to the folder's owner whoever
wrote them, so that root may act for the service. A file that others may read, or that is no key file, is refused with one line: nothing is
repaired in silence. Keys are Curve25519 in Z85, as CurveZMQ has them (RFC 26, RFC 32).
"""

import fcntl
import json
import os
import stat
import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, replace
from functools import reduce
from pathlib import Path
from typing import Any, Final

from common.errors import DataError, SettingsError, UnavailableError

SERVICE_FOLDER: Final = Path("/var/lib/tandemscan")
"""Where the board's service keeps its state (StateDirectory= of its unit)."""

MAX_NAME: Final = 64
"""Longest host name on Linux (HOST_NAME_MAX)."""

_KEY_FILE: Final = "key"
_PEERS_FILE: Final = "peers.json"
_CODES_FILE: Final = "spent-codes"
_CODES_KEPT: Final = 64
"""Codes that were typed last; a board shows one for minutes."""
_Z85_CHARACTERS: Final = 40
_Z85_ALPHABET: Final = b"0123456789abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ.-:+=^!/*?&<>()[]{}@%$#"
"""RFC 32. A text of 40 of them may still be no 256 bits (each five stand for less than 2^32): see is_key."""
_MAX_FILE_BYTES: Final = 1 << 20
"""Thousands of peers; more is no file of ours."""


@dataclass(frozen=True, slots=True)
class Peer:
    """A machine that this one trusts.

    Attributes:
        name: by which people know it; unique in a folder.
        key: its public key, Z85.
        added: local wall time, ISO 8601.
        address: link on which a host reaches it; empty for a host.
    """

    name: str
    key: str
    added: str
    address: str = ""


@dataclass(frozen=True, slots=True)
class OwnKey:
    """This machine's pair of keys, Z85."""

    public: str
    secret: str


class KeyFolder:
    """Key and peers in a folder. Nothing is made before it is asked for.

    Args:
        path: the folder; made with the first file.
    """

    def __init__(self, path: Path) -> None:
        self.path = path

    @property
    def has_key(self) -> bool:
        """Whether a key was made already."""
        return _exists(self.path / _KEY_FILE)

    def own(self) -> OwnKey:
        """Give this machine's keys; makes them when there are none.

        Raises:
            DataError: the file is no key, or others may read it.
            UnavailableError: it cannot be read or written.
        """
        path = self.path / _KEY_FILE
        if not _exists(path):
            self._make(path)
        secret = _read(path, "keys --new").strip()
        with suppress(ValueError):  # of a text that is no Z85
            if is_key(secret):
                return OwnKey(_curve().curve_public(secret.encode()).decode(), secret)
        raise DataError(f"{path} is no key", "restore it, or make a new one with keys --new and pair again")

    def renew(self) -> OwnKey:
        """Make new keys in place of the old ones; whoever trusted those must be paired again.

        Raises:
            UnavailableError: they cannot be written.
        """
        secret = _curve().curve_keypair()[1]
        with self._locked():
            _write(self.path / _KEY_FILE, secret + b"\n")
        return self.own()

    def peers(self) -> tuple[Peer, ...]:
        """Give all peers, in the order in which they were added.

        Raises:
            DataError: the file is none of ours, or others may read it.
            UnavailableError: it cannot be read.
        """
        path = self.path / _PEERS_FILE
        if not _exists(path):
            return ()
        text = _read(path, "keys --forget")
        try:
            items = json.loads(text)
            if not isinstance(items, list):
                raise TypeError(items)
            return tuple(_peer(item) for item in items)
        except (ValueError, TypeError, RecursionError):
            raise DataError(
                f"{path} is no list of peers", "restore it, or delete it and pair every machine again"
            ) from None

    @property
    def peers_state(self) -> tuple[int, int, int] | None:
        """Something that changes when the file of peers does; None while there is none. As cheap as one system call."""
        try:
            status = os.stat(self.path / _PEERS_FILE)  # noqa: PTH116 - once for each connection
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
            raise SettingsError(f"{peer.key!r} is no public key", "give the 40 characters that `keys` shows there")
        with self._locked():
            others = tuple(known for known in self.peers() if known.key != peer.key)
            taken = {known.name for known in others}
            wanted = clean_name(peer.name)
            names = (wanted, *(f"{wanted}-{number}" for number in range(2, len(taken) + 3)))
            named = replace(peer, name=next(name for name in names if name not in taken))
            self._write_peers((*others, named))
        return named

    def forget(self, name: str) -> Peer:
        """Trust a machine no longer; gives what was known of it.

        Raises:
            SettingsError: there is none of that name.
            DataError: the file of peers is bad.
            UnavailableError: it cannot be written.
        """
        with self._locked():
            peers = self.peers()
            for peer in peers:
                if peer.name == name:
                    self._write_peers(tuple(known for known in peers if known is not peer))
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
        path = self.path / _CODES_FILE
        return tuple(_read(path, "pair").split()) if _exists(path) else ()

    def spend(self, code: str) -> None:
        """Take note that a code is being proved.

        Raises:
            DataError: others may read the file.
            UnavailableError: it cannot be written.
        """
        with self._locked():
            codes = (*self.spent_codes(), code)[-_CODES_KEPT:]
            _write(self.path / _CODES_FILE, "\n".join(codes).encode() + b"\n")

    def _write_peers(self, peers: tuple[Peer, ...]) -> None:
        text = json.dumps([asdict(peer) for peer in peers], indent=1)
        _write(self.path / _PEERS_FILE, text.encode() + b"\n")

    def _make(self, path: Path) -> None:
        with self._locked():
            if not _exists(path):  # another process may have been faster
                _write(path, _curve().curve_keypair()[1] + b"\n")

    @contextmanager
    def _locked(self) -> Iterator[None]:
        """Keep other processes from changing the folder meanwhile."""
        try:
            self.path.mkdir(mode=0o700, parents=True, exist_ok=True)
            folder = os.open(self.path, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
        except OSError as error:
            raise _unavailable(self.path, error) from None
        try:
            fcntl.flock(folder, fcntl.LOCK_EX)
            yield
        except OSError as error:
            raise _unavailable(self.path, error) from None
        finally:
            os.close(folder)


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


def peer_at(peers: Sequence[Peer], address: str) -> Peer | None:
    """Find who is at an address: whoever was paired there last, else who is named like it, else the only one that there is.

    Args:
        peers: all that are known.
        address: `tcp://HOST:PORT`.

    Returns:
        The peer; its key decides whether it is the right one. None if there are several and none fits.
    """
    host = address.partition("://")[2].rpartition(":")[0].lower().removesuffix(".").removesuffix(".local")
    there = [peer for peer in peers if peer.address == address] or [peer for peer in peers if peer.name.lower() == host]
    return there[-1] if there else peers[0] if len(peers) == 1 else None


def is_key(text: str) -> bool:
    """Whether a text has the form of a key in Z85."""
    digits = [_Z85_ALPHABET.find(c) for c in text.encode()]
    if len(digits) != _Z85_CHARACTERS or -1 in digits:
        return False
    groups = (digits[at : at + 5] for at in range(0, len(digits), 5))
    return all(reduce(lambda value, digit: 85 * value + digit, group, 0) < 2**32 for group in groups)


def clean_name(name: str) -> str:
    """Make a name of what a peer says of itself: letters, digits, dots, hyphens, at most 64; anything else becomes a hyphen."""
    kept = "".join(c if c.isascii() and (c.isalnum() or c in "._-") else "-" for c in name[:MAX_NAME])
    return kept.strip(".-") or "unnamed"


def _curve() -> Any:  # noqa: ANN401 - a module
    """ZeroMQ, loaded only when a key is made or read: --help and settings need none of it."""
    import zmq  # noqa: PLC0415

    if not zmq.has("curve"):
        raise UnavailableError("this ZeroMQ has no CURVE", "install one with libsodium (apt: python3-zmq)")
    return zmq


def _peer(item: Any) -> Peer:  # noqa: ANN401 - whatever JSON holds
    peer = Peer(**item)
    if not all(isinstance(value, str) for value in asdict(peer).values()) or not is_key(peer.key):
        raise ValueError(item)
    return peer


def _exists(path: Path) -> bool:
    try:
        return path.exists()
    except OSError as error:
        raise _unavailable(path, error) from None


def _read(path: Path, remedy: str) -> str:
    """Read a small file that must be its owner's alone."""
    try:
        with path.open("rb") as file:
            status = os.fstat(file.fileno())
            if not stat.S_ISREG(status.st_mode) or status.st_size > _MAX_FILE_BYTES:
                raise DataError(f"{path} is no file of keys", f"move it away; see {remedy}")
            if status.st_mode & 0o077:
                mode = f"mode {stat.S_IMODE(status.st_mode):04o}"
                raise DataError(f"{path} is open to others ({mode})", f"chmod 600 {path}")
            return file.read().decode("ascii", "replace")
    except OSError as error:
        raise _unavailable(path, error) from None


def _write(path: Path, content: bytes) -> None:
    """Put a file in place, whole, for its owner only; a power cut leaves the old one or the new one."""
    temporary = path.with_name(f".{path.name}.{os.getpid()}-{threading.get_native_id()}.part")
    try:
        descriptor = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_CLOEXEC, 0o600)
        with os.fdopen(descriptor, "wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
            if os.geteuid() == 0:
                owner = path.parent.stat()
                os.fchown(file.fileno(), owner.st_uid, owner.st_gid)
        temporary.replace(path)
    except OSError:
        temporary.unlink(missing_ok=True)
        raise


def _unavailable(path: Path, error: OSError) -> UnavailableError:
    remedy = "run it with sudo, or name another folder with --keys" if error.errno in {1, 13, 30} else "check the disk"
    return UnavailableError(f"{path} cannot be used ({error.strerror})", remedy)


def change(
    folder: KeyFolder, *, forget: str | None, new: bool, add: Sequence[str] | None, address: str, when: str
) -> None:
    """Do what the options of a `keys` verb ask for.

    Args:
        folder: the folder.
        forget: name of a peer to trust no longer; None: nobody.
        new: whether to make a new key.
        add: name and public key of a peer to trust; None: nobody.
        address: link on which that peer listens; empty if it does not.
        when: local wall time.

    Raises:
        SettingsError: a name or key makes no sense.
        DataError: the files are bad.
        UnavailableError: they cannot be written.
    """
    if new:
        folder.renew()
    if forget is not None:
        folder.forget(forget)
    if add is not None:
        folder.add(Peer(add[0], add[1], when, address))


def listing(folder: KeyFolder, *, as_json: bool) -> str:
    """What a `keys` verb prints: the own public key and who is trusted, never the secret key.

    Args:
        folder: the folder; its key is made if there is none.
        as_json: whether as one JSON object; else as lines for people.

    Raises:
        DataError: the files are bad.
        UnavailableError: they cannot be read.
    """
    own, peers = folder.own(), folder.peers()
    if as_json:
        known = [asdict(peer) for peer in peers]
        return json.dumps({"folder": str(folder.path), "public": own.public, "peers": known})
    rows = [(peer.name, peer.key, peer.added, peer.address) for peer in peers]
    widths = [max((len(row[column]) for row in rows), default=0) for column in range(4)]
    lines = ["  ".join(f"{cell:{width}}" for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]
    return "\n".join((f"folder  {folder.path}", f"public  {own.public}", *(lines or ["nobody is known yet"])))
