"""The command lines in the documentation, as a reader would type them."""

import re
import shlex
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).parents[2]
_PROGRAMS: Final = ("phone-host", "board-agent", "delay-bench")
_INLINE: Final = re.compile(r"`([^`\n]+)`")
_FENCE: Final = re.compile(r"^\s*```")


@dataclass(frozen=True, slots=True)
class Command:
    """A command line on a page.

    Attributes:
        page: its page, with the line number.
        words: program and arguments.
        line: as it is printed.
    """

    page: str
    words: tuple[str, ...]
    line: str

    @property
    def is_mention(self) -> bool:
        """Whether it only names a program or a verb, as a sentence does."""
        return len(self.named) <= 2 and not any(word.startswith("-") for word in self.named)

    @property
    def named(self) -> tuple[str, ...]:
        """The words without a trailing `--help`."""
        return self.words[:-1] if self.words[-1] == "--help" else self.words


def pages() -> list[Path]:
    """Every page that a reader may type from; pages generated from the code are left out."""
    made = {"figures.md", "changelog.md"}
    found = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]
    return [path for path in found if path.name not in made]


def documented() -> list[Command]:
    """All command lines of all pages, in order."""
    return [command for page in pages() for command in _of(page)]


def _of(page: Path) -> Iterator[Command]:
    fenced, joined = False, ""
    for number, text in enumerate(page.read_text(encoding="utf-8").splitlines(), 1):
        if _FENCE.match(text):
            fenced = not fenced
            continue
        in_block = fenced or text.startswith("    ")
        if in_block and text.endswith("\\"):
            joined += text.rstrip("\\").strip() + " "
            continue
        lines = [joined + text.strip()] if in_block else _INLINE.findall(text)
        joined = ""
        for line in lines:
            if words := _words(line):
                yield Command(f"{page.relative_to(ROOT)}:{number}", words, line)


def _words(line: str) -> tuple[str, ...]:
    """Program and arguments; nothing if the line begins with another program."""
    try:
        words = shlex.split(line, comments=True)
    except ValueError:  # prose with an apostrophe
        return ()
    while words and (words[0] in {"sudo", "exec"} or "=" in words[0]):
        words = words[1:]
    if not words or Path(words[0]).name not in _PROGRAMS:
        return ()
    return (Path(words[0]).name, *words[1:])
