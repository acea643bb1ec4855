"""Files appear whole or not at all.

Rule: every writer of this package goes through `replacing`; none opens its target for writing itself.
"""

import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO


@contextmanager
def replacing(path: Path) -> Iterator[BinaryIO]:
    """Open a temporary file beside `path` that takes its place when the block ends well.

    The temporary name starts with a dot and carries process and thread, so that two writers never share it.

    Args:
        path: the file to write; its folder exists.

    Yields:
        The temporary file, open for binary writing.

    Raises:
        OSError: as the operating system gives it (ENOSPC, EACCES, ...); nothing of the partial file is left.
    """
    temporary = path.with_name(f".{path.name}.{os.getpid()}-{threading.get_native_id()}.part")
    try:
        # Closed before the rename: a full disk may show only when the last buffer is flushed.
        with temporary.open("wb") as file:
            yield file
        temporary.replace(path)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


def write_bytes(path: Path, *parts: bytes | memoryview) -> None:
    """Write the parts one after the other to `path`, whole or not at all.

    Raises:
        OSError: as `replacing`.
    """
    with replacing(path) as file:
        for part in parts:
            file.write(part)


def write_text(path: Path, text: str) -> None:
    """Write `text` as UTF-8 to `path`, whole or not at all.

    Raises:
        OSError: as `replacing`.
    """
    write_bytes(path, text.encode())
