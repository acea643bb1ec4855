"""Strangers at a board's door: plain sockets that carry words of pairing, a few at a time, each for seconds.

This is not ZeroMQ, which lets a stranger send a message of endlessly many parts, keeps all of them, and cannot hang up on anyone. Here a
caller costs one socket and one unfinished word. When all places are taken, the caller that was silent longest must make room, so nobody can
block them; a caller in the middle of a proof stays. A caller that was cut off may call again: before a proof a connection holds no state.
"""

import select
import socket
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import count
from typing import Final

from common.errors import ProtocolError
from common.protocol.enrolment_wire import MAX_WORD_BYTES, WordReader, frame_word
from common.protocol.enrolment_words import Word
from common.protocol.zap import plain_address

_MOST: Final = 16
"""Callers at a time. One owner pairs one host."""

_SILENCE_NS: Final = 3_000_000_000
"""Time without a whole word. Nobody has to type while a connection lasts."""

_CALL_NS: Final = 15_000_000_000
"""Longest call. A proof may take ten seconds."""

_AT_ONCE: Final = 32
"""Callers accepted, or reads, per round of the poll loop. A flood of them must not hold up frames."""

_BACKLOG: Final = 16


@dataclass(slots=True)
class _Caller:
    connection: bytes
    socket: socket.socket
    address: str
    since_ns: int
    heard_ns: int
    reader: WordReader = field(default_factory=WordReader)


@dataclass(frozen=True, slots=True)
class Said:
    """A caller said a word."""

    connection: bytes
    address: str
    word: Word


@dataclass(frozen=True, slots=True)
class Nonsense:
    """A caller said something that is not a word, and was cut off."""

    connection: bytes
    address: str
    problem: str


@dataclass(frozen=True, slots=True)
class Left:
    """A caller is gone."""

    connection: bytes


Call = Said | Nonsense | Left


class Callers:
    """Listens for callers and holds them. Its descriptor stays the same whether it listens or not.

    Args:
        stays: whether a connection is exempt from making room for a newcomer.
    """

    def __init__(self, stays: Callable[[bytes], bool]) -> None:
        self._stays = stays
        self._epoll = select.epoll()
        self._listeners: dict[int, socket.socket] = {}
        self._callers: dict[int, _Caller] = {}
        self._numbers = count()

    def fileno(self) -> int:
        """The descriptor to wait on."""
        return self._epoll.fileno()

    def listen(self, addresses: Sequence[tuple[str, int]]) -> None:
        """Listen on all of these addresses, or on none.

        Args:
            addresses: addresses of this machine, with their ports; `::` includes IPv4.

        Raises:
            OSError: an address cannot be had.
        """
        try:
            for host, port in addresses:
                family = socket.AF_INET6 if ":" in host else socket.AF_INET
                both = host == "::" and socket.has_dualstack_ipv6()
                listener = socket.create_server((host, port), family=family, backlog=_BACKLOG, dualstack_ipv6=both)
                listener.settimeout(0)
                self._listeners[listener.fileno()] = listener
                self._epoll.register(listener, select.EPOLLIN)
        except OSError:
            self.shut()
            raise

    def shut(self) -> None:
        """Stop listening, and hang up on everybody."""
        for caller in tuple(self._callers.values()):
            self._hang_up(caller)
        for listener in self._listeners.values():
            listener.close()  # which also removes it from the epoll
        self._listeners.clear()

    def close(self) -> None:
        """Like `shut`, but for good."""
        self.shut()
        self._epoll.close()

    def receive(self, now_ns: int) -> Iterator[Call]:
        """Return what has arrived.

        Args:
            now_ns: CLOCK_MONOTONIC, ns.
        """
        for fd, _ in self._epoll.poll(0, _AT_ONCE):
            if fd in self._listeners:
                yield from self._accept(self._listeners[fd], now_ns)
            elif fd in self._callers:  # not hung up on in this very round
                yield from self._read(self._callers[fd], now_ns)

    def tick(self, now_ns: int) -> Iterator[Call]:
        """Hang up on callers that are silent or take too long. Call this once a second."""
        for caller in tuple(self._callers.values()):
            if now_ns - caller.heard_ns >= _SILENCE_NS or now_ns - caller.since_ns >= _CALL_NS:
                yield self._hang_up(caller)
        for fd in self._listeners:
            self._epoll.modify(fd, select.EPOLLIN)

    def say(self, connection: bytes, word: Word) -> None:
        """Send a word to a caller. One that does not read hears nothing."""
        for caller in self._callers.values():
            if caller.connection == connection:
                with suppress(OSError):
                    caller.socket.send(frame_word(word))

    def _accept(self, listener: socket.socket, now_ns: int) -> Iterator[Call]:
        for _ in range(_AT_ONCE):
            try:
                accepted, address = listener.accept()
            except (BlockingIOError, ConnectionError):
                return
            except OSError:  # no descriptors left: the listener would stay readable for ever
                self._epoll.modify(listener, 0)
                return
            accepted.settimeout(0)
            if len(self._callers) >= _MOST:
                yield self._hang_up(
                    min(
                        (caller for caller in self._callers.values() if not self._stays(caller.connection)),
                        key=lambda caller: caller.heard_ns,
                    )
                )
            connection = next(self._numbers).to_bytes(8, "big")
            caller = _Caller(connection, accepted, plain_address(address[0]), now_ns, now_ns)
            self._callers[accepted.fileno()] = caller
            self._epoll.register(accepted, select.EPOLLIN)

    def _read(self, caller: _Caller, now_ns: int) -> Iterator[Call]:
        try:
            received = caller.socket.recv(1 + MAX_WORD_BYTES)
            words = caller.reader.feed(received)
        except BlockingIOError:
            return
        except OSError:
            received, words = b"", []
        except ProtocolError as error:
            yield self._hang_up(caller)
            yield Nonsense(caller.connection, caller.address, error.problem)
            return
        if not received:
            yield self._hang_up(caller)
            return
        if words:
            caller.heard_ns = now_ns
        for word in words:
            yield Said(caller.connection, caller.address, word)

    def _hang_up(self, caller: _Caller) -> Left:
        del self._callers[caller.socket.fileno()]
        caller.socket.close()
        return Left(caller.connection)
