"""The host's call at a board's door: connect, exchange the words of pairing, keep the board's key. A core of its own decides (pairing_code)."""

import os
import socket
from collections.abc import Callable
from contextlib import suppress
from typing import Final, assert_never

import zmq
from zmq.utils import z85

from common import now
from common.errors import DataError, ProtocolError, TandemError, UnavailableError
from common.keys import KeyFolder, Peer, clean_name
from common.protocol.pairing_code import Asking, Identity, Refuse, Refused, Word
from common.protocol.pairing_wire import MAX_WORD_BYTES, decode_word, encode_word

_ANSWER_MS: Final = 10_000
"""A word takes a round trip and one round of the board's loop; a board that is busy elsewhere gets this long."""


class PairingCall:
    """One attempt to be trusted.

    Args:
        address: of the board's door, `tcp://HOST:PORT`.
        keys: this host's key; the board's is added when it has proved the code.
    """

    def __init__(self, address: str, keys: KeyFolder) -> None:
        self._address, self._keys = address, keys
        me = Identity(z85.decode(keys.own().public.encode()), clean_name(socket.gethostname()))
        self._asking = Asking(me, os.urandom)
        self._context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
        self._socket = self._context.socket(zmq.DEALER)
        for option, value in ((zmq.MAXMSGSIZE, MAX_WORD_BYTES), (zmq.LINGER, 500), (zmq.IMMEDIATE, 1), (zmq.IPV6, 1)):
            self._socket.setsockopt(option, value)
        self._socket.connect(address)

    def ask(self) -> str:
        """Ask the board to show a code; gives the board's name.

        Raises:
            UnavailableError: the board takes in nobody, or not now.
            DataError: what answers is no board.
        """
        if not self._socket.poll(_ANSWER_MS, zmq.POLLOUT):
            raise UnavailableError(
                f"{self._address} takes in no new host",
                "start board-agent there; if it knows a host already: sudo board-agent pair",
            )
        self._say(self._asking.ask())
        self._asking.receive(self._hear())
        assert self._asking.board is not None
        return clean_name(self._asking.board.name)

    def prove(self, code: int, link: str, progress: Callable[[], None]) -> Peer:
        """Prove the code, have the board prove it, and keep the board's key.

        Args:
            code: what was typed.
            link: where the board is to be found from now on.
            progress: called once a round.

        Returns:
            The board as it is known from now on.

        Raises:
            DataError: one of the two does not know the code.
            UnavailableError: the board has fallen silent.
        """
        word: Word | None = self._asking.begin(code)
        while word is not None:
            self._say(word)
            word = self._asking.receive(self._hear())
            progress()
        board = self._asking.board
        assert board is not None
        assert self._asking.proved
        return self._keys.add(Peer(board.name, z85.encode(board.key).decode(), now.wall_time(), link))

    def close(self) -> None:
        """Hang up; the board need not wait for us."""
        if not self._asking.proved:
            with suppress(zmq.ZMQError):
                self._socket.send(encode_word(Refuse(Refused.CLOSED)), zmq.DONTWAIT)
        self._context.destroy(linger=500)

    def _say(self, word: Word) -> None:
        with suppress(zmq.Again):  # the answer that does not come tells it
            self._socket.send(encode_word(word), zmq.DONTWAIT)

    def _hear(self) -> Word:
        if not self._socket.poll(_ANSWER_MS):
            raise UnavailableError(f"{self._address} has fallen silent", "try again")
        try:
            parts = self._socket.recv_multipart(zmq.DONTWAIT)
            word = decode_word(parts[0])
        except ProtocolError as error:
            raise DataError(f"{self._address} is no board's door ({error.problem})", "check --link") from None
        if isinstance(word, Refuse):
            raise _refusal(word)
        return word


def _refusal(word: Refuse) -> TandemError:
    wait = f"wait {word.seconds} s" if word.seconds else "try again"
    match word.reason:
        case Refused.CLOSED:
            return UnavailableError("the board takes in no new host", "run `sudo board-agent pair` there")
        case Refused.PAUSE:
            return UnavailableError(
                "the board takes a pause after wrong codes", f"{wait}, or run `sudo board-agent pair` there"
            )
        case Refused.BUSY:
            return UnavailableError("another host is being paired", wait)
        case Refused.WRONG:
            return DataError("the code was wrong", f"{wait} with the new code that the board then shows")
        case _:
            assert_never(word.reason)
