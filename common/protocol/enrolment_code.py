"""Two machines learn each other's public keys over an open line; a code that a person carries from one to the other proves them. Sans-I/O.

The board shows six digits and the host's owner types them. For each of their 20 bits, both sides commit to the bit before either opens its
commitment. Each commitment has a fresh nonce and is bound to both keys and names. Someone who guesses at the board succeeds with probability
2^-20, and a failed attempt spends the code. A man in the middle has his own keys in his commitments. He learns the host's bits one by one
until one of his guesses there is wrong, and must then guess the rest at the board: 21 x 2^-20. A recording does not help to try codes: it
holds only a spent code. Source: Bluetooth Core Specification 5.4, Vol 2 Part H, 7.2.3 (authentication stage 1, passkey entry) and 7.7.1
(f1 = HMAC-SHA-256), here over the digest of the keys and names, with the round and the side in each commitment.

Rules: a code serves one attempt. After three failed attempts there is a pause, which grows (`Desk`). Asking reserves nothing: the desk is
taken only from a proof's first word to its last, for seconds at most. `now_ns` and randomness are passed in.
"""

import hashlib
import hmac
import struct
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Final, assert_never

from common.errors import ProtocolError, SettingsError
from common.protocol.enrolment_words import (
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

ROUNDS: Final = 20
"""Bits of a code: 10^6 < 2^20."""

CODE_DIGITS: Final = 6

_S: Final = 1_000_000_000

CODE_LIFE_NS: Final = 300 * _S
"""An unused code is spent this long after it was last asked for: time to walk from the board to the host, but not to guess."""

PROOF_NS: Final = 10 * _S
"""Time limit of a proof. It has 20 rounds of two round trips: 4 s if each takes 100 ms. Nobody has to type meanwhile."""

TRIES: Final = 3
"""Failed attempts before a pause."""

FIRST_PAUSE_NS: Final = 60 * _S
LONGEST_PAUSE_NS: Final = 3600 * _S
"""At three guesses an hour, a year of guessing reaches 2.5 % of the codes. Nobody leaves pairing open for a year."""

_BIT_BASE: Final = 0x80
"""A round's bit is committed as 0x80 or 0x81, as in the specification."""


class Speaker(Enum):
    """Who speaks."""

    HOST = b"host"
    BOARD = b"board"


def code_text(code: int) -> str:
    """A code as people see it."""
    return f"{code:0{CODE_DIGITS}d}"


def read_code(text: str) -> int:
    """Read a typed code; blanks and hyphens are ignored.

    Raises:
        SettingsError: the text is not a code.
    """
    digits = text.replace(" ", "").replace("-", "").strip()
    if len(digits) == CODE_DIGITS and digits.isascii() and digits.isdigit():
        return int(digits)
    raise SettingsError(f"{text.strip()!r:.40} is not a code", f"type the {CODE_DIGITS} digits that the board shows")


def new_code(chance: Callable[[int], bytes]) -> int:
    """Make a code; all codes are equally likely.

    Args:
        chance: returns that many random bytes (`os.urandom`).
    """
    while True:  # a number beyond the largest multiple of 10^6 would favour small codes
        value = int.from_bytes(chance(4), "big")
        if value < 2**32 - 2**32 % 10**CODE_DIGITS:
            return int(value % 10**CODE_DIGITS)


class _Proof:
    """One side's part in an attempt: its own commitments, and the check of the other side's."""

    def __init__(
        self, *, side: Speaker, host: Identity, board: Identity, code: int, chance: Callable[[int], bytes]
    ) -> None:
        self._side = side
        self._other = Speaker.BOARD if side is Speaker.HOST else Speaker.HOST
        self._context = _context(host, board)
        self._code = code
        self._chance = chance
        self._nonce = b""
        self._theirs = b""
        self.round = 0

    def commit(self) -> Commit:
        """Commit to this round's bit."""
        self._nonce = self._chance(NONCE_BYTES)
        return Commit(self.round, self._commitment(self._side, self._nonce))

    def keep(self, commit: Commit) -> None:
        """Store the other side's commitment."""
        self._theirs = commit.commitment

    def open(self) -> Open:
        """Open this side's commitment."""
        return Open(self.round, self._nonce)

    def check(self, opened: Open) -> bool:
        """Check the other side's commitment and begin the next round. Return whether it committed to the same bit and the same keys."""
        expected = self._commitment(self._other, opened.nonce)
        self.round += 1
        return hmac.compare_digest(expected, self._theirs)

    def _commitment(self, side: Speaker, nonce: bytes) -> bytes:
        bit = _BIT_BASE | (self._code >> self.round & 1)
        said = struct.pack("<BB", self.round, bit) + side.value + b"\0" + self._context
        return hmac.digest(nonce, said, "sha256")


def _context(host: Identity, board: Identity) -> bytes:
    digest = hashlib.sha256(b"tandemscan pairing 1\0")
    for part in (host.key, board.key, host.name.encode(), board.name.encode()):
        digest.update(struct.pack("<I", len(part)) + part)
    return digest.digest()


class Asking:
    """The host's side of one attempt.

    Args:
        host: who it is.
        chance: returns that many random bytes.
    """

    def __init__(self, host: Identity, chance: Callable[[int], bytes]) -> None:
        self._host = host
        self._chance = chance
        self._proof: _Proof | None = None
        self._expects: type = Shown
        self.board: Identity | None = None
        self.proved = False

    def ask(self) -> Ask:
        """The first word."""
        return Ask(self._host)

    def begin(self, code: int) -> Begin:
        """Begin the proof with the typed code. Call only after `Shown` has come; it may have come over another connection."""
        assert self.board is not None
        self._proof = _Proof(side=Speaker.HOST, host=self._host, board=self.board, code=code, chance=self._chance)
        self._expects = Commit
        return Begin(self._host, self._proof.commit().commitment)

    def receive(self, word: Word) -> Word | None:
        """Handle a word from the board.

        Returns:
            The answer; None if there is nothing to say now: the code is still to be typed, or both are done (`proved`).

        Raises:
            ProtocolError: the board, or a man in the middle, does not know the code or speaks out of turn.
        """
        if isinstance(word, Shown) and self._expects is Shown and self.board is None:
            self.board = word.board
            return None
        proof = self._proof
        if proof is None or type(word) is not self._expects or getattr(word, "round", -1) != proof.round:
            raise _out_of_turn()
        if isinstance(word, Commit):
            proof.keep(word)
            self._expects = Open
            return proof.open()
        assert isinstance(word, Open)
        if not proof.check(word):
            raise ProtocolError("the code was not proved", "ask for a new code and type that one")
        self._expects = Commit
        self.proved = proof.round == ROUNDS
        return None if self.proved else proof.commit()


@dataclass(frozen=True, slots=True)
class Say:
    """Desk: send this word on that connection."""

    connection: bytes
    word: Word


@dataclass(frozen=True, slots=True)
class ShowCode:
    """Desk: show this code to the board's owner. A host of that name has asked."""

    code: int
    name: str


@dataclass(frozen=True, slots=True)
class Enrolled:
    """Desk: this host has proved the code and is trusted from now on."""

    host: Identity


@dataclass(frozen=True, slots=True)
class Failed:
    """Desk: an attempt failed and its code is spent. `pause_ns`: how long nobody may try now."""

    name: str
    pause_ns: int


Output = Say | ShowCode | Enrolled | Failed


@dataclass(slots=True)
class _Attempt:
    connection: bytes
    host: Identity
    proof: _Proof
    until_ns: int
    expects: type = Open


class Desk:
    """The board's side: shows a code, takes one proof at a time, and makes guessers wait.

    Args:
        board: the board's identity.
        chance: returns that many random bytes.
    """

    def __init__(self, board: Identity, chance: Callable[[int], bytes]) -> None:
        self._board = board
        self._chance = chance
        self._code: int | None = None
        self._code_until_ns = 0
        self._attempt: _Attempt | None = None
        self._failures = 0
        self._closed_until_ns = 0

    def code(self, now_ns: int) -> int:
        """Return the code that the next attempt must prove. Make a new one if there is none or if nobody used it in time."""
        if self._code is None or (self._attempt is None and now_ns >= self._code_until_ns):
            self._code = new_code(self._chance)
            self._code_until_ns = now_ns + CODE_LIFE_NS
        return self._code

    def is_proving(self, connection: bytes) -> bool:
        """Whether this connection is making the current attempt."""
        return self._attempt is not None and self._attempt.connection == connection

    def pardon(self) -> None:
        """Forget failed attempts and the code shown so far: the owner stands at the board and asks for it."""
        self._failures = 0
        self._closed_until_ns = 0
        if self._attempt is None:
            self._code = None

    def receive(self, connection: bytes, word: Word, now_ns: int) -> list[Output]:
        """Handle a word."""
        outputs = self.tick(now_ns)
        attempt = self._attempt
        is_theirs = attempt is not None and attempt.connection == connection
        match word:
            case Begin() | Ask() if attempt is None or not is_theirs:
                return outputs + (self._refusal(connection, now_ns) or self._take(connection, word, now_ns))
            case Commit() | Open() if attempt is not None and is_theirs:
                return outputs + self._prove(attempt, word, now_ns)
            case Commit() | Open():
                return [*outputs, Say(connection, Refuse(Denial.WRONG))]
            case Ask() | Begin() | Shown() | Refuse():
                return outputs + (self._fail(now_ns) if is_theirs else [])
            case _:
                assert_never(word)

    def tick(self, now_ns: int) -> list[Output]:
        """Give up a proof that takes too long."""
        if self._attempt is not None and now_ns >= self._attempt.until_ns:
            return self._fail(now_ns)
        return []

    def _refusal(self, connection: bytes, now_ns: int) -> list[Output]:
        """Turn a host away while a proof or a pause lasts; otherwise return nothing."""
        reason, until_ns = Denial.PAUSE, self._closed_until_ns
        if self._attempt is not None:
            reason, until_ns = Denial.BUSY, self._attempt.until_ns
        return [Say(connection, Refuse(reason, -((now_ns - until_ns) // _S)))] if now_ns < until_ns else []

    def _take(self, connection: bytes, word: Ask | Begin, now_ns: int) -> list[Output]:
        code = self.code(now_ns)
        if isinstance(word, Ask):
            self._code_until_ns = now_ns + CODE_LIFE_NS
            return [ShowCode(code, word.host.name), Say(connection, Shown(self._board))]
        proof = _Proof(side=Speaker.BOARD, host=word.host, board=self._board, code=code, chance=self._chance)
        proof.keep(Commit(0, word.commitment))
        self._attempt = _Attempt(connection, word.host, proof, now_ns + PROOF_NS)
        return [Say(connection, proof.commit())]

    def _prove(self, attempt: _Attempt, word: Commit | Open, now_ns: int) -> list[Output]:
        proof, connection = attempt.proof, attempt.connection
        if type(word) is not attempt.expects or word.round != proof.round:
            return self._fail(now_ns)
        if isinstance(word, Commit):
            proof.keep(word)
            attempt.expects = Open
            return [Say(connection, proof.commit())]
        answer = proof.open()
        if not proof.check(word):
            return self._fail(now_ns)
        attempt.expects = Commit
        if proof.round < ROUNDS:
            return [Say(connection, answer)]
        self._attempt = None
        self.pardon()
        return [Enrolled(attempt.host), Say(connection, answer)]

    def _fail(self, now_ns: int) -> list[Output]:
        assert self._attempt is not None
        attempt, self._attempt, self._code = self._attempt, None, None
        self._failures += 1
        pause_ns = 0
        if self._failures % TRIES == 0:
            pause_ns = min(FIRST_PAUSE_NS << min(self._failures // TRIES - 1, 20), LONGEST_PAUSE_NS)
            self._closed_until_ns = now_ns + pause_ns
        return [Failed(attempt.host.name, pause_ns), Say(attempt.connection, Refuse(Denial.WRONG, pause_ns // _S))]


def _out_of_turn() -> ProtocolError:
    return ProtocolError("a word of pairing came out of turn", "try again; if it stays so, somebody meddles")
