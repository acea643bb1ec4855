"""The words of pairing by a code. `enrolment_code` says who says what when; `enrolment_wire` says how the words travel."""

from dataclasses import dataclass
from enum import Enum
from typing import Final

NONCE_BYTES: Final = 16
COMMITMENT_BYTES: Final = 32


@dataclass(frozen=True, slots=True)
class Identity:
    """What one side says about itself, unencrypted.

    Attributes:
        key: its public key, 32 bytes.
        name: for people.
    """

    key: bytes
    name: str


@dataclass(frozen=True, slots=True)
class Ask:
    """Host: I want to be trusted; this is who I am."""

    host: Identity


@dataclass(frozen=True, slots=True)
class Shown:
    """Board: this is who I am, and now I show a code."""

    board: Identity


@dataclass(frozen=True, slots=True)
class Begin:
    """Host: the code was typed; this is who I am, and my commitment to its first bit."""

    host: Identity
    commitment: bytes


@dataclass(frozen=True, slots=True)
class Commit:
    """Either side: my commitment to this round's bit."""

    round: int
    commitment: bytes


@dataclass(frozen=True, slots=True)
class Open:
    """Either side: the nonce with which my commitment can be checked."""

    round: int
    nonce: bytes


class Denial(Enum):
    """Why an attempt has no future."""

    CLOSED = 0
    PAUSE = 1
    BUSY = 2
    WRONG = 3


@dataclass(frozen=True, slots=True)
class Refuse:
    """Either side: no. `seconds` until it may be tried again, if known; else 0."""

    reason: Denial
    seconds: int = 0


Word = Ask | Shown | Begin | Commit | Open | Refuse
