"""Hooks for mkdocs: README.md, CONTRIBUTING.md and CHANGELOG.md become pages; the decisions get an index and menu entries.

The three files stay at the project's root, where people look for them; their links work in both places. The page of messages is
made from the code and kept nowhere else.
"""

import re
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files

from tests.docs import troubleshooting
from tests.docs.message_texts import Code

_ROOT = Path(__file__).parents[2]
_AT_ROOT = {"README.md": "index.md", "CONTRIBUTING.md": "contributing.md", "CHANGELOG.md": "changelog.md"}
_MESSAGES = "troubleshooting.md"
_MESSAGES_ELSEWHERE = "Troubleshooting (`make docs`)"
"""How the repository's documents name that page, which a checkout does not have."""
_TITLE = re.compile(r"^# *(.+)$", re.MULTILINE)


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Add every decision to the menu."""
    decisions = [f"decisions/{path.name}" for path in _decisions()]
    assert config.nav is not None
    config.nav = [
        {"Decisions": ["decisions/README.md", *decisions]} if "Decisions" in item else item for item in config.nav
    ]
    return config


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages from outside docs/, the index of the decisions and the page of messages."""
    for name, page in _AT_ROOT.items():
        text = (_ROOT / name).read_text(encoding="utf-8").replace("](docs/decisions)", "](decisions/README.md)")
        files.append(File.generated(config, page, content=_linked(text.replace("](docs/", "]("), "")))
    rows = [f"- [{_title(path)}]({path.name})" for path in _decisions()]
    text = "\n".join(["# Decisions", "", "What could be contested, and why it is so.", "", *rows, ""])
    files.append(File.generated(config, "decisions/README.md", content=text))
    code = Code(troubleshooting.packages())
    if unread := troubleshooting.unresolved(code):
        raise PluginError(
            f"no message could be read at {', '.join(unread)}: give it a literal text, or a variable with literal texts"
        )
    files.append(File.generated(config, _MESSAGES, content=troubleshooting.page(code)))
    return files


def on_page_markdown(markdown: str, **_kwargs: object) -> str:
    """Point links to files at the root to their pages."""
    return _linked(markdown, "../")


def _linked(text: str, up: str) -> str:
    text = text.replace(_MESSAGES_ELSEWHERE, f"[Troubleshooting]({_MESSAGES})")
    for name, page in _AT_ROOT.items():
        text = re.sub(rf"\]\({re.escape(up + name)}(#[^)]*)?\)", rf"]({page}\1)", text)
    # Readers find the code in the repository; the site has no copy of it.
    return re.sub(rf"\[([^\]]+)\]\({re.escape(up)}examples\)", r"\1", text)


def _decisions() -> list[Path]:
    return sorted((_ROOT / "docs" / "decisions").glob("[0-9]*.md"))


def _title(path: Path) -> str:
    found = _TITLE.search(path.read_text(encoding="utf-8"))
    return found[1] if found else path.stem
