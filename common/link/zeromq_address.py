"""Checks an address before ZeroMQ binds it, and explains ZeroMQ's refusals in plain words."""

import errno
import os
import socket
import stat
from typing import Final

import zmq

from common.errors import SettingsError, TakenError, UnavailableError
from common.link.ipc import owner_of

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
