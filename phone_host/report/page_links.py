"""The parts of a page that lead on: files beside it, commands to copy, lists of sentences. Pure."""

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from urllib.parse import quote

from phone_host.report.page_frame import section


@dataclass(frozen=True, slots=True)
class FileLink:
    """A file beside the page.

    Attributes:
        name: its name, relative to the page.
        words: what it holds, with axes and unit where it has them.
    """

    name: str
    words: str


@dataclass(frozen=True, slots=True)
class NextCommand:
    """A command to copy.

    Attributes:
        words: what it is for.
        command: one line, as it is typed into a shell.
    """

    words: str
    command: str


def address(name: str) -> str:
    """Return a file's name as the address of a link, relative to the page."""
    return escape(quote(name))


def files_section(files: Sequence[FileLink], title: str = "Files") -> str:
    """Make a card of links to files; empty if there are none."""
    if not files:
        return ""
    rows = "".join(
        f'<dt><a href="{address(one.name)}">{escape(one.name)}</a></dt><dd>{escape(one.words)}</dd>' for one in files
    )
    return section(title, "", f'<dl class="words files">{rows}</dl>')


def next_section(steps: Sequence[str], commands: Sequence[NextCommand]) -> str:
    """Make the card `What next`: sentences that are steps, then commands with a button that copies them; empty if there are none."""
    if not steps and not commands:
        return ""
    lines = "".join(
        f'<p class="for">{escape(one.words)}</p><div class="command"><code>{escape(one.command)}</code>'
        '<button type="button" class="copy" hidden>copy</button></div>'
        for one in commands
    )
    return section("What next", "", bullets(steps) + lines)


def list_section(title: str, lines: Sequence[str]) -> str:
    """Make a card of sentences; empty if there are none."""
    return section(title, "", bullets(lines)) if lines else ""


def bullets(lines: Sequence[str]) -> str:
    """Make a list of sentences; empty if there are none."""
    return f"<ul>{''.join(f'<li>{escape(line)}</li>' for line in lines)}</ul>" if lines else ""
