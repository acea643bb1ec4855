"""Texts as other programs write them: their size, and lines that end in any way. Pure."""

import io
from collections.abc import Iterator
from typing import Final

from common.errors import DataError

_MAX_BYTES: Final = 1 << 29
"""Of a text: some eight million triangles, which take ten times as much memory while they are read."""


def require_short(size_bytes: int, name: str) -> None:
    """Check the size of a text before it is read.

    Raises:
        DataError: it has more than 512 MB.
    """
    if size_bytes > _MAX_BYTES:
        raise DataError(f"{name} is a text of {size_bytes >> 20} MB; 512 are read", "export it as binary PLY or STL")


def text_lines(content: bytes) -> Iterator[bytes]:
    r"""Yield the lines of a text one by one, which takes no memory for all of them.

    Args:
        content: of the file; its lines end in `\n`, `\r\n` or, if it holds no `\n`, in `\r`.
    """
    yield from content.split(b"\r") if b"\n" not in content else io.BytesIO(content)
