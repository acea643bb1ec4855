"""Checks an address before ZeroMQ binds or dials it, and explains ZeroMQ's refusals in plain words.

An ipc path is owned by three: the folder in which its socket lies, the socket, and the process behind it.
Guaranteed: the listener listens only in a folder in which nobody else can replace its socket. That socket has mode 0600, so only its owner
and root can connect. The dialler believes no packet from another user's process, whatever lies under the path by then: the kernel says whose
process it is (SO_PEERCRED, which ZeroMQ delivers with each message). Not guaranteed: in a folder such as /tmp anybody may take a free name
first, which is reported. Processes of the same user, and root's, are not distinguished. A stranger who listens there learns that somebody
greets a board, which is no secret. Where the kernel does not say (not Linux), the owner and folder of the socket at the start must suffice.
"""

import errno
import os
import pwd
import socket
import stat
from contextlib import suppress
from pathlib import Path
from typing import Final

import zmq

from common.errors import SettingsError, TakenError, UnavailableError
from common.files import is_open_to_others


def trusted_users(owner: str) -> frozenset[int]:
    """User ids that may be at the other end of an ipc link: this user, root, and the user named by the link's `owner=`.

    Args:
        owner: name or number of a user; empty for none.

    Raises:
        SettingsError: there is no such user.
    """
    own = {os.geteuid(), 0}
    if not owner:
        return frozenset(own)
    if owner.isascii() and owner.isdigit():
        return frozenset({*own, int(owner)})
    try:
        return frozenset({*own, pwd.getpwnam(owner).pw_uid})
    except (KeyError, ValueError):
        raise SettingsError(f"owner={owner}: there is no such user", "give a user's name or number") from None


def check_folder(path: str, trusted: frozenset[int]) -> None:
    """Refuse a path in a folder in which somebody else could replace what lies there.

    Args:
        path: path of the socket, which need not exist.
        trusted: users who may.

    Raises:
        UnavailableError: the folder belongs to someone else, or others may write to it and it is not sticky.
    """
    folder = Path(path).parent
    with suppress(OSError):  # a missing folder is reported elsewhere
        status = folder.stat()
        if status.st_uid not in trusted:
            raise _refused(path, f"{folder} belongs to {_name(status.st_uid)}", status.st_uid)
        if is_open_to_others(status):
            raise UnavailableError(
                f"ipc://{path} is not safe: other users may write to {folder}, which belongs to {_name(status.st_uid)}",
                f"chmod go-w {folder}, or choose a path in $XDG_RUNTIME_DIR",
            )


def check_socket(path: str, trusted: frozenset[int]) -> None:
    """Refuse a socket that belongs to another user, or that lies where another user could put one.

    Args:
        path: path of the socket, which need not exist.
        trusted: users who may own it.

    Raises:
        UnavailableError: it does.
    """
    check_folder(path, trusted)
    with suppress(OSError):
        status = Path(path).stat()
        if stat.S_ISSOCK(status.st_mode) and status.st_uid not in trusted:
            raise _refused(path, f"it belongs to {_name(status.st_uid)}", status.st_uid)
        if not os.access(path, os.R_OK | os.W_OK):
            raise UnavailableError(
                f"ipc://{path} does not let this user in: it belongs to {_name(status.st_uid)}",
                f"add ?owner={os.geteuid()} to the link of the side that listens, as root",
            )


def check_peer(path: str, message: zmq.Frame, trusted: frozenset[int]) -> None:
    """Refuse a message from another user's process.

    Args:
        path: path of the socket.
        message: any part of the received message.
        trusted: users whose messages are believed.

    Raises:
        UnavailableError: it is a stranger's.
    """
    try:
        # libzmq, stream_engine_base.cpp: the address, then ":uid:gid:pid" where the system has SO_PEERCRED. A peer's own properties follow it.
        uid = int(str(message.get("Peer-Address")).split(":")[-3])
    except (zmq.ZMQError, ValueError, IndexError):
        return
    if uid not in trusted:
        raise _refused(path, f"a process of {_name(uid)} listens there", uid)


