"""Prints how large the project is, per room: `python -m tests.docs.size [REVISION]`. With a revision, its figures stand beside today's.

A room is a package below `board_agent` or `phone_host`, or one of the other top folders. Lines of code are lines that hold a token other than
a comment or a docstring; prose is what Markdown files, docstrings and comments say.
"""

import ast
import io
import subprocess
import sys
import tarfile
import tokenize
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

_ROOT: Final = Path(__file__).parents[2]
_SOURCES: Final = frozenset({".js", ".mjs", ".css", ".c", ".h"})
_PRODUCT: Final = ("board_agent", "common", "phone_host")


@dataclass(slots=True)
class Size:
    """What a room holds.

    Attributes:
        files: Python files.
        lines: their lines.
        code: those with code.
        words: words of docstrings, comments and Markdown files.
        other: lines of C, JavaScript and style sheets.
    """

    files: int = 0
    lines: int = 0
    code: int = 0
    words: int = 0
    other: int = 0

    def add(self, more: "Size") -> None:
        """Add another room's figures."""
        self.files += more.files
        self.lines += more.lines
        self.code += more.code
        self.words += more.words
        self.other += more.other

    @property
    def cells(self) -> tuple[int, ...]:
        """The figures in the order of the table."""
        return self.files, self.lines, self.code, self.words, self.other


def room_of(path: str) -> str:
    """Return the room of a file, by its path from the project's root."""
    parts = path.split("/")
    if len(parts) == 1:
        return "(top)"
    if parts[0] in _PRODUCT[::2]:
        return "/".join(parts[:2]) if len(parts) > 2 else parts[0]
    return "/".join(parts[:2]) if parts[0] in {"common", "tests"} and len(parts) > 2 else parts[0]


def measured(path: str, text: str) -> Size:
    """Measure one file.

    Args:
        path: by its suffix it is Python, another language, Markdown or nothing that counts.
        text: its content.
    """
    suffix = Path(path).suffix
    if suffix == ".md":
        return Size(words=len(text.split()))
    if suffix in _SOURCES:
        return Size(other=text.count("\n"))
    return _python(text) if suffix == ".py" else Size()


def _python(text: str) -> Size:
    docstrings = list(_docstrings(ast.parse(text)))
    prose = sum(len(str(node.value).split()) for node in docstrings)
    silent = {line for node in docstrings for line in range(node.lineno, (node.end_lineno or node.lineno) + 1)}
    code: set[int] = set()
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.COMMENT:
            prose += len(token.string.split()) - 1
        elif token.string.strip() and token.type != tokenize.ENDMARKER:
            code.update(range(token.start[0], token.end[0] + 1))
    return Size(1, text.count("\n"), len(code - silent), prose)


def _docstrings(tree: ast.Module) -> Iterator[ast.Constant]:
    """Yield every string that stands alone: docstrings, and those under attributes."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
            yield node.value


def rooms(revision: str) -> dict[str, Size]:
    """Measure every room at a revision.

    Args:
        revision: as git names it.

    Raises:
        subprocess.CalledProcessError: git does not know it.
    """
    packed = subprocess.run(("git", "archive", revision), cwd=_ROOT, capture_output=True, check=True).stdout
    found: dict[str, Size] = defaultdict(Size)
    with tarfile.open(fileobj=io.BytesIO(packed)) as archive:
        for member in archive:
            content = archive.extractfile(member) if member.isfile() else None
            if content is not None and Path(member.name).suffix in {".py", ".md", *_SOURCES}:
                size = measured(member.name, content.read().decode())
                found[room_of(member.name)].add(size)
                found["(all)"].add(size)
                if member.name.startswith(_PRODUCT):
                    found["(product)"].add(size)
    return found


def main(words: Sequence[str]) -> int:
    """Print the table; exit code 2 for a revision that git does not know."""
    try:
        now, before = rooms("HEAD"), rooms(words[0]) if words else {}
    except subprocess.CalledProcessError as error:
        print(f"error: {error.stderr.decode().strip()}: name a commit, a tag or a branch", file=sys.stderr)
        return 2
    names = ("files", "lines", "code", "words", "other")
    print(f"{'room':28}" + "".join(f"{name:>18}" for name in names))
    for room in sorted(now.keys() | before.keys()):
        pairs = zip(before.get(room, Size()).cells, now.get(room, Size()).cells, strict=True)
        print(f"{room:28}" + "".join(f"{f'{old} > {new}' if before else new:>18}" for old, new in pairs))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
