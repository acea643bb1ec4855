"""The page's files, read once at the start: what is not in this list has no address, so no path leads elsewhere."""

import base64
import hashlib
import mimetypes
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

PACKAGE_PAGE: Final = Path(__file__).with_name("page")
INDEX: Final = "index.html"

_SUFFIXES: Final[Mapping[str, str]] = {"br": ".br", "gzip": ".gz"}
"""Encodings in the order in which they are preferred, and the files that hold them."""

_TYPES: Final[Mapping[str, str]] = {
    # Not from the machine's own table, which may say text/plain; browsers refuse such modules.
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".json": "application/json",
    ".map": "application/json",
    ".svg": "image/svg+xml",
    ".txt": "text/plain; charset=utf-8",
    ".webmanifest": "application/manifest+json",
    ".woff2": "font/woff2",
}
_INLINE_SCRIPT: Final = re.compile(rb"<script(?![^>]*\ssrc\s*=)[^>]*>(.*?)</script\s*>", re.DOTALL | re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class StaticFile:
    """A file of the page.

    Attributes:
        kind: its Content-Type.
        tag: names its content.
        content: its bytes by encoding; `identity` is always there.
    """

    kind: str
    tag: str
    content: Mapping[str, bytes]


def read_files(folder: Path) -> dict[str, StaticFile]:
    """Read a folder's files, by their paths in it.

    Args:
        folder: the folder; a missing one is empty.

    Raises:
        OSError: a file cannot be read.
    """
    paths = [path for path in sorted(folder.rglob("*")) if path.is_file() and path.suffix not in _SUFFIXES.values()]
    return {path.relative_to(folder).as_posix(): _read(path) for path in paths}


def chosen_encoding(accepted: str, file: StaticFile) -> str:
    """Choose the smallest form that a browser accepts.

    Returns:
        br, gzip or identity.
    """
    offered = {name.strip(): weight for part in accepted.lower().split(",") for name, weight in [_weighed(part)]}
    wanted = (name for name in _SUFFIXES if name in file.content and offered.get(name, 0.0) > 0)
    return next(wanted, "identity")


def script_hashes(page: bytes) -> tuple[str, ...]:
    """Return the SHA-256 of each inline script of a page, base64, as its Content-Security-Policy names them."""
    return tuple(base64.b64encode(hashlib.sha256(text).digest()).decode() for text in _INLINE_SCRIPT.findall(page))


def _read(path: Path) -> StaticFile:
    content = {"identity": path.read_bytes()}
    for encoding, suffix in _SUFFIXES.items():
        packed = path.with_name(path.name + suffix)
        if packed.is_file():
            content[encoding] = packed.read_bytes()
    kind = _TYPES.get(path.suffix) or mimetypes.guess_type(path.name)[0] or "application/octet-stream"
    return StaticFile(kind, hashlib.sha256(content["identity"]).hexdigest()[:20], content)


def _weighed(part: str) -> tuple[str, float]:
    name, _, weight = part.partition(";")
    digits = weight.strip().removeprefix("q=")
    try:
        return name, float(digits) if digits else 1.0
    except ValueError:
        return name, 0.0
