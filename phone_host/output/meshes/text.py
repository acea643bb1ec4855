"""Texts as other programs write them: with or without a byte order mark, with lines that end in any way. Pure."""

import codecs
import io
from collections.abc import Iterator
from typing import Final

from common.errors import DataError

_MARK: Final = b"\xef\xbb\xbf"
_WIDE_MARKS: Final = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
_MAX_BYTES: Final = 1 << 29
"""Of a text: some eight million triangles, which take ten times as much memory while they are read."""


def without_mark(content: bytes) -> bytes:
    """Return a text's bytes without the mark that some editors put before UTF-8, and UTF-16 as UTF-8.

    Args:
        content: of the file.
    """
    if content.startswith(_WIDE_MARKS):
        return content.decode("utf-16", "replace").encode()
    return content.removeprefix(_MARK)


def require_short(content: bytes, name: str) -> None:
    """Check the size of a text before it is read.

    Args:
        content: of the file.
        name: of the file, for errors.

    Raises:
        DataError: it has more than 512 MB.
    """
    if len(content) > _MAX_BYTES:
        raise DataError(f"{name} is a text of {len(content) >> 20} MB; 512 are read", "export it as binary PLY or STL")


def text_lines(content: bytes) -> Iterator[bytes]:
    r"""Yield the lines of a text one by one, which takes no memory for all of them.

    Args:
        content: of the file; its lines end in `\n`, `\r\n` or, if it holds no `\n`, in `\r`.
    """
    yield from content.split(b"\r") if b"\n" not in content else io.BytesIO(content)
