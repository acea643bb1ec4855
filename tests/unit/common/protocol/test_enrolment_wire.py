"""Words of pairing as bytes: an invalid word is refused with what is wrong with it, before any of it is used."""

from typing import Any

import msgpack
import pytest

from common.errors import ProtocolError
from common.protocol.enrolment_wire import WordReader, decode_word, encode_word, frame_word
from common.protocol.enrolment_words import Ask, Begin, Commit, Denial, Identity, Open, Refuse, Shown, Word

KEY, COMMITMENT, NONCE = bytes(range(32)), bytes(32), bytes(16)
ME = Identity(KEY, "me")
VERSION, ASK, COMMIT, OPEN, REFUSE, BEGIN = 2, 0, 2, 3, 4, 5


def packed(*items: Any) -> bytes:
    """An array of these."""
    data: bytes = msgpack.packb(list(items))
    return data


@pytest.mark.parametrize(
    "word",
    [Ask(ME), Shown(ME), Begin(ME, COMMITMENT), Commit(3, COMMITMENT), Open(3, NONCE), Refuse(Denial(0), 60)],
)
def test_every_kind_of_word_comes_back(word: Word) -> None:
    """Every kind of word survives its bytes, even when these come one by one."""
    assert decode_word(encode_word(word)) == word
    reader = WordReader()
    came = [whole for byte in frame_word(word) for whole in reader.feed(bytes((byte,)))]
    assert came == [word]
    assert reader.unread_bytes == 0


@pytest.mark.parametrize(
    ("data", "problem"),
    [
        (bytes(256), "256 bytes"),
        (b"\xc1", "no msgpack"),
        (packed(VERSION, ASK), "no [version, kind, field, field]"),
        (msgpack.packb("word"), "no [version, kind, field, field]"),
        (packed(VERSION + 1, ASK, KEY, "me"), "version"),
        (packed("2", ASK, KEY, "me"), "version"),
        (packed(VERSION, 6, KEY, "me"), "kind"),
        (packed(VERSION, -1, KEY, "me"), "kind"),
        (packed(VERSION, "0", KEY, "me"), "kind"),
        (packed(VERSION, ASK, KEY[1:], "me"), "no key with a name"),
        (packed(VERSION, ASK, KEY, b"me"), "no key with a name"),
        (packed(VERSION, ASK, KEY, 65 * "m"), "no key with a name"),
        (packed(VERSION, ASK, KEY, "me", 1), "3 fields"),
        (packed(VERSION, BEGIN, KEY, "me"), "no key, name and commitment"),
        (packed(VERSION, BEGIN, KEY, "me", COMMITMENT[1:]), "no key, name and commitment"),
        (packed(VERSION, COMMIT, "3", COMMITMENT), "no number"),
        (packed(VERSION, COMMIT, 3, NONCE), "no round"),
        (packed(VERSION, OPEN, 3, COMMITMENT), "no round"),
        (packed(VERSION, COMMIT, -1, COMMITMENT), "no round"),
        (packed(VERSION, COMMIT, 10_000, COMMITMENT), "no round"),
        (packed(VERSION, REFUSE, 99, 1), "no refusal"),
        (packed(VERSION, REFUSE, 0, -1), "no refusal"),
        (packed(VERSION, REFUSE, 0, 86_401), "no refusal"),
        (packed(VERSION, REFUSE, 0, 1.5), "no refusal"),
    ],
)
def test_what_is_no_word_is_refused(data: bytes, problem: str) -> None:
    """A word is refused if it is too long, no msgpack, of another shape, version or kind, or has a field of another type or size."""
    with pytest.raises(ProtocolError) as caught:
        decode_word(data)
    assert problem in caught.value.problem


def test_a_word_too_long_to_travel_is_not_framed() -> None:
    """64 letters of four bytes beside a commitment exceed what the single length byte can state."""
    with pytest.raises(ProtocolError) as caught:
        frame_word(Begin(Identity(KEY, 64 * "\U0001f980"), COMMITMENT))
    assert "bytes" in caught.value.problem
