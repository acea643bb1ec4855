"""The byte order mark that some editors, above all on Windows, put before a text. Pure.

Every reader of other people's texts takes it off here; `open(encoding="utf-8-sig")` does the same for UTF-8 that is read line by line.
"""

import codecs
from typing import Final

UTF_8_MARK: Final = codecs.BOM_UTF8
_WIDE_MARKS: Final = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)


def without_mark(content: bytes) -> bytes:
    """Return a text's bytes without its byte order mark, and UTF-16 as UTF-8."""
    if content.startswith(_WIDE_MARKS):
        return content.decode("utf-16", "replace").encode()
    return content.removeprefix(UTF_8_MARK)
