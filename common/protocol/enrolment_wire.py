"""Encodes and decodes the words of pairing: a msgpack array [version, kind, fields…] of at most 255 bytes, preceded by one byte of length.

Every field is checked. For a stranger, nothing is kept but the part of a word that has come.
"""

from typing import Any, Final, assert_never

import msgpack

from common.errors import ProtocolError
from common.protocol.enrolment_code import ROUNDS
from common.protocol.enrolment_words import (
    COMMITMENT_BYTES,
    NONCE_BYTES,
    Ask,
    Begin,
    Commit,
    Denial,
    Identity,
    Open,
    Refuse,
    Shown,
    Word,
)
from common.protocol.zap import KEY_BYTES
from common.versions import ENROLMENT_VERSION

MAX_WORD_BYTES: Final = 255
"""The longest honest word has 203 bytes: a key and a commitment, with a name of 64 letters of 2 bytes."""

MAX_NAME: Final = 64

_KINDS: Final[tuple[type, ...]] = (Ask, Shown, Commit, Open, Refuse, Begin)
_LONGEST_S: Final = 86_400


def encode_word(word: Word) -> bytes:
    """Encode a word, without its length byte."""
    packed: bytes = msgpack.packb([ENROLMENT_VERSION, _KINDS.index(type(word)), *_fields(word)])
    return packed


def decode_word(packed: bytes) -> Word:
    """Decode a word.

    Raises:
        ProtocolError: these bytes are not a word.
    """
    if len(packed) > MAX_WORD_BYTES:
        raise _bad(f"{len(packed)} bytes")
    try:
        items = msgpack.unpackb(packed, max_array_len=5, max_map_len=0, max_ext_len=0, max_bin_len=64, max_str_len=256)
    except (ValueError, RecursionError, msgpack.exceptions.UnpackException) as error:
        raise _bad(f"no msgpack ({error})") from None
    if not isinstance(items, list) or len(items) not in {4, 5}:
        raise _bad("no [version, kind, field, field]")
    version, kind, *fields = items
    if type(version) is not int or version != ENROLMENT_VERSION:
        raise _bad(f"version {version!r:.20}")
    if type(kind) is not int or not 0 <= kind < len(_KINDS):
        raise _bad(f"kind {kind!r:.20}")
    return _read_begin(fields) if _KINDS[kind] is Begin else _read(_KINDS[kind], fields)


def frame_word(word: Word) -> bytes:
    """Encode a word with its length byte, as it travels.

    Raises:
        ProtocolError: it is too long.
    """
    packed = encode_word(word)
    if len(packed) > MAX_WORD_BYTES:
        raise _bad(f"{len(packed)} bytes")
    return bytes((len(packed),)) + packed


class WordReader:
    """Assembles words from a byte stream in chunks of any size; keeps at most one unfinished word."""

    def __init__(self) -> None:
        self._unread = b""

    @property
    def unread_bytes(self) -> int:
        """Number of bytes kept of an incomplete word."""
        return len(self._unread)

    def feed(self, received: bytes) -> list[Word]:
        """Return the words that are now complete.

        Raises:
            ProtocolError: these bytes are not words; the stream cannot be continued.
        """
        unread, words = self._unread + received, []
        while unread and len(unread) > unread[0]:
            words.append(decode_word(unread[1 : 1 + unread[0]]))
            unread = unread[1 + unread[0] :]
        self._unread = unread
        return words


def _fields(word: Word) -> list[Any]:
    match word:
        case Ask(who) | Shown(who):
            return [who.key, who.name[:MAX_NAME]]
        case Begin(who, commitment):
            return [who.key, who.name[:MAX_NAME], commitment]
        case Commit(number, content) | Open(number, content):
            return [number, content]
        case Refuse(reason, seconds):
            return [reason.value, min(seconds, _LONGEST_S)]
        case _:
            assert_never(word)


def _read_begin(fields: list[Any]) -> Begin:
    if len(fields) != 3 or type(fields[2]) is not bytes or len(fields[2]) != COMMITMENT_BYTES:
        raise _bad("no key, name and commitment")
    return Begin(_identity(*fields[:2]), fields[2])


def _read(kind: type, fields: list[Any]) -> Word:
    if len(fields) != 2:
        raise _bad(f"{len(fields)} fields")
    first, second = fields
    if kind in {Ask, Shown}:
        who = _identity(first, second)
        return Ask(who) if kind is Ask else Shown(who)
    if type(first) is not int:
        raise _bad("no number")
    if kind is Refuse:
        if not 0 <= first < len(Denial) or type(second) is not int or not 0 <= second <= _LONGEST_S:
            raise _bad("no refusal")
        return Refuse(Denial(first), second)
    size = COMMITMENT_BYTES if kind is Commit else NONCE_BYTES
    if not 0 <= first < ROUNDS or type(second) is not bytes or len(second) != size:
        raise _bad("no round")
    return Commit(first, second) if kind is Commit else Open(first, second)


def _identity(key: Any, name: Any) -> Identity:  # noqa: ANN401 - whatever msgpack found
    if type(key) is not bytes or len(key) != KEY_BYTES or type(name) is not str or len(name) > MAX_NAME:
        raise _bad("no key with a name")
    return Identity(key, name)


def _bad(problem: str) -> ProtocolError:
    return ProtocolError(f"not a word of pairing: {problem}", "check that both sides have the same version")
