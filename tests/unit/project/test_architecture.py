"""The names in docs/architecture.md's two ways are those of the code."""

import ast
import re
from pathlib import Path
from typing import Final

import pytest

ROOT: Final = Path(__file__).resolve().parents[3]
_NAMES: Final = re.compile(r"`((?:common|board_agent|phone_host)/[a-z0-9_/]+)`: ((?:`[A-Za-z_.]+`(?:, )?)+)")


def named() -> list[tuple[str, str]]:
    """Return every (module, class and method) of the two tables."""
    text = (ROOT / "docs/architecture.md").read_text()
    return [(module, name) for module, names in _NAMES.findall(text) for name in re.findall(r"`([A-Za-z_.]+)`", names)]


def test_the_ways_are_told_by_names() -> None:
    """Both ways name what they pass through."""
    assert len(named()) > 40


@pytest.mark.parametrize(("module", "name"), named())
def test_a_name_is_in_the_code(module: str, name: str) -> None:
    """The module defines the class with the method, or the function."""
    body = ast.parse((ROOT / f"{module}.py").read_text()).body
    for part in name.split("."):
        found = [node for node in body if isinstance(node, ast.ClassDef | ast.FunctionDef) and node.name == part]
        assert found, part
        body = found[0].body