def let_in(path: str, owner: str) -> None:
    """Give a newly bound socket to the user who is to connect to it. It stays closed to everyone else except root.

    Args:
        path: path of the socket.
        owner: name or number of the user.

    Raises:
        UnavailableError: this user may not give it away.
        SettingsError: there is no such user.
    """
    (uid,) = trusted_users(owner) - {os.geteuid(), 0} or {os.geteuid()}
    try:
        os.chown(path, uid, -1, follow_symlinks=False)
    except OSError:
        raise UnavailableError(
            f"ipc://{path} cannot be opened to user {owner}: only root may give a socket away",
            "let that user's side listen (?bind=1), and give owner= on this side",
        ) from None


def owner_of(path: str) -> str:
    """Name of a path's owner, for people."""
    try:
        return _name(os.lstat(path).st_uid)
    except OSError:
        return "somebody"


def _refused(path: str, why: str, uid: int) -> UnavailableError:
    owner = _name(uid).removeprefix("user ")
    return UnavailableError(
        f"ipc://{path} is not this user's: {why}",
        f"choose a path in $XDG_RUNTIME_DIR, or add ?owner={owner} to the link if that user is meant",
    )


def _name(uid: int) -> str:
    try:
        return f"user {pwd.getpwuid(uid).pw_name}"
    except KeyError:
        return f"user {uid}"


_UNIX_PATH_MAX: Final = 107
"""Bytes of a Unix socket's path, without the terminating zero (unix(7))."""


def explained(address: str, error: zmq.ZMQError, remedy: str) -> SettingsError | UnavailableError:
    """Turn ZeroMQ's refusal of an address into an error that says whose fault it is.

    Args:
        address: the refused address.
        error: ZeroMQ's error.
        remedy: what to do if the address is taken or makes no sense.
    """
    why = zmq.strerror(error.errno or 0)  # the exception's own text repeats the address
    if error.errno == zmq.EADDRINUSE:
        return TakenError(f"{address} cannot be used ({why})", remedy)
    if error.errno in {zmq.EADDRNOTAVAIL, errno.ENODEV}:
        return UnavailableError(f"{address} cannot be used ({why})", "give an address of this machine, or * for all")
    if error.errno in {errno.EPERM, errno.ENOENT, errno.EACCES}:  # the folder of an ipc path, or a port below 1024
        return UnavailableError(f"{address} cannot be opened ({why})", "check the folder and its permissions")
    return SettingsError(f"link {address!r} is not valid ({why})", remedy)


def _check_replaceable(path: str) -> None:
    """Refuse a path that holds anything but a socket, because ZeroMQ unlinks whatever is there.

    Raises:
        UnavailableError: it holds something else.
    """
    try:
        status = os.lstat(path)
    except OSError:
        return
    if not stat.S_ISSOCK(status.st_mode):
        raise UnavailableError(f"ipc://{path} is a file, not a socket", "choose another path with --link")
    if os.geteuid() not in {0, status.st_uid}:
        raise TakenError(f"ipc://{path} belongs to {owner_of(path)}", "choose another path with --link")


def free_path(path: str) -> None:
    """Remove the socket of a dead listener. ZeroMQ would silently take the path even from a live one.

    Raises:
        SettingsError: the path is too long for a Unix socket.
        TakenError: something listens there.
        UnavailableError: it is not a socket, or may not be touched.
    """
    if len(os.fsencode(path)) > _UNIX_PATH_MAX:
        raise SettingsError(
            f"ipc path of {len(os.fsencode(path))} bytes",
            f"use one of at most {_UNIX_PATH_MAX} bytes, for example ipc://$XDG_RUNTIME_DIR/board",
        )
    with socket.socket(socket.AF_UNIX) as probe:
        probe.setblocking(False)  # noqa: FBT003 - a listener may never accept; then its queue is full, and the path is taken
        try:
            probe.connect(path)
        except BlockingIOError:
            pass
        except (FileNotFoundError, ConnectionRefusedError):
            _check_replaceable(path)
            return  # ZeroMQ itself unlinks a dead socket
        except OSError as error:
            raise UnavailableError(
                f"ipc://{path} cannot be opened ({error.strerror})", "choose another path with --link"
            ) from None
    raise TakenError(
        f"ipc://{path} is taken by {owner_of(path)}", "stop what listens there, or choose another path with --link"
    )


def plain_endpoint(endpoint: str) -> str:
    """Return a bound ZeroMQ endpoint as people know it: IPv4 without the brackets and prefix that it has on a dual-stack socket."""
    scheme, _, rest = endpoint.partition("://")
    host, _, port = rest.rpartition(":")
    return f"{scheme}://{host[8:-1]}:{port}" if host.startswith("[::ffff:") else endpoint
