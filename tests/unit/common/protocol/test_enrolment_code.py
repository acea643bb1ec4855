"""The core of pairing by code: a host that knows the code is trusted, one that guesses is not, and guessing becomes slow."""

import random
from collections.abc import Callable
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.errors import ProtocolError, SettingsError
from common.protocol.enrolment_code import (
    CODE_LIFE_NS,
    FIRST_PAUSE_NS,
    LONGEST_PAUSE_NS,
    PROOF_NS,
    ROUNDS,
    TRIES,
    Asking,
    Desk,
    Enrolled,
    Failed,
    Output,
    Say,
    ShowCode,
    code_text,
    new_code,
    read_code,
)
from common.protocol.enrolment_wire import MAX_WORD_BYTES, WordReader, decode_word, encode_word, frame_word
from common.protocol.enrolment_words import Ask, Begin, Commit, Denial, Identity, Open, Refuse, Shown, Word

BOARD = Identity(bytes(range(32)), "bone")
HOST = Identity(bytes(range(32, 64)), "phone")
MALLORY = Identity(bytes(range(64, 96)), "phone")
S = 1_000_000_000
codes = st.integers(0, 999_999)


def chance(seed: int) -> Callable[[int], bytes]:
    """Random bytes that a test can repeat."""
    return random.Random(seed).randbytes


def said(outputs: list[Output]) -> list[Word]:
    """The words among a desk's outputs."""
    return [output.word for output in outputs if isinstance(output, Say)]


def shown_code(outputs: list[Output]) -> int:
    """The code that a desk shows."""
    return next(output.code for output in outputs if isinstance(output, ShowCode))


def converse(desk: Desk, asking: Asking, typed: int, connection: bytes, now_ns: int) -> list[Output]:
    """Carry words between the two until neither has more to say; return all that the desk put out."""
    word: Word | None = asking.begin(typed)
    everything: list[Output] = []
    while word is not None:
        outputs = desk.receive(connection, decode_word(encode_word(word)), now_ns)
        everything += outputs
        (answer,) = said(outputs)
        if isinstance(answer, Refuse):
            break
        word = asking.receive(decode_word(encode_word(answer)))
    return everything


def start(desk: Desk, asking: Asking, connection: bytes = b"a", now_ns: int = 0) -> int:
    """Ask; return the code that the board shows."""
    outputs = desk.receive(connection, asking.ask(), now_ns)
    (answer,) = said(outputs)
    asking.receive(answer)
    return shown_code(outputs)


@given(st.integers(0, 2**32))
def test_who_types_the_code_is_trusted_and_trusts(seed: int) -> None:
    """With the right code each side ends with the other's key proved, and the code is spent."""
    desk, asking = Desk(BOARD, chance(seed)), Asking(HOST, chance(seed + 1))
    code = start(desk, asking)
    outputs = converse(desk, asking, code, b"a", 0)
    assert [output for output in outputs if isinstance(output, Enrolled)] == [Enrolled(HOST)]
    assert asking.proved
    assert asking.board == BOARD
    assert desk.receive(b"a", Commit(0, bytes(32)), 0) == [Say(b"a", Refuse(Denial.WRONG))]


@given(st.integers(0, 2**32), st.integers(1, 999_999))
def test_any_other_code_proves_nothing(seed: int, off: int) -> None:
    """Every wrong code fails at its first wrong bit, on both sides, and spends the code."""
    desk, asking = Desk(BOARD, chance(seed)), Asking(HOST, chance(seed + 1))
    code = start(desk, asking)
    typed = (code + off) % 10**6
    outputs = converse(desk, asking, typed, b"a", 0)
    assert not any(isinstance(output, Enrolled) for output in outputs)
    assert not asking.proved
    same_bits = ((code ^ typed) & -(code ^ typed)).bit_length() - 1
    assert sum(isinstance(word, Commit) for word in said(outputs)) == same_bits + 1, "the board's, one a round"
    assert sum(isinstance(word, Open) for word in said(outputs)) == same_bits
    again = Asking(HOST, chance(seed + 2))
    assert start(desk, again, b"b") == desk.code(0)
    assert said(outputs)[-1] == Refuse(Denial.WRONG, 0)


