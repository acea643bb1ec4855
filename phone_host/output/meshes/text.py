"""Texts as other programs write them: with or without a byte order mark, lines that end in any way, and lines that go on. Pure."""

import io
from collections.abc import Iterator
from typing import Final

_MARK: Final = b"\xef\xbb\xbf"


def without_mark(content: bytes) -> bytes:
    """Return a file's bytes without the mark that some editors put before UTF-8.

    Args:
        content: of the file.
    """
    return content.removeprefix(_MARK)


def text_lines(content: bytes) -> Iterator[bytes]:
    r"""Yield the lines of a text one by one, which takes no memory for all of them. A backslash at the end joins the next line.

    Args:
        content: of the file; its lines end in `\n`, `\r\n` or, if it holds no `\n`, in `\r`.
    """
    begun: list[bytes] = []
    lines = content.split(b"\r") if b"\n" not in content else io.BytesIO(content)
    for line in lines:
        if line.rstrip().endswith(b"\\"):
            begun.append(line.rstrip()[:-1])
        elif begun:
            yield b" ".join((*begun, line))
            begun.clear()
        else:
            yield line
    if begun:
        yield b" ".join(begun)
