"""What the service manager is told: ready, alive, status, stopping. See sd_notify(3) for words and socket.

A core composes the datagrams, with `now_ns` passed in; a shell sends them. Only the capture and link loop itself feeds the watchdog, so a
loop that hangs is a service that hangs.
"""

import os
import socket
from collections.abc import Mapping
from contextlib import suppress
from typing import Final

_TELL_NS: Final = 2_000_000_000
"""People read the status; a datagram costs the board 0.1 ms."""


class ServiceState:
    """Decides what to tell the service manager, and when. Each datagram says everything, so a lost one does no harm.

    Args:
        watchdog_ns: the service is restarted after this much silence, ns; None without a watchdog.
    """

    def __init__(self, watchdog_ns: int | None) -> None:
        self._alive = [] if watchdog_ns is None else ["WATCHDOG=1"]
        self._period_ns = _TELL_NS if watchdog_ns is None else min(_TELL_NS, watchdog_ns // 4)
        self._due_ns = 0

    def due(self, now_ns: int) -> bool:
        """Whether a datagram is due.

        Args:
            now_ns: CLOCK_MONOTONIC now, ns.
        """
        return now_ns >= self._due_ns

    def alive(self, now_ns: int, status: str) -> bytes:
        """Return the datagram of a loop that is running.

        Args:
            now_ns: CLOCK_MONOTONIC now, ns.
            status: one line for people.
        """
        self._due_ns = now_ns + self._period_ns
        return _datagram("READY=1", *self._alive, _status(status))

    def stopping(self, status: str) -> bytes:
        """Return the datagram that says goodbye.

        Args:
            status: one line for people.
        """
        return _datagram("STOPPING=1", _status(status))


def watchdog_ns(environment: Mapping[str, str], process_id: int) -> int | None:
    """Return how much silence the service manager tolerates, ns; None if it does not watch this process.

    Args:
        environment: environment of the process: WATCHDOG_USEC, and WATCHDOG_PID if it is meant for one process only.
        process_id: own process id.
    """
    if environment.get("WATCHDOG_PID", str(process_id)) != str(process_id):
        return None
    try:
        watchdog_us = int(environment["WATCHDOG_USEC"])
    except (KeyError, ValueError):
        return None
    return watchdog_us * 1000 if watchdog_us > 0 else None


def socket_address(environment: Mapping[str, str]) -> str | None:
    r"""Return where the service manager listens: a path, or a name in the abstract namespace (`@` stands for its leading \0).

    Args:
        environment: environment of the process: NOTIFY_SOCKET.

    Returns:
        The address for `connect`; None outside a service, or if it is not a Unix socket.
    """
    address = environment.get("NOTIFY_SOCKET", "")
    if address.startswith("@"):
        return "\0" + address[1:]
    return address if address.startswith("/") else None


class Notifier:
    """Talks to the service manager; without one, every call does nothing.

    Args:
        environment: environment of the process.
    """

    def __init__(self, environment: Mapping[str, str]) -> None:
        self._address = socket_address(environment)
        self._state = ServiceState(watchdog_ns(environment, os.getpid()))
        self._socket: socket.socket | None = None
        if self._address is not None:
            self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK)

    def due(self, now_ns: int) -> bool:
        """Whether `alive` should be called now, with a fresh status."""
        return self._socket is not None and self._state.due(now_ns)

    def alive(self, now_ns: int, status: str) -> None:
        """Report that the service is ready and its loop is running.

        Args:
            now_ns: CLOCK_MONOTONIC now, ns.
            status: one line for people.
        """
        self._send(self._state.alive(now_ns, status))

    def stopping(self, status: str) -> None:
        """Report that the service is stopping by itself."""
        self._send(self._state.stopping(status))

    def close(self) -> None:
        """Release the socket."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def _send(self, datagram: bytes) -> None:
        """Send without waiting. A service manager that restarts or is busy must not stop the stream; the next datagram repeats everything."""
        if datagram and self._socket is not None and self._address is not None:
            with suppress(OSError):
                self._socket.sendto(datagram, self._address)


def _status(text: str) -> str:
    return "STATUS=" + " ".join(text.split())


def _datagram(*words: str) -> bytes:
    return "\n".join(words).encode()