@given(codes, st.integers(0, 2**32))
@settings(max_examples=30)
def test_keys_changed_on_the_way_are_noticed_even_with_the_right_code(code: int, seed: int) -> None:
    """Whoever inserts a key or name of their own into the exchange fails in the first round, although all know the code."""
    for changed in (MALLORY, replace(HOST, name="fone")):
        desk, asking = Desk(BOARD, chance(seed)), Asking(HOST, chance(seed + 1))
        asking.receive(Shown(BOARD))
        begun = asking.begin(start(desk, Asking(HOST, chance(0))))
        (commit,) = said(desk.receive(b"a", Begin(changed, begun.commitment), 0))
        opened = asking.receive(commit)
        assert isinstance(opened, Open)
        assert said(desk.receive(b"a", opened, 0)) == [Refuse(Denial.WRONG)]
    asking = Asking(HOST, chance(seed))
    desk = Desk(BOARD, chance(seed + 1))
    outputs = desk.receive(b"a", asking.ask(), 0)
    asking.receive(Shown(replace(BOARD, key=MALLORY.key)))  # the host believes in another board
    assert not any(isinstance(o, Enrolled) for o in converse(desk, asking, shown_code(outputs), b"a", 0))
    assert not asking.proved
    del code


def test_a_guess_succeeds_once_in_two_to_the_rounds() -> None:
    """Exactly the codes with the same first k bits pass k rounds: each round halves what is left, and 20 rounds leave one of 2^20."""
    desk = Desk(BOARD, chance(7))
    asking = Asking(HOST, chance(8))
    code = start(desk, asking)
    assert code < 10**6 < 2**ROUNDS
    passed = []
    for typed in range(0, 10**6, 4999):
        desk, asking = Desk(BOARD, chance(7)), Asking(HOST, chance(typed))
        assert start(desk, asking) == code
        outputs = converse(desk, asking, typed, b"a", 0)
        passed.append((typed, sum(isinstance(word, Open) for word in said(outputs))))
    assert all((typed ^ code) % 2**rounds == 0 for typed, rounds in passed)
    assert all((typed ^ code) >> rounds & 1 for typed, rounds in passed if rounds < ROUNDS)


def test_what_was_recorded_does_not_tell_the_code_before_it_is_spent() -> None:
    """Before a round is opened each of its two commitments fits both bits: the nonces are fresh each time and the words carry nothing else."""
    words: set[bytes] = set()
    for seed in range(200):
        desk, asking = Desk(BOARD, chance(1)), Asking(HOST, chance(1000 + seed))
        code = start(desk, asking)
        words.add(asking.begin(code).commitment)
    assert len(words) == 200


def fail_once(desk: Desk, now_ns: int, connection: bytes = b"x") -> list[Output]:
    """One wrong guess."""
    asking = Asking(MALLORY, chance(now_ns + 1))
    code = start(desk, asking, connection, now_ns)
    return converse(desk, asking, (code + 1) % 10**6, connection, now_ns)


