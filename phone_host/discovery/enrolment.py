"""The host's calls at a board's door: exchange the words of enrolment and keep the board's key.

The core in `common/protocol/enrolment_code.py` decides. The first call ends before the code is typed, and another call
proves it, so no connection stays open while a person walks between the machines.
"""

import os
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Final, assert_never

from zmq.utils import z85

from common import now
from common.errors import DataError, ProtocolError, SettingsError, TandemError, UnavailableError
from common.keys import KeyFolder
from common.link.factory import is_this_machine
from common.peers import Peer, clean_name
from common.protocol.enrolment_code import Asking, code_text
from common.protocol.enrolment_wire import MAX_WORD_BYTES, WordReader, frame_word
from common.protocol.enrolment_words import Denial, Identity, Open, Refuse, Word

_ANSWER_S: Final = 10.0
"""Time limit for an answer. It takes a round trip and one round of the board's loop, but the board may be busy or open
its door only now."""

_AGAIN_S: Final = 0.2

_PROBE_S: Final = 2.0
"""Time limit for a connection that only shows whether anybody is there; a board in a room answers within milliseconds."""


class PairingCall:
    """One attempt to be trusted.

    Args:
        door: host and port of the board's door.
        keys: this host's keys. The board's key is added once the board has proved the code.
        link: the board's address, `tcp://HOST:PORT`, as the user knows it.
        say: is told in one line what takes long.
        patience_s: time limit for an answer, s.
    """

    def __init__(
        self,
        door: tuple[str, int],
        keys: KeyFolder,
        link: str = "",
        say: Callable[[str], None] = lambda _: None,
        *,
        patience_s: float = _ANSWER_S,
    ) -> None:
        self._door, self._keys, self._link, self._say, self._patience_s = door, keys, link, say, patience_s
        me = Identity(z85.decode(keys.own().public.encode()), clean_name(socket.gethostname()))
        self._asking = Asking(me, os.urandom)

    def ask(self) -> str:
        """Ask the board to show a code. Return the board's name.

        Raises:
            UnavailableError: the board takes in no new host, or not now.
            DataError: the answer is not from a board.
        """
        deadline_ns = now.monotonic_ns() + round(self._patience_s * 1e9)
        has_said = False
        while True:
            try:
                with self._line() as line:
                    line.say(self._asking.ask())
                    self._asking.receive(line.hear())
            except _HungUpError:
                if now.monotonic_ns() >= deadline_ns:
                    raise
                if not has_said:
                    has_said = True
                    self._say(f"waiting {self._patience_s:g} s for {self._name} to take in a new host")
                threading.Event().wait(_AGAIN_S)
            else:
                break
        assert self._asking.board is not None
        return clean_name(self._asking.board.name)

    def prove(self, code: int, link: str, progress: Callable[[], None]) -> Peer:
        """Prove the code, have the board prove it, and keep the board's key.

        Args:
            code: the code that was typed.
            link: the board's address from now on.
            progress: called once a round.

        Raises:
            SettingsError: this code was typed before.
            DataError: one of the two does not know the code.
            UnavailableError: the board does not answer any more.
        """
        if code_text(code) in self._keys.spent_codes():
            raise SettingsError(
                "this code was typed before", "type a new one: `sudo board-agent pair` on the board shows it"
            )
        is_spent = False
        word: Word | None = self._asking.begin(code)
        with self._line() as line:
            while word is not None:
                if isinstance(word, Open) and not is_spent:  # from now on somebody may learn the code
                    self._keys.spend(code_text(code))
                    is_spent = True
                line.say(word)
                word = self._asking.receive(line.hear())
                progress()
        board = self._asking.board
        assert board is not None
        assert self._asking.proved
        return self._keys.add(
            Peer(name=board.name, key=z85.encode(board.key).decode(), added=now.wall_time(), address=link)
        )

    @property
    def _name(self) -> str:
        """The board's address and its door, for people."""
        door = f"tcp://{self._door[0]}:{self._door[1]}"
        return f"{self._link} (pairing port {self._door[1]})" if self._link else door

    @contextmanager
    def _line(self) -> "Iterator[_Line]":
        try:
            connected = socket.create_connection(self._door, self._patience_s)
        except OSError as error:
            raise self._closed(error.strerror or str(error)) from None
        with connected:
            yield _Line(connected, self._name)

    def _closed(self, cause: str) -> "_HungUpError":
        """Return the error for a door that is closed: nobody listens at all, or a board that takes in no host now."""
        if self._link and not _is_open(self._link):
            return _HungUpError(
                f"nobody listens at {self._link}, nor at its pairing port {self._door[1]} ({cause})",
                "check --link, and that board-agent runs there with a link such as tcp://*:5555",
            )
        problem = f"{self._name} does not take in a new host ({cause})"
        if is_this_machine(self._door[0]):
            return _HungUpError(
                problem,
                "for a board-agent that listens on 127.0.0.1 no pairing is needed, `phone-host run` connects;"
                " for one with a link such as tcp://*:5555 run `sudo board-agent pair`",
            )
        return _HungUpError(problem, "start board-agent there, and run sudo board-agent pair")


def _is_open(link: str) -> bool:
    """Whether somebody listens at a link's address."""
    host, _, port = link.removeprefix("tcp://").rpartition(":")
    try:
        socket.create_connection((host.strip("[]"), int(port)), _PROBE_S).close()
    except (OSError, ValueError):
        return False
    return True


class _HungUpError(UnavailableError):
    """Nobody answers at the door, but it may open in a moment."""


class _Line:
    """A connection to the door."""

    def __init__(self, connected: socket.socket, where: str) -> None:
        self._socket, self._where = connected, where
        self._reader = WordReader()

    def say(self, word: Word) -> None:
        with suppress(OSError):  # the missing answer reveals it
            self._socket.sendall(frame_word(word))

    def hear(self) -> Word:
        deadline_ns = now.monotonic_ns() + round(_ANSWER_S * 1e9)
        while True:
            try:
                # The limit is not per read: a stranger might send a byte now and then. 0 would mean not to wait at all.
                self._socket.settimeout(max(1e-3, (deadline_ns - now.monotonic_ns()) / 1e9))
                received = self._socket.recv(1 + MAX_WORD_BYTES)
                words = self._reader.feed(received)
            except TimeoutError:
                raise UnavailableError(f"{self._where} does not answer any more", "try again") from None
            except OSError:
                received, words = b"", []
            except ProtocolError as error:
                raise DataError(
                    f"{self._where} does not answer like a board that takes in new hosts ({error.problem})",
                    "check --link",
                ) from None
            if words:
                if isinstance(words[0], Refuse):
                    raise _refusal(words[0])
                return words[0]
            if not received:
                raise _HungUpError(
                    f"{self._where} closes the connection",
                    "start board-agent there, and run sudo board-agent pair",
                )


def _refusal(word: Refuse) -> TandemError:
    wait = f"wait {word.seconds} s" if word.seconds else "try again"
    match word.reason:
        case Denial.CLOSED:
            return UnavailableError("the board does not take in a new host", "run `sudo board-agent pair` there")
        case Denial.PAUSE:
            return UnavailableError(
                "the board pauses after wrong codes", f"{wait}, or run `sudo board-agent pair` there"
            )
        case Denial.BUSY:
            return UnavailableError("another host is being paired", wait)
        case Denial.WRONG:
            return DataError(
                "the code was wrong", f"{wait} with the new code that `sudo board-agent pair` then shows there"
            )
        case _:
            assert_never(word.reason)
