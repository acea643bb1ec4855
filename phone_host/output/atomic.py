"""Writes files whole or not at all.

Rule: every writer of this package uses `replacing`; none opens its target for writing itself. So a link under a
result's name is replaced, never followed. What people keep and read (reports, rigs, pages: `write_text`) also survives
a power cut. A run writes many images and clouds; these are synced together with their folder (`listed.py`), in a thread
that nobody waits for.
"""

import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from common.files import replacing_in
from common.plain_text import writable


@contextmanager
def replacing(path: Path, *, durable: bool = False) -> Iterator[BinaryIO]:
    """Open a temporary file beside `path`; it replaces `path` when the block ends without an error.

    The temporary name is random and starts with a dot, so that two writers never share it and nobody can predict it.

    Args:
        path: the file to write; its folder exists.
        durable: whether the file must survive a power cut from then on; costs a disk some ms.

    Yields:
        The temporary file, open for binary writing.

    Raises:
        OSError: as the operating system reports it (ENOSPC, EACCES, ...); nothing of the partial file is left.
    """
    folder = os.open(path.parent, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        with replacing_in(folder, path.name, durable=durable) as file:
            yield file
    except OSError as error:
        error.filename = str(path)  # not the temporary name, which means nothing to a user
        raise
    finally:
        os.close(folder)


def write_bytes(path: Path, *parts: bytes | memoryview) -> None:
    """Write the parts one after another to `path`, whole or not at all.

    Raises:
        OSError: see `replacing`.
    """
    write_parts(path, parts)


def write_parts(path: Path, parts: Iterable[bytes | memoryview]) -> None:
    """Write parts one after another to `path`, whole or not at all. Each is made only when it is written, so they need not fit into memory together.

    Raises:
        OSError: see `replacing`.
    """
    with replacing(path) as file:
        for part in parts:
            file.write(part)


def write_text(path: Path, text: str) -> None:
    """Write `text` as UTF-8 to `path`, whole or not at all; it survives a power cut. Names in it may hold bytes that are no UTF-8.

    Raises:
        OSError: see `replacing`.
    """
    with replacing(path, durable=True) as file:
        file.write(writable(text).encode())
