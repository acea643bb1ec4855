"""Text that quotes names and values of others: nothing in it may control a terminal or a page, or be impossible to write. Light.

A file's name is bytes. Python stands for those that are no UTF-8 by surrogates (PEP 383), which no encoding can write.
"""

import re
from typing import Final

_SURROGATE: Final = re.compile("[\ud800-\udfff]")

_CONTROLS: Final = re.compile(
    "[\0-\x08\x0b-\x1f\x7f-\x9f\u061c\u200b\u200e\u200f\u2028-\u202e\u2060-\u206f\ufeff\ufff9-\ufffb\ud800-\udfff]"
)
"""What an HTML document must not hold (WHATWG HTML, 13.3: controls other than white space, surrogates), and what is not seen in one or
changes the order of the letters around it (Unicode UAX 9: bidirectional controls)."""

_SPACES: Final = re.compile("[\u00a0\u1680\u2000-\u200a\u202f\u205f\u3000]")
"""Unicode's spaces (category Zs) beside the usual one, such as the narrow one between a number and its unit."""

_BYTES: Final = range(0xDC80, 0xDD00)
"""The surrogates that stand for single bytes."""


def printable(text: str) -> str:
    """Return the text as one line that cannot control the terminal, whatever name or value it quotes. Other spaces become the usual one."""
    return text if text.isprintable() else "".join(map(_shown, plain_spaces(text)))


def plain_spaces(text: str) -> str:
    """Return the text with the usual space in place of all others."""
    return _SPACES.sub(" ", text)


def printable_lines(text: str) -> str:
    """Return lines that cannot control the terminal; only their ends stay."""
    return "\n".join(map(printable, text.split("\n")))


def printable_page(text: str) -> str:
    r"""Return an HTML document without control characters; what is no text in it is shown as Python writes it, such as \x1b."""
    return _CONTROLS.sub(_found, text)


def writable(text: str) -> str:
    r"""Return the text so that every encoding of Unicode can write it: bytes of a name that are no UTF-8 become \xff."""
    return _SURROGATE.sub(_found, text)


def _shown(letter: str) -> str:
    if letter.isprintable():
        return letter
    return f"\\x{ord(letter) - 0xDC00:02x}" if ord(letter) in _BYTES else repr(letter)[1:-1]


def _found(found: re.Match[str]) -> str:
    letter = found[0]
    return repr(letter)[1:-1] if letter.isprintable() else _shown(letter)
