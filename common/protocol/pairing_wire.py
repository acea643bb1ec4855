"""Words of pairing to bytes and back: a msgpack array [version, kind, fields…] of at most 256 bytes, every field checked."""

from typing import Any, Final, assert_never

import msgpack

from common.errors import ProtocolError
from common.protocol.pairing_code import (
    COMMITMENT_BYTES,
    NONCE_BYTES,
    ROUNDS,
    Ask,
    Commit,
    Identity,
    Open,
    Refuse,
    Refused,
    Shown,
    Word,
)
from common.protocol.zap import KEY_BYTES

MAX_WORD_BYTES: Final = 256
"""The longest honest word, a key with a name of 64 letters of 2 bytes, has 170."""

MAX_NAME: Final = 64

_VERSION: Final = 1
_KINDS: Final[tuple[type, ...]] = (Ask, Shown, Commit, Open, Refuse)
_LONGEST_S: Final = 86_400


def encode_word(word: Word) -> bytes:
    """Give a word's bytes."""
    packed: bytes = msgpack.packb([_VERSION, _KINDS.index(type(word)), *_fields(word)])
    return packed


def decode_word(packed: bytes) -> Word:
    """Read a word.

    Raises:
        ProtocolError: these bytes are none.
    """
    if len(packed) > MAX_WORD_BYTES:
        raise _bad(f"{len(packed)} bytes")
    try:
        items = msgpack.unpackb(packed, max_array_len=4, max_map_len=0, max_ext_len=0, max_bin_len=64, max_str_len=256)
    except (ValueError, RecursionError, msgpack.exceptions.UnpackException) as error:
        raise _bad(f"no msgpack ({error})") from None
    if not isinstance(items, list) or len(items) != 4:
        raise _bad("no [version, kind, field, field]")
    version, kind, first, second = items
    if type(version) is not int or version != _VERSION:
        raise _bad(f"version {version!r:.20}")
    if type(kind) is not int or not 0 <= kind < len(_KINDS):
        raise _bad(f"kind {kind!r:.20}")
    return _read(_KINDS[kind], first, second)


def _fields(word: Word) -> list[Any]:
    match word:
        case Ask(who) | Shown(who):
            return [who.key, who.name[:MAX_NAME]]
        case Commit(number, content) | Open(number, content):
            return [number, content]
        case Refuse(reason, seconds):
            return [reason.value, min(seconds, _LONGEST_S)]
        case _:
            assert_never(word)


def _read(kind: type, first: Any, second: Any) -> Word:  # noqa: ANN401 - whatever msgpack found
    if kind in {Ask, Shown}:
        if type(first) is not bytes or len(first) != KEY_BYTES or type(second) is not str or len(second) > MAX_NAME:
            raise _bad("no key with a name")
        who = Identity(first, second)
        return Ask(who) if kind is Ask else Shown(who)
    if type(first) is not int:
        raise _bad("no number")
    if kind is Refuse:
        if not 0 <= first < len(Refused) or type(second) is not int or not 0 <= second <= _LONGEST_S:
            raise _bad("no refusal")
        return Refuse(Refused(first), second)
    size = COMMITMENT_BYTES if kind is Commit else NONCE_BYTES
    if not 0 <= first < ROUNDS or type(second) is not bytes or len(second) != size:
        raise _bad("no round")
    return Commit(first, second) if kind is Commit else Open(first, second)


def _bad(problem: str) -> ProtocolError:
    return ProtocolError(f"not a word of pairing: {problem}", "check that both sides have the same version")