def test_after_three_wrong_codes_there_is_a_pause_that_grows() -> None:
    """After three tries a pause of one minute, after three more two minutes, and so on up to an hour; a host that asks meanwhile is told how long."""
    desk, now_ns, pauses = Desk(BOARD, chance(3)), 0, []
    for _ in range(10):
        failures = [output for _ in range(TRIES) for output in fail_once(desk, now_ns) if isinstance(output, Failed)]
        assert [failed.pause_ns > 0 for failed in failures] == [False, False, True]
        pauses.append(failures[-1].pause_ns)
        (refusal,) = said(desk.receive(b"y", Ask(HOST), now_ns + 1))
        assert refusal == Refuse(Denial.PAUSE, pauses[-1] // S)
        now_ns += pauses[-1]
    assert pauses == [min(FIRST_PAUSE_NS * 2**k, LONGEST_PAUSE_NS) for k in range(10)]


def test_the_owner_ends_a_pause_and_success_forgets_failures() -> None:
    """`pardon` lets hosts try again at once; a successful pairing clears the failures for later hosts."""
    desk = Desk(BOARD, chance(4))
    for _ in range(TRIES):
        fail_once(desk, 0)
    assert said(desk.receive(b"y", Ask(HOST), 1)) == [Refuse(Denial.PAUSE, 60)]
    desk.pardon()
    fail_once(desk, 1)
    asking = Asking(HOST, chance(5))
    code = start(desk, asking, b"h", 1)
    converse(desk, asking, code, b"h", 1)
    assert asking.proved
    for number in range(TRIES):
        failed = next(output for output in fail_once(desk, 2) if isinstance(output, Failed))
        assert (failed.pause_ns > 0) is (number == TRIES - 1)


def test_who_only_asks_keeps_nobody_waiting() -> None:
    """Hosts that ask and say no more, however many, reserve and spend nothing: a host that types the shown code still gets in."""
    desk, first = Desk(BOARD, chance(6)), Asking(HOST, chance(7))
    code = start(desk, first)
    for number in range(1000):
        outputs = desk.receive(b"m%d" % number, Ask(MALLORY), number)
        assert [type(output) for output in outputs] == [ShowCode, Say]
        assert shown_code(outputs) == code
    assert any(isinstance(output, Enrolled) for output in converse(desk, first, code, b"later", 10 * S))
    assert first.proved


def test_one_proof_at_a_time_and_for_seconds() -> None:
    """While a proof lasts others hear `busy` and disturb nothing. A proof that falls silent fails within seconds, counts as a try and spends the code."""
    desk, first = Desk(BOARD, chance(6)), Asking(HOST, chance(7))
    code = start(desk, first)
    commit = said(desk.receive(b"a", first.begin(code), 0))[0]
    for word in (Ask(MALLORY), Begin(MALLORY, bytes(32))):
        assert said(desk.receive(b"b", word, S)) == [Refuse(Denial.BUSY, PROOF_NS // S - 1)]
    assert said(desk.receive(b"b", Commit(0, bytes(32)), S)) == [Refuse(Denial.WRONG)]
    assert desk.receive(b"b", Refuse(Denial.CLOSED), S) == []
    assert desk.is_proving(b"a")
    answer = first.receive(commit)
    while answer is not None:
        answer = first.receive(said(desk.receive(b"a", answer, S))[0])
    assert first.proved
    for number in range(TRIES):
        asking = Asking(HOST, chance(8 + number))
        code = start(desk, asking, b"c", number * PROOF_NS)
        desk.receive(b"c", asking.begin(code), number * PROOF_NS)
        assert desk.tick((number + 1) * PROOF_NS - 1) == []
        failed, refusal = desk.tick((number + 1) * PROOF_NS)
        assert isinstance(failed, Failed)
        assert (failed.pause_ns > 0) is (number == TRIES - 1)
        assert isinstance(refusal, Say)
        assert desk.code(TRIES * PROOF_NS) != code
    late = TRIES * PROOF_NS + 1
    for word in (Ask(HOST), Begin(HOST, bytes(32))):
        assert said(desk.receive(b"d", word, late)) == [Refuse(Denial.PAUSE, FIRST_PAUSE_NS // S)]


def test_tries_are_counted_whoever_makes_them_and_however_often_they_connect() -> None:
    """A guess counts as one of the three even from a new connection, under a new key and name, without asking first, or broken off half way."""
    desk = Desk(BOARD, chance(20))
    desk.receive(b"a", Begin(MALLORY, bytes(32)), 0)
    assert any(isinstance(output, Failed) for output in desk.receive(b"a", Refuse(Denial.CLOSED), 0))
    fail_once(desk, 0, b"b")
    other = Identity(bytes(32), "another")
    desk.receive(b"c", Begin(other, bytes(32)), 0)
    (failed, _) = desk.receive(b"c", Open(0, bytes(16)), 0)
    assert isinstance(failed, Failed)
    assert failed.pause_ns == FIRST_PAUSE_NS


def test_a_code_that_nobody_types_runs_out() -> None:
    """A code is spent when nobody has used it within its life since it was last asked for; that alone is no failed try."""
    desk = Desk(BOARD, chance(9))
    code = start(desk, Asking(HOST, chance(10)))
    again_ns = CODE_LIFE_NS - 1
    assert start(desk, Asking(HOST, chance(11)), b"b", again_ns) == code
    assert desk.tick(again_ns + CODE_LIFE_NS - 1) == []
    assert desk.code(again_ns + CODE_LIFE_NS - 1) == code
    assert desk.code(again_ns + CODE_LIFE_NS) != code
    late = Asking(HOST, chance(12))
    late.receive(Shown(BOARD))
    assert not any(isinstance(o, Enrolled) for o in converse(desk, late, code, b"c", again_ns + CODE_LIFE_NS))
    owned = Desk(BOARD, chance(12))  # a code shown by the owner's command before anybody asked
    early = owned.code(0)
    assert owned.code(CODE_LIFE_NS - 1) == early
    assert owned.code(CODE_LIFE_NS) != early
    before = owned.code(CODE_LIFE_NS)
    owned.pardon()
    assert owned.code(CODE_LIFE_NS) != before, "the owner's coming spends it"


words = st.one_of(
    st.builds(Ask, st.builds(Identity, st.binary(min_size=32, max_size=32), st.text(max_size=64))),
    st.builds(Shown, st.builds(Identity, st.binary(min_size=32, max_size=32), st.text(max_size=64))),
    st.builds(
        Begin,
        st.builds(Identity, st.binary(min_size=32, max_size=32), st.text(max_size=64)),
        st.binary(min_size=32, max_size=32),
    ),
    st.builds(Commit, st.integers(0, ROUNDS - 1), st.binary(min_size=32, max_size=32)),
    st.builds(Open, st.integers(0, ROUNDS - 1), st.binary(min_size=16, max_size=16)),
    st.builds(Refuse, st.sampled_from(Denial), st.integers(0, 86_400)),
)


@given(words)
def test_words_survive_the_line(word: Word) -> None:
    """Every word comes back from its bytes as it went in, unless its name is too long for them."""
    packed = encode_word(word)
    if len(packed) <= MAX_WORD_BYTES:
        assert decode_word(packed) == word
    else:
        for refused in (lambda: decode_word(packed), lambda: frame_word(word)):
            with pytest.raises(ProtocolError):
                refused()


@given(st.lists(words, max_size=6), st.lists(st.integers(1, 300)))
def test_words_are_the_same_however_the_stream_is_chopped(sequence: list[Word], cuts: list[int]) -> None:
    """A stream of words gives the same words however it is cut up, and at most one unfinished word is kept."""
    fitting = [word for word in sequence if len(encode_word(word)) <= MAX_WORD_BYTES]
    stream = b"".join(frame_word(word) for word in fitting)
    reader, heard = WordReader(), []
    for size in (*cuts, *([1] * len(stream))):
        heard += reader.feed(stream[:size])
        stream = stream[size:]
        assert reader.unread_bytes <= MAX_WORD_BYTES
    assert heard == fitting


@given(st.binary(min_size=1, max_size=600))
def test_a_stream_of_anything_is_words_or_refused(stream: bytes) -> None:
    """Hostile bytes at the door raise at most ProtocolError, and are not kept."""
    reader = WordReader()
    try:
        for at in range(0, len(stream), 7):
            reader.feed(stream[at : at + 7])
            assert reader.unread_bytes <= MAX_WORD_BYTES
    except ProtocolError as error:
        assert "\n" not in str(error)  # noqa: PT017 - either is right


@given(st.lists(st.tuples(st.sampled_from([b"a", b"b"]), words, st.integers(0, 400 * S)), max_size=12))
def test_no_order_of_words_lets_a_stranger_in(events: list[tuple[bytes, Word, int]]) -> None:
    """Whatever strangers say, in any order, nobody is let in, and a word has at most six consequences (an attempt runs out, one fails, one begins)."""
    desk, now_ns = Desk(BOARD, chance(13)), 0
    for connection, word, wait_ns in events:
        now_ns += wait_ns
        outputs = desk.receive(connection, word, now_ns)
        assert not any(isinstance(output, Enrolled) for output in outputs)
        assert len(outputs) <= 6


@given(st.binary(max_size=300))
def test_any_bytes_are_a_word_or_refused(packed: bytes) -> None:
    """Hostile bytes raise ProtocolError and nothing else."""
    try:
        decode_word(packed)
    except ProtocolError as error:
        assert "\n" not in str(error)  # noqa: PT017 - either is right


@given(codes)
def test_codes_are_read_as_people_type_them(code: int) -> None:
    """Six digits, with blanks or hyphens, are a code; anything else is not."""
    text = code_text(code)
    assert read_code(text) == read_code(f" {text[:3]} {text[3:]}\n") == read_code(f"{text[:3]}-{text[3:]}") == code
    for wrong in (text[:5], text + "0", text[:5] + "x", "", "٣" * 6):
        with pytest.raises(SettingsError):
            read_code(wrong)


def test_codes_are_equally_likely() -> None:
    """Bytes at or above the greatest multiple of a million are drawn again, so no code is favoured."""
    draws = iter([b"\xff" * 4, (4294000000 - 1).to_bytes(4, "big"), (1_000_001).to_bytes(4, "big")])
    assert new_code(lambda _: next(draws)) == 999_999
    assert new_code(lambda _: next(draws)) == 1


@given(words)
def test_a_host_takes_no_word_out_of_turn(word: Word) -> None:
    """Before it has asked and typed, a host accepts nothing but the board's name."""
    asking = Asking(HOST, chance(14))
    if isinstance(word, Shown):
        assert asking.receive(word) is None
        with pytest.raises(ProtocolError):
            asking.receive(word)
    else:
        with pytest.raises(ProtocolError):
            asking.receive(word)


def test_a_board_that_does_not_know_the_code_is_not_trusted() -> None:
    """If a stand-in for the board opens what it did not commit to, the host notices and trusts nobody."""
    asking = Asking(HOST, chance(15))
    asking.receive(Shown(BOARD))
    asking.begin(123_456)
    assert isinstance(asking.receive(Commit(0, bytes(32))), Open)
    with pytest.raises(ProtocolError, match=r"not proved.*ask for a new code"):
        asking.receive(Open(0, bytes(32)))
    assert not asking.proved


def test_a_pardon_does_not_spoil_a_proof_under_way() -> None:
    """When the owner lifts the pause while a host proves its code, the code stays in force: the host gets in."""
    desk, asking = Desk(BOARD, chance(16)), Asking(HOST, chance(17))
    code = start(desk, asking)
    word: Word | None = asking.begin(code)
    outputs: list[Output] = []
    shown = set()
    while word is not None:
        outputs = desk.receive(b"a", word, 0)
        desk.pardon()
        if desk.is_proving(b"a"):
            shown.add(desk.code(0))
        (answer,) = said(outputs)
        word = asking.receive(answer)
    assert Enrolled(HOST) in outputs
    assert asking.proved
    assert shown == {code}
